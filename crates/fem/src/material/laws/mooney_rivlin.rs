//! Mooney–Rivlin law. With x = J^(−1/3):
//!
//! ```text
//! W = c10 (x² a + k1) + c01 (x⁴ b + k2),  k1 = x² (3 + 2 d) − 3,  k2 = x⁴ (3 + 4 d) − 3,
//! ```
//!
//! where k1 and k2 are evaluated without terms that cancel. In plane strain, W = g(J) e + k(J); see note 0001.

use crate::material::parameters::{Described, Description, Parameter, Range};
use crate::material::three::{Curvature, Invariants, Isotropic, Slope};
use crate::material::{PlaneCurvature, PlaneSlope, Real};

/// Mooney–Rivlin law `W = c10 (I1 J^(−2/3) − 3) + c01 (I2 J^(−4/3) − 3)`. It is the neo-Hookean law for c01 = 0.
///
/// If c01 is negative, the initial shear modulus 2 (c10 + c01) must still be positive. The law is then stable for
/// moderate strains only.
///
/// Valid for J > 0. Paper, eq. (20).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MooneyRivlin {
    /// Coefficient of the first invariant, in Pa.
    pub c10: f64,
    /// Coefficient of the second invariant, in Pa.
    pub c01: f64,
}

impl Described for MooneyRivlin {
    const DESCRIPTION: Description = Description {
        name: "mooney-rivlin",
        energy: "c10 (Ī1-3) + c01 (Ī2-3)",
        about: "Eq. (20).",
        parameters: &[
            Parameter::new("c10", "Pa", Range::NotNegative, "Coefficient of the first invariant"),
            Parameter::new(
                "c01",
                "Pa",
                Range::Finite,
                "Coefficient of the second invariant, above -c10",
            )
            .or(0.0),
        ],
        complete: false,
    };
}

impl MooneyRivlin {
    /// Returns `c10 a + c01 b`. The functions g and k' / (2 d / 3) have the form a x^m + b x^n with x = J^(−1/3).
    #[inline(always)]
    fn mix<R: Real>(&self, a: R, b: R) -> R {
        a.mul_add(a.like(self.c10), b * self.c01)
    }
}

impl Isotropic for MooneyRivlin {
    #[inline(always)]
    fn energy<R: Real>(&self, at: Invariants<R>) -> R {
        let (first, _) = at.isochoric_first();
        let (second, _) = at.isochoric_second();
        self.mix(first, second)
    }

    #[inline(always)]
    fn slope<R: Real>(&self, Invariants { a, b, d }: Invariants<R>) -> Slope<R> {
        let x = (d + d.like(1.0)).inverse_cube_root();
        let x2 = x * x;
        let x4 = x2 * x2;
        let (x5, x7) = (x4 * x, x4 * x2 * x);
        Slope {
            a: x2 * self.c10,
            b: x4 * self.c01,
            d: self.mix(x5 * (d - a), x7 * (b + d) * -2.0) * (2.0 / 3.0),
        }
    }

    #[inline(always)]
    fn curvature<R: Real>(&self, Invariants { a, b, d }: Invariants<R>) -> Curvature<R> {
        let x = (d + d.like(1.0)).inverse_cube_root();
        let x2 = x * x;
        let x5 = x2 * x2 * x;
        let (x7, x8, x10) = (x5 * x2, x5 * x2 * x, x5 * x5);
        let zero = d.like(0.0);
        Curvature {
            aa: zero,
            ab: zero,
            bb: zero,
            ad: x5 * (-2.0 / 3.0 * self.c10),
            bd: x7 * (-4.0 / 3.0 * self.c01),
            dd: self.mix(x5 * 3.0 - x8 * (d - a) * 5.0, x10 * (b + d) * 14.0 - x7 * 6.0)
                * (2.0 / 9.0),
        }
    }

    #[inline(always)]
    fn plane_slope<R: Real>(&self, e: R, d: R) -> PlaneSlope<R> {
        let x = (d + d.like(1.0)).inverse_cube_root();
        let x2 = x * x;
        let (x4, x5) = (x2 * x2, x2 * x2 * x);
        let x7 = x5 * x2;
        PlaneSlope {
            e: self.mix(x2, x4),
            d: self.mix(x5 * (d - e), x4 * d - x7 * e * 2.0) * (2.0 / 3.0),
        }
    }

    #[inline(always)]
    fn plane_curvature<R: Real>(&self, e: R, d: R) -> PlaneCurvature<R> {
        let x = (d + d.like(1.0)).inverse_cube_root();
        let x2 = x * x;
        let x5 = x2 * x2 * x;
        let (x7, x8, x10) = (x5 * x2, x5 * x2 * x, x5 * x5);
        PlaneCurvature {
            ee: e.like(0.0),
            ed: self.mix(x5, x7 * 2.0) * (-2.0 / 3.0),
            dd: self.mix(
                x8 * (d.like(3.0) - d * 2.0 + e * 5.0),
                x7 * (d.like(3.0) - d) + x10 * e * 14.0,
            ) * (2.0 / 9.0),
        }
    }
}

#[cfg(test)]
mod tests {
    mod plane {
        use crate::material::tests::*;

        law_tests! {
            mooney_rivlin: Law::MooneyRivlin { c10: 1e4, c01: 2e2 };
            second_invariant_only: Law::MooneyRivlin { c10: 0.0, c01: 5e3 };
            negative_second: Law::MooneyRivlin { c10: 4.8e4, c01: -4e4 };
        }
    }

    mod space {
        use crate::error::FemError;
        use crate::material::three::tests::*;

        law_tests! {
            mooney_rivlin: Law::MooneyRivlin { c10: 1e4, c01: 2e2 }, STATES;
            second_invariant_only: Law::MooneyRivlin { c10: 0.0, c01: 5e3 }, STATES;
            negative_second: Law::MooneyRivlin { c10: 4.8e4, c01: -4e4 }, STATES;
        }

        /// Regression: published constants with a negative c01 were rejected.
        #[test]
        fn a_negative_second_coefficient_needs_a_positive_shear_modulus() {
            let fibers = [("c3", 1e6), ("c4", 10.0), ("c5", 1e9), ("stretch_max", 1.03)];
            for (name, more) in [("mooney-rivlin", &[][..]), ("transverse-mooney-rivlin", &fibers)]
            {
                let law = |c01| Law::named(name, &[&[("c10", 4.8e4), ("c01", c01)], more].concat());
                assert!(law(-4.7e4).is_ok());
                for c01 in [-4.8e4, -1e5] {
                    let error = law(c01).unwrap_err();
                    assert!(matches!(error, FemError::Parameter { name: "c01", .. }), "{error}");
                }
            }
        }
    }
}
