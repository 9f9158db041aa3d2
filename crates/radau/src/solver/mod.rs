//! The integrator.
//!
//! [`RadauSolver`] is constructed in `builder`, and its data are defined in `state`. `stepping` repeats an `attempt`
//! until a step is accepted, and `events` pauses within steps. `verification` repeats first steps and steps in which
//! multipliers jump. `output` returns results between steps.

mod attempt;
mod builder;
mod events;
mod first_step;
mod hidden_constraints;
mod jacobian_point;
mod last_step;
mod output;
mod output_error;
mod restart;
mod saved;
mod state;
mod stepping;
mod verification;

use myovib_dae::{LinearSolver, Problem, integrator_by_own_methods};

use crate::error::RadauError;
pub use builder::RadauBuilder;
pub(crate) use last_step::AcceptedStep;
pub use saved::RadauState;
pub use state::RadauSolver;

integrator_by_own_methods!(
    [P: Problem, M: LinearSolver<P>] RadauSolver<P, M>, P, RadauError, reinit_with
);
