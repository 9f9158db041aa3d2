//! Events: zero crossings of functions of the solution.

use std::fmt;

use myovib_dae::{Direction, Problem, StepError};

use crate::dense::Collocation;
use crate::method::Method;
use crate::newton::expect_finite;
use crate::work::Counters;

/// Root functions, which write g(t, y, ẏ) to the last argument.
pub(crate) type RootFunctions<P> =
    dyn FnMut(&mut P, f64, &[f64], &[f64], &mut [f64]) -> Result<(), StepError> + Send;

/// Monitors root functions g on the dense output of accepted steps.
///
/// A crossing is detected by a change of sign between two successive nodes of a step (including its ends), because a
/// step of high order may contain several crossings. It is located up to a few rounding errors of t. If a function is
/// zero, its next crossing is detected only after the function has become nonzero.
pub(crate) struct Roots<P> {
    directions: Vec<Direction>,
    functions: Box<RootFunctions<P>>,
    /// Time up to which the search for crossings is complete; `None` before the first step.
    t: Option<f64>,
    /// g at `t`.
    low: Vec<f64>,
    /// g at the end of the current interval.
    high: Vec<f64>,
    /// g within the interval.
    middle: Vec<f64>,
    y: Vec<f64>,
    y_dot: Vec<f64>,
}

impl<P> fmt::Debug for Roots<P> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Roots")
            .field("directions", &self.directions)
            .field("t", &self.t)
            .field("low", &self.low)
            .finish_non_exhaustive()
    }
}

/// Last step, whose polynomial is searched.
pub(crate) struct LastStep<'a> {
    pub(crate) method: &'a Method,
    pub(crate) collocation: &'a Collocation,
}

/// First crossing. The result for each function is 1 if it rises through zero, −1 if it falls, and 0 if it does not
/// cross zero.
pub(crate) struct Crossing {
    pub(crate) t: f64,
    pub(crate) crossings: Vec<i32>,
}

impl<P: Problem> Roots<P> {
    /// Creates root functions, one per entry of `directions`, for a problem with `n` unknowns.
    pub(crate) fn new(
        directions: Vec<Direction>,
        functions: Box<RootFunctions<P>>,
        n: usize,
    ) -> Self {
        let n_roots = directions.len();
        Self {
            directions,
            functions,
            t: None,
            low: vec![0.0; n_roots],
            high: vec![0.0; n_roots],
            middle: vec![0.0; n_roots],
            y: vec![0.0; n],
            y_dot: vec![0.0; n],
        }
    }

    /// Discards the interval that has been searched.
    pub(crate) fn restart(&mut self) {
        self.t = None;
    }

    /// Returns the time up to which the search for crossings is complete, and g at that time.
    pub(crate) fn saved(&self) -> (Option<f64>, Vec<f64>) {
        (self.t, self.low.clone())
    }

    /// Restores the state returned by [`saved`](Self::saved) if the number of functions is the same.
    pub(crate) fn restore(&mut self, t: Option<f64>, low: &[f64]) {
        if low.len() == self.low.len() {
            self.t = t;
            self.low.copy_from_slice(low);
        }
    }

    /// Returns the first new crossing up to `end`, a time in the last step.
    pub(crate) fn next(
        &mut self,
        problem: &mut P,
        step: &LastStep<'_>,
        end: f64,
        counters: &mut Counters,
    ) -> Result<Option<Crossing>, StepError> {
        let Collocation { t0, h, .. } = *step.collocation;
        if self.t.is_none() {
            self.evaluate(problem, step, t0, counters)?;
            self.pass(t0);
        }
        let nodes = step.method.nodes().iter().map(|c| t0 + c * h);
        for node in nodes.filter(|node| *node < end).chain([end]) {
            if self.t.is_some_and(|t| node <= t) {
                continue;
            }
            self.evaluate(problem, step, node, counters)?;
            if let Some(crossing) = self.first(problem, step, node, counters)? {
                return Ok(Some(crossing));
            }
            self.pass(node);
        }
        Ok(None)
    }

