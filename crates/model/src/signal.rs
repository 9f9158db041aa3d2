//! Functions of time with their exact first and second derivatives.
//!
//! Loads need the value, the rod's Rayleigh load its first derivative (MODEL §3), prescribed
//! displacements both: their rates enter the differentiated constraints.

use std::f64::consts::TAU;

use crate::jet::Jet;

/// A function of time, in the units of what it drives.
#[derive(Debug, Clone, PartialEq)]
pub enum Signal {
    /// The same value at all times.
    Constant(f64),
    /// `amplitude · sin(2π frequency t + phase)`.
    Sine {
        /// Amplitude.
        amplitude: f64,
        /// Frequency, Hz.
        frequency: f64,
        /// Phase, rad.
        phase: f64,
    },
    /// The paper's load of section 3.2, a sine introduced by a shifted sigmoid that is 0 at t = 0:
    /// `amplitude · (1/(1+exp(-steepness t + shift)) - 1/(1+exp(shift))) · sin(2π frequency t)`.
    RampedSine {
        /// Amplitude once the ramp is over.
        amplitude: f64,
        /// Frequency, Hz.
        frequency: f64,
        /// Steepness of the sigmoid, 1/s.
        steepness: f64,
        /// Shift of the sigmoid; its middle lies at `shift / steepness`.
        shift: f64,
    },
}

impl Signal {
    /// The load of the paper, 8 Hz: `τ_y` of section 3.2 at `amplitude` = 100 Pa, `τ` of the rod
    /// at `amplitude` = 1.
    pub fn paper(amplitude: f64) -> Self {
        Self::RampedSine {
            amplitude,
            frequency: 8.0,
            steepness: 10.0,
            shift: 8.0,
        }
    }

    /// Value, first and second derivative at time `t` (s).
    pub fn at(&self, t: f64) -> Jet {
        let time = Jet::variable(t);
        match *self {
            Self::Constant(value) => Jet::constant(value),
            Self::Sine {
                amplitude,
                frequency,
                phase,
            } => (time * (TAU * frequency) + phase).sin() * amplitude,
            Self::RampedSine {
                amplitude,
                frequency,
                steepness,
                shift,
            } => {
                let at_rest = 1.0 / (1.0 + shift.exp());
                let ramp = (time * steepness + (-shift)).sigmoid() + (-at_rest);
                ramp * (time * (TAU * frequency)).sin() * amplitude
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn signals() -> Vec<Signal> {
        vec![
            Signal::Constant(3.0),
            Signal::Sine {
                amplitude: 2.0,
                frequency: 0.7,
                phase: 0.3,
            },
            Signal::paper(100.0),
        ]
    }

    #[test]
    fn derivatives_agree_with_central_differences() {
        let h = 1e-5;
        for signal in signals() {
            for t in [0.0, 0.31, 0.8, 1.7] {
                let (before, here, after) = (signal.at(t - h), signal.at(t), signal.at(t + h));
                // Truncation h²/6·|f'''| with |f'''| ≤ 100·(16π)³ ≈ 1.3e7, and one order more
                // for the second derivative of the same signal: 1.3e7·50·1.7e-11.
                assert!((here.d1 - (after.value - before.value) / (2.0 * h)).abs() < 1e-3);
                assert!((here.d2 - (after.d1 - before.d1) / (2.0 * h)).abs() < 2e-2);
            }
        }
    }

    #[test]
    fn the_papers_load_starts_from_rest_and_reaches_its_amplitude() {
        let load = Signal::paper(100.0);
        assert_eq!(load.at(0.0).value, 0.0);
        // At t = 5 + 1/32 s the sine is 1 and the sigmoid is 1 to exp(-42).
        let expected = 100.0 * (1.0 - 1.0 / (1.0 + 8f64.exp()));
        assert!((load.at(5.0 + 1.0 / 32.0).value - expected).abs() < 1e-10);
    }
}
