//! Table 2 for people.

use super::RowRun;
use crate::table::{Align, Cell, Table, Tone, coloured_stdout, compared, exponent, kappa};

/// The table for people: counts beside the paper's, then what stands behind them.
pub fn text(runs: &[RowRun], is_modified: bool) -> String {
    let coloured = coloured_stdout();
    format!(
        "{}\n{}\n{}",
        comparison(runs).render(coloured),
        settings_and_work(runs).render(coloured),
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
            cells.extend(compared(paper, run.count(ours)));
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
        ("left out", Left),
        ("max order", Right),
        ("unknowns", Right),
        ("residuals", Right),
        ("Newton it.", Right),
        ("Newton fail.", Right),
        ("factorisations", Right),
        ("drift", Right),
    ]);
    for run in runs {
        let left_out = match &run.suppressed()[..] {
            [] => "none".to_owned(),
            symbols => symbols.join(","),
        };
        let count = |name| run.count(name).to_string();
        table.row(
            [
                run.row.key.to_owned(),
                left_out,
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

/// What the runs at hand show, and nothing of those that were not made.
pub(super) fn notes(runs: &[RowRun], is_modified: bool) -> String {
    let mut notes = String::new();
    for (name, meaning) in [
        (
            "paper",
            "the algebraic variables are left out of the error test, λ in (28) and (31), only μ in (29)",
        ),
        ("multipliers", "λ and μ are left out everywhere"),
    ] {
        let of_it = runs.iter().filter(|run| run.conventions().contains(&name));
        let ratios: Vec<String> = of_it
            .map(|run| {
                let ratio = run.count("steps") as f64 / run.paper().steps as f64;
                format!("{} {ratio:.2}", run.row.key)
            })
            .collect();
        if !ratios.is_empty() {
            let ratios = ratios.join(", ");
            notes += &format!("convention `{name}`: {meaning}. Steps, ours : paper: {ratios}\n");
        }
    }
    if let Some(run) = runs.iter().find(|run| run.is_radau()) {
        notes += &format!(
            "Radau IIA of order {}: the error test has all variables but those under `left out`.\n",
            run.order()
        );
    }
    if is_modified {
        notes += "Settings differ from those of the table: the outcomes are not judged.\n";
    }
    for run in runs.iter().filter(|run| !run.is_finished()) {
        let (key, index) = (run.row.key, run.count("index"));
        notes += &format!(
            "row {key} (index {index}) stopped: {}\n",
            run.word("message")
        );
    }
    notes + &row_4(runs)
}

/// Which variants of row 4 run through where it stops.
fn row_4(runs: &[RowRun]) -> String {
    let of_4 = |run: &&RowRun| run.row.paper_key == "4" && !run.is_radau();
    let described = |run: &RowRun| {
        let left_out = match &run.suppressed()[..] {
            [] => "nothing left out of the error test".to_owned(),
            symbols => format!("{} left out of the error test", symbols.join(",")),
        };
        format!("{} (order {}, {left_out})", run.row.key, run.order())
    };
    let (finished, stopped): (Vec<_>, Vec<_>) =
        runs.iter().filter(of_4).partition(|run| run.is_finished());
    let list = |runs: &[&RowRun]| -> String {
        let runs: Vec<String> = runs.iter().map(|run| described(run)).collect();
        runs.join(", ")
    };
    match (&finished[..], &stopped[..]) {
        (finished @ [_, ..], stopped @ [_, ..]) => format!(
            "Of the incompressible muscle in (28) these stop: {}; these run through: {}.\n",
            list(stopped),
            list(finished)
        ),
        _ => String::new(),
    }
}
