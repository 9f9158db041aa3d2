//! Functions of time with their exact first and second derivatives.
//!
//! Loads require only the value. A strain prescribed at the end of the rod also requires the first derivative.
//! Prescribed displacements require both derivatives, which occur in the differentiated constraints.
//!
//! Any type that implements [`TimeFunction`] can be used. [`formula`] lists the functions that scenes select by name,
//! each defined in its own file.

mod composed;
pub mod formula;
pub(crate) mod jet;
pub(crate) mod schedule;
pub(crate) mod spline;
pub(crate) mod table;
pub(crate) mod timing;

use std::f64::consts::FRAC_PI_2;
use std::fmt::Debug;
use std::sync::Arc;

use composed::{Combination, Operation, Turn};
use jet::Jet;
use timing::{Break, FRACTION, TimeScales};

/// A function of time, with the properties that an integration requires. Times are in s.
///
/// # Examples
/// ```
/// use myovib_model::{Jet, Signal, TimeFunction};
///
/// #[derive(Debug)]
/// struct Decay(f64);
///
/// impl TimeFunction for Decay {
///     fn at(&self, t: f64) -> Jet {
///         let value = (-self.0 * t).exp();
///         Jet { value, d1: -self.0 * value, d2: self.0 * self.0 * value }
///     }
///     fn time_scale(&self, _: f64, _: f64) -> Option<f64> {
///         Some(1.0 / self.0)
///     }
/// }
/// let load = Signal::product(vec![Signal::constant(3.0), Decay(2.0).into()]);
/// assert_eq!(load.at(0.0).d1, -6.0);
/// ```
pub trait TimeFunction: Debug + Send + Sync {
    /// Returns the value and the first two derivatives at time `t`. At a break and up to 16 ε t after it, these are the
    /// values from before the break.
    fn at(&self, t: f64) -> Jet;

    /// Returns the shortest time scale of changes between two times, such as a rise time or a period;
    /// `None` if the function is constant.
    fn time_scale(&self, from: f64, to: f64) -> Option<f64>;

    /// Returns the longest step that cannot miss a change between two times, if there is a change.
    fn longest_step(&self, from: f64, to: f64) -> Option<f64> {
        Some(FRACTION * self.time_scale(from, to)?)
    }

    /// Returns the value if the function is constant between two times. If this is not implemented, steps stay as short
    /// as [`longest_step`](Self::longest_step) over the whole run.
    fn constant_over(&self, _from: f64, _to: f64) -> Option<f64> {
        None
    }

    /// Returns the first break after the time `after`.
    fn next_break(&self, _after: f64) -> Option<Break> {
        None
    }

    /// Returns the order of the lowest derivative that jumps: 0 for the value, 3 if no derivative
    /// below the third jumps.
    fn lowest_jump(&self) -> u8 {
        3
    }

    /// Returns the highest frequency (Hz) of the sines in the function, if any.
    fn frequency(&self) -> Option<f64> {
        None
    }

    /// Returns the lowest and the highest frequency (Hz) of a sweep between t = 0 and `to` (s); `None` for other
    /// functions.
    fn sweep(&self, _to: f64) -> Option<[f64; 2]> {
        None
    }

    /// Returns the first and the last time (s) at which the function is defined.
    fn range(&self) -> (f64, f64) {
        ALWAYS
    }

    /// Returns the reason why the parameters of the function are inconsistent, if they are.
    fn objection(&self) -> Option<Objection> {
        None
    }

    /// Returns the function under the fraction `part` of a load; `None` if the result is `part` times the function.
    fn under_part(&self, _part: f64) -> Option<Signal> {
        None
    }
}

/// Reason why the parameters of a function are invalid.
#[derive(Debug, Clone, PartialEq)]
pub struct Objection {
    /// Name of the parameter.
    pub key: &'static str,
    /// Description of the problem.
    pub problem: &'static str,
    /// Value found.
    pub found: String,
    /// Allowed values.
    pub allowed: &'static str,
    /// Suggested remedy.
    pub next: &'static str,
}

const ALWAYS: (f64, f64) = (f64::NEG_INFINITY, f64::INFINITY);

/// Function of time, in the units of the quantity that it drives.
#[derive(Debug, Clone)]
pub struct Signal(Arc<dyn TimeFunction>);

impl<F: TimeFunction + 'static> From<F> for Signal {
    fn from(function: F) -> Self {
        Self(Arc::new(function))
    }
}

impl Signal {
    /// Creates a constant function.
    pub fn constant(value: f64) -> Self {
        value.into()
    }

    /// Creates the sum of `terms`.
    pub fn sum(terms: Vec<Self>) -> Self {
        Combination(Operation::Sum, terms).into()
    }

    /// Creates the product of `factors`.
    pub fn product(factors: Vec<Self>) -> Self {
        Combination(Operation::Product, factors).into()
    }

