//! Figure 3: radii of the oscillators and of their centroid as functions of time.

use super::chain_plots::{COLUMNS, chain_rows, defined_coherence};
use super::product::Product;
use crate::chains::{ChainRun, chain_document};
use myovib_report::plot::{Axis, Color, Figure, LinePlot, Series};

pub(super) fn draw(run: &ChainRun) -> anyhow::Result<Product> {
    let (history, n) = (&run.history, run.n_oscillators());
    let radius = |n: usize| -> Vec<f64> { history.phasors.iter().map(|z| z[n].norm()).collect() };
    // All radii share one legend entry.
    let radii = (0..n).map(|n| {
        let name = if n == 0 { "radii *r*_{*n*}" } else { "" };
        Series::curve(name, &history.t, &radius(n)).colored(Color::SKY)
    });
    let strength = Series::curve("|Ψ|", &history.t, &history.strength());
    let coherence = Series::curve("|χ|", &history.t, &defined_coherence(history));
    let plot = LinePlot {
        x: Axis::new("*t*", "s").between(0.0, run.scene.t_end),
        y: Axis::new("*r*_{*n*}, |Ψ|, |χ|", ""),
        series: radii
            .chain([strength.colored(Color::VERMILION), coherence.colored(Color::BLACK)])
            .collect(),
        ..LinePlot::default()
    };
    let columns = (1..=n).map(|n| format!("r_{n}"));
    let rows = chain_rows(history).map(|(i, mut row)| {
        row.extend(history.phasors[i].iter().map(|z| z.norm()));
        row
    });
    Ok(Product {
        number: 3,
        figure: Figure::of("Radii of oscillators and centroid over time", plot),
        columns: COLUMNS.map(String::from).into_iter().chain(columns).collect(),
        rows: rows.collect(),
        findings: run.findings()?,
        run: chain_document(run),
        exit: run.exit(),
    })
}
