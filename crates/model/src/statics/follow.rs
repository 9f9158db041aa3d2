//! Loading paths: equilibria under an increasing load.

use std::ops::ControlFlow;

use super::arc_length::ArcLength;
use super::loads::LoadSteps;
use super::neighbor::{self, Continued};
use super::newton::Newton;
use super::path::{PathEnd, PathState};
use super::{Search, Shortfall};
use crate::analysis::support::expect_held;
use crate::error::ModelError;
use crate::field::Field;
use crate::formulation::Formulation;
use crate::muscle::Muscle;

/// Method by which a loading path is followed, and the end of the path.
#[derive(Debug, Clone, PartialEq)]
pub enum Control {
    /// Equilibria under these load factors, in this order. Intermediate steps are taken where necessary.
    Load(Vec<f64>),
    /// The equilibrium under the whole load, continued from the equilibrium of a similar body. The similar body has the
    /// same mesh but different loads or constants, and the vector contains the displacement of all its nodes. If the
    /// continuation fails, the search starts from the unloaded body.
    Neighbor(Vec<f64>),
    /// Arc-length continuation, which can pass limit points, until the load factor is 1 or -1. The step length is
    /// adapted.
    ArcLength {
        /// Load factor predicted for the first step, which determines its length. Must be positive.
        first_load: f64,
        /// Maximum number of steps.
        max_steps: usize,
    },
}

/// Follows the path of equilibria from the unloaded body, as [`equilibrium`](super::equilibrium) does. `record`
/// receives each requested state except for the unloaded body, and may end the path. These states have converged to
/// rounding errors. `watch` is called before each iteration and may interrupt the search.
///
/// If the path ends early, its last state is also recorded. Multipliers of contacts converge only at requested states.
/// With multipliers, the last state is therefore recorded only if there is no other state.
///
/// # Errors
/// Errors of [`equilibrium`](super::equilibrium) except for [`ModelError::NoEquilibrium`] and
/// [`ModelError::Penetration`].
pub fn follow(
    muscle: &Muscle,
    formulation: Formulation,
    t: f64,
    control: &Control,
    watch: &mut dyn FnMut(&Search) -> ControlFlow<()>,
    record: &mut dyn FnMut(PathState) -> ControlFlow<()>,
) -> Result<PathEnd, ModelError> {
    muscle.check_at_rest()?;
    expect_held(muscle)?;
    if !formulation.has(Field::Pressure) {
        formulation.check(&muscle.parameters)?;
    }
    let mut newton = Newton::new(muscle, formulation, t)?;
    match control {
        Control::Neighbor(displacement) => {
            let mut interrupted = false;
            let mut watched = |search: &Search| {
                let flow = watch(search);
                interrupted |= flow.is_break();
                flow
            };
            let found = neighbor::follow(&mut newton, displacement, &mut watched)?;
            let newton_iterations = newton.iterations;
            let mut end = PathEnd {
                reached: 0.0,
                load_steps: 0,
                newton_iterations,
                critical_points: Vec::new(),
                shortfall: None,
                is_continued: true,
            };
            if let Some(Continued { x, steps }) = found {
                (end.reached, end.load_steps) = (1.0, steps);
                let _ = record(PathState::new(&newton, &x, 1.0));
                return Ok(end);
            }
            if interrupted {
                end.shortfall = Some(Shortfall::Interrupted);
                return Ok(end);
            }
            let mut newton = Newton::new(muscle, formulation, t)?;
            newton.iterations = newton_iterations;
            LoadSteps::new(&mut newton).follow(&[1.0], watch, record)
        }
        Control::Load(loads) => LoadSteps::new(&mut newton).follow(loads, watch, record),
        Control::ArcLength { first_load, max_steps } => {
            ArcLength::new(&mut newton, *first_load)?.follow(*max_steps, watch, record)
        }
    }
}
