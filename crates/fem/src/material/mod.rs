//! Material laws in plane strain: energy, stress, tangent and their rates from H = ∇u.
//!
//! Every isotropic law of the plane is a function of two invariants that vanish at rest,
//!
//! ```text
//! d = J − 1 = tr H + det H,        e = (H00 − H11)² + (H01 + H10)² = |F|² − 2 J,
//! ```
//!
//! so a law is one `Potential`: W(e, d) and its partial derivatives. All tensors follow from
//! `∂e/∂F = 2 D`, `∂d/∂F = N` with `D = H − cof H` and `N = cof F`, both linear in H. Nothing is
//! formed by subtracting numbers near one: see note 0001. For small strains `d = tr H`, `N = I`.
//!
//! Note 0001 derives the invariant form; the guide's page on the model has the laws. A law is a
//! file in `laws`, and its line in `laws.rs`.

mod activation;
mod active;
mod dual;
pub(crate) mod elementary;
pub(crate) mod fibres;
mod field;
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
pub use active::{ActiveFibre, ActiveStress, ForceLength, ForceVelocity, Tension};
pub use dual::Dual;
pub use field::{Directed, axes_at, check_direction};
pub use laws::*;
pub(crate) use laws::{with_law, with_potential};
pub use parameters::{Described, Description, Parameter, Range};
pub(crate) use potential::Potential;
pub use potential::{PlaneCurvature, PlaneSlope};
pub use prony::{Prony, PronyTerm};
pub use real::Real;
pub use viscous::{Spread, Viscous, ViscousSlopes};

use tensor::{Strain, Volumetric};
use three::{Axes, CustomLaw, Law3, Tangent3, Tensor3};

/// A 2 × 2 tensor: ∇u, a stress, a velocity gradient.
pub type Tensor = [[f64; 2]; 2];

/// A derivative of a tensor by a tensor; rows and columns in the order 00, 01, 10, 11.
pub type Tangent = [[f64; 4]; 4];

/// The law in plane strain: the part in the plane of what is in three dimensions at F33 = 1.
///
/// Laws with fibres have them along x here; in three dimensions the axes are given.
impl Law {
    /// A law written outside the crate, for bodies: in the plane, too, it is evaluated in space.
    ///
    /// It computes the numbers of a law of the crate, somewhat slower. `name` is for messages.
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

    /// The law with its energy multiplied by `factor`: all its constants in Pa.
    #[must_use]
    pub fn scaled(self, factor: f64) -> Self {
        if let Law::Custom(own) = self {
            return Law::Custom(own.scaled(factor));
        }
        let Description {
            name, parameters, ..
        } = self.description();
        let mut values = self.values();
        for (value, parameter) in values.iter_mut().zip(parameters) {
            if parameter.unit == "Pa" {
                *value *= factor;
            }
        }
        Law::from_values(name, &values)
    }

    /// W at `h` = ∇u, without the pressure's part.
    pub fn energy(self, h: Tensor) -> f64 {
        with_potential!(
            self,
            w => Strain::new(&w, h).energy(&w),
            else => self.energy3(embed(h), along_x())
        )
    }

    /// First Piola–Kirchhoff stress P = ∂W/∂F − p cof F.
    pub fn stress(self, h: Tensor, p: f64) -> Tensor {
        let volumetric = Volumetric::pressure(p);
        with_potential!(
            self,
            w => Strain::new(&w, h).stress(&w, volumetric),
            else => in_plane(self.stress3(embed(h), p, along_x()))
        )
    }

    /// Ṗ = ∂P/∂F : ∇v + ∂P/∂p ṗ, with `v` = ∇v.
    pub fn stress_rate(self, h: Tensor, v: Tensor, p: f64, p_rate: f64) -> Tensor {
        let volumetric = Volumetric {
            p,
            p_rate,
            kappa: 0.0,
        };
        with_potential!(
            self,
            w => Strain::new(&w, h).stress_rate(&w, v, volumetric),
            else => in_plane(self.stress_rate3(embed(h), embed(v), [p, p_rate], along_x()))
        )
    }

    /// ∂P/∂F at fixed p.
    pub fn tangent(self, h: Tensor, p: f64) -> Tangent {
        let volumetric = Volumetric::pressure(p);
        with_potential!(
            self,
            w => Strain::new(&w, h).tangent(&w, volumetric).full(),
            else => in_plane_tangent(&self.tangent3(embed(h), p, along_x()))
        )
    }

    /// ∂Ṗ/∂F at fixed ∇v, p, ṗ: the rate of the tangent along `v` = ∇v.
    pub fn tangent_rate(self, h: Tensor, v: Tensor, p_rate: f64) -> Tangent {
        let volumetric = Volumetric {
            p: 0.0,
            p_rate,
            kappa: 0.0,
        };
        with_potential!(
            self,
            w => Strain::new(&w, h).tangent_rate(&w, v, volumetric).full(),
            // In the plane the cofactor is linear: p itself does not enter.
            else => in_plane_tangent(&self.tangent_rate3(embed(h), embed(v), [0.0, p_rate], along_x()))
        )
    }

    /// J − 1, or div u for small strains.
    pub fn volume_change(self, h: Tensor) -> f64 {
        self.volume_change3(embed(h))
    }

    /// ∂(J − 1)/∂F = cof F, or I for small strains.
    pub fn volume_gradient(self, h: Tensor) -> Tensor {
        in_plane(self.volume_gradient3(embed(h)))
    }

    /// The stress P33 that keeps F33 = 1.
    pub fn stress_33(self, h: Tensor, p: f64) -> f64 {
        self.stress3(embed(h), p, along_x())[2][2]
    }

    /// Whether the law depends on the axes of fibres.
    #[inline(always)]
    pub fn has_fibres(self) -> bool {
        #[inline(always)]
        fn has_fibres<W: Law3>(_: &W) -> bool {
            W::FIBRES
        }
        with_law!(self, w => has_fibres(&w), own => own.has_fibres())
    }

    /// κ of the penalty energy κ/2 (J − 1)² in place of a pressure: zero for a law whose energy
    /// holds the volume's part.
    pub(crate) fn penalty(self, kappa: f64) -> f64 {
        if self.description().complete {
            0.0
        } else {
            kappa
        }
    }

    /// Whether the force is linear in displacement and pressure.
    pub fn is_linear(self) -> bool {
        fn is_small<W: Law3>(_: &W) -> bool {
            !W::FINITE
        }
        with_law!(self, w => is_small(&w), own => !own.is_finite())
    }
}

/// ∇u of a plane motion in three dimensions.
fn embed([[a, b], [c, d]]: Tensor) -> Tensor3 {
    [[a, b, 0.0], [c, d, 0.0], [0.0; 3]]
}

/// The part in the plane.
fn in_plane([[a, b, _], [c, d, _], _]: Tensor3) -> Tensor {
    [[a, b], [c, d]]
}

fn in_plane_tangent(a: &Tangent3) -> Tangent {
    const PLACES: [usize; 4] = [0, 1, 3, 4];
    PLACES.map(|row| PLACES.map(|column| a[row][column]))
}

fn along_x() -> Axes<f64> {
    Axes::cartesian(0.0)
}

#[cfg(test)]
mod tests;
