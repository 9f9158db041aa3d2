//! The arithmetic IDAS does on vectors, with the vector instructions the processor has.
//!
//! A step of order 2 makes some thirty passes over vectors, each cheap and together a third of the
//! time of a run with SUNDIALS' scalar loops. Elementwise results are those of SUNDIALS to the
//! last bit but for sums; sums are taken in [`LANES`] parts whatever the processor, so that all
//! processors agree.

use std::mem::MaybeUninit;
use std::sync::LazyLock;

use pulp::{Arch, Simd, WithSimd};

/// Partial sums of a norm: four registers of AVX-512, enough to hide the latency of an addition.
const LANES: usize = 32;

/// What the processor can do, asked once.
static ARCH: LazyLock<Arch> = LazyLock::new(Arch::new);

/// `out` ← a x + b y.
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

/// `y` ← a x + b y.
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

/// `out` ← c x.
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

/// `x` ← c x.
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

/// `x` ← |x|.
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

/// `x` ← 1/x.
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

/// Whether no entry is infinite or not a number.
pub(crate) fn is_finite(x: &[f64]) -> bool {
    ARCH.dispatch(IsFinite { x })
}

struct IsFinite<'a> {
    x: &'a [f64],
}

impl WithSimd for IsFinite<'_> {
    type Output = bool;

    /// Without a way out on the way, which would keep it scalar.
    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> bool {
        self.x.iter().fold(true, |all, x| all & x.is_finite())
    }
}

/// Whether all entries are positive and none is infinite or not a number.
pub(crate) fn is_positive(x: &[f64]) -> bool {
    ARCH.dispatch(IsPositive { x })
}

struct IsPositive<'a> {
    x: &'a [f64],
}

impl WithSimd for IsPositive<'_> {
    type Output = bool;

    /// By a sum that is 0 of such entries only: the compiler makes two comparisons of an entry one
    /// of its bits, which is scalar.
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

/// √(Σ (x w)² / n), over all n entries.
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

/// What is behind the whole chunks, as one more: with a loop of its own for it the compiler makes all of
/// this sum scalar, four times slower.
#[inline(always)]
fn with_zeros(rest: &[f64]) -> [f64; LANES] {
    let mut chunk = [0.0; LANES];
    chunk[..rest.len()].copy_from_slice(rest);
    chunk
}

/// √(Σ (x w)² / n), the sum over the entries with a positive `id`, n the number of all.
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
        // A choice and not a product: what is left out may be infinite.
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

    /// At every place, in whole chunks and behind them.
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
