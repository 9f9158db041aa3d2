//! Notes on responses with missing or unbounded peaks, and on amplitudes that are too large for a linear theory.

use myovib_fem::{AddedStress, Space};
use myovib_model::Muscle;
use num_complex::Complex64;

use super::{Curves, peaks};
use crate::modes::Mode;

/// Strain amplitude above which a note is added to a linear response.
const LARGE_STRAIN: f64 = 0.1;

/// Largest amplitudes of a response, each with its frequency in Hz.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Largest {
    /// Displacement component (m).
    displacement: [f64; 2],
    /// Strain along an edge of the mesh.
    strain: [f64; 2],
}

impl Largest {
    /// Updates the maxima with the result of [`displacement_and_strain`] at a frequency.
    pub(super) fn add(&mut self, frequency: f64, sizes: [f64; 2]) {
        for (largest, size) in [&mut self.displacement, &mut self.strain].into_iter().zip(sizes) {
            if size > largest[0] {
                *largest = [size, frequency];
            }
        }
    }

    /// Returns a note if the displacement exceeds the length of the body, or if the strain exceeds [`LARGE_STRAIN`].
    pub(super) fn note(&self, length: f64) -> Option<String> {
        let [displacement, at] = self.displacement;
        let [strain, strain_at] = self.strain;
        let found = match (displacement > length, strain > LARGE_STRAIN) {
            (true, _) => format!(
                "displacements of {:.1} times the size of the body at {at:.4} Hz",
                displacement / length
            ),
            (_, true) => format!("strains of {:.0} % at {strain_at:.4} Hz", 100.0 * strain),
            _ => return None,
        };
        Some(format!(
            "the response reaches {found}: linearization is inaccurate there; reduce the loads, to which amplitudes are \
             proportional, or compute a periodic state"
        ))
    }
}

/// Returns the largest displacement component (m) and the largest strain along an edge.
pub(crate) fn displacement_and_strain(space: &Space, u: &[Complex64]) -> [f64; 2] {
    let dimension = space.dimension();
    let largest_square = u.iter().map(Complex64::norm_sqr).fold(0.0, f64::max);
    let mut strain_square = 0.0_f64;
    for element in 0..space.n_elements() {
        let corners = &space.element_nodes(element)[..=dimension];
        for (i, &a) in corners.iter().enumerate() {
            for &b in &corners[..i] {
                let edge = space.node_point(a).iter().zip(space.node_point(b)).map(|(a, b)| a - b);
                let change = (0..dimension).map(|m| u[dimension * a + m] - u[dimension * b + m]);
                let (along, square) = edge
                    .zip(change)
                    .fold((Complex64::ZERO, 0.0), |(z, l), (e, du)| (z + e * du, l + e * e));
                strain_square = strain_square.max(along.norm_sqr() / (square * square));
            }
        }
    }
    [largest_square.sqrt(), strain_square.sqrt()]
}

/// Returns a note if some of the lowest `modes` of the body are below `lowest` (Hz), the lower end of the frequency
/// range.
pub(super) fn modes_below(modes: &[Mode], lowest: f64) -> Option<String> {
    let below = modes.iter().filter_map(|mode| mode.frequency).filter(|own| *own < lowest);
    let below: Vec<f64> = below.collect();
    let is_last_below = modes.last().and_then(|mode| mode.frequency).is_some_and(|f| f < lowest);
    let at_least = if is_last_below { "at least " } else { "" };
    below.first().map(|first| {
        let (n, s) = (below.len(), if below.len() == 1 { "" } else { "s" });
        format!(
            "{at_least}{n} mode{s} below the range, the first at {first:.4} Hz: peaks there are missing"
        )
    })
}

/// Returns a note for each probe whose displacement is largest at an end of the frequency range.
pub(super) fn resonances_outside(curves: &[Curves], frequencies: &[f64]) -> Vec<String> {
    let notes = curves.iter().filter_map(|of| {
        let (column, frequency) = of.largest_at_an_end(frequencies)?;
        Some(format!(
            "`{}.{column}` is largest at {frequency} Hz, an end of the range: its resonance may be outside the range",
            of.name
        ))
    });
    notes.collect()
}

impl Curves {
    /// Returns the column name of the largest displacement, and its frequency. Returns `None` if this frequency is not
    /// an end of the range.
    fn largest_at_an_end(&self, frequencies: &[f64]) -> Option<(&str, f64)> {
        let last = frequencies.len().checked_sub(1).filter(|last| *last > 1)?;
        let size = |(k, j): (usize, usize)| self.amplitudes[k][j].norm();
        let all = (0..=last).flat_map(|k| (0..self.columns.len()).map(move |j| (k, j)));
        let displacements = all.filter(|(_, j)| self.columns[*j].starts_with("u_"));
        let (k, j) = displacements.max_by(|a, b| size(*a).total_cmp(&size(*b)))?;
        let is_end = k == last || k == 0 && frequencies[0] > 0.0;
        let is_constant = peaks::is_constant((0..=last).map(|k| size((k, j))));
        (is_end && !is_constant).then(|| (&*self.columns[j], frequencies[k]))
    }
}

/// Returns a note if no stress or support of the body dissipates energy.
pub(super) fn undamped(muscle: &Muscle) -> Option<String> {
    let Muscle { solid, parameters, .. } = muscle;
    let is_undamped = parameters.alpha == 0.0
        && !parameters.is_damped()
        && solid.n_slots() == 0
        && !solid.added_stresses().iter().any(AddedStress::is_viscous)
        && muscle.foundations.iter().all(|own| own.damping() == 0.0);
    let note = "the body has no damping: amplitudes are unbounded at resonances, and peaks depend on the \
                chosen frequencies";
    is_undamped.then(|| note.to_owned())
}
