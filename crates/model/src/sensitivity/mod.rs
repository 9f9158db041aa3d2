//! What a muscle's motion depends on.
//!
//! Cast: a [`Dependence`] is a parameter with muscles that differ in it, whose residuals make ∂F/∂p by a
//! [`Stencil`]; [`Dependences`] are all of a muscle's, with [`ChainDependence`]s of the chains it drives; a [`SensitiveIntegrator`] is Radau IIA that carries
//! ∂y/∂p along with the motion; `Tangents` multiply with ∂F/∂y for it, by passes over the elements where an
//! `ElementProduct` can. [`ElementStiffness`] is a field of parameters for an
//! [`Adjoint`](myovib_radau::Adjoint), with which a [`RecordedIntegrator`] goes back over its steps.

mod chains;
mod dependence;
mod elements;
mod integrator;
mod recorded;
mod relaxation;
mod stencil;
mod stiffness;
mod tangents;

pub use myovib_radau::AdjointWork;

pub use chains::{ChainDependence, DrivenDependences};
pub use dependence::{Dependence, Dependences};
pub use integrator::{DrivingIntegrator, Reading, SensitiveIntegrator, Twins};
pub use recorded::{LinearMisfit, RecordedIntegrator};
pub use stencil::Stencil;
pub use stiffness::ElementStiffness;
