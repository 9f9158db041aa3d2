//! Material laws: energy, stress, tangent and their rates as functions of H = ∇u.
//!
//! In plane strain, an isotropic law is a function of two invariants that vanish at rest,
//!
//! ```text
//! d = J − 1 = tr H + det H,        e = (H00 − H11)² + (H01 + H10)² = |F|² − 2 J,
//! ```
//!
//! and is given by a `Potential`: W(e, d) and its partial derivatives. All tensors follow from `∂e/∂F = 2 D` and
//! `∂d/∂F = N` with `D = H − cof H` and `N = cof F`, which are linear in H. Small numbers are never computed as
//! differences of numbers near one; see note 0001. For small strains, `d = tr H` and `N = I`.
//!
//! Note 0001 derives the invariant form. Each law consists of a file in `laws` and a line in `laws/mod.rs`. The
//! module [`three`] contains the laws in 3D.

mod activation;
mod active;
mod dual;
pub(crate) mod elementary;
pub(crate) mod fibers;
mod field;
mod inlined;
mod laws;
mod parameters;
mod potential;
mod prony;
pub(crate) mod real;
mod single;
pub(crate) mod tensor;
pub mod three;
mod viscous;

pub use activation::Bestel;
pub use active::{ActiveFiber, ActiveStress, ForceLength, ForceVelocity, Tension};
pub use dual::Dual;
pub use field::{Directed, axes_at, check_direction, unit_vector};
pub use laws::*;
pub(crate) use laws::{with_law, with_potential};
pub use parameters::{Described, Description, Parameter, Range};
pub(crate) use potential::Potential;
pub use potential::{PlaneCurvature, PlaneSlope};
pub use prony::{Prony, PronyTerm, Springpot};
pub use real::Real;
pub use tensor::VolumeFunction;
pub use viscous::{GradientProducts, Viscous, ViscousTangents};

use tensor::{Strain, Volumetric};
use three::{Axes, CustomLaw, Law3, Tensor3};

/// 2 × 2 tensor: ∇u, a stress or a velocity gradient.
pub type Tensor = [[f64; 2]; 2];

/// Evaluation at a point in plane strain, which uses the in-plane components of the 3D law at F33 = 1.
///
/// For laws with fibers, the fibers are along x. In 3D, the axes are arguments.
impl Law {
    /// Returns whether the tangent at rest is one-sided. In this case, the fibers resist only tension, and their
    /// stiffness has a jump at stretch 1. Returns `false` for user-defined laws.
    pub fn is_one_sided_at_rest(self) -> bool {
        match self {
            Self::HolzapfelOgden { a_f, a_s, k, .. } => {
                k == f64::INFINITY && (a_f > 0.0 || a_s > 0.0)
            }
            Self::TransverseMooneyRivlin { c3, .. } => c3 > 0.0,
            _ => false,
        }
    }

    /// Creates a law from a user-defined type. In 2D, the law is evaluated by its 3D functions.
    ///
    /// In 3D, the results are bitwise equal to the results of a built-in law with the same formulas, but the
    /// evaluation is somewhat slower. Messages refer to the law as `name`.
    ///
    /// # Examples
    /// ```
    /// use myovib_fem::Law;
    /// use myovib_fem::material::MooneyRivlin;
    /// static RUBBER: MooneyRivlin = MooneyRivlin { c10: 1e4, c01: 2e2 };
    /// let shear = [[0.0, 0.3], [0.0, 0.0]];
    /// // Simple shear: P01 = 2 (c10 + c01) γ.
    /// assert!((Law::custom("rubber", &RUBBER).stress(shear, 0.0)[0][1] - 6120.0).abs() < 1e-9);
    /// ```
    pub fn custom<W: Law3 + Send + Sync>(name: &'static str, law: &'static W) -> Self {
        Law::Custom(CustomLaw::new(name, law))
    }

    /// Returns the law with its energy multiplied by `factor`: all constants in Pa are scaled.
    #[must_use]
    pub fn scaled(self, factor: f64) -> Self {
        if let Law::Custom(custom) = self {
            return Law::Custom(custom.scaled(factor));
        }
        let Description { name, parameters, .. } = self.description();
        let mut values = self.values();
        for (value, parameter) in values.iter_mut().zip(parameters) {
            if parameter.unit == "Pa" {
                *value *= factor;
            }
        }
        Law::from_values(name, &values)
    }

    /// Returns W at `h` = ∇u without the pressure term.
    pub fn energy(self, h: Tensor) -> f64 {
        with_potential!(
            self,
            w => Strain::new(&w, h).energy(&w),
            else => self.energy3(embed(h), along_x())
        )
    }

    /// Returns the first Piola–Kirchhoff stress P = ∂W/∂F − p cof F.
    pub fn stress(self, h: Tensor, p: f64) -> Tensor {
        let volumetric = Volumetric::pressure(p);
        with_potential!(
            self,
            w => Strain::new(&w, h).stress(&w, volumetric),
            else => in_plane(self.stress3(embed(h), p, along_x()))
        )
    }

    /// Returns J − 1, or div u for small strains.
    pub fn volume_change(self, h: Tensor) -> f64 {
        self.volume_change3(embed(h))
    }

    /// Returns the out-of-plane stress P33 that maintains F33 = 1.
    pub fn stress_33(self, h: Tensor, p: f64) -> f64 {
        self.stress3(embed(h), p, along_x())[2][2]
    }

    /// Returns whether the law depends on the fiber axes.
    #[inline(always)]
    pub fn has_fibers(self) -> bool {
        #[inline(always)]
        fn has_fibers<W: Law3>(_: &W) -> bool {
            W::FIBERS
        }
        with_law!(self, w => has_fibers(&w), custom => custom.has_fibers())
    }

    /// Returns κ of the penalty energy κ/2 g(J)², or zero for a law whose energy includes the volumetric part.
    pub(crate) fn penalty(self, kappa: f64) -> f64 {
        if self.description().complete { 0.0 } else { kappa }
    }

    /// Returns whether the force is linear in the displacement and the pressure.
    pub fn is_linear(self) -> bool {
        fn is_small<W: Law3>(_: &W) -> bool {
            !W::FINITE
        }
        with_law!(self, w => is_small(&w), custom => !custom.is_finite())
    }
}

/// Embeds a 2D displacement gradient in 3D.
fn embed([[a, b], [c, d]]: Tensor) -> Tensor3 {
    [[a, b, 0.0], [c, d, 0.0], [0.0; 3]]
}

fn in_plane([[a, b, _], [c, d, _], _]: Tensor3) -> Tensor {
    [[a, b], [c, d]]
}

fn along_x() -> Axes<f64> {
    Axes::cartesian(0.0)
}

#[cfg(test)]
mod tests;
