//! Vector arithmetic of IDAS with the processor's vector instructions.
//!
//! A step of order 2 makes about thirty passes over vectors, each cheap, which together take a
//! third of the run time with SUNDIALS' scalar loops. Elementwise results equal the results of
//! SUNDIALS bit for bit, except for sums. Sums are split into [`LANES`] partial sums on every
//! processor, so results do not depend on the processor.

use std::mem::MaybeUninit;
use std::sync::LazyLock;

use pulp::{Arch, Simd, WithSimd};

/// Number of partial sums of a norm: four registers of AVX-512, enough to hide the latency of an
/// addition.
const LANES: usize = 32;

/// Instruction set of the processor, detected once.
static ARCH: LazyLock<Arch> = LazyLock::new(Arch::new);

/// Computes `out` ← a x + b y.
pub(crate) fn linear_sum(a: f64, x: &[f64], b: f64, y: &[f64], out: &mut [MaybeUninit<f64>]) {
    ARCH.dispatch(LinearSum { a, x, b, y, out });
}

struct LinearSum<'a> {
    a: f64,
    x: &'a [f64],
    b: f64,
    y: &'a [f64],
    out: &'a mut [MaybeUninit<f64>],
}

impl WithSimd for LinearSum<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { a, x, b, y, out } = self;
        for ((out, x), y) in out.iter_mut().zip(x).zip(y) {
            out.write(a * x + b * y);
        }
    }
}

/// Computes `y` ← a x + b y.
pub(crate) fn add_scaled(a: f64, x: &[f64], b: f64, y: &mut [f64]) {
    ARCH.dispatch(AddScaled { a, x, b, y });
}

struct AddScaled<'a> {
    a: f64,
    x: &'a [f64],
    b: f64,
    y: &'a mut [f64],
}

impl WithSimd for AddScaled<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { a, x, b, y } = self;
        for (y, x) in y.iter_mut().zip(x) {
            *y = a * x + b * *y;
        }
    }
}

/// Computes `out` ← c x.
pub(crate) fn scale(c: f64, x: &[f64], out: &mut [MaybeUninit<f64>]) {
    ARCH.dispatch(Scale { c, x, out });
}

struct Scale<'a> {
    c: f64,
    x: &'a [f64],
    out: &'a mut [MaybeUninit<f64>],
}

impl WithSimd for Scale<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        for (out, x) in self.out.iter_mut().zip(self.x) {
            out.write(self.c * x);
        }
    }
}

/// Computes `x` ← c x.
pub(crate) fn scale_in_place(c: f64, x: &mut [f64]) {
    ARCH.dispatch(ScaleInPlace { c, x });
}

struct ScaleInPlace<'a> {
    c: f64,
    x: &'a mut [f64],
}

impl WithSimd for ScaleInPlace<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        for x in self.x {
            *x *= self.c;
        }
    }
}

/// Computes `x` ← |x|.
pub(crate) fn absolute_in_place(x: &mut [f64]) {
    ARCH.dispatch(AbsoluteInPlace { x });
}

struct AbsoluteInPlace<'a> {
    x: &'a mut [f64],
}

impl WithSimd for AbsoluteInPlace<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        for x in self.x {
            *x = x.abs();
        }
    }
}

/// Computes `x` ← 1/x.
pub(crate) fn invert_in_place(x: &mut [f64]) {
    ARCH.dispatch(InvertInPlace { x });
}

struct InvertInPlace<'a> {
    x: &'a mut [f64],
}

impl WithSimd for InvertInPlace<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        for x in self.x {
            *x = 1.0 / *x;
        }
    }
}

/// Returns whether no entry is infinite or NaN.
pub(crate) fn is_finite(x: &[f64]) -> bool {
    ARCH.dispatch(IsFinite { x })
}

struct IsFinite<'a> {
    x: &'a [f64],
}

impl WithSimd for IsFinite<'_> {
    type Output = bool;

    /// Has no early exit, which would prevent vectorization.
    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> bool {
        self.x.iter().fold(true, |all, x| all & x.is_finite())
    }
}

/// Returns whether all entries are positive and finite.
pub(crate) fn is_positive(x: &[f64]) -> bool {
    ARCH.dispatch(IsPositive { x })
}

struct IsPositive<'a> {
    x: &'a [f64],
}

impl WithSimd for IsPositive<'_> {
    type Output = bool;

    /// Computes a sum that is 0 only for such entries: with two comparisons per entry the compiler
    /// produces scalar code.
    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> bool {
        let nothing = |x: f64| if x > 0.0 { x * 0.0 } else { f64::NAN };
        let mut sums = [0.0; LANES];
        let (x, rest) = self.x.as_chunks::<LANES>();
        for x in x {
            for l in 0..LANES {
                sums[l] += nothing(x[l]);
            }
        }
        sums.iter().sum::<f64>() + rest.iter().map(|&x| nothing(x)).sum::<f64>() == 0.0
    }
}

/// Returns √(Σ (x w)² / n) over all n entries.
pub(crate) fn weighted_rms(x: &[f64], w: &[f64]) -> f64 {
    root_mean(ARCH.dispatch(WeightedSquares { x, w }), x.len())
}

struct WeightedSquares<'a> {
    x: &'a [f64],
    w: &'a [f64],
}

impl WithSimd for WeightedSquares<'_> {
    type Output = f64;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> f64 {
        let mut sums = [0.0; LANES];
        let (x, x_rest) = self.x.as_chunks::<LANES>();
        let (w, w_rest) = self.w.as_chunks::<LANES>();
        let last = (&with_zeros(x_rest), &with_zeros(w_rest));
        for (x, w) in x.iter().zip(w).chain([last]) {
            for l in 0..LANES {
                let product = x[l] * w[l];
                sums[l] += product * product;
            }
        }
        sums.iter().sum()
    }
}

/// Pads the remainder to a full chunk: with a separate loop for the remainder, the compiler
/// produces scalar code for the whole sum, four times slower.
#[inline(always)]
fn with_zeros(rest: &[f64]) -> [f64; LANES] {
    let mut chunk = [0.0; LANES];
    chunk[..rest.len()].copy_from_slice(rest);
    chunk
}

/// Returns √(Σ (x w)² / n), summed over the entries with a positive `id`, where n is the number of
/// all entries.
pub(crate) fn weighted_rms_masked(x: &[f64], w: &[f64], id: &[f64]) -> f64 {
    root_mean(ARCH.dispatch(MaskedSquares { x, w, id }), x.len())
}

struct MaskedSquares<'a> {
    x: &'a [f64],
    w: &'a [f64],
    id: &'a [f64],
}

impl WithSimd for MaskedSquares<'_> {
    type Output = f64;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> f64 {
        // A selection instead of a product: excluded entries may be infinite.
        let square = |x: f64, w: f64, id: f64| {
            let product = if id > 0.0 { x * w } else { 0.0 };
            product * product
        };
        let mut sums = [0.0; LANES];
        let (x, x_rest) = self.x.as_chunks::<LANES>();
        let (w, w_rest) = self.w.as_chunks::<LANES>();
        let (id, id_rest) = self.id.as_chunks::<LANES>();
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
}

fn root_mean(sum: f64, n: usize) -> f64 {
    (sum / n as f64).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// At every position, in full chunks and in the remainder.
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
