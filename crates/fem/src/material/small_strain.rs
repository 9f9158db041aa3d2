//! Linear isochoric elasticity: W = ζ |dev ε|² = ζ (e/2 + d²/6).

use super::Real;
use super::potential::{First, Potential, Second, Third};

#[derive(Debug, Clone, Copy)]
pub(crate) struct SmallStrain {
    pub(crate) shear_modulus: f64,
}

impl Potential for SmallStrain {
    const FINITE: bool = false;

    #[inline(always)]
    fn energy(&self, e: f64, d: f64) -> f64 {
        self.shear_modulus * (e / 2.0 + d * d / 6.0)
    }

    #[inline(always)]
    fn first<R: Real>(&self, _e: R, d: R) -> First<R> {
        First {
            e: d.like(self.shear_modulus / 2.0),
            d: d * (self.shear_modulus / 3.0),
        }
    }

    #[inline(always)]
    fn second<R: Real>(&self, _e: R, d: R) -> Second<R> {
        let zero = d.like(0.0);
        Second {
            ee: zero,
            ed: zero,
            dd: d.like(self.shear_modulus / 3.0),
        }
    }

    #[inline(always)]
    fn third<R: Real>(&self, _e: R, d: R) -> Third<R> {
        Third::zero(d)
    }
}
