//! Static equilibrium by continuation in the load, with Newton's method at each load step.

mod arc_length;
mod follow;
mod loads;
mod neighbor;
mod newton;
mod path;
mod prospect;
mod response;

use std::ops::ControlFlow;

use myovib_fem::{Inverted, Law};

use crate::error::ModelError;
use crate::field::Field;
use crate::formulation::Formulation;
use crate::muscle::Muscle;
use crate::operators;
pub use follow::{Control, follow};
use newton::Newton;
pub use path::{CriticalKind, CriticalPoint, PathEnd, PathState};
pub(crate) use prospect::Prospect;
pub use response::EquilibriumDerivatives;

/// Maximum increment of the displacement gradient in the prediction of a load step.
const GRADIENT_STEP: f64 = 0.2;

/// A body at rest, with or without loads.
#[derive(Debug, Clone, PartialEq)]
pub struct Equilibrium {
    /// Free displacement components, m.
    pub displacement: Vec<f64>,
    /// Pressure at the vertices, Pa; empty for a formulation without pressure.
    pub pressure: Vec<f64>,
    /// Time at which the loads are evaluated, s; `None` if no load acts.
    pub preload_time: Option<f64>,
    /// Newton iterations over all load steps, excluding predictions.
    pub newton_iterations: usize,
    /// Load steps taken.
    pub load_steps: usize,
    /// Number of independent small motions about the equilibrium that grow; 0 if the equilibrium is stable. `None`
    /// after an incomplete search, if surface loads make the tangent unsymmetric, or if pivots had to be exchanged.
    pub instabilities: Option<usize>,
}

impl Equilibrium {
    /// Returns the displacement (m) of all nodal components of `muscle`.
    pub fn nodal_displacement(&self, muscle: &Muscle) -> Vec<f64> {
        let mut u = operators::rest(&muscle.solid);
        muscle.solid.dofs().expand(&self.displacement, &mut u);
        if let Some(t) = self.preload_time {
            for prescribed in &muscle.prescribed {
                u[prescribed.component] = prescribed.signal.at(t).value;
            }
        }
        u
    }

    /// Returns the state of the body without loads, prescribed displacements or tensions.
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

/// Result of a search for an equilibrium.
#[derive(Debug, Clone, PartialEq)]
pub struct Approach {
    /// The last equilibrium that was found.
    pub equilibrium: Equilibrium,
    /// Fraction of the load at which `equilibrium` was found.
    pub reached: f64,
    /// Reason why the full load was not reached, if applicable.
    pub shortfall: Option<Shortfall>,
}

/// Reason why the whole load was not reached.
#[derive(Debug, Clone, PartialEq)]
pub enum Shortfall {
    /// The caller ended the search.
    Interrupted,
    /// Newton's method failed even in small load steps.
    NotConverged {
        /// An element that was inverted in the last trials.
        inverted: Option<Inverted>,
        /// Suggested remedy.
        remedy: String,
    },
    /// Augmented Lagrange multipliers did not remove the penetration of a contact.
    Penetration,
}

impl Approach {
    /// Returns the reason why no equilibrium under the full load was found.
    pub fn error(&self) -> Option<ModelError> {
        let shortfall = self.shortfall.clone()?;
        Some(shortfall.error(self.reached))
    }
}

impl Shortfall {
    /// Returns the error of a search that ended at the load factor `reached`.
    pub fn error(self, reached: f64) -> ModelError {
        match self {
            Self::Interrupted => ModelError::Interrupted,
            Self::NotConverged { inverted, remedy } => {
                ModelError::NoEquilibrium { reached, inverted, remedy }
            }
            Self::Penetration => ModelError::Penetration { reached },
        }
    }
}

/// Progress of the search for an equilibrium before an iteration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Search {
    /// One-based number of the load step. A failed step and its repetition with a smaller load count as one step.
    pub load_step: usize,
    /// Fraction of the load at which the last equilibrium was found.
    pub reached: f64,
    /// Fraction of the load that this load step is intended to reach.
    pub target: f64,
    /// One-based number of the Newton iteration in this load step.
    pub iteration: usize,
    /// Number of iterations over all load steps, including the next one.
    pub iterations: usize,
}

/// Solves ∫P:∇φ = f(t), ∫ψ(p/κ + g(J)) = 0 for the loads at time `t`. For a `formulation` without pressure, solves
/// only ∫P:∇φ = f(t), with P derived from an energy that includes κ/2 g(J)².
///
/// The path of equilibria is followed from the unloaded body. The prediction of each load step uses the equations
/// linearized at the start of the step. The size of a step is limited so that the prediction changes no displacement
/// gradient by more than 0.2, but the limit is at least 1/1024 of the load. A step is repeated with half the load if
/// Newton's method fails or moves the body by more than a quarter of the prediction. Prescribed displacements and the
/// tensions of active stresses are part of the load. Tensions governed by activation models are zero.
///
/// # Errors
/// Returns [`ModelError::NotHeld`] if the body can move without strain. If the search fails, returns
/// [`ModelError::NoEquilibrium`], which contains the fraction of the load that was reached and the inverted element,
/// if any, or [`ModelError::Penetration`]. Returns [`ModelError::NotAllowed`] if the formulation is `displacement` and
/// κ = ∞. Also returns the errors of [`Muscle::check`], except for motions that jump.
pub fn equilibrium(
    muscle: &Muscle,
    formulation: Formulation,
    t: f64,
) -> Result<Equilibrium, ModelError> {
    equilibrium_watched(muscle, formulation, t, &mut |_| ControlFlow::Continue(()))
}

