//! Sensitivities of a muscle's motion to parameters.
//!
//! A [`Dependence`] describes a parameter by perturbed muscles. ∂F/∂p is computed from the residuals of these muscles
//! with a [`Stencil`]. A [`ChainDependence`] is its counterpart for networks. [`Dependences`] collects all parameters
//! of a muscle and its chains.
//!
//! [`SensitiveIntegrator`] integrates ∂y/∂p together with the motion by Radau IIA. It uses `Tangents` for products with
//! ∂F/∂y, which are computed by element passes where an `ElementProduct` is available. [`PerturbedSystems`] provides
//! the perturbed systems for the explicit derivatives of readings.
//!
//! [`ElementStiffness`] is a field of parameters for an [`Adjoint`](myovib_radau::Adjoint), with which a
//! [`RecordedIntegrator`] traverses its steps backward.

mod chain;
mod dependence;
mod driven;
mod elements;
mod integrator;
mod perturbed;
mod recorded;
mod relaxation;
mod stencil;
mod stiffness;
mod tangents;

pub use myovib_radau::AdjointWork;

pub use chain::ChainDependence;
pub use dependence::{Dependence, Dependences};
pub use driven::DrivenDependences;
pub use integrator::{DrivingIntegrator, OutputFunction, SensitiveIntegrator};
pub use perturbed::PerturbedSystems;
pub use recorded::{LinearMisfit, RecordedIntegrator};
pub use stencil::Stencil;
pub use stiffness::ElementStiffness;
