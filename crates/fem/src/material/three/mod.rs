//! Material laws in 3D: energy, stress, tangent and their rates as functions of H = ∇u.
//!
//! A [`Law3`] evaluates its energy, stress and tangent at a [`Strain3`]. The strain is computed from ∇u without
//! cancellation near rest and contains the fiber [`Axes`]. An [`Isotropic`] law requires only W(a, b, d), a
//! function of invariants that vanish at rest. For all laws, [`Strain3`] adds the volumetric term, which is −p
//! g(J) or a penalty. Rates are derivatives computed with [`Dual`](super::Dual) numbers.

mod custom;
mod fibers;
mod isotropic;
mod law;
mod response;
mod strain;
mod tensor;

pub use custom::CustomLaw;
pub use fibers::{FiberStrain, FiberStrains};
pub use isotropic::{Curvature, Invariants, Isotropic, Slope};
pub use law::Law3;
pub use strain::{Axes, Strain3};
pub use tensor::{Symmetric3, Tensor3Of, add_scaled3, contract3, product3, scaled3, trace3};
pub(crate) use tensor::{UPPER3, cofactor3};

/// 3 × 3 tensor: ∇u, a stress or a velocity gradient.
pub type Tensor3 = Tensor3Of<f64>;

/// Derivative of a tensor with respect to a tensor. The row or column of component (i, J) is 3 i + J.
pub type Tangent3 = [[f64; 9]; 9];

#[cfg(test)]
mod closed_forms;
#[cfg(test)]
pub(super) mod tests;
