//! The matrix as text for people.

use std::collections::BTreeMap;

use myovib_model::Formulation;

use super::Row;
use super::verdict::Verdict;
use myovib_report::table::{Align, Cell, Table, Tone, coloured_stdout, exponent, kappa};

/// More cells than these are only counted; the document has them all.
const LISTED: usize = 150;

pub(super) fn text(rows: &[Row]) -> String {
    let coloured = coloured_stdout();
    let mut text = counts(rows).render(coloured);
    text.push('\n');
    if rows.len() <= LISTED {
        text += &cells(rows.iter()).render(coloured);
        text.push('\n');
    }
    text += &causes(rows);
    for row in rows.iter().filter(|row| row.verdict == Verdict::Wrong) {
        text += &format!(
            "wrong: {}: u_y off by {:.1e}. {}\n",
            row.cell,
            row.errors.error_u_y.unwrap_or(f64::NAN),
            row.explanation.as_deref().unwrap_or("")
        );
    }
    text
}

fn counts(rows: &[Row]) -> Table {
    let mut columns = vec![("formulation", Align::Left)];
    columns.extend(Verdict::ALL.map(|verdict| (verdict.name(), Align::Right)));
    let mut table = Table::new(&columns);
    for formulation in Formulation::ALL {
        let of = |verdict| {
            let matches =
                |row: &&Row| row.cell.formulation == formulation && row.verdict == verdict;
            rows.iter().filter(matches).count()
        };
        let counts = Verdict::ALL.map(|verdict| Cell::from(of(verdict).to_string()));
        table.row(
            [Cell::from(formulation.name().to_owned())]
                .into_iter()
                .chain(counts),
        );
    }
    table
}

fn cells<'a>(rows: impl Iterator<Item = &'a Row>) -> Table {
    use Align::{Left, Right};
    let mut table = Table::new(&[
        ("formulation", Left),
        ("κ", Left),
        ("β", Left),
        ("rtol", Right),
        ("load", Right),
        ("level", Right),
        ("order", Right),
        ("multipliers", Left),
        ("index", Right),
        ("verdict", Left),
        ("error u_y", Right),
        ("p", Right),
        ("drift", Right),
        ("energy", Right),
        ("steps", Right),
        ("rejected", Right),
        ("rcond", Right),
        ("wall s", Right),
        ("stopped by", Left),
    ]);
    let number = |x: Option<f64>| x.map_or("–".to_owned(), |x| format!("{x:.0e}"));
    for row in rows {
        let (cell, measured) = (&row.cell, &row.measured);
        let tone = match row.verdict {
            Verdict::Ok => Tone::Good,
            Verdict::Wrong => Tone::Bad,
            _ => Tone::Plain,
        };
        let cause = measured.reason.as_deref().or(measured.message.as_deref());
        let mut line: Vec<Cell> = [
            cell.formulation.name().to_owned(),
            kappa(cell.physics.kappa),
            exponent(cell.physics.beta),
            format!("{:.0e}", cell.rtol),
            cell.physics.load.to_string(),
            cell.physics.level.to_string(),
            cell.max_order.to_string(),
            cell.multipliers.name().to_owned(),
            measured.index.to_string(),
        ]
        .map(Cell::from)
        .into();
        line.push(Cell::new(row.verdict.name(), tone));
        line.extend(
            [
                number(row.errors.error_u_y),
                number(row.errors.error_p),
                format!("{:.0e}", measured.constraint_drift),
                number(measured.energy_imbalance),
                measured.steps.to_string(),
                measured.error_test_failures.to_string(),
                number(measured.rcond),
                format!("{:.1}", measured.wall_seconds),
                cause.map_or(String::new(), |cause| {
                    format!("{cause} at t = {:.3}", measured.t_reached)
                }),
            ]
            .map(Cell::from),
        );
        table.row(line);
    }
    table
}

/// How many runs stopped for which reason.
fn causes(rows: &[Row]) -> String {
    let mut causes: BTreeMap<&str, usize> = BTreeMap::new();
    for row in rows.iter().filter(|row| row.verdict == Verdict::Stopped) {
        let reason = row.measured.reason.as_deref().unwrap_or("failed");
        *causes.entry(reason).or_default() += 1;
    }
    causes
        .into_iter()
        .map(|(reason, count)| format!("stopped by {reason}: {count}\n"))
        .collect()
}
