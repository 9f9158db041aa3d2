//! Failures in the search for consistent initial values, and the norm used by the search.

use crate::problem::StepError;

/// Reason why no consistent initial values were found.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the messages name the fields")]
pub enum Inconsistent {
    /// Newton's method does not converge.
    #[error(
        "Newton's method does not converge: its last correction is {norm:.2e} times the \
         tolerance; at most {CONVERGED} is accepted"
    )]
    NotFound {
        /// Weighted norm of the last correction.
        norm: f64,
    },
    /// The problem states no constraints.
    #[error(
        "the problem defines no constraints: implement Problem::n_constraints and \
         Problem::constraints, including hidden constraints"
    )]
    NoConstraints,
    /// The problem states an index above 1, so a correction of the requested values does not give a consistent state.
    #[error(
        "{component} has index {index}, but ConsistencyMode::AlgebraicAndDerivatives requires at most 1: use \
         ConsistencyMode::Constraints"
    )]
    IndexTooHigh {
        /// Name of a component with the highest index.
        component: String,
        index: u8,
    },
    /// No values satisfy both F and the stated constraints.
    #[error(
        "the constraints are incompatible with the equations: residual {residual:.2e} in equation \
         {equation} (constraints are numbered after the last equation)"
    )]
    Contradicted {
        /// Zero-based index of the equation. If it is at least the number of equations, the difference is the index of
        /// the constraint whose time derivative is violated.
        equation: usize,
        residual: f64,
    },
    /// A function of the problem, or its linear algebra, failed.
    #[error(transparent)]
    Failed(#[from] StepError),
}

/// Newton's method has converged if the correction is at most this fraction of the tolerance, as in IDACalcIC.
pub(crate) const CONVERGED: f64 = 0.0033;

/// Returns the weighted root mean square.
pub(crate) fn norm(x: &[f64], weights: &[f64]) -> f64 {
    let squares = x.iter().zip(weights).map(|(x, w)| (x * w).powi(2));
    (squares.sum::<f64>() / x.len() as f64).sqrt()
}
