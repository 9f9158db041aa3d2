//! Functions of time with their exact first and second derivatives.
//!
//! Loads need the value, the rod's Rayleigh load its first derivative, prescribed
//! displacements both: their rates enter the differentiated constraints.

pub(crate) mod jet;
pub(crate) mod schedule;
pub(crate) mod spline;
pub(crate) mod timing;

use std::f64::consts::TAU;
use std::sync::Arc;

use jet::Jet;
use spline::Spline;
use timing::just_after;

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
    /// 0 before `start`, `value` after `start + rise`, between them `value · s³ (6 s² - 15 s + 10)`
    /// with `s = (t - start)/rise`: two continuous derivatives. Without a rise it jumps: it is still
    /// 0 at `start`, and `value` right after.
    Step {
        /// Value after the step.
        value: f64,
        /// When it begins, s.
        start: f64,
        /// How long it takes, s; 0 for a jump.
        rise: f64,
    },
    /// 0 before `start`, `value` after `end`, linear between them.
    Ramp {
        /// Value at the end.
        value: f64,
        /// When it begins, s.
        start: f64,
        /// When it ends, s; after `start`.
        end: f64,
    },
    /// Values at given times.
    Table(Arc<Spline>),
    /// The sum of its terms.
    Sum(Vec<Signal>),
    /// The product of its factors.
    Product(Vec<Signal>),
}

impl Signal {
    /// The highest frequency of its sines, Hz, if it has any.
    pub fn frequency(&self) -> Option<f64> {
        match self {
            Self::Sine { frequency, .. } | Self::RampedSine { frequency, .. } => {
                (*frequency != 0.0).then_some(frequency.abs())
            }
            Self::Sum(parts) | Self::Product(parts) => {
                parts.iter().filter_map(Self::frequency).reduce(f64::max)
            }
            _ => None,
        }
    }

    /// Value, first and second derivative at time `t` (s).
    pub fn at(&self, t: f64) -> Jet {
        let time = Jet::variable(t);
        match self {
            Self::Constant(value) => Jet::constant(*value),
            Self::Sine {
                amplitude,
                frequency,
                phase,
            } => (time * (TAU * frequency) + *phase).sin() * *amplitude,
            Self::RampedSine {
                amplitude,
                frequency,
                steepness,
                shift,
            } => {
                let at_rest = 1.0 / (1.0 + shift.exp());
                let ramp = (time * *steepness + (-shift)).sigmoid() + (-at_rest);
                ramp * (time * (TAU * frequency)).sin() * *amplitude
            }
            Self::Step { value, start, rise } if *rise == 0.0 => {
                Jet::constant(if t < just_after(*start) { 0.0 } else { *value })
            }
            Self::Step { value, start, rise } => {
                let s = (time + (-start)) * (1.0 / rise);
                smooth_step(s) * *value
            }
            Self::Ramp { value, start, end } => {
                let s = (time + (-start)) * (1.0 / (end - start));
                clamp(s) * *value
            }
            Self::Table(spline) => spline.at(t),
            Self::Sum(terms) => {
                let zero = Jet::constant(0.0);
                terms.iter().fold(zero, |sum, term| sum + term.at(t))
            }
            Self::Product(factors) => {
                let one = Jet::constant(1.0);
                factors
                    .iter()
                    .fold(one, |product, factor| product * factor.at(t))
            }
        }
    }

    /// The lowest derivative that jumps, 0 being the value itself; 3 stands for no lower one.
    pub fn lowest_jump(&self) -> u8 {
        match self {
            Self::Step { rise, .. } if *rise == 0.0 => 0,
            Self::Ramp { .. } => 1,
            Self::Sum(parts) | Self::Product(parts) => {
                parts.iter().map(Self::lowest_jump).min().unwrap_or(3)
            }
            _ => 3,
        }
    }

    /// Why nothing can move as it says, and what to do; none if its value and slope are continuous.
    pub fn unfit_for_motion(&self) -> Option<&'static str> {
        match self.lowest_jump() {
            0 => Some("it jumps: give the step a rise"),
            1 => Some("its slope jumps: take a `step`, whose rise is smooth, in place of a `ramp`"),
            _ => None,
        }
    }

    /// The latest start and the earliest end of the tables it is made of, s.
    pub fn range(&self) -> (f64, f64) {
        match self {
            Self::Table(spline) => spline.range(),
            Self::Sum(parts) | Self::Product(parts) => parts
                .iter()
                .map(Self::range)
                .fold(ALWAYS, |(start, end), (s, e)| (start.max(s), end.min(e))),
            _ => ALWAYS,
        }
    }
}

