//! What a muscle's motion depends on.
//!
//! Cast: a [`Dependence`] is a parameter with muscles that differ in it, whose residuals make ∂F/∂p by a
//! [`Stencil`]; [`Dependences`] are all of a muscle's; a [`SensitiveIntegrator`] is Radau IIA that carries
//! ∂y/∂p along with the motion; `Tangents` multiply with ∂F/∂y for it, by passes over the elements where an
//! `ElementProduct` can. [`ElementStiffness`] is a field of parameters for an
//! [`Adjoint`](myovib_radau::Adjoint).

mod dependence;
mod elements;
mod integrator;
mod relaxation;
mod stencil;
mod stiffness;
mod tangents;

pub use dependence::{Dependence, Dependences};
pub use integrator::{Reading, SensitiveIntegrator};
pub use stencil::Stencil;
pub use stiffness::ElementStiffness;
