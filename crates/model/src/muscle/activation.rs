//! Sources of the tension of active stresses.

use myovib_fem::material::Bestel;

use crate::signal::Signal;
use crate::signal::timing::{Break, FRACTION, TimeScales, shortest};

/// Tension T of an active stress, uniform over its region.
#[derive(Debug, Clone)]
pub enum Activation {
    /// Nonnegative function of time (Pa).
    Given(Signal),
    /// Unknown tension that satisfies Bestel's equation. It starts from zero unless the run continues from a saved
    /// state.
    Bestel(Bestel),
    /// Tension determined by the coherence of oscillators through a [`Feedback`](crate::coupling::Feedback). The value
    /// below applies while the oscillators are incoherent or at rest.
    Coherence {
        /// Tension T0 of incoherent oscillators, Pa.
        unsynchronized: f64,
    },
    /// Linear function of time: the tangent of an activation model at a state, used for derivatives at that state.
    Line {
        /// Time of the state, s.
        t: f64,
        /// Tension T in this state, Pa.
        tension: f64,
        /// Rate Ṫ, Pa/s.
        slope: f64,
    },
}

impl Activation {
    /// Returns the activation model if it determines the tension.
    pub fn model(&self) -> Option<&Bestel> {
        match self {
            Self::Bestel(model) => Some(model),
            Self::Given(_) | Self::Coherence { .. } | Self::Line { .. } => None,
        }
    }

    /// Returns whether the coherence of oscillators determines the tension.
    pub(crate) fn is_coherent(&self) -> bool {
        matches!(self, Self::Coherence { .. })
    }

    /// Returns the tension at time `t`. If an activation model determines the tension, this is `unknown`.
    pub fn at(&self, t: f64, unknown: f64) -> f64 {
        match self {
            Self::Given(signal) => signal.at(t).value,
            Self::Bestel(_) => unknown,
            Self::Coherence { unsynchronized } => *unsynchronized,
            Self::Line { t: touches, tension, slope } => tension + slope * (t - touches),
        }
    }

    /// Returns the activation with the tension scaled by `part`. Tensions of activation models are unknowns and are not
    /// scaled.
    #[must_use]
    pub fn scaled(&self, part: f64) -> Self {
        match self {
            Self::Given(signal) => Self::Given(signal.scaled(part)),
            Self::Bestel(model) => Self::Bestel(*model),
            Self::Coherence { unsynchronized } => {
                Self::Coherence { unsynchronized: part * unsynchronized }
            }
            Self::Line { t, tension, slope } => {
                Self::Line { t: *t, tension: part * tension, slope: part * slope }
            }
        }
    }

    /// Replaces an activation model by its tangent at time `t` and `tension`. Other activations are returned unchanged.
    pub(crate) fn tangent_at(&self, t: f64, tension: f64) -> Self {
        match self {
            Self::Bestel(model) => Self::Line { t, tension, slope: model.rate(t, tension) },
            other => other.clone(),
        }
    }
}

/// Distance from the center of a switch, in units of its width, beyond which tanh is constant to within 1e-17.
const SWITCH_WIDTH: f64 = 20.0;

/// Near a switch, steps are limited to a fraction of its duration. Steps end at the kinks of |a|.
impl TimeScales for Bestel {
    fn next_break(&self, after: f64) -> Option<Break> {
        let t = self.breakpoints().into_iter().find(|t| *t > after)?;
        Some(Break { t, order: 1 })
    }

    fn time_scale(&self, from: f64, to: f64) -> Option<f64> {
        let reach = SWITCH_WIDTH * self.width;
        let switches = [self.systole, self.diastole];
        let near = |switch: &f64| from < switch + reach && to > switch - reach;
        let rise = switches.iter().any(near).then_some(4.0 * self.width);
        shortest(rise)
    }

    fn longest_step(&self, from: f64, to: f64) -> Option<f64> {
        Some(FRACTION * self.time_scale(from, to)?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_end_at_kinks_and_are_short_at_switches() {
        let model = Bestel::ventricle(1.5e5);
        let next = model.next_break(0.162).unwrap();
        assert!((next.t - 0.16448).abs() < 5e-6 && next.order == 1);
        assert_eq!(model.next_break(0.485), None);
        assert_eq!(model.longest_step(0.27, 0.3), None);
        assert_eq!(model.longest_step(0.1, 0.2), Some(0.005));
    }
}
