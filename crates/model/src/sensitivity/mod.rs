//! What a muscle's motion depends on.
//!
//! Cast: a [`Dependence`] is a parameter with muscles that differ in it, whose residuals make ∂F/∂p;
//! [`Dependences`] are all of a muscle's; a [`SensitiveIntegrator`] is Radau IIA that carries
//! ∂y/∂p along with the motion, from rest. [`ElementStiffness`] is a field of parameters for an
//! [`Adjoint`](myovib_radau::Adjoint).

mod dependence;
mod integrator;
mod stiffness;

pub use dependence::{Dependence, Dependences};
pub use integrator::{Reading, SensitiveIntegrator};
pub use stiffness::ElementStiffness;
