//! Mooney–Rivlin: W = g(J) e + k(J), g = c10 J^(−2/3) + c01 J^(−4/3); note 0001 has k.

use super::potential::{First, Potential, Second, Third};

#[derive(Debug, Clone, Copy)]
pub(crate) struct MooneyRivlin {
    pub(crate) c10: f64,
    pub(crate) c01: f64,
}

/// Powers of x = J^(−1/3) weighted with the coefficients.
impl MooneyRivlin {
    /// g and k' / (2 d / 3) have the form a x^m + b x^n: `c10 a + c01 b`.
    #[inline(always)]
    fn mix(&self, a: f64, b: f64) -> f64 {
        self.c10 * a + self.c01 * b
    }
}

impl Potential for MooneyRivlin {
    const FINITE: bool = true;

    #[inline(always)]
    fn energy(&self, e: f64, d: f64) -> f64 {
        let x = inverse_cube_root(1.0 + d);
        let (x2, x4) = (x * x, x * x * x * x);
        let ratio = d / (1.0 + x + x2);
        self.mix(x2, x4) * e + ratio * ratio * x4 * self.mix(x * (2.0 + x), 1.0 + 2.0 * x)
    }

    #[inline(always)]
    fn first(&self, e: f64, d: f64) -> First {
        let x = inverse_cube_root(1.0 + d);
        let x2 = x * x;
        let (x4, x5) = (x2 * x2, x2 * x2 * x);
        let x7 = x5 * x2;
        First {
            e: self.mix(x2, x4),
            d: 2.0 / 3.0 * self.mix(x5 * (d - e), x4 * d - 2.0 * x7 * e),
        }
    }

    #[inline(always)]
    fn second(&self, e: f64, d: f64) -> Second {
        let x = inverse_cube_root(1.0 + d);
        let x2 = x * x;
        let x5 = x2 * x2 * x;
        let (x7, x8, x10) = (x5 * x2, x5 * x2 * x, x5 * x5);
        Second {
            ee: 0.0,
            ed: -2.0 / 3.0 * self.mix(x5, 2.0 * x7),
            dd: 2.0 / 9.0
                * self.mix(
                    x8 * (3.0 - 2.0 * d + 5.0 * e),
                    x7 * (3.0 - d) + 14.0 * x10 * e,
                ),
        }
    }

    #[inline(always)]
    fn third(&self, e: f64, d: f64) -> Third {
        let x = inverse_cube_root(1.0 + d);
        let x2 = x * x;
        let (x4, x5) = (x2 * x2, x2 * x2 * x);
        let (x8, x10) = (x4 * x4, x5 * x5);
        let (x11, x13) = (x10 * x, x10 * x2 * x);
        Third {
            eee: 0.0,
            eed: 0.0,
            edd: 2.0 / 9.0 * self.mix(5.0 * x8, 14.0 * x10),
            ddd: 4.0 / 27.0
                * self.mix(
                    x11 * (5.0 * d - 15.0 - 20.0 * e),
                    x10 * (2.0 * d - 12.0) - 70.0 * x13 * e,
                ),
        }
    }
}

/// J^(−1/3) for normal J > 0, without branches or calls, so that loops over lanes vectorise.
///
/// The exponent's third gives a guess within 4 %; each step of the cubic iteration
/// y ← y (1 + r/3 + 2 r²/9), r = 1 − J y³, takes r to about r³/2: 0.1, 6e-4, 1e-10, rounding.
#[inline(always)]
fn inverse_cube_root(j: f64) -> f64 {
    // 4/3 of the exponent's bias, less a part that balances the error of the linear guess.
    const GUESS: u64 = 0x553e_f0ff;
    let third = ((j.to_bits() >> 32) * 0xAAAA_AAAB) >> 33;
    let mut y = f64::from_bits(GUESS.wrapping_sub(third) << 32);
    for _ in 0..3 {
        let r = 1.0 - j * y * y * y;
        y += y * r * (1.0 / 3.0 + 2.0 / 9.0 * r);
    }
    y
}

#[cfg(test)]
mod tests {
    use super::inverse_cube_root;

    #[test]
    fn inverse_cube_root_is_correct_to_rounding() {
        let mut j = 1e-6;
        while j < 1e6 {
            let relative = inverse_cube_root(j) * j.cbrt() - 1.0;
            // Three roundings in the last step and those of the check itself.
            assert!(relative.abs() < 4.0 * f64::EPSILON, "{j}: {relative:e}");
            j *= 1.003;
        }
    }
}
