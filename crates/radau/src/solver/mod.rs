//! The integrator.
//!
//! [`RadauSolver`] is put together in `builder` and owns what `state` lists. `stepping` drives it:
//! it repeats an `attempt` until a step is accepted, and `events` pauses within steps; `output`
//! answers what may be asked in between.

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
