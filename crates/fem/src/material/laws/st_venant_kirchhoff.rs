//! St. Venant–Kirchhoff: W = λ/2 (tr E)² + μ E:E with Green's strain, the textbook's, and with its
//! deviator in place of E.
//!
//! With s = 2 tr E = a + 2 d and 4 E:E = s² + 4 a − 2 b: W = (λ + 2 μ) s²/8 + μ (a − b/2).

use crate::material::Real;
use crate::material::parameters::{Described, Description, Parameter, Range};
use crate::material::three::{Curvature, Invariants, Isotropic, Slope};

/// `W = λ/2 (tr E)² + μ E:E` with Green's strain E = (FᵀF − I)/2.
///
/// The energy holds the volume's part: no pressure and no κ are added. Valid for J > 0, meant for
/// moderate strains: it softens in compression.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StVenantKirchhoff {
    /// λ, Pa.
    pub lambda: f64,
    /// μ, Pa.
    pub shear_modulus: f64,
}

impl Described for StVenantKirchhoff {
    const DESCRIPTION: Description = Description {
        name: "st-venant-kirchhoff",
        energy: "λ/2 (tr E)² + μ E:E",
        about: "The textbook's law, with its own volume part: for `displacement` only, and for \
                moderate strains, as it softens in compression.",
        parameters: &[
            Parameter::new(
                "lambda",
                "Pa",
                Range::NotNegative,
                "Lamé's first constant λ",
            ),
            SHEAR_MODULUS,
        ],
        fibres: false,
        complete: true,
    };
}

/// `W = ζ |dev E|²` with Green's strain E, the deviator taken in three dimensions.
///
/// Valid for J > 0, meant for moderate strains: it softens in compression.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DeviatoricStVenantKirchhoff {
    /// ζ, Pa.
    pub shear_modulus: f64,
}

impl Described for DeviatoricStVenantKirchhoff {
    const DESCRIPTION: Description = Description {
        name: "deviatoric-st-venant-kirchhoff",
        energy: "ζ |dev E|²",
        about: "Of Green's strain without its trace; for moderate strains, as it softens in \
                compression.",
        parameters: &[SHEAR_MODULUS],
        fibres: false,
        complete: false,
    };
}

const SHEAR_MODULUS: Parameter = Parameter::new(
    "shear_modulus",
    "Pa",
    Range::Positive,
    "Shear modulus at rest",
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
        let along = (a + d * 2.0) * (0.25 * self.lambda + 0.5 * self.shear_modulus);
        Slope {
            a: along + d.like(self.shear_modulus),
            b: d.like(-0.5 * self.shear_modulus),
            d: along * 2.0,
        }
    }

    #[inline(always)]
    fn curvature<R: Real>(&self, Invariants { d, .. }: Invariants<R>) -> Curvature<R> {
        let once = d.like(0.25 * self.lambda + 0.5 * self.shear_modulus);
        let zero = d.like(0.0);
        Curvature {
            aa: once,
            ab: zero,
            bb: zero,
            ad: once * 2.0,
            bd: zero,
            dd: once * 4.0,
        }
    }
}

impl DeviatoricStVenantKirchhoff {
    /// |dev E|² = E:E − (tr E)²/3.
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
