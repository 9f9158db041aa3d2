//! Mooney–Rivlin: W = g(J) e + k(J), g = c10 J^(−2/3) + c01 J^(−4/3); note 0001 has k.

use super::Real;
use super::potential::{First, Potential, Second, Third};

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
        let x = inverse_cube_root(1.0 + d);
        let (x2, x4) = (x * x, x * x * x * x);
        let ratio = d / (1.0 + x + x2);
        self.mix(x2, x4) * e + ratio * ratio * x4 * self.mix(x * (2.0 + x), 1.0 + 2.0 * x)
    }

    #[inline(always)]
    fn first<R: Real>(&self, e: R, d: R) -> First<R> {
        let x = inverse_cube_root(d + d.like(1.0));
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
        let x = inverse_cube_root(d + d.like(1.0));
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
        let x = inverse_cube_root(d + d.like(1.0));
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

/// J^(−1/3) for normal J > 0, without branches or calls, so that it is vector instructions on
/// lanes.
///
/// The exponent's third gives a guess within 4 %; each step of the cubic iteration
/// y ← y (1 + r/3 + 2 r²/9), r = 1 − J y³, takes r to about r³/2: 0.1, 6e-4, 1e-10, rounding.
#[inline(always)]
fn inverse_cube_root<R: Real>(j: R) -> R {
    // 4/3 of the exponent's bias, less a part that balances the error of the linear guess.
    const GUESS: u64 = 0x553e_f0ff;
    let mut y = j.map(|j| {
        let third = ((j.to_bits() >> 32) * 0xAAAA_AAAB) >> 33;
        f64::from_bits(GUESS.wrapping_sub(third) << 32)
    });
    for _ in 0..3 {
        let r = j.like(1.0) - j * (y * y * y);
        y = (y * r).mul_add(r.mul_add(r.like(2.0 / 9.0), r.like(1.0 / 3.0)), y);
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
