//! Figure 7: coherence of the chain in the muscle.

use super::chain_plots::{COLUMNS, chain_rows, defined_coherence};
use super::product::Product;
use crate::chains::{ChainRun, chain_document};
use myovib_report::plot::{Axis, Color, Figure, LinePlot, Series};

pub(super) fn draw(run: &ChainRun) -> anyhow::Result<Product> {
    let history = &run.history;
    let plot = |axis: Axis, values: &[f64], color| {
        Box::new(LinePlot {
            x: Axis::new("*t*", "s").between(0.0, run.scene.t_end),
            y: axis,
            series: vec![Series::curve("", &history.t, values).colored(color)],
            ..LinePlot::default()
        })
    };
    let phase = Axis::new("|χ|", "").between(0.0, 1.05);
    let figure = Figure::column(
        "Coherence of the chain in the muscle",
        vec![
            plot(phase, &defined_coherence(history), Color::BLUE),
            plot(Axis::new("|Ψ|", ""), &history.strength(), Color::VERMILION),
        ],
    );
    Ok(Product {
        number: 7,
        figure,
        columns: COLUMNS.map(String::from).into(),
        rows: chain_rows(history).map(|(_, row)| row).collect(),
        findings: run.findings()?,
        run: chain_document(run),
        exit: run.exit(),
    })
}
