//! Notes on responses with missing or unbounded peaks.

use myovib_fem::AddedStress;
use myovib_model::Muscle;

use super::{Curves, peaks};

/// Returns a note for each probe whose displacement is largest at an end of the frequency range.
pub(super) fn resonances_outside(curves: &[Curves], frequencies: &[f64]) -> Vec<String> {
    let notes = curves.iter().filter_map(|of| {
        let (column, frequency) = of.largest_at_an_end(frequencies)?;
        Some(format!(
            "`{}.{column}` is largest at {frequency} Hz, an end of the range: its resonance may be outside",
            of.name
        ))
    });
    notes.collect()
}

impl Curves {
    /// Returns the name of the largest displacement and its frequency if this frequency is an end of the range.
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
