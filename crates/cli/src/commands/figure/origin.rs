//! Figure 6: vertical displacement and pressure at the origin.

use super::muscle_run::MuscleRun;
use super::product::Product;
use myovib_report::plot::{Axis, Figure, LinePlot, Series};

/// Length of the plotted time interval (s). The interval ends with the run, as in the paper.
const SHOWN: f64 = 3.0;

pub(super) fn draw(run: &MuscleRun) -> anyhow::Result<Product> {
    let end = run.statistics.t_reached;
    let shown: Vec<&[f64; 4]> = run.origin.iter().filter(|row| row[0] >= end - SHOWN).collect();
    let column = |c: usize| -> Vec<f64> { shown.iter().map(|row| row[c]).collect() };
    let panel = |c: usize, quantity: &str, unit: &str| LinePlot {
        x: Axis::new("*t*", "s").between((end - SHOWN).max(0.0), end),
        y: Axis::new(quantity, unit),
        series: vec![Series::curve("", &column(0), &column(c))],
        ..LinePlot::default()
    };
    let largest = |c: usize| column(c).into_iter().fold(0.0, |m: f64, value| m.max(value.abs()));
    Ok(Product {
        number: 6,
        figure: Figure::column(
            "Vertical displacement and pressure at the origin (0, 0)",
            vec![Box::new(panel(2, "*u*_{*y*}(0, 0)", "m")), Box::new(panel(3, "*p*(0, 0)", "Pa"))],
        ),
        columns: ["t", "u_x", "u_y", "p"].map(String::from).into(),
        rows: run.origin.iter().map(|row| row.to_vec()).collect(),
        findings: vec![
            ("u_y_largest_shown", largest(2).into()),
            ("p_largest_shown", largest(3).into()),
        ],
        run: run.document()?,
        exit: run.exit(),
    })
}