const ALWAYS: (f64, f64) = (f64::NEG_INFINITY, f64::INFINITY);

/// s³ (6 s² - 15 s + 10) between 0 and 1, constant beyond.
fn smooth_step(s: Jet) -> Jet {
    let x = s.value.clamp(0.0, 1.0);
    s.compose(
        x * x * x * (x * (6.0 * x - 15.0) + 10.0),
        30.0 * x * x * (x - 1.0) * (x - 1.0),
        60.0 * x * (x - 1.0) * (2.0 * x - 1.0),
    )
}

/// s between 0 and 1, constant beyond.
fn clamp(s: Jet) -> Jet {
    let inside = (0.0..1.0).contains(&s.value);
    s.compose(s.value.clamp(0.0, 1.0), f64::from(u8::from(inside)), 0.0)
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
            Signal::Step {
                value: 4.0,
                start: 0.2,
                rise: 0.4,
            },
            Signal::Ramp {
                value: 2.0,
                start: 0.1,
                end: 1.3,
            },
            Signal::Table(Arc::new(
                Spline::new(vec![-1.0, 0.5, 1.0, 2.0], vec![0.0, 2.0, -1.0, 3.0]).unwrap(),
            )),
            Signal::Sum(vec![Signal::Constant(1.0), Signal::paper(2.0)]),
            Signal::Product(vec![
                Signal::paper(2.0),
                Signal::Sine {
                    amplitude: 3.0,
                    frequency: 1.0,
                    phase: 0.1,
                },
            ]),
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
    fn the_frequency_is_that_of_what_oscillates() {
        let sine = |frequency| Signal::Sine {
            amplitude: 1.0,
            frequency,
            phase: 0.0,
        };
        assert_eq!(sine(0.0).frequency(), None);
        assert_eq!(sine(-8.0).frequency(), Some(8.0));
        let sum = Signal::Sum(vec![sine(-8.0), sine(3.0), Signal::Constant(1.0)]);
        assert_eq!(sum.frequency(), Some(8.0));
    }

    #[test]
    fn steps_have_the_derivatives_they_claim_at_their_ends() {
        let step = Signal::Step {
            value: 4.0,
            start: 0.2,
            rise: 0.4,
        };
        assert_eq!(step.lowest_jump(), 3);
        for end in [0.2, 0.2 + 0.4] {
            let (before, after) = (step.at(end - 1e-9), step.at(end + 1e-9));
            // The third derivative is 60·4/0.4³ = 3750 at the ends.
            assert!((before.d2 - after.d2).abs() < 3750.0 * 2e-9 * 1.01);
            assert!(before.d1.abs() < 1e-12 && after.d1.abs() < 1e-12);
        }
        assert_eq!((step.at(0.0).value, step.at(5.0).value), (0.0, 4.0));
        let kinked = Signal::Sum(vec![
            step,
            Signal::Ramp {
                value: 1.0,
                start: 0.0,
                end: 1.0,
            },
        ]);
        assert_eq!(kinked.lowest_jump(), 1);
        let sudden = Signal::Step {
            value: 1.0,
            start: 0.0,
            rise: 0.0,
        };
        let jumps = Signal::Product(vec![kinked, sudden]);
        assert_eq!(jumps.lowest_jump(), 0);
    }

    /// Values on both sides, to the last times that stages can have, and no derivatives.
    #[test]
    fn a_step_without_a_rise_has_a_value_on_each_side() {
        for start in [0.0, 0.3, 7.0, -2.0] {
            let jump = Signal::Step {
                value: 4.0,
                start,
                rise: 0.0,
            };
            let after = just_after(start);
            assert!(after > start);
            for (t, value) in [(start, 0.0), (start.next_up(), 0.0), (after, 4.0)] {
                let expected = if start == 0.0 && t == start.next_up() {
                    0.0
                } else {
                    value
                };
                assert_eq!(jump.at(t), Jet::constant(expected));
            }
            let breaks: Vec<_> = jump.breaks(start - 1.0, start + 1.0).collect();
            assert_eq!(breaks, [timing::Break { t: start, order: 0 }]);
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
