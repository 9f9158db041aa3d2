//! Veronda and Westmann's law, which is exponential in the first invariant and linear in the second.

use super::mooney_rivlin::MooneyRivlin;
use crate::material::Real;
use crate::material::parameters::{Described, Description, Parameter, Range};
use crate::material::three::{Invariants, Isotropic, Slope};

/// Veronda and Westmann's law `W = c1 (e^{c2 (Ī1 − 3)} − 1) − c1 c2/2 (Ī2 − 3)` for skin.
///
/// Source: Veronda and Westmann (1970), Journal of Biomechanics 3, 111–124. The initial shear modulus is c1 c2.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VerondaWestmann {
    /// Scale of the exponential, in Pa.
    pub c1: f64,
    /// Exponent c2.
    pub c2: f64,
}

impl Described for VerondaWestmann {
    const DESCRIPTION: Description = Description {
        name: "veronda-westmann",
        energy: "c1 (exp c2 (Ī1-3) - 1) - c1 c2/2 (Ī2-3)",
        about: "Skin; initial shear modulus c1 c2.",
        parameters: &[
            Parameter::new("c1", "Pa", Range::Positive, "Scale of the exponential"),
            Parameter::new("c2", "", Range::Positive, "Exponent"),
        ],
        complete: false,
    };
}

impl VerondaWestmann {
    /// Returns the term with the second invariant.
    #[inline(always)]
    fn second(&self) -> MooneyRivlin {
        MooneyRivlin { c10: 0.0, c01: -0.5 * self.c1 * self.c2 }
    }
}

impl Isotropic for VerondaWestmann {
    #[inline(always)]
    fn energy<R: Real>(&self, at: Invariants<R>) -> R {
        let (y, _) = at.isochoric_first();
        (y * self.c2).exp_m1() * self.c1 + Isotropic::energy(&self.second(), at)
    }

    #[inline(always)]
    fn slope<R: Real>(&self, at: Invariants<R>) -> Slope<R> {
        let (y, slope) = at.isochoric_first();
        let first = slope.scaled((y * self.c2).exp() * (self.c1 * self.c2));
        let second = self.second().slope(at);
        Slope { a: first.a + second.a, b: first.b + second.b, d: first.d + second.d }
    }
}

#[cfg(test)]
mod tests {
    mod plane {
        use crate::material::tests::*;

        law_tests! {
            veronda_westmann: Law::VerondaWestmann { c1: 5e3, c2: 1.5 };
        }
    }

    mod space {
        use crate::material::three::tests::*;

        law_tests! {
            veronda_westmann: Law::VerondaWestmann { c1: 5e3, c2: 1.5 }, STATES;
        }
    }
}
