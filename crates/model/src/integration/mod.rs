//! Time integration of a DAE: settings, integrators, observers, statistics.
//!
//! [`launch`] starts an [`Integrator`](integrator::Integrator) according to [`Settings`](settings::Settings): [`ida`],
//! [`radau`] ([`viscoelastic`] for a body with Prony terms), or a wrapper around one of them ([`projected`]). [`run`]
//! advances the integrator to its end time, calls observers such as [`recorder`] after each step, and returns
//! [`statistics`].

pub(crate) mod events;
pub mod ida;
pub(crate) mod integrator;
pub(crate) mod launch;
pub(crate) mod pace;
pub(crate) mod projected;
pub mod radau;
pub(crate) mod recorder;
pub(crate) mod run;
pub(crate) mod settings;
pub(crate) mod statistics;
pub mod step_weights;
pub(crate) mod typical;
pub(crate) mod verify;
pub(crate) mod viscoelastic;
