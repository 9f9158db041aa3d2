//! Assigns peaks to modes by the contributions of the modes to a response.
//!
//! A value is the sum of the contributions qᵢ wᵢ of all modes, plus contributions of moving supports that vary
//! smoothly. The modal coordinates qᵢ are computed from the amplitudes. The factor wᵢ is the value for mode i alone at
//! its natural frequency. At a resonance, the contribution of the resonant mode as a function of frequency bends more
//! sharply than all others, even if these are larger. Therefore, a peak belongs to the mode whose contribution bends
//! most between the frequencies next to the peak.

use std::f64::consts::TAU;

use myovib_model::harmonic::{Amplitude, DynamicStiffness};
use myovib_model::statics::Equilibrium;
use myovib_model::{ModelError, Muscle, spectrum};
use num_complex::Complex64;

use super::peaks::PeakMode;
use super::{Response, Values};
use crate::modes::{BodyModes, Mode};
use crate::probe::HarmonicMotion;

/// Maximum number of modes that are compared with the peaks. Computing this number of modes costs as much as a few
/// frequencies.
const MODES: usize = 20;

/// Allowed ratios of the frequency of a mode to the frequency of a peak. Viscoelastic stress makes a body up to a
/// hundred times as stiff as the relaxed body, whose modes are used.
const RATIOS: std::ops::RangeInclusive<f64> = 0.1..=2.0;

/// Modes of a body to which peaks are assigned.
pub(super) struct Assignment {
    pub(super) body: BodyModes,
    /// Pressures of the modes.
    pressures: Vec<Vec<f64>>,
    /// Products M φ for the modes, at the free components.
    inertia: Vec<Vec<f64>>,
}

impl Assignment {
    /// Computes the modes to which peaks up to the frequency `last` (Hz) are assigned. For a body at rest, the
    /// computation stops at the first mode above this frequency, because damping cannot increase the vibrations of
    /// higher modes.
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

    /// Assigns the peaks of a response to modes, given the modal coordinates at the frequencies of the response. The
    /// probes are evaluated once for each mode.
    ///
    /// # Errors
    /// Returns the errors of the probes.
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

    /// Returns the values of all probes for each mode alone. The contributions of the loads, which are part of
    /// reactions, are subtracted. At least one mode is required.
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

    /// Returns the mode whose contribution has the largest `bend`, among the modes whose ratio of natural frequency to
    /// `frequency` (Hz) is in [`RATIOS`]. Returns `None` if `frequency` exceeds all natural frequencies.
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
