//! St. Venant–Kirchhoff: W = ζ |dev E|² with Green's strain E = (FᵀF − I)/2, in three dimensions.
//!
//! In plane strain `2 tr E = |F|² − 2 = e + 2 d` and `4 tr E² = (e + 2 d)² + 2 e − 2 d²`, so that
//! `W = ζ ((e + 2 d)²/6 + e/2 − d²/2)`: a quadratic, linearised by the law of small strains.

use super::Real;
use super::potential::{First, Potential, Second, Third};

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