    /// Creates the function sin θ of an angle θ (rad).
    pub fn sine(angle: Self) -> Self {
        Turn { angle, phase: 0.0 }.into()
    }

    /// Creates the function cos θ − 1 of an angle θ (rad).
    pub fn cosine_less_one(angle: Self) -> Self {
        let phase = FRAC_PI_2;
        Turn { angle, phase }.into()
    }

    /// Returns the function under a fraction `factor` of the load. This is `factor` times the function, except for
    /// functions of an angle, in which the angle is scaled.
    #[must_use]
    pub fn scaled(&self, factor: f64) -> Self {
        let product = || Self::product(vec![Self::constant(factor), self.clone()]);
        self.0.under_part(factor).unwrap_or_else(product)
    }

    /// Returns whether [`scaled`](Self::scaled) multiplies the function by the factor.
    pub(crate) fn is_linear_in_load(&self) -> bool {
        self.0.under_part(1.0).is_none()
    }

    /// Returns the highest frequency (Hz) of the sines in the function, if any.
    pub fn frequency(&self) -> Option<f64> {
        self.0.frequency()
    }

    /// Returns the lowest and the highest frequency (Hz) of a sweep between t = 0 and `to` (s); `None` for other
    /// functions.
    pub fn sweep(&self, to: f64) -> Option<[f64; 2]> {
        self.0.sweep(to)
    }

    /// Returns the value and the first two derivatives at time `t` (s).
    pub fn at(&self, t: f64) -> Jet {
        self.0.at(t)
    }

    /// Returns the order of the lowest derivative that jumps: 0 for the value, 3 if no derivative
    /// below the third jumps.
    pub fn lowest_jump(&self) -> u8 {
        self.0.lowest_jump()
    }

    /// Returns the reason why the function cannot prescribe a motion, with a remedy. Returns `None` if the value and
    /// the slope are continuous.
    pub fn unfit_for_motion(&self) -> Option<&'static str> {
        match self.lowest_jump() {
            0 => Some("it jumps; give the step a rise"),
            1 => Some(
                "its slope jumps; use a `step`, whose rise is smooth, instead of a `ramp`, and `interpolation = \
                 \"pchip\"` for a table",
            ),
            _ => None,
        }
    }

    /// Returns the latest start and the earliest end (s) of the tables in the function.
    pub fn range(&self) -> (f64, f64) {
        self.0.range()
    }

    /// Returns the reason why the parameters of the function are inconsistent, if they are.
    pub fn objection(&self) -> Option<Objection> {
        self.0.objection()
    }

    /// Returns the value if the function is constant between two times.
    pub(crate) fn constant_over(&self, from: f64, to: f64) -> Option<f64> {
        self.0.constant_over(from, to)
    }

    /// Returns the breaks in the interval (`from`, `to`].
    pub fn breaks(&self, from: f64, to: f64) -> impl Iterator<Item = Break> {
        std::iter::successors(self.next_break(from), |last| self.next_break(last.t))
            .take_while(move |next| next.t <= to)
    }
}

impl TimeScales for Signal {
    fn next_break(&self, after: f64) -> Option<Break> {
        self.0.next_break(after)
    }

    fn time_scale(&self, from: f64, to: f64) -> Option<f64> {
        let is_constant = self.constant_over(from, to).is_some();
        (!is_constant).then(|| self.0.time_scale(from, to))?
    }

    fn longest_step(&self, from: f64, to: f64) -> Option<f64> {
        let is_constant = self.constant_over(from, to).is_some();
        (!is_constant).then(|| self.0.longest_step(from, to))?
    }
}

#[cfg(test)]
mod tests {
    use super::spline::Spline;
    use super::timing::just_after;
    use super::*;

    fn signals() -> Vec<Signal> {
        vec![
            Signal::constant(3.0),
            Signal::from(formula::Sine { amplitude: 2.0, frequency: 0.7, phase: 0.3 }),
            Signal::from(formula::Chirp {
                amplitude: 2.0,
                frequency: 3.0,
                end_frequency: 0.5,
                duration: 1.0,
                phase: 0.3,
            }),
            Signal::paper(100.0),
            Signal::from(formula::StepFunction { value: 4.0, start: 0.2, rise: 0.4 }),
            Signal::from(formula::Ramp { value: 2.0, start: 0.1, end: 1.3 }),
            Signal::from(
                Spline::new(vec![-1.0, 0.5, 1.0, 2.0], vec![0.0, 2.0, -1.0, 3.0]).unwrap(),
            ),
            Signal::sum(vec![Signal::constant(1.0), Signal::paper(2.0)]),
            Signal::product(vec![
                Signal::paper(2.0),
                Signal::from(formula::Sine { amplitude: 3.0, frequency: 1.0, phase: 0.1 }),
            ]),
        ]
    }

