//! What the integrator owns.

use myovib_dae::{InconsistentStart, VariableKind};
use num_complex::Complex64;
use serde::{Deserialize, Serialize};

use super::linearized::Linearized;
use crate::control::Control;
use crate::dense::Collocation;
use crate::error_test::ErrorTest;
use crate::failure::Failure;
use crate::interpolation::Interpolation;
use crate::matrices::SparseDirectSolver;
use crate::memory::Memory;
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
/// The initial values must be consistent, as for IDAS: the first step refuses those that contradict the
/// equations (see [`check_start`](myovib_dae::check_start)). An algebraic variable may have 0 for ẏ_0: it
/// serves only to choose and to start the first step, and for others in its dense output.
///
/// A recoverable error of the residual or the Jacobian, and a singular Newton matrix, halve the
/// step; a fatal error is handed back; a panic of the problem passes through.
///
/// # Examples
/// See the [crate's front page](crate).
#[derive(Debug)]
pub struct RadauSolver<P, M = SparseDirectSolver> {
    pub(super) problem: P,
    pub(super) matrices: M,
    pub(super) method: Method,
    pub(super) options: RadauOptions,
    pub(super) t: f64,
    pub(super) y: Vec<f64>,
    pub(super) y_dot: Vec<f64>,
    /// The step to try next, before it is shortened to meet a limit; `None` at the start.
    pub(super) h: Option<f64>,
    /// Whether the initial values are consistent: the first step says if not.
    pub(super) start: Result<(), InconsistentStart>,
    /// Whether nothing is known from steps before: at the start, and after a break.
    pub(super) fresh: bool,
    /// Whether nothing was before the last accepted step.
    pub(super) began_afresh: bool,
    /// The reason why the problem has refused steps longer than the next one, if it has.
    pub(super) refused: Option<String>,
    /// What the next step may be at most.
    pub(super) next_limit: Option<f64>,
    /// The last accepted step's polynomial.
    pub(super) collocation: Collocation,
    pub(super) predictor: Predictor,
    pub(super) newton: NewtonSolver,
    pub(super) error_test: ErrorTest,
    pub(super) rounding: Rounding,
    pub(super) multipliers: Multipliers,
    pub(super) interpolation: Interpolation,
    /// The increments of a step without the errors of multipliers.
    pub(super) corrected: Vec<f64>,
    pub(super) control: Control,
    pub(super) jacobian: Jacobian,
    /// The step the Newton matrices are set up for.
    pub(super) set_up_for: Option<f64>,
    /// Where the Jacobian was evaluated last.
    pub(super) linearized: Linearized,
    /// Where all pivots were chosen, and for which step; `None` where none depend on the past.
    pub(super) pivots_at: Option<(Linearized, f64)>,
    /// Whether pivots are to be chosen anew.
    pub(super) pivots_due: bool,
    /// How often the linear solver had chosen pivots after the last set-up.
    pub(super) pivot_choices: u64,
    /// λ/h of the complex modes.
    pub(super) shifts: Vec<Complex64>,
    /// How each variable enters F.
    pub(super) kinds: Vec<VariableKind>,
    /// The variables whose derivative does not occur in F.
    pub(super) algebraic: Vec<usize>,
    pub(super) weights: Weights<P>,
    /// Whether the weights could be computed at y: the next step says if not.
    pub(super) weighed: Result<(), Failure>,
    /// The functions whose roots are looked for.
    pub(super) roots: Option<Roots<P>>,
    /// The states that are not among the unknowns.
    pub(super) memory: Option<Memory<P>>,
    /// What is integrated along with the solution.
    pub(super) quadrature: Option<Quadrature<P>>,
    /// The `t_out` and the limit that the last accepted step was asked for with.
    pub(super) bounds: [f64; 2],
    /// Where the integration pauses within the last step.
    pub(super) pause: Option<Pause>,
    pub(super) counters: Counters,
    /// Number of starts after the first: each `reinit` and each `restore`.
    pub(super) restarts: u64,
    /// Residual evaluations for differences before the last start.
    pub(super) differences_before: u64,
}

/// The step of size `$h` from where `$solver` is. It borrows the fields that all steps share, no others.
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

/// Where the Jacobian in use was evaluated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Jacobian {
    /// Nowhere that serves: it is due.
    Due,
    /// At an earlier step.
    Old,
    /// At the beginning of this step.
    Current,
}

/// A time within the last step at which the integration pauses; y and ẏ are those of the dense
/// output.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Pause {
    pub(super) t: f64,
    pub(super) y: Vec<f64>,
    pub(super) y_dot: Vec<f64>,
}
