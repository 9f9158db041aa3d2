//! Gent's law for molecular chains of limited extensibility.

use crate::material::Real;
use crate::material::parameters::{Described, Description, Parameter, Range};
use crate::material::three::{Invariants, Isotropic, Slope};

/// Gent's law `W = −μ J_m/2 ln(1 − (Ī1 − 3)/J_m)`, which locks at Ī1 − 3 = J_m.
///
/// Source: Gent (1996), Rubber Chemistry and Technology 69, 59–61. Beyond the limit, energy and
/// stress are NaN, so that solvers reject the state.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gent {
    /// Initial shear modulus μ, in Pa.
    pub shear_modulus: f64,
    /// Limit J_m of Ī1 − 3.
    pub limit: f64,
}

impl Described for Gent {
    const DESCRIPTION: Description = Description {
        name: "gent",
        energy: "-ζ J_m/2 ln(1 - (Ī1-3)/J_m)",
        about: "Locks at large strains.",
        parameters: &[
            Parameter::new("shear_modulus", "Pa", Range::Positive, "Initial shear modulus ζ"),
            Parameter::new("limit", "", Range::Positive, "Limit J_m of Ī1 - 3"),
        ],
        complete: false,
    };
}

impl Isotropic for Gent {
    #[inline(always)]
    fn energy<R: Real>(&self, at: Invariants<R>) -> R {
        let (y, _) = at.isochoric_first();
        (y * (-1.0 / self.limit)).ln_1p() * (-0.5 * self.shear_modulus * self.limit)
    }

    #[inline(always)]
    fn slope<R: Real>(&self, at: Invariants<R>) -> Slope<R> {
        let (y, slope) = at.isochoric_first();
        let left = (y * -1.0) + y.like(self.limit);
        let factor = y.like(0.5 * self.shear_modulus * self.limit) / left;
        slope.scaled(left.choose(factor, y.like(f64::NAN)))
    }
}

#[cfg(test)]
mod tests {
    mod plane {
        use crate::material::tests::*;

        law_tests! {
            gent: Law::Gent { shear_modulus: 1e4, limit: 6.0 };
        }
    }

    mod space {
        use crate::material::three::tests::*;

        law_tests! {
            gent: Law::Gent { shear_modulus: 1e4, limit: 6.0 }, STATES;
        }
    }
}
