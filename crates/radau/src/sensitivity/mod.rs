//! What the computed solution depends on.
//!
//! [`ForwardSensitivities`] follow a [`RadauSolver`](crate::RadauSolver) step by step: at the stages
//! of each accepted step a `StageOperator` linearises the equations, and `Krylov` solves with it, the
//! step's factors being the preconditioner. The plain integration knows nothing of it.

mod curve;
mod forward;
mod krylov;
mod nonzeros;
mod operator;
mod trouble;
mod work;

pub use forward::ForwardSensitivities;
pub use work::SensitivityWork;
