//! Figure 2: the oscillators in the complex plane at four times.

use super::chain_plots::{complex_plane, largest_radius};
use super::product::Product;
use crate::chains::{ChainRun, chain_document};
use myovib_report::plot::{Figure, Panel};

/// Times of the snapshots, as fractions of the run. The first is near the maximum of |Ψ|, the next two are taken while
/// the phases are scattered, and the last is in the settled state.
const TIMES: [f64; 4] = [0.065, 0.15, 0.3, 1.0];

pub(super) fn draw(run: &ChainRun) -> anyhow::Result<Product> {
    let (history, n) = (&run.history, run.n_oscillators());
    let radius = largest_radius(history);
    let last = history.t.len() - 1;
    let samples = TIMES.map(|fraction| (fraction * last as f64).round() as usize);
    // Only the first panel has a legend.
    let panels = samples.into_iter().enumerate().map(|(k, i)| {
        let mut plane = complex_plane(history, i, radius);
        if k > 0 {
            plane.points_name.clear();
            plane.centroid_name.clear();
        }
        Box::new(plane) as Box<dyn Panel>
    });
    let row = |&i: &usize| {
        let points = history.phasors[i].iter().flat_map(|z| [z.re, z.im]);
        let psi = history.centroid[i];
        [history.t[i], psi.re, psi.im].into_iter().chain(points).collect()
    };
    let columns = (1..=n).flat_map(|n| [format!("re_{n}"), format!("im_{n}")]);
    Ok(Product {
        number: 2,
        figure: Figure {
            n_columns: 2,
            ..Figure::column(format!("{n} oscillators in the complex plane"), panels.collect())
        },
        columns: ["t", "psi_re", "psi_im"].map(String::from).into_iter().chain(columns).collect(),
        rows: samples.iter().map(row).collect(),
        findings: run.findings()?,
        run: chain_document(run),
        exit: run.exit(),
    })
}