    #[test]
    fn derivatives_agree_with_central_differences() {
        let h = 1e-5;
        for signal in signals() {
            for t in [0.0, 0.31, 0.8, 1.7] {
                let (before, here, after) = (signal.at(t - h), signal.at(t), signal.at(t + h));
                // The truncation error is h²/6·|f'''| with |f'''| ≤ 100·(16π)³ ≈ 1.3e7. For the second derivative, the
                // next derivative is larger by a factor of about 50: 1.3e7·50·1.7e-11.
                assert!((here.d1 - (after.value - before.value) / (2.0 * h)).abs() < 1e-3);
                assert!((here.d2 - (after.d1 - before.d1) / (2.0 * h)).abs() < 2e-2);
            }
        }
    }

    #[test]
    fn the_frequency_is_the_frequency_of_the_oscillating_factor() {
        let sine =
            |frequency| Signal::from(formula::Sine { amplitude: 1.0, frequency, phase: 0.0 });
        assert_eq!(sine(0.0).frequency(), None);
        assert_eq!(sine(-8.0).frequency(), Some(8.0));
        let sum = Signal::sum(vec![sine(-8.0), sine(3.0), Signal::constant(1.0)]);
        assert_eq!(sum.frequency(), Some(8.0));
    }

    /// The phase at a time is the mean frequency times this time.
    #[test]
    fn a_chirp_passes_from_one_frequency_to_another() {
        let chirp = Signal::from(formula::Chirp {
            amplitude: 2.0,
            frequency: 4.0,
            end_frequency: 10.0,
            duration: 3.0,
            phase: 0.0,
        });
        for (t, frequency) in [(0.0, 4.0), (1.0, 6.0), (3.0, 10.0), (4.0, 10.0)] {
            let here = chirp.at(t);
            // The phase is 0, 5, 21 and 31 turns; the bound allows for the rounding error of 2 · 2π · 31.
            assert!(here.value.abs() < 1e-12);
            assert!((here.d1 / (std::f64::consts::TAU * frequency) - 2.0).abs() < 1e-12);
        }
        assert_eq!(chirp.frequency(), Some(10.0));
        assert_eq!(chirp.time_scale(0.0, 1.0), Some(1.0 / 6.0));
        let enveloped = Signal::product(vec![Signal::paper(2.0), chirp]);
        assert_eq!(enveloped.sweep(1.0), Some([4.0, 6.0]));
        assert_eq!(enveloped.sweep(9.0), Some([4.0, 10.0]));
        assert_eq!(Signal::paper(2.0).sweep(9.0), None);
        // A sine of negative frequency vibrates equally fast. This chirp slows down to zero frequency and then becomes
        // faster again.
        let through_zero = Signal::from(formula::Chirp {
            amplitude: 2.0,
            frequency: 4.0,
            end_frequency: -10.0,
            duration: 3.0,
            phase: 0.0,
        });
        assert_eq!(through_zero.sweep(9.0), Some([0.0, 10.0]));
    }

    #[test]
    fn steps_have_the_derivatives_they_claim_at_their_ends() {
        let step = Signal::from(formula::StepFunction { value: 4.0, start: 0.2, rise: 0.4 });
        assert_eq!(step.lowest_jump(), 3);
        for end in [0.2, 0.2 + 0.4] {
            let (before, after) = (step.at(end - 1e-9), step.at(end + 1e-9));
            // The third derivative is 60·4/0.4³ = 3750 at the ends.
            assert!((before.d2 - after.d2).abs() < 3750.0 * 2e-9 * 1.01);
            assert!(before.d1.abs() < 1e-12 && after.d1.abs() < 1e-12);
        }
        assert_eq!((step.at(0.0).value, step.at(5.0).value), (0.0, 4.0));
        let kinked = Signal::sum(vec![
            step,
            Signal::from(formula::Ramp { value: 1.0, start: 0.0, end: 1.0 }),
        ]);
        assert_eq!(kinked.lowest_jump(), 1);
        let sudden = Signal::from(formula::StepFunction { value: 1.0, start: 0.0, rise: 0.0 });
        let jumps = Signal::product(vec![kinked, sudden]);
        assert_eq!(jumps.lowest_jump(), 0);
    }

    /// The step is constant on each side and has no derivatives. Times within rounding errors after the step still have
    /// the value on the left.
    #[test]
    fn a_step_without_a_rise_has_a_value_on_each_side() {
        for start in [0.0, 0.3, 7.0, -2.0] {
            let jump = Signal::from(formula::StepFunction { value: 4.0, start, rise: 0.0 });
            let after = just_after(start);
            assert!(after > start);
            for (t, value) in [(start, 0.0), (start.next_up(), 0.0), (after, 4.0)] {
                let expected = if start == 0.0 && t == start.next_up() { 0.0 } else { value };
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
        // At t = 5 + 1/32 s, the sine is 1, and the sigmoid differs from 1 by exp(-42).
        let expected = 100.0 * (1.0 - 1.0 / (1.0 + 8f64.exp()));
        assert!((load.at(5.0 + 1.0 / 32.0).value - expected).abs() < 1e-10);
    }
}
