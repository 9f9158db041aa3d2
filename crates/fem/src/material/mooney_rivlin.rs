//! Mooney–Rivlin: W = g(J) e + k(J), g = c10 J^(−2/3) + c01 J^(−4/3); note 0001 has k.

use super::Real;
use super::potential::{First, Potential, Second, Third};
use super::three::{Curvature, Invariants, Isotropic, Slope};

#[derive(Debug, Clone, Copy)]
pub(crate) struct MooneyRivlin {
    pub(crate) c10: f64,
    pub(crate) c01: f64,
}

impl MooneyRivlin {
    /// g and k' / (2 d / 3) have the form a x^m + b x^n: `c10 a + c01 b`, x = J^(−1/3).
    #[inline(always)]
    fn mix<R: Real>(&self, a: R, b: R) -> R {
        a.mul_add(a.like(self.c10), b * self.c01)
    }
}

impl Potential for MooneyRivlin {
    const FINITE: bool = true;

    #[inline(always)]
    fn energy(&self, e: f64, d: f64) -> f64 {
        let x = (1.0 + d).inverse_cube_root();
        let (x2, x4) = (x * x, x * x * x * x);
        let ratio = d / (1.0 + x + x2);
        self.mix(x2, x4) * e + ratio * ratio * x4 * self.mix(x * (2.0 + x), 1.0 + 2.0 * x)
    }

    #[inline(always)]
    fn first<R: Real>(&self, e: R, d: R) -> First<R> {
        let x = (d + d.like(1.0)).inverse_cube_root();
        let x2 = x * x;
        let (x4, x5) = (x2 * x2, x2 * x2 * x);
        let x7 = x5 * x2;
        First {
            e: self.mix(x2, x4),
            d: self.mix(x5 * (d - e), x4 * d - x7 * e * 2.0) * (2.0 / 3.0),
        }
    }

    #[inline(always)]
    fn second<R: Real>(&self, e: R, d: R) -> Second<R> {
        let x = (d + d.like(1.0)).inverse_cube_root();
        let x2 = x * x;
        let x5 = x2 * x2 * x;
        let (x7, x8, x10) = (x5 * x2, x5 * x2 * x, x5 * x5);
        Second {
            ee: e.like(0.0),
            ed: self.mix(x5, x7 * 2.0) * (-2.0 / 3.0),
            dd: self.mix(
                x8 * (d.like(3.0) - d * 2.0 + e * 5.0),
                x7 * (d.like(3.0) - d) + x10 * e * 14.0,
            ) * (2.0 / 9.0),
        }
    }

    #[inline(always)]
    fn third<R: Real>(&self, e: R, d: R) -> Third<R> {
        let x = (d + d.like(1.0)).inverse_cube_root();
        let x2 = x * x;
        let (x4, x5) = (x2 * x2, x2 * x2 * x);
        let (x8, x10) = (x4 * x4, x5 * x5);
        let (x11, x13) = (x10 * x, x10 * x2 * x);
        Third {
            eee: e.like(0.0),
            eed: e.like(0.0),
            edd: self.mix(x8 * 5.0, x10 * 14.0) * (2.0 / 9.0),
            ddd: self.mix(
                x11 * (d * 5.0 - d.like(15.0) - e * 20.0),
                x10 * (d * 2.0 - d.like(12.0)) - x13 * e * 70.0,
            ) * (4.0 / 27.0),
        }
    }
}

/// With x = J^(−1/3): W = c10 (x² a + k1) + c01 (x⁴ b + k2), k1 = x² (3 + 2 d) − 3 and
/// k2 = x⁴ (3 + 4 d) − 3, both written without the terms that cancel.
impl Isotropic for MooneyRivlin {
    #[inline(always)]
    fn energy<R: Real>(&self, at: Invariants<R>) -> R {
        let one = at.d.like(1.0);
        let x = (at.d + one).inverse_cube_root();
        let (x2, x4) = (x * x, x * x * x * x);
        let ratio = at.d / (one + x + x2);
        let k1 = ratio * ratio * x4 * x * (x + one * 2.0);
        let k2 = x4 * (ratio * ratio * (one + x * 2.0) - at.d * at.d);
        self.mix(x2 * at.a + k1, x4 * at.b + k2)
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
            dd: self.mix(
                x5 * 3.0 - x8 * (d - a) * 5.0,
                x10 * (b + d) * 14.0 - x7 * 6.0,
            ) * (2.0 / 9.0),
        }
    }
}
