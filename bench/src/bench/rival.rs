//! Points of an integrator that is not ours, measured elsewhere on the same equations and against the
//! same reference: the package `bench/` writes them.

use std::fs;
use std::path::Path;

use anyhow::Context;
use serde::{Deserialize, Serialize};

use myovib_report::plot::Series;
use myovib_report::table::{Align, Cell, Table, coloured_stdout};

/// One run of a rival.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct RivalPoint {
    case: String,
    formulation: String,
    way: String,
    rtol: f64,
    /// Why there are no errors, if there are none.
    stopped: Option<String>,
    /// The error of u_y at the origin, relative to its maximum.
    u_y: Option<f64>,
    /// That of p.
    p: Option<f64>,
    cpu_seconds: f64,
    steps: u64,
    residual_evaluations: u64,
    linear_setups: u64,
}

/// The points in a file; none without a file.
pub(super) fn read(path: Option<&Path>) -> anyhow::Result<Vec<RivalPoint>> {
    let Some(path) = path else {
        return Ok(Vec::new());
    };
    let text = fs::read_to_string(path)
        .with_context(|| format!("cannot read the rival's points `{}`", path.display()))?;
    serde_json::from_str(&text)
        .with_context(|| format!("`{}` has no points of a rival", path.display()))
}

/// One curve for each way of the rival to solve this formulation of this case.
pub(super) fn curves<'a>(
    points: &'a [RivalPoint],
    case: &'a str,
    formulation: &'a str,
) -> impl Iterator<Item = Series> + 'a {
    let of_panel =
        move |point: &&RivalPoint| point.case == case && point.formulation == formulation;
    let mut ways: Vec<&str> = points
        .iter()
        .filter(of_panel)
        .map(|p| p.way.as_str())
        .collect();
    ways.dedup();
    ways.into_iter().map(move |way| {
        let (x, y): (Vec<_>, Vec<_>) = points
            .iter()
            .filter(of_panel)
            .filter(|point| point.way == way)
            .filter_map(|point| Some((point.u_y?, point.cpu_seconds)))
            .unzip();
        Series::curve(way, &x, &y).marked()
    })
}

/// The points as a table; nothing if there are none.
pub(super) fn text(points: &[RivalPoint]) -> String {
    use Align::{Left, Right};
    if points.is_empty() {
        return String::new();
    }
    let mut table = Table::new(&[
        ("case", Left),
        ("formulation", Left),
        ("rival", Left),
        ("rtol", Right),
        ("error u_y", Right),
        ("p", Right),
        ("CPU s", Right),
        ("steps", Right),
        ("residuals", Right),
        ("set-ups", Right),
        ("stopped", Left),
    ]);
    let number = |x: Option<f64>| x.map_or("–".to_owned(), |x| format!("{x:.1e}"));
    for point in points {
        table.row(
            [
                point.case.clone(),
                point.formulation.clone(),
                point.way.clone(),
                format!("{:.0e}", point.rtol),
                number(point.u_y),
                number(point.p),
                format!("{:.2}", point.cpu_seconds),
                point.steps.to_string(),
                point.residual_evaluations.to_string(),
                point.linear_setups.to_string(),
                point.stopped.clone().unwrap_or_default(),
            ]
            .map(Cell::from),
        );
    }
    format!("\n{}", table.render(coloured_stdout()))
}
