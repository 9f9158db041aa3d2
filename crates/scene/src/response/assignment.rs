//! Assignment of peaks to modes by the contributions of the modes to a response.
//!
//! A value is the sum of the contributions qᵢ wᵢ of all modes, with the modal coordinates qᵢ of the computed amplitudes and
//! the value wᵢ of mode i alone at its own frequency, apart from contributions of moving supports, which are smooth. At a
//! resonance, the contribution of its mode bends more sharply with the frequency than all
//! others, even if these are larger. So a peak belongs to the mode whose contribution bends most between the frequencies
//! beside the peak.

use std::f64::consts::TAU;

use myovib_model::harmonic::{Amplitude, DynamicStiffness};
use myovib_model::statics::Equilibrium;
use myovib_model::{ModelError, Muscle, spectrum};
use num_complex::Complex64;

use super::peaks::PeakMode;
use super::{Response, Values};
use crate::modes::{BodyModes, Mode};
use crate::probe::HarmonicMotion;

/// Maximum number of modes computed for comparison with the peaks. They cost as much as a few frequencies.
const MODES: usize = 20;

/// Smallest and largest ratio of the frequencies of the mode and of the peak: viscoelastic stress makes a body up to a hundred
/// times as stiff as the relaxed body, to which the modes belong.
const RATIOS: std::ops::RangeInclusive<f64> = 0.1..=2.0;

/// Modes of a body, to which peaks are assigned.
pub(super) struct Assignment {
    pub(super) body: BodyModes,
    /// Pressures of the modes.
    pressures: Vec<Vec<f64>>,
    /// M φ of the modes at the free components.
    inertia: Vec<Vec<f64>>,
}

impl Assignment {
    /// Computes the modes to which peaks up to a frequency (Hz) are assigned. At rest, modes above the next one are not
    /// computed, because damping cannot increase their vibrations.
    pub(super) fn new(muscle: &Muscle, at: &Equilibrium, last: f64) -> Result<Self, ModelError> {
        let modes = match at.preload_time {
            None => spectrum::up_to(muscle, at, last, MODES)?,
            Some(_) => spectrum::lowest(muscle, at, MODES)?,
        };
        Ok(Self {
            pressures: modes.iter().map(|mode| mode.multipliers.clone()).collect(),
            inertia: modes.iter().map(|mode| spectrum::inertia(muscle, mode)).collect(),
            body: BodyModes::new(muscle, at, modes)?,
        })
    }

    /// Returns the coordinate qᵢ = φᵢᵀ M û of each mode. For any damping, the free components of û are Σ qᵢ φᵢ, except for the
    /// volume that moving supports displace in an incompressible body.
    pub(super) fn coordinates(&self, displacement: &[Complex64]) -> Vec<Complex64> {
        let coordinate =
            |inertia: &Vec<f64>| displacement.iter().zip(inertia).map(|(u, m)| u * m).sum();
        self.inertia.iter().map(coordinate).collect()
    }

    /// Assigns the peaks of a response, given the modal coordinates at its frequencies. Reads the values of each mode once.
    ///
    /// # Errors
    /// Errors of the probes.
    pub(super) fn assign(
        &self,
        found: &mut Response,
        coordinates: &[Vec<Complex64>],
        values: &Values,
        stiffness: &DynamicStiffness,
    ) -> Result<(), ModelError> {
        if found.peaks.is_empty() || self.body.modes.is_empty() {
            return Ok(());
        }
        let of_modes = self.read_modes(values, stiffness)?;
        let tables = values.tables();
        let names = tables.iter().flat_map(|(table, columns)| {
            columns.iter().map(move |column| (table.as_str(), column.as_str()))
        });
        let names: Vec<(&str, &str)> = names.collect();
        for peak in &mut found.peaks {
            let distance = |k: &usize| (found.frequencies[*k] - peak.frequency).abs();
            let inner = 1..found.frequencies.len() - 1;
            let Some(k) = inner.min_by(|a, b| distance(a).total_cmp(&distance(b))) else {
                continue;
            };
            let name = (peak.probe.as_str(), peak.column.as_str());
            let Some(value) = names.iter().position(|other| *other == name) else { continue };
            let s = Complex64::new(0.0, TAU * found.frequencies[k]);
            let row: Vec<Complex64> =
                found.probes.iter().flat_map(|of| of.amplitudes[k].clone()).collect();
            peak.mode = self.mode_of(peak.frequency, |mode| {
                let slope = |k: usize| {
                    let rise = coordinates[k + 1][mode] - coordinates[k][mode];
                    rise / (found.frequencies[k + 1] - found.frequencies[k])
                };
                let bend = (slope(k) - slope(k - 1)).norm();
                values.change(value, s, &row, &of_modes[mode]).norm() * bend
            });
        }
        Ok(())
    }

    /// Returns the values of all probes for each mode alone, without the loads, which are parts of reactions.
    /// Requires at least one mode.
    fn read_modes(
        &self,
        values: &Values,
        stiffness: &DynamicStiffness,
    ) -> Result<Vec<Vec<Complex64>>, ModelError> {
        let read = |s: Complex64, factor: f64, k: usize| {
            let times =
                |values: &[f64]| values.iter().map(|x| Complex64::from(factor * x)).collect();
            let (displacement, pressure) =
                (times(&self.body.modes[k].shape), times(&self.pressures[k]));
            let amplitude = Amplitude { s, displacement, pressure };
            values.read_probes(&HarmonicMotion::Body(stiffness, &amplitude))
        };
        let of_loads = read(Complex64::ZERO, 0.0, 0)?;
        let of_mode = |(k, mode): (usize, &Mode)| {
            let s = Complex64::new(0.0, TAU * mode.frequency.unwrap_or_default());
            let values = read(s, 1.0, k)?.into_iter().zip(&of_loads);
            Ok(values.map(|(value, of_loads)| value - of_loads).collect())
        };
        self.body.modes.iter().enumerate().map(of_mode).collect()
    }

    /// Returns the mode whose contribution has the largest `bend` among those within [`RATIOS`] of a `frequency` (Hz), unless the
    /// frequency exceeds all modes.
    fn mode_of(&self, frequency: f64, bend: impl Fn(usize) -> f64) -> Option<PeakMode> {
        let natural = self.body.modes.iter().enumerate();
        let natural = natural.filter_map(|(k, mode)| Some((k, mode.frequency?)));
        if natural.clone().all(|(_, own)| own < frequency) {
            return None;
        }
        let near = natural
            .filter(|(_, own)| RATIOS.contains(&(own / frequency)))
            .map(|(k, own)| (bend(k), PeakMode { number: k + 1, frequency: own }));
        let most = near.max_by(|a, b| a.0.total_cmp(&b.0));
        most.map(|(_, mode)| mode)
    }
}
