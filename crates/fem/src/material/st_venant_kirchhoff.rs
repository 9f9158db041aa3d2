//! St. Venant–Kirchhoff: W = ζ |dev E|² with Green's strain E = (FᵀF − I)/2, in three dimensions.
//!
//! In plane strain `2 tr E = |F|² − 2 = e + 2 d` and `4 tr E² = (e + 2 d)² + 2 e − 2 d²`, so that
//! `W = ζ ((e + 2 d)²/6 + e/2 − d²/2)`: a quadratic, linearised by the law of small strains.

use super::Real;
use super::potential::{First, Potential, Second, Third};
use super::three::{Curvature, Invariants, Isotropic, Slope};

#[derive(Debug, Clone, Copy)]
pub(crate) struct StVenantKirchhoff {
    pub(crate) shear_modulus: f64,
}

impl StVenantKirchhoff {
    /// P33 without the pressure's part: F33 S33 with F33 = 1, S = 2 ζ dev E, E33 = 0.
    pub(crate) fn stress_33(&self, e: f64, d: f64) -> f64 {
        -self.shear_modulus / 3.0 * (e + 2.0 * d)
    }
}

impl Potential for StVenantKirchhoff {
    const FINITE: bool = true;

    #[inline(always)]
    fn energy(&self, e: f64, d: f64) -> f64 {
        let s = e + 2.0 * d;
        self.shear_modulus * (s * s / 6.0 + 0.5 * (e - d * d))
    }

    #[inline(always)]
    fn first<R: Real>(&self, e: R, d: R) -> First<R> {
        let third = self.shear_modulus / 3.0;
        First {
            e: (e + d * 2.0) * third + d.like(0.5 * self.shear_modulus),
            d: (e * 2.0 + d) * third,
        }
    }

    #[inline(always)]
    fn second<R: Real>(&self, _e: R, d: R) -> Second<R> {
        let third = d.like(self.shear_modulus / 3.0);
        Second {
            ee: third,
            ed: third * 2.0,
            dd: third,
        }
    }

    #[inline(always)]
    fn third<R: Real>(&self, _e: R, d: R) -> Third<R> {
        Third::zero(d)
    }
}

/// 2 tr E = a + 2 d = s and 4 E:E = s² + 4 a − 2 b, so that W = ζ (s²/6 + a − b/2).
impl Isotropic for StVenantKirchhoff {
    #[inline(always)]
    fn energy<R: Real>(&self, Invariants { a, b, d }: Invariants<R>) -> R {
        let s = a + d * 2.0;
        (s * s * (1.0 / 6.0) + a - b * 0.5) * self.shear_modulus
    }

    #[inline(always)]
    fn slope<R: Real>(&self, Invariants { a, d, .. }: Invariants<R>) -> Slope<R> {
        let along = (a + d * 2.0) * (self.shear_modulus / 3.0);
        Slope {
            a: along + d.like(self.shear_modulus),
            b: d.like(-0.5 * self.shear_modulus),
            d: along * 2.0,
        }
    }

    #[inline(always)]
    fn curvature<R: Real>(&self, Invariants { d, .. }: Invariants<R>) -> Curvature<R> {
        let third = d.like(self.shear_modulus / 3.0);
        let zero = d.like(0.0);
        Curvature {
            aa: third,
            ab: zero,
            bb: zero,
            ad: third * 2.0,
            bd: zero,
            dd: third * 4.0,
        }
    }
}
