//! Table 2 as text.

use super::RowRun;
use crate::table::{Align, Cell, Table, Tone, colored_stdout, compared, exponent, kappa};

/// Returns the comparison with the paper's counts, a table of settings and work, and notes.
pub fn text(runs: &[RowRun], is_modified: bool) -> String {
    let colored = colored_stdout();
    format!(
        "{}\n{}\n{}",
        comparison(runs).render(colored),
        settings_and_work(runs).render(colored),
        notes(runs, is_modified)
    )
}

fn comparison(runs: &[RowRun]) -> Table {
    use Align::{Left, Right};
    let mut table = Table::new(&[
        ("row", Left),
        ("eq.", Left),
        ("κ", Left),
        ("β", Left),
        ("index", Right),
        ("convention", Left),
        ("steps: paper", Right),
        ("ours", Right),
        ("ratio", Right),
        ("rejected: paper", Right),
        ("ours", Right),
        ("ratio", Right),
        ("conv. fail.: paper", Right),
        ("ours", Right),
        ("ratio", Right),
        ("t reached", Right),
        ("CPU s", Right),
        ("outcome", Left),
    ]);
    for run in runs {
        let (paper, (bulk, beta)) = (run.paper(), run.constants());
        let tone = match run.agrees() {
            Some(true) => Tone::Good,
            Some(false) => Tone::Bad,
            None => Tone::Plain,
        };
        let mut cells: Vec<Cell> = [
            run.row.key.to_owned(),
            format!("({})", run.word("equation")),
            kappa(bulk),
            exponent(beta),
            run.count("index").to_string(),
            run.convention().to_owned(),
        ]
        .map(Cell::from)
        .into();
        for (paper, ours) in [
            (Some(paper.steps), "steps"),
            (Some(paper.rejected), "error_test_failures"),
            (paper.convergence_failures, "step_solve_failures"),
        ] {
            let mut compared = compared(paper, run.count(ours));
            if !run.has_the_papers_end() {
                compared[2] = "–".into();
            }
            cells.extend(compared);
        }
        cells.push(format!("{:.4}", run.number("t_reached")).into());
        cells.push(format!("{:.2}", run.number("cpu_seconds")).into());
        cells.push(Cell::new(run.outcome(), tone));
        table.row(cells);
    }
    table
}

fn settings_and_work(runs: &[RowRun]) -> Table {
    use Align::{Left, Right};
    let mut table = Table::new(&[
        ("row", Left),
        ("excluded", Left),
        ("max order", Right),
        ("unknowns", Right),
        ("residuals", Right),
        ("Newton it.", Right),
        ("Newton fail.", Right),
        ("factorizations", Right),
        ("drift", Right),
    ]);
    for run in runs {
        let excluded = match &run.suppressed()[..] {
            [] => "none".to_owned(),
            symbols => symbols.join(","),
        };
        let count = |name| run.count(name).to_string();
        table.row(
            [
                run.row.key.to_owned(),
                excluded,
                run.order().to_string(),
                count("unknowns"),
                count("residual_evaluations"),
                count("newton_iterations"),
                count("newton_failures"),
                count("linear_setups"),
                format!("{:.1e}", run.number("constraint_drift")),
            ]
            .map(Cell::from),
        );
    }
    table
}

/// Returns notes about the runs that were computed.
pub(super) fn notes(runs: &[RowRun], is_modified: bool) -> String {
    let mut notes = String::new();
    for (name, meaning) in [
        (
            "paper",
            "the algebraic variables are excluded from the error test: λ in (28) and (31), only μ in (29)",
        ),
        ("multipliers", "λ and μ are excluded in all equations"),
    ] {
        let of_it =
            runs.iter().filter(|run| run.conventions().contains(&name) && run.has_the_papers_end());
        let ratios: Vec<String> = of_it
            .map(|run| {
                let ratio = run.count("steps") as f64 / run.paper().steps as f64;
                format!("{} {ratio:.2}", run.row.key)
            })
            .collect();
        if !ratios.is_empty() {
            let ratios = ratios.join(", ");
            notes += &format!(
                "convention `{name}`: {meaning}. Ratio of our steps to the paper's: {ratios}\n"
            );
        }
    }
    if let Some(run) = runs.iter().find(|run| run.is_radau()) {
        notes += &format!(
            "Radau IIA of order {}: the error test includes all variables except those listed as `excluded`.\n",
            run.order()
        );
    }
    if is_modified {
        notes += "The settings differ from the table, so the outcomes are not compared.\n";
    }
    for run in runs.iter().filter(|run| !run.is_finished()) {
        let (key, index) = (run.row.key, run.count("index"));
        notes += &format!("row {key} (index {index}) stopped: {}\n", run.word("message"));
    }
    notes + &row_4(runs)
}

/// Describes which variants of row 4 finish and which stop.
fn row_4(runs: &[RowRun]) -> String {
    let of_4 = |run: &&RowRun| run.row.paper_key == "4" && !run.is_radau();
    let described = |run: &RowRun| {
        let excluded = match &run.suppressed()[..] {
            [] => "nothing excluded from the error test".to_owned(),
            symbols => format!("{} excluded from the error test", symbols.join(",")),
        };
        format!("{} (order {}, {excluded})", run.row.key, run.order())
    };
    let (finished, stopped): (Vec<_>, Vec<_>) =
        runs.iter().filter(of_4).partition(|run| run.is_finished());
    let list = |runs: &[&RowRun]| -> String {
        let runs: Vec<String> = runs.iter().map(|run| described(run)).collect();
        runs.join(", ")
    };
    match (&finished[..], &stopped[..]) {
        (finished @ [_, ..], stopped @ [_, ..]) => format!(
            "With an incompressible muscle in (28), these runs stop: {}; these runs finish: {}.\n",
            list(stopped),
            list(finished)
        ),
        _ => String::new(),
    }
}
