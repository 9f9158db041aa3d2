//! Linear isochoric elasticity: W = ζ |dev ε|² = ζ (e/2 + d²/6).

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
    fn first(&self, _e: f64, d: f64) -> First {
        First {
            e: self.shear_modulus / 2.0,
            d: self.shear_modulus / 3.0 * d,
        }
    }

    #[inline(always)]
    fn second(&self, _e: f64, _d: f64) -> Second {
        Second {
            ee: 0.0,
            ed: 0.0,
            dd: self.shear_modulus / 3.0,
        }
    }

    #[inline(always)]
    fn third(&self, _e: f64, _d: f64) -> Third {
        Third {
            eee: 0.0,
            eed: 0.0,
            edd: 0.0,
            ddd: 0.0,
        }
    }
}
