//! Elementary functions on vector registers, without branches or calls.

use super::real::Plain;

/// Returns x^(−1/3) for normal x > 0.
///
/// The initial guess, obtained from a third of the exponent, has an error of at most 4 %. Each step of the cubic
/// iteration y ← y (1 + r/3 + 2 r²/9) with r = 1 − x y³ reduces r to about r³/2. The values of r are 0.1, 6e-4,
/// 1e-10, and then rounding errors.
#[inline(always)]
pub(crate) fn inverse_cube_root<R: Plain>(x: R) -> R {
    // The constant is 4/3 of the exponent bias, minus a term that balances the error of the linear guess.
    const GUESS: u64 = 0x553e_f0ff;
    let mut y = x.map(|x| {
        let third = ((x.to_bits() >> 32) * 0xAAAA_AAAB) >> 33;
        f64::from_bits(GUESS.wrapping_sub(third) << 32)
    });
    for _ in 0..3 {
        let r = x.like(1.0) - x * (y * y * y);
        y = (y * r).mul_add(r.mul_add(r.like(2.0 / 9.0), r.like(1.0 / 3.0)), y);
    }
    y
}

/// Returns eˣ = 2ⁿ eʳ, where n is the integer closest to x / ln 2, so that |r| ≤ ln 2 / 2.
///
/// The Taylor polynomial of degree 13 has a relative error of 4e-18 in this range.
#[inline(always)]
pub(crate) fn exp<R: Plain>(x: R) -> R {
    use std::f64::consts::{LN_2, LOG2_E};
    // `HIGH` holds the first 32 bits of ln 2, whose product with n is exact, and `LOW` the remainder.
    const HIGH: f64 = 0.693_147_180_369_123_8;
    const LOW: f64 = 1.908_214_929_270_587_7e-10;
    const { assert!(HIGH + LOW == LN_2) };
    // Adding this constant moves n to the last bits.
    const ROUND: f64 = 6_755_399_441_055_744.0;
    // The values from 1/13! to 1/0!.
    const INVERSE_FACTORIALS: [f64; 14] = {
        let mut all = [1.0; 14];
        let (mut k, mut factorial) = (1, 1.0);
        while k < 14 {
            factorial *= k as f64;
            all[13 - k] = 1.0 / factorial;
            k += 1;
        }
        all
    };
    // Clamps x: n = 1024 is the exponent of ∞, and n = -1021 is the exponent of a normal number.
    let x = (x - x.like(710.0)).choose(x.like(710.0), x);
    let x = (x.like(-708.0) - x).choose(x.like(-708.0), x);
    let shifted = x.mul_add(x.like(LOG2_E), x.like(ROUND));
    let n = shifted - x.like(ROUND);
    let r = n.mul_add(x.like(-LOW), n.mul_add(x.like(-HIGH), x));
    let mut sum = x.like(INVERSE_FACTORIALS[0]);
    for coefficient in &INVERSE_FACTORIALS[1..] {
        sum = sum.mul_add(r, x.like(*coefficient));
    }
    sum * shifted.map(|n| f64::from_bits(n.to_bits().wrapping_add(1023) << 52))
}

#[cfg(test)]
mod tests {
    use super::{exp, inverse_cube_root};

    #[test]
    fn inverse_cube_root_is_accurate_to_rounding() {
        let mut x = 1e-6;
        while x < 1e6 {
            let relative = inverse_cube_root(x) * x.cbrt() - 1.0;
            // There are three roundings in the last step, and further roundings in the check.
            assert!(relative.abs() < 4.0 * f64::EPSILON, "{x}: {relative:e}");
            x *= 1.003;
        }
    }

    #[test]
    fn exp_is_accurate_to_rounding() {
        for k in -70_000..=70_900 {
            let x = 0.01 * f64::from(k);
            let relative = exp(x) / x.exp() - 1.0;
            // There are two roundings in the last step and in the check.
            assert!(relative.abs() < 3.0 * f64::EPSILON, "{x}: {relative:e}");
        }
        assert_eq!(exp(0.0), 1.0);
        assert_eq!(exp(800.0), f64::INFINITY);
        assert!(exp(-800.0) < 1e-300);
        assert!(exp(f64::NAN).is_nan());
    }
}
