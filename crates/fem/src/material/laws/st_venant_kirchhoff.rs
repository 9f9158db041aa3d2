//! St. Venant–Kirchhoff laws: W = λ/2 (tr E)² + μ E:E with the Green strain E, and a law with the deviator of E.
//!
//! With s = 2 tr E = a + 2 d and 4 E:E = s² + 4 a − 2 b, the energy is W = (λ + 2 μ) s²/8 + μ (a − b/2).

use crate::material::Real;
use crate::material::parameters::{Described, Description, Parameter, Range};
use crate::material::three::{Curvature, Invariants, Isotropic, Slope};

/// St. Venant–Kirchhoff law `W = λ/2 (tr E)² + μ E:E` with the Green strain E = (FᵀF − I)/2.
///
/// The energy includes the volumetric part, so neither pressure nor κ is added. The law is valid for J > 0. It
/// softens in compression, so it is intended for moderate strains.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StVenantKirchhoff {
    /// First Lamé parameter λ, in Pa.
    pub lambda: f64,
    /// Shear modulus μ, in Pa.
    pub shear_modulus: f64,
}

impl Described for StVenantKirchhoff {
    const DESCRIPTION: Description = Description {
        name: "st-venant-kirchhoff",
        energy: "λ/2 (tr E)² + μ E:E",
        about: "For `displacement` only and moderate strains; softens in compression.",
        parameters: &[
            Parameter::new(
                "first_lame_parameter",
                "Pa",
                Range::NotNegative,
                "First Lamé parameter λ",
            ),
            SHEAR_MODULUS,
        ],
        complete: true,
    };
}

/// Deviatoric law `W = ζ |dev E|²` with the Green strain E, where dev is the deviator in 3D.
///
/// The law is valid for J > 0. It softens in compression, so it is intended for moderate strains.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DeviatoricStVenantKirchhoff {
    /// Shear modulus ζ, in Pa.
    pub shear_modulus: f64,
}

impl Described for DeviatoricStVenantKirchhoff {
    const DESCRIPTION: Description = Description {
        name: "deviatoric-st-venant-kirchhoff",
        energy: "ζ |dev E|²",
        about: "For moderate strains; softens in compression.",
        parameters: &[SHEAR_MODULUS],
        complete: false,
    };
}

const SHEAR_MODULUS: Parameter = Parameter::new(
    "shear_modulus",
    "Pa",
    Range::Positive,
    "Shear modulus of the undeformed material",
);

impl Isotropic for StVenantKirchhoff {
    const COMPLETE: bool = true;

    #[inline(always)]
    fn energy<R: Real>(&self, Invariants { a, b, d }: Invariants<R>) -> R {
        let s = a + d * 2.0;
        s * s * (0.125 * self.lambda + 0.25 * self.shear_modulus)
            + (a - b * 0.5) * self.shear_modulus
    }

    #[inline(always)]
    fn slope<R: Real>(&self, Invariants { a, d, .. }: Invariants<R>) -> Slope<R> {
        let slope = (a + d * 2.0) * (0.25 * self.lambda + 0.5 * self.shear_modulus);
        Slope {
            a: slope + d.like(self.shear_modulus),
            b: d.like(-0.5 * self.shear_modulus),
            d: slope * 2.0,
        }
    }

    #[inline(always)]
    fn curvature<R: Real>(&self, Invariants { d, .. }: Invariants<R>) -> Curvature<R> {
        let once = d.like(0.25 * self.lambda + 0.5 * self.shear_modulus);
        let zero = d.like(0.0);
        Curvature { aa: once, ab: zero, bb: zero, ad: once * 2.0, bd: zero, dd: once * 4.0 }
    }
}

impl DeviatoricStVenantKirchhoff {
    /// Returns the law with |dev E|² = E:E − (tr E)²/3.
    #[inline(always)]
    fn with_trace(self) -> StVenantKirchhoff {
        StVenantKirchhoff {
            lambda: self.shear_modulus * (-2.0 / 3.0),
            shear_modulus: self.shear_modulus,
        }
    }
}

impl Isotropic for DeviatoricStVenantKirchhoff {
    #[inline(always)]
    fn energy<R: Real>(&self, at: Invariants<R>) -> R {
        self.with_trace().energy(at)
    }

    #[inline(always)]
    fn slope<R: Real>(&self, at: Invariants<R>) -> Slope<R> {
        self.with_trace().slope(at)
    }

    #[inline(always)]
    fn curvature<R: Real>(&self, at: Invariants<R>) -> Curvature<R> {
        self.with_trace().curvature(at)
    }
}

#[cfg(test)]
mod tests {
    mod plane {
        use crate::material::tests::*;

        law_tests! {
            deviatoric: Law::DeviatoricStVenantKirchhoff { shear_modulus: 2.04e4 };
            complete: Law::StVenantKirchhoff { lambda: 3e4, shear_modulus: 2.04e4 };
        }
    }

    mod space {
        use crate::material::three::tests::*;

        law_tests! {
            deviatoric: Law::DeviatoricStVenantKirchhoff { shear_modulus: 2.04e4 }, STATES;
            complete: Law::StVenantKirchhoff { lambda: 3e4, shear_modulus: 2.04e4 }, STATES;
        }
    }
}