/// Searches for an equilibrium like [`equilibrium`]. `watch` is called before each iteration and may end the search.
///
/// # Errors
/// Returns the errors of [`equilibrium`], and [`ModelError::Interrupted`] if `watch` ends the search.
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

/// Computes the equilibrium under the largest reachable load. If there is no equilibrium under the full load, or if
/// `watch` ends the search, returns the last equilibrium that was found.
///
/// # Errors
/// Returns the errors of [`equilibrium`] except for [`ModelError::NoEquilibrium`] and [`ModelError::Penetration`].
pub fn approach(
    muscle: &Muscle,
    formulation: Formulation,
    t: f64,
    watch: &mut dyn FnMut(&Search) -> ControlFlow<()>,
) -> Result<Approach, ModelError> {
    let n_free = muscle.solid.dofs().n_free();
    let mut last = PathState {
        load: 0.0,
        displacement: vec![0.0; n_free],
        pressure: operators::no_pressure(&muscle.solid),
        instabilities: None,
        newton_iterations: 0,
        multipliers: Vec::new(),
    };
    if !formulation.has(Field::Pressure) {
        last.pressure.clear();
    }
    let mut keep = |state: PathState| {
        last = state;
        ControlFlow::Continue(())
    };
    let control = Control::Load(vec![1.0]);
    let end = follow(muscle, formulation, t, &control, watch, &mut keep)?;
    Ok(Approach {
        equilibrium: Equilibrium {
            displacement: last.displacement,
            pressure: last.pressure,
            preload_time: Some(t),
            newton_iterations: end.newton_iterations,
            load_steps: end.load_steps,
            // After an incomplete search, the factors belong to its last trial.
            instabilities: last.instabilities.filter(|_| end.shortfall.is_none()),
        },
        reached: last.load,
        shortfall: end.shortfall,
    })
}

/// Remedy for elements that collapse because of the material law.
pub(crate) const COLLAPSE: &str = "with the law `guccione` and a pressure field, elements collapse under large strains: use `isochoric-guccione`, which is the same material at constant volume";
/// Remedy at a limit load.
const LIMIT_LOAD: &str = "at a limit load, follow the path by `analysis = \"static\"` with `method = \"arc-length\"` of [static], or compute a damped motion";

/// Remedy at the limit of Gent's law.
const LOCKING: &str = "the law `gent` locks where Ī1 - 3 approaches its `limit`: reduce the load, or increase `limit`";

/// Remedy for contacts with augmented Lagrange multipliers. Without penetration, the equilibrium jumps where another
/// facet of a coarse mesh touches the obstacle. Arc-length continuation does not support multipliers.
const MULTIPLIERS: &str =
    "use `method = \"penalty\"` of [[contact]], refine the mesh there, or use a damped motion";

fn not_converged(newton: &Newton<'_>) -> Shortfall {
    Shortfall::NotConverged { inverted: newton.inverted, remedy: remedy(newton) }
}

/// Returns a remedy for a failure of Newton's method.
fn remedy(newton: &Newton<'_>) -> String {
    let is_mixed = newton.layout.range(Field::Pressure).is_some();
    let laws = newton.muscle.solid.laws();
    if let Some((group, depth)) = newton.overlap_at_rest() {
        return format!(
            "the obstacle at `{group}` enters the unloaded body by {depth:.2e} m: start it outside the body, and move it by x, y, z"
        );
    }
    if newton.has_multipliers() {
        return MULTIPLIERS.to_owned();
    }
    let remedy = match is_mixed && laws.iter().any(is_guccione) {
        true if laws.iter().all(is_guccione) => COLLAPSE.to_owned(),
        true => format!("{COLLAPSE}; or, {LIMIT_LOAD}"),
        false if laws.iter().any(|law| matches!(law, Law::Gent { .. })) => {
            format!("{LOCKING}; or, {LIMIT_LOAD}")
        }
        false => LIMIT_LOAD.to_owned(),
    };
    match newton.muscle.contacts.is_empty() {
        true => remedy,
        false => format!("{remedy}; or reduce the `stiffness` of [[contact]]"),
    }
}

/// Returns whether the body has a law whose elements collapse in mixed form. The energy of Guccione's law, which is a
/// function of E, also grows with the volume, and p compensates for this growth only on average over an element.
pub(crate) fn collapses(muscle: &Muscle, formulation: Formulation) -> bool {
    formulation.has(Field::Pressure) && muscle.solid.laws().iter().any(is_guccione)
}

fn is_guccione(law: &Law) -> bool {
    matches!(law, Law::Guccione { .. })
}
