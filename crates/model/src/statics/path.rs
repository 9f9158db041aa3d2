//! Equilibria on a loading path, and the limit and bifurcation points of the path.

use super::Shortfall;
use super::newton::Newton;

/// An equilibrium on a loading path.
#[derive(Debug, Clone, PartialEq)]
pub struct PathState {
    /// Load factor.
    pub load: f64,
    /// Free displacement components, m.
    pub displacement: Vec<f64>,
    /// Pressure at the vertices, Pa; empty for a formulation without pressure.
    pub pressure: Vec<f64>,
    /// Number of independent small motions that grow, as in [`Equilibrium`](super::Equilibrium); unknown at a limit
    /// point.
    pub instabilities: Option<usize>,
    /// Number of Newton iterations up to this state.
    pub newton_iterations: usize,
    /// Augmented Lagrange multipliers of each contact, expressed as penetration depths, for
    /// [`with_multipliers`](crate::Muscle::with_multipliers).
    pub multipliers: Vec<Vec<f64>>,
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
    /// Limit point or bifurcation.
    pub kind: CriticalKind,
    /// Load factors of the computed states before and after the point. If the point was located, both values are the
    /// load factor of the point.
    pub loads: [f64; 2],
}

/// End of a loading path.
#[derive(Debug, Clone, PartialEq)]
pub struct PathEnd {
    /// Load factor of the last state.
    pub reached: f64,
    /// Number of steps taken.
    pub load_steps: usize,
    /// Number of Newton iterations over all steps, excluding predictions.
    pub newton_iterations: usize,
    /// Limit and bifurcation points, in the order in which they occur on the path.
    pub critical_points: Vec<CriticalPoint>,
    /// Reason why the path ends early, if it does.
    pub shortfall: Option<Shortfall>,
    /// Whether the path starts from a neighboring equilibrium instead of the unloaded body.
    pub is_continued: bool,
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
            multipliers: newton.multipliers(),
        }
    }
}

/// Number of directions in which the energy decreases, followed along a path.
#[derive(Debug, Default)]
pub(super) struct Stability {
    /// Load factor and number of these directions at the last state for which the number is known.
    last: Option<(f64, usize)>,
    pub(super) points: Vec<CriticalPoint>,
}

impl Stability {
    /// Records the critical points since the previous state, from the change in the number of `negative` directions.
    /// `limit` is the load factor of a limit point between the two states. At the limit point, the stiffness of one
    /// direction changes sign.
    pub(super) fn observe(
        &mut self,
        newton: &Newton<'_>,
        negative: Option<usize>,
        load: f64,
        limit: Option<f64>,
    ) {
        if let Some(limit) = limit {
            self.points.push(CriticalPoint { kind: CriticalKind::Limit, loads: [limit; 2] });
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
                self.points
                    .push(CriticalPoint { kind: CriticalKind::Bifurcation, loads: [from, load] });
            }
        }
    }
}
