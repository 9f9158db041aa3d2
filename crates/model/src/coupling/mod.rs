//! A body and the oscillators it drives as one differential-algebraic system.
//!
//! The coupling is one-way: the states of the oscillators are appended to the body's system and
//! forced by γ u(ξ, t). With the body's F_b and the oscillators' F_o,
//!
//! ```text
//! F_b(t, y, ẏ) = 0              a ∂F/∂Y + b ∂F/∂Ẏ = ⎛ J_b           ⎞
//! F_o(s, ṡ; γ u(t, y)) = 0                          ⎝ a γ e wᵀ   J_o ⎠
//! ```
//!
//! The vector e selects the rows on which the forcing acts, and w contains the weights of the unknowns that form u.
//! Systems without oscillators have no states s, and systems without a body ([`NoBody`]) have no mesh.
//!
//! Main types: [`CoupledDae`] is the system of a [`Body`] and [`Oscillators`] with a [`Source`] for each direction. A
//! [`Recording`] replays a body's motion to oscillators integrated later. [`ErrorTest`] holds the tolerances of each
//! part. [`CoupledSolver`] extends a body's linear solver to the oscillators. [`start_coupled`] creates an integrator.
//! [`CoherenceHistory`] records the coherence, and [`LockCriterion`] evaluates it. [`Multirate`] integrates a body and
//! its oscillators with separate steps. With a [`Feedback`], the coupling is two-way: [`FeedbackDae`] and
//! [`FeedbackSolver`].
#![doc = include_str!("../../notes/0003-a-chain-beside-a-muscle.md")]

mod body;
mod chebyshev;
mod dae;
mod effect;
mod error_test;
mod feedback;
mod feedback_solver;
mod history;
mod ida;
mod locking;
mod multirate;
mod networks;
mod no_body;
mod nonlocal;
mod oscillators;
mod radau;
mod reach;
mod recording;
mod solver;
mod start;
mod step_motion;

pub use body::{Body, SystemMatrices};
pub use dae::CoupledDae;
pub use effect::{Effect, Feedback};
pub use error_test::{ErrorTest, StateTolerances};
pub use feedback::FeedbackDae;
pub use feedback_solver::FeedbackSolver;
pub use history::{CoherenceHistory, Settling};
pub use locking::{LockCriterion, Synchrony};
pub use multirate::{ChainIntegrator, Driven, Driving, Multirate};
pub use no_body::NoBody;
pub use oscillators::{Oscillators, Source};
pub use radau::matrices;
pub use recording::{Recorder, Recording};
pub use solver::CoupledSolver;
pub use start::{CoupledOptions, start_coupled, start_coupled_from, start_with_feedback};
pub use step_motion::StepPoint;
