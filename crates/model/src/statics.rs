//! Static equilibrium by continuation in the load, with Newton's method at each load step.

mod newton;
mod prospect;
mod response;

use std::ops::ControlFlow;

use myovib_fem::{Inverted, Law};

use crate::analysis::support::expect_held;
use crate::error::ModelError;
use crate::field::Field;
use crate::formulation::Formulation;
use crate::muscle::Muscle;
use crate::operators;
use newton::{Newton, is_singular};
pub(crate) use prospect::Prospect;

/// Maximum number of iterations of a load step after which the next step may be twice as long.
const QUICK: usize = 4;
/// Largest predicted increment of the displacement gradient in a load step.
const GRADIENT_STEP: f64 = 0.2;
/// Smallest load increment, as a fraction of the whole load.
const SMALLEST_LOAD_STEP: f64 = 1.0 / 1024.0;

/// A body at rest under its loads, or without.
#[derive(Debug, Clone, PartialEq)]
pub struct Equilibrium {
    /// Free displacement components, m.
    pub displacement: Vec<f64>,
    /// Pressure at the vertices, Pa; empty for a formulation without.
    pub pressure: Vec<f64>,
    /// Time of the loads, s; `None` for a body without loads.
    pub preload_time: Option<f64>,
    /// Newton iterations over all load steps, without their predictions.
    pub newton_iterations: usize,
    /// Load steps taken.
    pub load_steps: usize,
    /// Number of independent small motions from the equilibrium that grow: 0 if it is stable.
    /// Unknown if pressures follow the body, so that its tangent is not symmetric, or if pivots had
    /// to be exchanged.
    pub instabilities: Option<usize>,
}

impl Equilibrium {
    /// Returns the body without loads, prescribed displacements and tensions.
    pub fn unloaded(muscle: &Muscle) -> Self {
        let solid = &muscle.solid;
        Self {
            displacement: vec![0.0; solid.dofs().n_free()],
            pressure: operators::no_pressure(solid),
            preload_time: None,
            newton_iterations: 0,
            load_steps: 0,
            instabilities: None,
        }
    }
}

/// How far a search for an equilibrium came.
#[derive(Debug, Clone, PartialEq)]
pub struct Approach {
    /// The last equilibrium that was found.
    pub equilibrium: Equilibrium,
    /// The part of the load that it is under.
    pub reached: f64,
    /// Why it is not the whole load, if it is not.
    pub shortfall: Option<Shortfall>,
}

/// Why the whole load was not reached.
#[derive(Debug, Clone, PartialEq)]
pub enum Shortfall {
    /// The caller ended the search.
    Interrupted,
    /// Newton's method failed even in small load steps.
    NotConverged {
        /// An element that the last trials turned inside out.
        inverted: Option<Inverted>,
        /// Suggested remedy.
        remedy: String,
    },
}

impl Approach {
    /// Returns the reason why no equilibrium under the full load was found.
    pub fn error(&self) -> Option<ModelError> {
        Some(match self.shortfall.clone()? {
            Shortfall::Interrupted => ModelError::Interrupted,
            Shortfall::NotConverged { inverted, remedy } => ModelError::NoEquilibrium {
                reached: self.reached,
                inverted,
                remedy,
            },
        })
    }
}

/// How far the search for an equilibrium is, before an iteration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Search {
    /// Number of the load step, from 1; a failed step and its repetition with less load count once.
    pub load_step: usize,
    /// Fraction of the load that is in equilibrium.
    pub reached: f64,
    /// The part that this load step is to reach.
    pub target: f64,
    /// Newton's iteration for it, from 1.
    pub iteration: usize,
    /// Iterations over all load steps, with this one.
    pub iterations: usize,
}

/// Solves ∫P:∇φ = f(t), ∫ψ(p/κ + J - 1) = 0 for the loads at time `t`, or, for a `formulation`
/// without pressure, ∫P:∇φ = f(t) with the energy κ/2 (J - 1)² in P.
///
/// The path of equilibria is followed from the unloaded body. Each load step is predicted by the
/// equations linearized at its start. Its size is limited so that the prediction changes no
/// displacement gradient by more than 0.2. It is repeated with half the load if Newton's method
/// fails or moves the body by more than the prediction. Prescribed displacements and the tensions
/// of active stresses are part of the load. A tension that follows a model of activation has its
/// initial value, zero.
///
/// # Errors
/// [`ModelError::NotHeld`] for a body that can move without strain; [`ModelError::NoEquilibrium`]
/// with the fraction of the load that was reached, and the inverted element, if any;
/// [`ModelError::NotAllowed`] for `displacement` with κ = ∞; errors of [`Muscle::check`].
pub fn equilibrium(
    muscle: &Muscle,
    formulation: Formulation,
    t: f64,
) -> Result<Equilibrium, ModelError> {
    equilibrium_watched(muscle, formulation, t, &mut |_| ControlFlow::Continue(()))
}

/// Does the same; `watch` is called before each iteration, and may end the search.
///
/// # Errors
/// Errors of [`equilibrium`]; [`ModelError::Interrupted`].
pub fn equilibrium_watched(
    muscle: &Muscle,
    formulation: Formulation,
    t: f64,
    watch: &mut dyn FnMut(&Search) -> ControlFlow<()>,
) -> Result<Equilibrium, ModelError> {
    let approach = approach(muscle, formulation, t, watch)?;
    match approach.error() {
        Some(error) => Err(error),
        None => Ok(approach.equilibrium),
    }
}

