//! How a search for consistent initial values fails, and the norm that it goes by.

use crate::problem::StepError;

/// Why no consistent initial values were found.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Inconsistent {
    /// Newton's method does not get there.
    #[error("Newton's method stays at {norm:.2e} times the tolerance")]
    NotFound {
        /// The weighted norm of the last correction.
        norm: f64,
    },
    /// The problem states no constraints.
    #[error(
        "the problem states no constraints: implement Problem::n_constraints and \
         Problem::constraints, hidden ones included"
    )]
    NoConstraints,
    /// No values satisfy both F and the constraints stated.
    #[error(
        "the constraints stated do not go with the equations: equation {equation} (constraints \
         count on after the last) is left at {left:.2e}"
    )]
    Contradicted {
        /// The equation, or the number of equations and that of the constraint whose rate it is.
        equation: usize,
        /// Its residual.
        left: f64,
    },
    /// A function of the problem, or its linear algebra, failed.
    #[error(transparent)]
    Failed(#[from] StepError),
}

/// The weighted root mean square.
pub(crate) fn norm(x: &[f64], weights: &[f64]) -> f64 {
    let squares = x.iter().zip(weights).map(|(x, w)| (x * w).powi(2));
    (squares.sum::<f64>() / x.len() as f64).sqrt()
}
