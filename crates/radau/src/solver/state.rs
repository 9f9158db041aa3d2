//! Data of the integrator.

use myovib_dae::{InconsistentStart, VariableKind};
use num_complex::Complex64;
use serde::{Deserialize, Serialize};

use super::jacobian_point::JacobianPoint;
use crate::control::Control;
use crate::dense::Collocation;
use crate::error_test::ErrorTest;
use crate::failure::Failure;
use crate::internal_variables::EliminatedVariables;
use crate::interpolation::Interpolation;
use crate::matrices::SparseDirectSolver;
use crate::method::Method;
use crate::multipliers::Multipliers;
use crate::newton::NewtonSolver;
use crate::options::RadauOptions;
use crate::predictor::Predictor;
use crate::quadrature::Quadrature;
use crate::roots::Roots;
use crate::rounding::Rounding;
use crate::weights::Weights;
use crate::work::Counters;

/// An integration of a [`Problem`](myovib_dae::Problem) by a Radau IIA method with adaptive steps.
///
/// The initial values must be consistent, as for IDAS: the first step rejects values that violate the equations (see
/// [`check_start`](myovib_dae::check_start)). For an algebraic variable, ẏ_0 may be 0, because its value affects only
/// the size and the initial guess of the first step. For other variables, ẏ_0 also affects the dense output of this
/// step.
///
/// After a recoverable error of the residual or the Jacobian, or if a Newton matrix is singular, the step size is
/// halved. A fatal error is returned. A panic of the problem is not caught.
///
/// # Examples
/// See the [front page of the crate](crate).
#[derive(Debug)]
pub struct RadauSolver<P, M = SparseDirectSolver> {
    pub(super) problem: P,
    pub(super) matrices: M,
    pub(super) method: Method,
    pub(super) options: RadauOptions,
    pub(super) t: f64,
    pub(super) y: Vec<f64>,
    pub(super) y_dot: Vec<f64>,
    /// Size of the next step, before it is shortened to meet a limit; `None` at the start.
    pub(super) h: Option<f64>,
    /// Whether the initial values are consistent. The first step reports an inconsistency.
    pub(super) start: Result<(), InconsistentStart>,
    /// Whether the previous steps are ignored: at the start, and after a discontinuity.
    pub(super) fresh: bool,
    /// Whether the last accepted step was treated as a first step.
    pub(super) began_afresh: bool,
    /// Message of the problem if it rejected longer steps than the next one.
    pub(super) refused: Option<String>,
    /// Whether the last step was repeated near a kink.
    pub(super) near_kink: bool,
    /// End of the first step in which a multiplier of index 2 jumped, and the minimum size of steps before this time.
    /// After acceptance of a step that contains the jump, this is the start of this step and 0.
    pub(super) jump: Option<[f64; 2]>,
    /// Polynomial of the last accepted step.
    pub(super) collocation: Collocation,
    pub(super) predictor: Predictor,
    pub(super) newton: NewtonSolver,
    pub(super) error_test: ErrorTest,
    pub(super) rounding: Rounding,
    pub(super) multipliers: Multipliers,
    pub(super) interpolation: Interpolation,
    /// Increments of a step after removal of the errors of multipliers.
    pub(super) corrected: Vec<f64>,
    pub(super) control: Control,
    pub(super) jacobian: JacobianAge,
    /// Step size for which the Newton matrices are set up.
    pub(super) set_up_for: Option<f64>,
    /// Point at which the Jacobian was last evaluated.
    pub(super) jacobian_point: JacobianPoint,
    /// Point and step size at which all pivots were selected; `None` if the pivots are independent
    /// of previous steps.
    pub(super) pivots_at: Option<(JacobianPoint, f64)>,
    /// Whether pivots must be selected again.
    pub(super) pivots_due: bool,
    /// Number of pivot selections of the linear solver after the last matrix setup.
    pub(super) pivot_choices: u64,
    /// λ/h of the complex modes.
    pub(super) shifts: Vec<Complex64>,
    /// Whether each variable is differential or algebraic in F.
    pub(super) kinds: Vec<VariableKind>,
    /// Indices of the variables whose derivatives do not occur in F.
    pub(super) algebraic: Vec<usize>,
    pub(super) weights: Weights<P>,
    /// Whether the weights could be computed at y. The next step reports a failure.
    pub(super) weights_result: Result<(), Failure>,
    /// Monitored root functions.
    pub(super) roots: Option<Roots<P>>,
    /// Internal variables, which are eliminated from the equations.
    pub(super) internal: Option<EliminatedVariables<P>>,
    /// Quadratures integrated together with the solution.
    pub(super) quadrature: Option<Quadrature<P>>,
    /// `t_out` and the time limit passed to the call that accepted the last step.
    pub(super) time_limits: [f64; 2],
    /// Time within the last step at which the integration pauses.
    pub(super) pause: Option<Pause>,
    pub(super) counters: Counters,
    /// Number of starts after the first one. Each `reinit` and each `restore` is a start.
    pub(super) restarts: u64,
    /// Residual evaluations for difference quotients before the last start.
    pub(super) differences_before: u64,
}

/// Step of size `$h` from the current state of `$solver`. Borrows only the fields that all steps share.
macro_rules! step_of {
    ($solver:ident, $h:expr) => {
        $crate::newton::Step {
            method: &$solver.method,
            t: $solver.t,
            h: $h,
            y: &$solver.y,
            weights: $solver.weights.scaled(),
        }
    };
}
pub(super) use step_of;

/// Point at which the current Jacobian was evaluated, relative to the current step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum JacobianAge {
    /// The Jacobian must be evaluated.
    Due,
    /// Evaluated at an earlier step.
    Old,
    /// Evaluated at the start of the current step.
    Current,
}

/// Time within the last step at which the integration pauses, with y and ẏ from the dense output.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Pause {
    pub(super) t: f64,
    pub(super) y: Vec<f64>,
    pub(super) y_dot: Vec<f64>,
}
