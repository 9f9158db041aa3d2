//! Equilibria under given load factors.

use std::ops::ControlFlow;

use super::newton::{Newton, is_singular, square};
use super::path::{PathEnd, PathState, Stability};
use super::{GRADIENT_STEP, Search, Shortfall, not_converged};
use crate::error::ModelError;

/// The next load step may be twice as long if a step requires at most this number of iterations.
const QUICK: usize = 6;
/// Largest allowed second-order part of a prediction, relative to the first-order part.
const LARGEST_CHANGE: f64 = 0.5;
/// A path ends if a step fails whose load increment is below this fraction of the whole load, and whose change of the
/// displacement gradient is below this fraction of the allowed change. A soft body may require smaller load increments,
/// for example before a limit point or at the start of a contact.
const SMALLEST_STEP: f64 = 1.0 / 1024.0;
/// Load increment, as a fraction of the whole load, below which a failed step always ends the path.
const SMALLEST_LOAD_STEP: f64 = 1e-9;

/// A path followed in load steps.
pub(super) struct LoadSteps<'n, 'm> {
    newton: &'n mut Newton<'m>,
    x: Vec<f64>,
    reached: f64,
    /// Largest load increment of the next step.
    increment: f64,
    load_steps: usize,
    /// Load increment of the last step, and the direction at the start of that step.
    before: Option<(f64, Vec<f64>)>,
    stability: Stability,
}

impl<'n, 'm> LoadSteps<'n, 'm> {
    pub(super) fn new(newton: &'n mut Newton<'m>) -> Self {
        Self {
            x: vec![0.0; newton.layout.n_unknowns()],
            newton,
            reached: 0.0,
            increment: 1.0,
            load_steps: 0,
            before: None,
            stability: Stability::default(),
        }
    }

    /// Computes the equilibria under all `loads`.
    pub(super) fn follow(
        mut self,
        loads: &[f64],
        watch: &mut dyn FnMut(&Search) -> ControlFlow<()>,
        record: &mut dyn FnMut(PathState) -> ControlFlow<()>,
    ) -> Result<PathEnd, ModelError> {
        let (mut shortfall, mut has_states) = (None, false);
        for &load in loads {
            let from = self.reached;
            shortfall = self.advance_to(load, watch)?;
            // Multipliers converge only at requested states. Another state is recorded only if the path would otherwise
            // be empty.
            let is_state = self.reached != from && !(has_states && self.newton.has_multipliers());
            if shortfall.is_none() || is_state {
                has_states = true;
                let state = PathState::new(self.newton, &self.x, self.reached);
                if record(state).is_break() {
                    break;
                }
            }
            if shortfall.is_some() {
                break;
            }
        }
        Ok(PathEnd {
            reached: self.reached,
            load_steps: self.load_steps,
            newton_iterations: self.newton.iterations,
            critical_points: self.stability.points,
            shortfall,
            is_continued: false,
        })
    }

