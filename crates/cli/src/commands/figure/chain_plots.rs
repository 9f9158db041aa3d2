//! Common parts of the figures that show chains.

use myovib_model::coupling::CoherenceHistory;
use num_complex::Complex64;
use serde_json::Value;

use crate::chains::ChainRun;
use myovib_report::plot::ComplexPlane;

/// Columns of a chain's history.
pub(super) const COLUMNS: [&str; 7] =
    ["t", "psi_abs", "psi_re", "psi_im", "chi_abs", "chi_arg", "frequency"];

/// Returns the samples of a history with all plotted values, one row per sample. The values are in the order of
/// [`COLUMNS`].
pub(super) fn chain_rows(
    history: &CoherenceHistory,
) -> impl Iterator<Item = (usize, Vec<f64>)> + '_ {
    (0..history.t.len()).map(|i| {
        let (psi, chi) = (history.centroid[i], history.phase[i]);
        let row = vec![
            history.t[i],
            psi.norm(),
            psi.re,
            psi.im,
            chi.norm(),
            chi.arg(),
            history.frequency[i],
        ];
        (i, row)
    })
}

/// Returns |χ| at each sample. It is NaN while all oscillators are at rest; curves have a gap there.
pub(super) fn defined_coherence(history: &CoherenceHistory) -> Vec<f64> {
    let at_rest = |phasors: &Vec<Complex64>| phasors.iter().all(|z| z.norm() == 0.0);
    let samples = history.coherence().into_iter().zip(&history.phasors);
    samples.map(|(chi, phasors)| if at_rest(phasors) { f64::NAN } else { chi }).collect()
}

/// Returns the maximum radius over all oscillators and samples, plus a small margin.
pub(in crate::commands) fn largest_radius(history: &CoherenceHistory) -> f64 {
    let radii = history.phasors.iter().flatten().map(|z| z.norm());
    let largest = radii.fold(0.0, f64::max);
    if largest > 0.0 { 1.12 * largest } else { 1.0 }
}

/// Plots the oscillators at sample `i` in the complex plane.
pub(in crate::commands) fn complex_plane(
    history: &CoherenceHistory,
    i: usize,
    radius: f64,
) -> ComplexPlane {
    let point = |z: &Complex64| [z.re, z.im];
    ComplexPlane {
        title: format!("*t* = {:.2} s", history.t[i]),
        labels: ["*y*_{*n*}".into(), "*ẏ*_{*n*}/*ω*_{*n*}".into()],
        points: history.phasors[i].iter().map(point).collect(),
        points_name: "oscillators".into(),
        centroid: point(&history.centroid[i]),
        centroid_name: "centroid Ψ".into(),
        radius,
    }
}

impl ChainRun {
    /// Returns the settled values, for the text and for JSON.
    pub(super) fn findings(&self) -> anyhow::Result<Vec<(&'static str, Value)>> {
        Ok(vec![("settled", serde_json::to_value(self.settled())?)])
    }
}
