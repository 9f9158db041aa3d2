//! Yeoh's law, a cubic polynomial of the first invariant.

use crate::material::Real;
use crate::material::parameters::{Described, Description, Parameter, Range};
use crate::material::three::{Invariants, Isotropic, Slope};

/// Yeoh's law `W = c10 (Ī1 − 3) + c20 (Ī1 − 3)² + c30 (Ī1 − 3)³` for rubber, skin and fat.
///
/// Source: Yeoh (1993), Rubber Chemistry and Technology 66, 754–771. The initial shear modulus is 2 c10. With a
/// negative c20, W is convex in Ī1 only for c20² ≤ 3 c10 c30.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Yeoh {
    /// Linear coefficient, in Pa.
    pub c10: f64,
    /// Quadratic coefficient, in Pa.
    pub c20: f64,
    /// Cubic coefficient, in Pa.
    pub c30: f64,
}

impl Described for Yeoh {
    const DESCRIPTION: Description = Description {
        name: "yeoh",
        energy: "c10 (Ī1-3) + c20 (Ī1-3)² + c30 (Ī1-3)³",
        about: "Stiffens or softens with strain.",
        parameters: &[
            Parameter::new("c10", "Pa", Range::Positive, "Linear coefficient"),
            Parameter::new("c20", "Pa", Range::Finite, "Quadratic coefficient").or(0.0),
            Parameter::new("c30", "Pa", Range::Finite, "Cubic coefficient").or(0.0),
        ],
        complete: false,
    };
}

impl Isotropic for Yeoh {
    #[inline(always)]
    fn energy<R: Real>(&self, at: Invariants<R>) -> R {
        let (y, _) = at.isochoric_first();
        let quadratic = y.mul_add(y.like(self.c30), y.like(self.c20));
        y.mul_add(quadratic, y.like(self.c10)) * y
    }

    #[inline(always)]
    fn slope<R: Real>(&self, at: Invariants<R>) -> Slope<R> {
        let (y, slope) = at.isochoric_first();
        let linear = y.mul_add(y.like(3.0 * self.c30), y.like(2.0 * self.c20));
        slope.scaled(y.mul_add(linear, y.like(self.c10)))
    }
}

#[cfg(test)]
mod tests {
    mod plane {
        use crate::material::tests::*;

        law_tests! {
            yeoh: Law::Yeoh { c10: 1e4, c20: -1e3, c30: 4e2 };
        }
    }

    mod space {
        use crate::material::three::tests::*;

        law_tests! {
            yeoh: Law::Yeoh { c10: 1e4, c20: -1e3, c30: 4e2 }, STATES;
        }
    }
}
