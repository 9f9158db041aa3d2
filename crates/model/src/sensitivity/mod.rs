//! What a muscle's motion depends on.
//!
//! Cast: a [`Dependence`] is a parameter with muscles that differ in it, whose residuals make ∂F/∂p by a
//! [`Stencil`], a [`ChainDependence`] one with networks that differ; [`Dependences`] are all of a muscle's and its
//! chains'; a [`SensitiveIntegrator`] is Radau IIA that carries ∂y/∂p along with the motion; `Tangents` multiply with
//! ∂F/∂y for it, by passes over the elements where an `ElementProduct` can; [`Twins`] are what is read off for a
//! reading's own dependence. [`ElementStiffness`] is a field of parameters for an
//! [`Adjoint`](myovib_radau::Adjoint), with which a [`RecordedIntegrator`] goes back over its steps.

mod chain;
mod dependence;
mod driven;
mod elements;
mod integrator;
mod recorded;
mod relaxation;
mod stencil;
mod stiffness;
mod tangents;
mod twins;

pub use myovib_radau::AdjointWork;

pub use chain::ChainDependence;
pub use dependence::{Dependence, Dependences};
pub use driven::DrivenDependences;
pub use integrator::{DrivingIntegrator, Reading, SensitiveIntegrator};
pub use recorded::{LinearMisfit, RecordedIntegrator};
pub use stencil::Stencil;
pub use stiffness::ElementStiffness;
pub use twins::Twins;
