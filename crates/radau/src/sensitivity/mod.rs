//! Sensitivities of the computed solution.
//!
//! [`ForwardSensitivities`] follows a [`RadauSolver`](crate::RadauSolver) step by step. A `StageOperator` linearizes
//! the equations at the stages of each accepted step. `Block` solves the linearized equations for all parameters at
//! once, with the factors of the step as a preconditioner. The integrator itself does not depend on this module.
//!
//! An [`Adjoint`] traverses the steps of a [`Recording`] backward with the transposed operator and `Krylov`. A misfit
//! adds its derivatives to the [`Cotangents`] of each step.

mod adjoint;
mod block;
mod combination;
mod cotangents;
mod curves;
mod forward;
mod history;
mod krylov;
mod nonzeros;
mod operator;
mod recording;
mod reused_factors;
mod sweep_failure;
mod work;

pub use adjoint::{Adjoint, Gradient};
pub use cotangents::Cotangents;
pub use forward::ForwardSensitivities;
pub use recording::Recording;
pub use work::{AdjointWork, SensitivityWork};
