//! Vector arithmetic for IDAS with the vector instructions of the processor.
//!
//! A step of order 2 makes about thirty passes over vectors. Each of these passes is cheap, but with SUNDIALS' scalar
//! loops, they take a third of the run time. Elementwise operations return bitwise the same results as SUNDIALS; sums
//! differ by rounding. On every processor, sums are split into [`LANES`] partial sums, so results do not depend on the
//! processor.

use std::mem::MaybeUninit;
use std::sync::LazyLock;

use pulp::{Arch, Simd};
use pulp_macro::with_simd;

/// Number of partial sums in a norm: four AVX-512 registers, which is enough to hide the latency of an addition.
const LANES: usize = 32;

/// Instruction set of the processor, detected once.
static ARCH: LazyLock<Arch> = LazyLock::new(Arch::new);

/// Computes `out` ← a x + b y.
#[with_simd(linear_sum = ARCH)]
#[inline(always)]
pub(crate) fn linear_sum_with<S: Simd>(
    _: S,
    a: f64,
    x: &[f64],
    b: f64,
    y: &[f64],
    out: &mut [MaybeUninit<f64>],
) {
    for ((out, x), y) in out.iter_mut().zip(x).zip(y) {
        out.write(a * x + b * y);
    }
}

/// Computes `y` ← a x + b y.
#[with_simd(add_scaled = ARCH)]
#[inline(always)]
pub(crate) fn add_scaled_with<S: Simd>(_: S, a: f64, x: &[f64], b: f64, y: &mut [f64]) {
    for (y, x) in y.iter_mut().zip(x) {
        *y = a * x + b * *y;
    }
}

/// Computes `out` ← c x.
#[with_simd(scale = ARCH)]
#[inline(always)]
pub(crate) fn scale_with<S: Simd>(_: S, c: f64, x: &[f64], out: &mut [MaybeUninit<f64>]) {
    for (out, x) in out.iter_mut().zip(x) {
        out.write(c * x);
    }
}

/// Computes `x` ← c x.
#[with_simd(scale_in_place = ARCH)]
#[inline(always)]
pub(crate) fn scale_in_place_with<S: Simd>(_: S, c: f64, x: &mut [f64]) {
    for x in x {
        *x *= c;
    }
}

/// Computes `x` ← |x|.
#[with_simd(absolute_in_place = ARCH)]
#[inline(always)]
pub(crate) fn absolute_in_place_with<S: Simd>(_: S, x: &mut [f64]) {
    for x in x {
        *x = x.abs();
    }
}

/// Computes `x` ← 1/x.
#[with_simd(invert_in_place = ARCH)]
#[inline(always)]
pub(crate) fn invert_in_place_with<S: Simd>(_: S, x: &mut [f64]) {
    for x in x {
        *x = 1.0 / *x;
    }
}

/// Returns whether all entries are finite. There is no early exit, because it would prevent vectorization.
#[with_simd(is_finite = ARCH)]
#[inline(always)]
pub(crate) fn is_finite_with<S: Simd>(_: S, x: &[f64]) -> bool {
    x.iter().fold(true, |all, x| all & x.is_finite())
}

/// Returns whether all entries are positive and finite. Computes a sum that is 0 only for such entries, because the
/// compiler would generate scalar code for two comparisons per entry.
#[with_simd(is_positive = ARCH)]
#[inline(always)]
pub(crate) fn is_positive_with<S: Simd>(_: S, x: &[f64]) -> bool {
    let nothing = |x: f64| if x > 0.0 { x * 0.0 } else { f64::NAN };
    let mut sums = [0.0; LANES];
    let (x, rest) = x.as_chunks::<LANES>();
    for x in x {
        for l in 0..LANES {
            sums[l] += nothing(x[l]);
        }
    }
    sums.iter().sum::<f64>() + rest.iter().map(|&x| nothing(x)).sum::<f64>() == 0.0
}

/// Returns √(Σ (x w)² / n) over all n entries.
pub(crate) fn weighted_rms(x: &[f64], w: &[f64]) -> f64 {
    root_mean(squares(x, w), x.len())
}

#[with_simd(squares = ARCH)]
#[inline(always)]
fn squares_with<S: Simd>(_: S, x: &[f64], w: &[f64]) -> f64 {
    let mut sums = [0.0; LANES];
    let (x, x_rest) = x.as_chunks::<LANES>();
    let (w, w_rest) = w.as_chunks::<LANES>();
    let last = (&with_zeros(x_rest), &with_zeros(w_rest));
    for (x, w) in x.iter().zip(w).chain([last]) {
        for l in 0..LANES {
            let product = x[l] * w[l];
            sums[l] += product * product;
        }
    }
    sums.iter().sum()
}

/// Pads the remainder to a full chunk. With a separate loop for the remainder, the compiler would generate scalar code
/// for the whole sum, which is four times slower.
#[inline(always)]
fn with_zeros(rest: &[f64]) -> [f64; LANES] {
    let mut chunk = [0.0; LANES];
    chunk[..rest.len()].copy_from_slice(rest);
    chunk
}

/// Returns √(Σ (x w)² / n), summed over the entries with a positive `id`, where n is the total number of entries.
pub(crate) fn weighted_rms_masked(x: &[f64], w: &[f64], id: &[f64]) -> f64 {
    root_mean(masked_squares(x, w, id), x.len())
}

#[with_simd(masked_squares = ARCH)]
#[inline(always)]
fn masked_squares_with<S: Simd>(_: S, x: &[f64], w: &[f64], id: &[f64]) -> f64 {
    // This is a selection instead of a product, because excluded entries may be infinite.
    let square = |x: f64, w: f64, id: f64| {
        let product = if id > 0.0 { x * w } else { 0.0 };
        product * product
    };
    let mut sums = [0.0; LANES];
    let (x, x_rest) = x.as_chunks::<LANES>();
    let (w, w_rest) = w.as_chunks::<LANES>();
    let (id, id_rest) = id.as_chunks::<LANES>();
    for ((x, w), id) in x.iter().zip(w).zip(id) {
        for l in 0..LANES {
            sums[l] += square(x[l], w[l], id[l]);
        }
    }
    let rest = x_rest.iter().zip(w_rest).zip(id_rest);
    for (sum, ((&x, &w), &id)) in sums.iter_mut().zip(rest) {
        *sum += square(x, w, id);
    }
    sums.iter().sum()
}

fn root_mean(sum: f64, n: usize) -> f64 {
    (sum / n as f64).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Tests every position, in full chunks and in the remainder.
    #[test]
    fn one_entry_that_is_not_positive_and_finite_is_seen() {
        let mut x = [f64::MIN_POSITIVE; 2 * LANES + 7];
        x[3] = f64::MAX;
        assert!(is_positive(&x) && is_finite(&x) && is_positive(&[]));
        for i in 0..x.len() {
            for wrong in [0.0, -0.0, -1.0, f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
                let right = std::mem::replace(&mut x[i], wrong);
                assert!(!is_positive(&x), "{wrong} at {i}");
                assert_eq!(is_finite(&x), wrong.is_finite(), "{wrong} at {i}");
                x[i] = right;
            }
        }
    }
}
