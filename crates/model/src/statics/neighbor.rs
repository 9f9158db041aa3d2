//! Equilibria continued from the equilibrium of a similar body.

use std::ops::ControlFlow;

use super::newton::{Newton, is_singular};
use super::{GRADIENT_STEP, Search};
use crate::error::ModelError;

/// The next step may be twice as long if a step requires at most this number of iterations.
const QUICK: usize = 4;
/// Smallest step. Smaller steps would cost more than a search from the unloaded body.
const SMALLEST_STEP: f64 = 1.0 / 16.0;

/// An equilibrium under the whole load, and the number of steps taken.
pub(super) struct Continued {
    pub(super) x: Vec<f64>,
    pub(super) steps: usize,
}

/// Follows the solutions of R(x) = (1 − s) R(x₀) from s = 0 to the equilibrium at s = 1, where R is the residual under
/// the whole load. The state x₀ has the given nodal `displacement`. Supports move at constant rates from their
/// positions in x₀. Returns `None` if small steps fail or if `watch` ends the search.
pub(super) fn follow(
    newton: &mut Newton<'_>,
    displacement: &[f64],
    watch: &mut dyn FnMut(&Search) -> ControlFlow<()>,
) -> Result<Option<Continued>, ModelError> {
    let mut x = newton.take_over(displacement);
    let Ok(imbalance) = newton.imbalance(&x) else {
        return Ok(None);
    };
    let (mut reached, mut increment, mut steps) = (0.0, 1.0_f64, 0);
    while reached < 1.0 {
        let (slope, gradient) = match newton.rate(&x, &imbalance) {
            Ok(slope) => slope,
            Err(ModelError::Inverted(_)) => return Ok(None),
            Err(ModelError::Factorization(error)) if is_singular(&error) => return Ok(None),
            Err(error) => return Err(error),
        };
        loop {
            let step = increment.min((GRADIENT_STEP / gradient).max(SMALLEST_STEP));
            let target = if reached + step >= 1.0 { 1.0 } else { reached + step };
            let step = target - reached;
            let predicted: Vec<f64> = x.iter().zip(&slope).map(|(x, d)| x + step * d).collect();
            newton.offset = imbalance.iter().map(|r| (1.0 - target) * r).collect();
            newton.distant = 1.0 - target;
            let before = newton.iterations;
            let mut interrupted = false;
            let reported = |[iteration, iterations]: [usize; 2]| {
                let search =
                    Search { load_step: steps + 1, reached, target, iteration, iterations };
                let flow = watch(&search);
                interrupted |= flow.is_break();
                flow
            };
            let found = newton.solve(&x, &predicted, 1.0, target < 1.0, reported)?;
            newton.offset.clear();
            if let Some(next) = found {
                x = next;
                reached = target;
                steps += 1;
                increment = match newton.iterations - before {
                    ..=QUICK => 2.0 * step,
                    _ => step,
                };
                break;
            }
            newton.distant = 1.0 - reached;
            increment = 0.5 * step;
            if interrupted || increment < SMALLEST_STEP {
                return Ok(None);
            }
        }
    }
    newton.distances.clear();
    let mut reported = |[iteration, iterations]: [usize; 2]| {
        watch(&Search { load_step: steps, reached, target: 1.0, iteration, iterations })
    };
    let is_whole = newton.augment(&mut x, 1.0, &mut reported)?;
    Ok(is_whole.then_some(Continued { x, steps }))
}
