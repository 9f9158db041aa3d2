//! From a DAE to a run: settings, integrators, observers, statistics.
//!
//! Cast: [`Settings`](settings::Settings) say how; [`launch`] starts an
//! [`Integrator`](integrator::Integrator), which is [`ida`], [`radau`] ([`relaxing`] for a body with Prony
//! terms), or one of them with more around it ([`projected`]); [`run`] steps it to its end under the eyes of observers, as those of
//! [`recorder`], and gives [`statistics`].

pub(crate) mod events;
pub mod ida;
pub(crate) mod integrator;
pub(crate) mod launch;
pub(crate) mod pace;
pub(crate) mod projected;
pub mod radau;
pub(crate) mod recorder;
pub(crate) mod relaxing;
pub(crate) mod run;
pub(crate) mod settings;
pub(crate) mod statistics;
pub mod step_weights;
pub(crate) mod verify;
