//! Loading paths: equilibria under growing loads, and their limit and bifurcation points.

use std::ops::ControlFlow;

use super::arc_length::ArcLength;
use super::loads::LoadSteps;
use super::newton::Newton;
use super::{Search, Shortfall};
use crate::analysis::support::expect_held;
use crate::error::ModelError;
use crate::field::Field;
use crate::formulation::Formulation;
use crate::muscle::Muscle;

/// Method by which a loading path is followed, and its end.
#[derive(Debug, Clone, PartialEq)]
pub enum Control {
    /// Equilibria under these load factors, in this order. Intermediate steps are taken where necessary.
    Load(Vec<f64>),
    /// Steps of given arc length along the path, which can pass limit points, until the load factor is 1 or -1.
    ArcLength {
        /// Load factor predicted for the first step, which determines its length. Must be positive.
        first_load: f64,
        /// Maximum number of steps.
        max_steps: usize,
    },
}

/// An equilibrium on a loading path.
#[derive(Debug, Clone, PartialEq)]
pub struct PathState {
    /// Load factor.
    pub load: f64,
    /// Free displacement components, m.
    pub displacement: Vec<f64>,
    /// Pressure at the vertices, Pa; empty for a formulation without.
    pub pressure: Vec<f64>,
    /// Number of independent small motions that grow, as in [`Equilibrium`](super::Equilibrium); unknown at a limit
    /// point.
    pub instabilities: Option<usize>,
    /// Newton iterations up to this state.
    pub newton_iterations: usize,
}

/// Kind of a critical point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CriticalKind {
    /// The load has an extremum.
    Limit,
    /// Other branches of equilibria meet the path.
    Bifurcation,
}

/// A point of the path with a singular tangent.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CriticalPoint {
    /// Its kind.
    pub kind: CriticalKind,
    /// Load factors of the states before and after it; the load factor of the point itself, twice, if it was located.
    pub loads: [f64; 2],
}

/// End of a loading path.
#[derive(Debug, Clone, PartialEq)]
pub struct PathEnd {
    /// Load factor of the last state.
    pub reached: f64,
    /// Steps taken.
    pub load_steps: usize,
    /// Newton iterations over all steps, excluding predictions.
    pub newton_iterations: usize,
    /// Limit and bifurcation points, in the order of the path.
    pub critical_points: Vec<CriticalPoint>,
    /// Reason why the path ends early, if it does.
    pub shortfall: Option<Shortfall>,
}

/// Follows the path of equilibria from the unloaded body, as [`equilibrium`](super::equilibrium) does. `record` receives
/// each requested state, converged to rounding, and may end the path; the unloaded body is not among them. `watch` is
/// called before each iteration, and may interrupt. If the path ends early, its last state is recorded too.
///
/// # Errors
/// Errors of [`equilibrium`](super::equilibrium) except for [`ModelError::NoEquilibrium`].
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
        Control::Load(loads) => LoadSteps::new(&mut newton).follow(loads, watch, record),
        Control::ArcLength {
            first_load,
            max_steps,
        } => ArcLength::new(&mut newton, *first_load)?.follow(*max_steps, watch, record),
    }
}

impl PathState {
    /// Creates the state with the unknowns `x`.
    pub(super) fn new(newton: &Newton<'_>, x: &[f64], load: f64) -> Self {
        let (displacement, pressure) = x.split_at(newton.n_free());
        Self {
            load,
            displacement: displacement.to_vec(),
            pressure: pressure.to_vec(),
            instabilities: newton.instabilities(),
            newton_iterations: newton.iterations,
        }
    }
}

/// Number of negative directions of the states of a path.
#[derive(Debug, Default)]
pub(super) struct Stability {
    /// Load factor and number at the last state where it is known.
    last: Option<(f64, usize)>,
    pub(super) points: Vec<CriticalPoint>,
}

impl Stability {
    /// Compares the number of `negative` directions with the number at the previous state. `limit` is the load factor
    /// of a limit point between them, where one direction changes its sign.
    pub(super) fn observe(
        &mut self,
        newton: &Newton<'_>,
        negative: Option<usize>,
        load: f64,
        limit: Option<f64>,
    ) {
        if let Some(limit) = limit {
            self.points.push(CriticalPoint {
                kind: CriticalKind::Limit,
                loads: [limit; 2],
            });
        }
        let Some(now) = negative else {
            self.last = None;
            return;
        };
        if let Some((from, before)) = self.last.replace((load, now)) {
            let turned = usize::from(limit.is_some());
            let bifurcates = match newton.is_symmetric() {
                true => before.abs_diff(now) != turned,
                false => before.abs_diff(now) % 2 != turned,
            };
            if bifurcates {
                self.points.push(CriticalPoint {
                    kind: CriticalKind::Bifurcation,
                    loads: [from, load],
                });
            }
        }
    }
}