    /// Returns the first crossing up to `t`, where the value of g is `high`.
    fn first(
        &mut self,
        problem: &mut P,
        step: &LastStep<'_>,
        mut t: f64,
        counters: &mut Counters,
    ) -> Result<Option<Crossing>, StepError> {
        let n_roots = self.directions.len();
        if !(0..n_roots).any(|i| self.crosses(i)) {
            return Ok(None);
        }
        // Each function that crosses zero moves t back to its crossing. Functions that cross later are then not
        // counted.
        for i in 0..n_roots {
            if self.crosses(i) {
                t = self.narrow(i, problem, step, t, counters)?;
            }
        }
        let crossings = (0..n_roots)
            .map(|i| match self.crosses(i) {
                true => -(self.low[i].signum() as i32),
                false => 0,
            })
            .collect();
        self.pass(t);
        Ok(Some(Crossing { t, crossings }))
    }

    /// Returns whether function i crosses zero in its direction between `low` and `high`.
    fn crosses(&self, i: usize) -> bool {
        let wanted = match self.directions[i] {
            Direction::Both => self.low[i] != 0.0,
            Direction::Rising => self.low[i] < 0.0,
            Direction::Falling => self.low[i] > 0.0,
        };
        wanted && changes(self.low[i], self.high[i])
    }

    /// Reduces the interval up to `t` so that the first crossing of function i is at its end. Uses regula falsi. If the
    /// same end is kept twice, the function value at this end is halved to speed up convergence (the Illinois method).
    /// If the function is zero at `t`, it may have been zero over an interval; bisection then finds the start of this
    /// interval.
    fn narrow(
        &mut self,
        i: usize,
        problem: &mut P,
        step: &LastStep<'_>,
        t: f64,
        counters: &mut Counters,
    ) -> Result<f64, StepError> {
        let Collocation { t0, h, .. } = *step.collocation;
        let tolerance = 100.0 * f64::EPSILON * (t0.abs() + h);
        let (mut from, mut to) = (self.t.unwrap_or(t0), t);
        let (mut at_from, mut at_to) = (self.low[i], self.high[i]);
        let mut end_moved = None;
        let mut is_zero_seen = false;
        while to - from > tolerance {
            let middle = match (at_to == 0.0, is_zero_seen) {
                (false, false) => to - at_to * (to - from) / (at_to - at_from),
                (true, false) => to - 0.5 * tolerance,
                (_, true) => 0.5 * (from + to),
            };
            is_zero_seen |= at_to == 0.0;
            let middle = middle.clamp(from + 0.5 * tolerance, to - 0.5 * tolerance);
            std::mem::swap(&mut self.high, &mut self.middle);
            self.evaluate(problem, step, middle, counters)?;
            let end = changes(self.low[i], self.high[i]);
            let stays = end_moved.replace(end) == Some(end);
            if end {
                (to, at_to) = (middle, self.high[i]);
                at_from *= if stays { 0.5 } else { 1.0 };
            } else {
                (from, at_from) = (middle, self.high[i]);
                at_to *= if stays { 0.5 } else { 1.0 };
                std::mem::swap(&mut self.high, &mut self.middle);
            }
        }
        Ok(to)
    }

    /// Evaluates g at `t` and writes it to `high`.
    fn evaluate(
        &mut self,
        problem: &mut P,
        step: &LastStep<'_>,
        t: f64,
        counters: &mut Counters,
    ) -> Result<(), StepError> {
        step.collocation.evaluate(step.method, t, 0, &mut self.y);
        step.collocation.evaluate(step.method, t, 1, &mut self.y_dot);
        counters.statistics.root_evaluations += 1;
        (self.functions)(problem, t, &self.y, &self.y_dot, &mut self.high)?;
        expect_finite("root function", t, &self.high)
    }

    /// Continues the search from `t`, where the value of g is `high`.
    fn pass(&mut self, t: f64) {
        self.t = Some(t);
        std::mem::swap(&mut self.low, &mut self.high);
    }
}

/// Returns whether a function changes sign or becomes zero between the values `low` and `high`.
fn changes(low: f64, high: f64) -> bool {
    high == 0.0 || (low < 0.0) != (high < 0.0)
}
