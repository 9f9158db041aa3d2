//! The integrator.
//!
//! [`RadauSolver`] is constructed in `builder`; `state` lists its data. `stepping` drives it: it
//! repeats an `attempt` until a step is accepted, and `events` stops within steps. `output` returns
//! results between steps.

mod attempt;
mod builder;
mod events;
mod last_step;
mod linearized;
mod output;
mod restart;
mod saved;
mod state;
mod stepping;

pub use builder::RadauBuilder;
pub(crate) use last_step::AcceptedStep;
pub use saved::RadauState;
pub use state::RadauSolver;
