//! Sums over short vectors and tensors in a fixed order.

use crate::material::Real;

/// Returns Σ a_j b_j. The last product is rounded first.
#[inline(always)]
pub(crate) fn dot<R: Real, const D: usize>(a: &[R; D], b: &[R; D]) -> R {
    let mut sum = a[D - 1] * b[D - 1];
    for j in (0..D - 1).rev() {
        sum = a[j].mul_add(b[j], sum);
    }
    sum
}

/// Returns Σ a_j g_j for numbers g. The last product is rounded first.
#[inline(always)]
pub(crate) fn dot_numbers<R: Real, const D: usize>(a: &[R; D], g: &[f64; D]) -> R {
    let mut sum = a[D - 1] * g[D - 1];
    for j in (0..D - 1).rev() {
        sum = a[j].mul_add(sum.like(g[j]), sum);
    }
    sum
}

/// Returns `sum` + Σ a_j g_j for numbers g. The last product is added first.
#[inline(always)]
pub(crate) fn add_dot<R: Real, const D: usize>(a: &[R; D], g: &[f64; D], mut sum: R) -> R {
    for j in (0..D).rev() {
        sum = a[j].mul_add(sum.like(g[j]), sum);
    }
    sum
}

/// Adds `factor` · `tensor` to `sum`.
#[inline(always)]
pub(crate) fn add_scaled<R: Real, const D: usize>(
    sum: &mut [[R; D]; D],
    factor: R,
    tensor: &[[R; D]; D],
) {
    for (sum, row) in sum.iter_mut().zip(tensor) {
        for (sum, entry) in sum.iter_mut().zip(row) {
            *sum = factor.mul_add(*entry, *sum);
        }
    }
}
