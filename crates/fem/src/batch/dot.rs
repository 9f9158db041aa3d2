//! Products of short vectors, in an order of sums that is fixed.

use crate::material::Real;

/// Σ a_j b_j, the last product rounded first.
#[inline(always)]
pub(crate) fn dot<R: Real, const D: usize>(a: &[R; D], b: &[R; D]) -> R {
    let mut sum = a[D - 1] * b[D - 1];
    for j in (0..D - 1).rev() {
        sum = a[j].mul_add(b[j], sum);
    }
    sum
}

/// `sum` + Σ a_j g_j for numbers g, the last product added first.
#[inline(always)]
pub(crate) fn add_dot<R: Real, const D: usize>(a: &[R; D], g: &[f64; D], mut sum: R) -> R {
    for j in (0..D).rev() {
        sum = a[j].mul_add(sum.like(g[j]), sum);
    }
    sum
}
