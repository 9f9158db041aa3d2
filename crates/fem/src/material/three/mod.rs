//! Material laws in three dimensions: energy, stress, tangent and their rates from H = ∇u.
//!
//! Cast: a [`Law3`] gives its energy, stress and tangent at a [`Strain3`], which is built from ∇u
//! without cancellation at rest and carries the [`Axes`] of the fibres. An [`Isotropic`] law is
//! W(a, b, d) of invariants that vanish at rest, and has the rest from here. The volume part, −p
//! (J − 1) or the penalty in its place, is added by [`Strain3`], the same for all laws. Rates are
//! derivatives by [`Dual`](super::Dual) numbers.

mod custom;
mod fibres;
mod isotropic;
mod law;
mod response;
mod strain;
mod tensor;

pub use custom::CustomLaw;
pub use fibres::{FibreStrain, FibreStrains};
pub use isotropic::{Curvature, Invariants, Isotropic, Slope};
pub use law::Law3;
pub use strain::{Axes, Strain3};
pub use tensor::{Symmetric3, Tensor3Of, add_scaled3, contract3, product3, scaled3, trace3};
pub(crate) use tensor::{UPPER3, cofactor3};

/// A 3 × 3 tensor: ∇u, a stress, a velocity gradient.
pub type Tensor3 = Tensor3Of<f64>;

/// A derivative of a tensor by a tensor; entry (i, J) has row and column 3 i + J.
pub type Tangent3 = [[f64; 9]; 9];

#[cfg(test)]
mod closed_forms;
#[cfg(test)]
pub(super) mod tests;
