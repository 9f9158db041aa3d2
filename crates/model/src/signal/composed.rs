//! Constants, splines, rotations, sums and products of functions of time.

use super::jet::Jet;
use super::spline::Spline;
use super::timing::{Break, FRACTION, TimeScales, shortest};
use super::{ALWAYS, Signal, TimeFunction};

impl TimeFunction for f64 {
    fn at(&self, _: f64) -> Jet {
        Jet::constant(*self)
    }

    fn time_scale(&self, _: f64, _: f64) -> Option<f64> {
        None
    }

    fn constant_over(&self, _: f64, _: f64) -> Option<f64> {
        Some(*self)
    }
}

/// Steps must resolve the curvature of the spline. They need not end at its knots, because the spline is smooth enough
/// there.
impl TimeFunction for Spline {
    fn at(&self, t: f64) -> Jet {
        self.at(t)
    }

    fn time_scale(&self, from: f64, to: f64) -> Option<f64> {
        self.time_scale(from, to)
    }

    fn range(&self) -> (f64, f64) {
        self.range()
    }
}

/// Operation that combines functions.
#[derive(Debug, Clone, Copy)]
pub(super) enum Operation {
    Sum,
    Product,
}

#[derive(Debug)]
pub(super) struct Combination(pub(super) Operation, pub(super) Vec<Signal>);

impl Combination {
    fn shortest(&self, time: impl Fn(&Signal) -> Option<f64>) -> Option<f64> {
        shortest(self.1.iter().filter_map(time))
    }
}

/// Value of a sum, relative to the sum of magnitudes of its terms, below which the terms cancel except for rounding. Such a
/// sum is zero: tensions must not be negative, and supports with a zero motion do not move.
const ROUNDING: f64 = 16.0 * f64::EPSILON;

/// Number of intervals at whose ends the speed of a rotation is evaluated.
const SPEEDS: u32 = 16;

/// The function sin(θ + `phase`) − sin(`phase`) of an angle θ.
#[derive(Debug)]
pub(super) struct Turn {
    pub(super) angle: Signal,
    pub(super) phase: f64,
}

impl TimeFunction for Turn {
    fn at(&self, t: f64) -> Jet {
        let turned = (self.angle.at(t) + Jet::constant(self.phase)).sin();
        turned + Jet::constant(-self.phase.sin())
    }

    fn time_scale(&self, from: f64, to: f64) -> Option<f64> {
        let angle = self.angle.time_scale(from, to)?;
        let times = (0..=SPEEDS).map(|i| from + (to - from) * f64::from(i) / f64::from(SPEEDS));
        let speeds = times.map(|t| 1.0 / self.angle.at(t).d1.abs());
        shortest(speeds.chain([angle]))
    }

    fn constant_over(&self, from: f64, to: f64) -> Option<f64> {
        let angle = self.angle.constant_over(from, to)?;
        Some((angle + self.phase).sin() - self.phase.sin())
    }

    fn next_break(&self, after: f64) -> Option<Break> {
        self.angle.next_break(after)
    }

    fn lowest_jump(&self) -> u8 {
        self.angle.lowest_jump()
    }

    fn frequency(&self) -> Option<f64> {
        self.angle.frequency()
    }

    fn range(&self) -> (f64, f64) {
        self.angle.range()
    }

    fn under_part(&self, part: f64) -> Option<Signal> {
        let angle = self.angle.scaled(part);
        let phase = self.phase;
        Some(Self { angle, phase }.into())
    }
}

impl TimeFunction for Combination {
    fn at(&self, t: f64) -> Jet {
        let (start, put): (f64, fn(Jet, Jet) -> Jet) = match self.0 {
            Operation::Sum => (0.0, |sum, term| sum + term),
            Operation::Product => (1.0, |product, factor| product * factor),
        };
        let mut size = 0.0;
        let parts = self.1.iter().map(|part| part.at(t)).inspect(|part| size += part.value.abs());
        let mut combined = parts.fold(Jet::constant(start), put);
        let cancels = size.is_finite() && combined.value.abs() <= ROUNDING * size;
        if matches!(self.0, Operation::Sum) && cancels {
            combined.value = 0.0;
        }
        combined
    }

    fn time_scale(&self, from: f64, to: f64) -> Option<f64> {
        self.shortest(|part| part.time_scale(from, to))
    }

    fn longest_step(&self, from: f64, to: f64) -> Option<f64> {
        let changes = |part: &&Signal| part.constant_over(from, to).is_none();
        match self.0 {
            // One factor may begin to change when another factor changes.
            Operation::Product if self.1.iter().filter(changes).count() > 1 => {
                Some(FRACTION * self.time_scale(from, to)?)
            }
            _ => self.shortest(|part| part.longest_step(from, to)),
        }
    }

    fn constant_over(&self, from: f64, to: f64) -> Option<f64> {
        let mut values = self.1.iter().map(|part| part.constant_over(from, to));
        match self.0 {
            Operation::Sum => values.try_fold(0.0, |sum, value| Some(sum + value?)),
            // A product with a zero factor is constant.
            Operation::Product if values.clone().any(|value| value == Some(0.0)) => Some(0.0),
            Operation::Product => values.try_fold(1.0, |product, value| Some(product * value?)),
        }
    }

    fn next_break(&self, after: f64) -> Option<Break> {
        let breaks = self.1.iter().filter_map(|part| part.next_break(after));
        breaks.reduce(Break::earlier)
    }

    fn under_part(&self, part: f64) -> Option<Signal> {
        if self.1.iter().all(Signal::is_linear_in_load) {
            return None;
        }
        let scaled = |own: &Signal| match (self.0, own.is_linear_in_load()) {
            (Operation::Product, true) => own.clone(),
            _ => own.scaled(part),
        };
        Some(Self(self.0, self.1.iter().map(scaled).collect()).into())
    }

    fn lowest_jump(&self) -> u8 {
        self.1.iter().map(Signal::lowest_jump).min().unwrap_or(3)
    }

    fn frequency(&self) -> Option<f64> {
        self.1.iter().filter_map(Signal::frequency).reduce(f64::max)
    }

    fn sweep(&self, to: f64) -> Option<[f64; 2]> {
        self.1.iter().find_map(|part| part.sweep(to))
    }

    fn range(&self) -> (f64, f64) {
        let ranges = self.1.iter().map(Signal::range);
        ranges.fold(ALWAYS, |(start, end), (s, e)| (start.max(s), end.min(e)))
    }
}