    /// Advances to the load factor `end`, or as far as possible.
    fn advance_to(
        &mut self,
        end: f64,
        watch: &mut dyn FnMut(&Search) -> ControlFlow<()>,
    ) -> Result<Option<Shortfall>, ModelError> {
        let n_free = self.newton.n_free();
        let mut direction = None;
        while self.reached != end {
            let slope = match direction.take() {
                Some(slope) => slope,
                None => match self.newton.direction(&self.x, self.reached) {
                    Ok(slope) => {
                        self.observe();
                        slope
                    }
                    Err(ModelError::Factorization(error))
                        if self.load_steps > 0 && is_singular(&error) =>
                    {
                        return self.give_up(not_converged(self.newton));
                    }
                    Err(error) => return Err(error),
                },
            };
            let gradient = self.newton.gradient(&slope[..n_free], 1.0);
            let left = end - self.reached;
            let step = self.increment.min((GRADIENT_STEP / gradient).max(SMALLEST_STEP));
            let is_last = step >= left.abs();
            let step = if is_last { left } else { step.copysign(left) };
            let target = if is_last { end } else { self.reached + step };
            let predicted = self.predicted(&slope, step);
            let before_step = self.newton.iterations;
            let mut interrupted = false;
            let at = Search {
                load_step: self.load_steps + 1,
                reached: self.reached,
                target,
                iteration: 0,
                iterations: 0,
            };
            let reported = |[iteration, iterations]: [usize; 2]| {
                let flow = watch(&Search { iteration, iterations, ..at });
                interrupted |= flow.is_break();
                flow
            };
            let found = self.newton.solve(&self.x, &predicted, target, !is_last, reported)?;
            if let Some(solution) = found {
                self.x = solution;
                self.before = Some((step, slope));
                self.reached = target;
                self.load_steps += 1;
                let longest = match self.newton.iterations - before_step {
                    ..=QUICK => 2.0 * step.abs(),
                    _ => step.abs(),
                };
                // A step that ends at a requested load may be shorter than possible.
                self.increment = match is_last {
                    true => self.increment.max(longest),
                    false => longest,
                };
            } else if interrupted {
                return Ok(Some(Shortfall::Interrupted));
            } else {
                self.increment = 0.5 * step.abs();
                direction = Some(slope);
                // At a kink of a law, for example where fibers become slack, the direction jumps, and its change over
                // the previous step predicts nothing.
                let was_curved = self.before.take().is_some();
                let is_stiff = self.increment * gradient < SMALLEST_STEP * GRADIENT_STEP;
                if self.increment < SMALLEST_LOAD_STEP
                    || (self.increment < SMALLEST_STEP && is_stiff && !was_curved)
                {
                    return self.give_up(not_converged(self.newton));
                }
            }
        }
        let at = Search {
            load_step: self.load_steps,
            reached: self.reached,
            target: end,
            iteration: 0,
            iterations: 0,
        };
        let mut interrupted = false;
        let mut reported = |[iteration, iterations]: [usize; 2]| {
            let flow = watch(&Search { iteration, iterations, ..at });
            interrupted |= flow.is_break();
            flow
        };
        match self.newton.augment(&mut self.x, end, &mut reported)? {
            true => self.observe(),
            false if interrupted => return Ok(Some(Shortfall::Interrupted)),
            false => return self.give_up(Shortfall::Penetration),
        }
        Ok(None)
    }

    /// Predicts the equilibrium after a `step` from the direction at the start of the step and the change of the
    /// direction over the previous step.
    fn predicted(&self, direction: &[f64], step: f64) -> Vec<f64> {
        let x = self.x.iter().zip(direction);
        let mut predicted: Vec<f64> = x.map(|(x, d)| x + step * d).collect();
        if let Some((length, before)) = &self.before {
            let change = direction.iter().zip(before).map(|(now, before)| now - before);
            let change: Vec<f64> = change.map(|d| 0.5 * step * step / length * d).collect();
            let n_free = self.newton.n_free();
            // If the direction changes rapidly, for example before a limit point, the change is not constant.
            if square(&change[..n_free])
                <= (LARGEST_CHANGE * step).powi(2) * square(&direction[..n_free])
            {
                for (predicted, change) in predicted.iter_mut().zip(change) {
                    *predicted += change;
                }
            }
        }
        predicted
    }

    fn observe(&mut self) {
        let negative = self.newton.negative_directions();
        self.stability.observe(self.newton, negative, self.reached, None);
    }

    /// Ends the path with `shortfall` after the last equilibrium has fully converged.
    fn give_up(&mut self, shortfall: Shortfall) -> Result<Option<Shortfall>, ModelError> {
        if self.load_steps > 0 {
            let goes_on = |_| ControlFlow::Continue(());
            let (x, reached) = (&self.x, self.reached);
            let polished = self.newton.solve(x, x, reached, false, goes_on)?;
            self.x = polished.unwrap_or_else(|| self.x.clone());
        }
        Ok(Some(shortfall))
    }
}
