//! What the computed solution depends on.
//!
//! [`ForwardSensitivities`] follow a [`RadauSolver`](crate::RadauSolver) step by step: at the stages
//! of each accepted step a `StageOperator` linearises the equations, and `Block` solves with it for all
//! parameters at once, the step's factors being the preconditioner. The plain integration knows nothing
//! of it.
//!
//! An [`Adjoint`] goes back over the steps of a [`Recording`], with the same operator transposed and `Krylov`; a
//! misfit adds to the [`Cotangents`] of each step.

mod adjoint;
mod block;
mod combination;
mod cotangents;
mod curves;
mod factors;
mod forward;
mod history;
mod krylov;
mod nonzeros;
mod operator;
mod recording;
mod trouble;
mod work;

pub use adjoint::{Adjoint, Gradient};
pub use cotangents::Cotangents;
pub use forward::ForwardSensitivities;
pub use recording::Recording;
pub use work::{AdjointWork, SensitivityWork};
