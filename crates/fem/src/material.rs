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
//! Note 0001 derives the invariant form; the guide's page on the model has the laws. To add a law:
//! write its `Potential`, add a variant to [`Law`] and a line to `with_potential`.

mod dual;
pub(crate) mod elementary;
mod mooney_rivlin;
mod potential;
mod real;
mod small_strain;
mod st_venant_kirchhoff;
pub(crate) mod tensor;
pub mod three;

pub use dual::Dual;
pub(crate) use mooney_rivlin::MooneyRivlin;
pub(crate) use potential::Potential;
pub(crate) use real::Plain;
pub use real::Real;
pub(crate) use small_strain::SmallStrain;
pub(crate) use st_venant_kirchhoff::StVenantKirchhoff;

use tensor::{Strain, Volumetric};

/// A 2 × 2 tensor: ∇u, a stress, a velocity gradient.
pub type Tensor = [[f64; 2]; 2];

/// A derivative of a tensor by a tensor; rows and columns in the order 00, 01, 10, 11.
pub type Tangent = [[f64; 4]; 4];

/// A material law: the part of the energy that does not hold the pressure.
///
/// The pressure adds `−p (J − 1)` to the energy and `−p cof F` to the stress (for small strains
/// `−p div u` and `−p I`). Paper: eqs. (20), (26); the exponent in Ī1 is a misprint there.
///
/// # Units
/// Moduli, energies and stresses in Pa.
///
/// # Examples
/// ```
/// use myovib_fem::material::Law;
/// let law = Law::MooneyRivlin { c10: 1e4, c01: 2e2 };
/// let shear = [[0.0, 0.3], [0.0, 0.0]];
/// // Simple shear: P01 = 2 (c10 + c01) γ for any pressure.
/// assert!((law.stress(shear, 0.0)[0][1] - 6120.0).abs() < 1e-9);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Law {
    /// `W = c10 (I1 J^(−2/3) − 3) + c01 (I2 J^(−4/3) − 3)`. Valid for J > 0. Paper: eq. (20).
    MooneyRivlin {
        /// Coefficient of the first invariant.
        c10: f64,
        /// Coefficient of the second invariant.
        c01: f64,
    },
    /// `W = ζ |dev ε|²`, the deviator taken in three dimensions. Valid for any ∇u, meant for small
    /// ones. Paper: eqs. (7), (26); the linearisation of Mooney–Rivlin has ζ = 2 (c10 + c01).
    SmallStrain {
        /// ζ.
        shear_modulus: f64,
    },
    /// `W = ζ |dev E|²` with Green's strain, the deviator taken in three dimensions. Valid for
    /// J > 0, meant for moderate strains: it softens in compression.
    StVenantKirchhoff {
        /// ζ.
        shear_modulus: f64,
    },
}

/// Evaluates an expression with `$potential` bound to the law's [`Potential`].
macro_rules! with_potential {
    ($law:expr, $potential:ident => $body:expr) => {
        match $law {
            $crate::material::Law::MooneyRivlin { c10, c01 } => {
                let $potential = $crate::material::MooneyRivlin { c10, c01 };
                $body
            }
            $crate::material::Law::SmallStrain { shear_modulus } => {
                let $potential = $crate::material::SmallStrain { shear_modulus };
                $body
            }
            $crate::material::Law::StVenantKirchhoff { shear_modulus } => {
                let $potential = $crate::material::StVenantKirchhoff { shear_modulus };
                $body
            }
        }
    };
}
pub(crate) use with_potential;

impl Law {
    /// The law with its energy multiplied by `factor`.
    #[must_use]
    pub fn scaled(self, factor: f64) -> Self {
        match self {
            Law::MooneyRivlin { c10, c01 } => Law::MooneyRivlin {
                c10: factor * c10,
                c01: factor * c01,
            },
            Law::SmallStrain { shear_modulus } => Law::SmallStrain {
                shear_modulus: factor * shear_modulus,
            },
            Law::StVenantKirchhoff { shear_modulus } => Law::StVenantKirchhoff {
                shear_modulus: factor * shear_modulus,
            },
        }
    }

    /// W at `h` = ∇u, without the pressure's part.
    pub fn energy(self, h: Tensor) -> f64 {
        with_potential!(self, w => Strain::new(&w, h).energy(&w))
    }

    /// First Piola–Kirchhoff stress P = ∂W/∂F − p cof F.
    pub fn stress(self, h: Tensor, p: f64) -> Tensor {
        let volumetric = Volumetric::pressure(p);
        with_potential!(self, w => Strain::new(&w, h).stress(&w, volumetric))
    }

    /// Ṗ = ∂P/∂F : ∇v + ∂P/∂p ṗ, with `v` = ∇v.
    pub fn stress_rate(self, h: Tensor, v: Tensor, p: f64, p_rate: f64) -> Tensor {
        let volumetric = Volumetric {
            p,
            p_rate,
            kappa: 0.0,
        };
        with_potential!(self, w => Strain::new(&w, h).stress_rate(&w, v, volumetric))
    }

    /// ∂P/∂F at fixed p.
    pub fn tangent(self, h: Tensor, p: f64) -> Tangent {
        let volumetric = Volumetric::pressure(p);
        with_potential!(self, w => Strain::new(&w, h).tangent(&w, volumetric)).full()
    }

    /// ∂Ṗ/∂F at fixed ∇v, p, ṗ: the rate of the tangent along `v` = ∇v.
    pub fn tangent_rate(self, h: Tensor, v: Tensor, p_rate: f64) -> Tangent {
        let volumetric = Volumetric {
            p: 0.0,
            p_rate,
            kappa: 0.0,
        };
        with_potential!(self, w => Strain::new(&w, h).tangent_rate(&w, v, volumetric)).full()
    }

    /// J − 1, or div u for small strains.
    pub fn volume_change(self, h: Tensor) -> f64 {
        with_potential!(self, w => Strain::new(&w, h).d)
    }

    /// ∂(J − 1)/∂F = cof F, or I for small strains.
    pub fn volume_gradient(self, h: Tensor) -> Tensor {
        with_potential!(self, w => Strain::new(&w, h).normal)
    }

    /// The stress P33 that keeps F33 = 1.
    ///
    /// The laws of Mooney–Rivlin and of small strains are isochoric: W does not change under
    /// F → s F in three dimensions, so that `P33 = −P : F` but for the pressure's part `−p J`.
    pub fn stress_33(self, h: Tensor, p: f64) -> f64 {
        let gradient = self.volume_gradient(h);
        let isochoric = |f: Tensor| {
            let jacobian = tensor::contract(gradient, f) / 2.0;
            -tensor::contract(self.stress(h, 0.0), f) - p * jacobian
        };
        match self {
            Law::MooneyRivlin { .. } => {
                isochoric([[1.0 + h[0][0], h[0][1]], [h[1][0], 1.0 + h[1][1]]])
            }
            Law::SmallStrain { .. } => isochoric([[1.0, 0.0], [0.0, 1.0]]),
            Law::StVenantKirchhoff { shear_modulus } => {
                let d = self.volume_change(h);
                let law = StVenantKirchhoff { shear_modulus };
                law.stress_33(Strain::new(&law, h).e, d) - p * (1.0 + d)
            }
        }
    }

    /// Whether the force is linear in displacement and pressure.
    pub fn is_linear(self) -> bool {
        matches!(self, Law::SmallStrain { .. })
    }
}

#[cfg(test)]
mod tests;