/// Computes the equilibrium under the largest reachable load. If there is no equilibrium under the
/// full load, or `watch` ends the search, the last equilibrium of the load steps is returned.
///
/// # Errors
/// Errors of [`equilibrium`] except for [`ModelError::NoEquilibrium`].
pub fn approach(
    muscle: &Muscle,
    formulation: Formulation,
    t: f64,
    watch: &mut dyn FnMut(&Search) -> ControlFlow<()>,
) -> Result<Approach, ModelError> {
    muscle.check()?;
    expect_held(muscle)?;
    if !formulation.has(Field::Pressure) {
        formulation.check(&muscle.parameters)?;
    }
    let mut newton = Newton::new(muscle, formulation, t)?;
    let n_free = muscle.solid.dofs().n_free();
    let mut x = vec![0.0; newton.layout.n_unknowns()];
    let (mut reached, mut increment) = (0.0, 1.0_f64);
    let mut load_steps = 0;
    let mut shortfall = None;
    let mut direction = None;
    while reached < 1.0 && shortfall.is_none() {
        let slope = match direction.take() {
            Some(slope) => slope,
            None => match newton.direction(&x, reached) {
                Ok(slope) => slope,
                Err(ModelError::Factorization(error)) if reached > 0.0 && is_singular(&error) => {
                    shortfall = Some(not_converged(&newton, muscle, formulation));
                    break;
                }
                Err(error) => return Err(error),
            },
        };
        let gradient = newton.gradient(&slope[..n_free], 1.0);
        let step = increment
            .min((GRADIENT_STEP / gradient).max(SMALLEST_LOAD_STEP))
            .min(1.0 - reached);
        let target = if step < 1.0 - reached {
            reached + step
        } else {
            1.0
        };
        let predicted: Vec<f64> = x.iter().zip(&slope).map(|(x, d)| x + step * d).collect();
        let before_step = newton.iterations;
        let mut interrupted = false;
        let reported = |[iteration, iterations]: [usize; 2]| {
            let flow = watch(&Search {
                load_step: load_steps + 1,
                reached,
                target,
                iteration,
                iterations,
            });
            interrupted |= flow.is_break();
            flow
        };
        if let Some(solution) = newton.solve(&x, &predicted, target, target < 1.0, reported)? {
            x = solution;
            reached = target;
            load_steps += 1;
            increment = match newton.iterations - before_step {
                ..=QUICK => 2.0 * step,
                _ => step,
            };
        } else if interrupted {
            shortfall = Some(Shortfall::Interrupted);
        } else {
            increment = 0.5 * step;
            direction = Some(slope);
            shortfall = (increment < SMALLEST_LOAD_STEP)
                .then(|| not_converged(&newton, muscle, formulation));
        }
    }
    if matches!(shortfall, Some(Shortfall::NotConverged { .. })) && reached > 0.0 {
        let polished = newton.solve(&x, &x, reached, false, |_| ControlFlow::Continue(()))?;
        x = polished.unwrap_or(x);
    }
    let (displacement, pressure) = x.split_at(n_free);
    Ok(Approach {
        equilibrium: Equilibrium {
            displacement: displacement.to_vec(),
            pressure: pressure.to_vec(),
            preload_time: Some(t),
            newton_iterations: newton.iterations,
            load_steps,
            // The factors of an incomplete search belong to its last trial.
            instabilities: match shortfall {
                None => newton.instabilities(),
                Some(_) => None,
            },
        },
        reached,
        shortfall,
    })
}

/// Remedy if the elements of a body collapse because of its law.
pub(crate) const COLLAPSE: &str = "elements with the law `guccione` and pressures collapse under large strains: take \
     `isochoric-guccione`, the same material where the volume stays";
/// Remedy at a limit load.
const LIMIT_LOAD: &str = "if that is a limit load, a damped motion gets past it";

fn not_converged(newton: &Newton, muscle: &Muscle, formulation: Formulation) -> Shortfall {
    Shortfall::NotConverged {
        inverted: newton.inverted,
        remedy: remedy(muscle, formulation),
    }
}

/// Returns a remedy for a failure of Newton's method.
fn remedy(muscle: &Muscle, formulation: Formulation) -> String {
    let is_uniform = muscle.solid.laws().iter().all(is_guccione);
    match collapses(muscle, formulation) {
        true if is_uniform => COLLAPSE.to_owned(),
        true => format!("{COLLAPSE}; or, {LIMIT_LOAD}"),
        false => LIMIT_LOAD.to_owned(),
    }
}

/// Returns whether the body has a law whose elements collapse in mixed form: the energy of
/// Guccione's law in E also grows with the volume, and p compensates for this only in the mean of
/// an element.
pub(crate) fn collapses(muscle: &Muscle, formulation: Formulation) -> bool {
    formulation.has(Field::Pressure) && muscle.solid.laws().iter().any(is_guccione)
}

fn is_guccione(law: &Law) -> bool {
    matches!(law, Law::Guccione { .. })
}
