//! What a law must give: its energy as a function of e and d, with derivatives.

use super::Real;

/// ∂W/∂e and ∂W/∂d.
#[derive(Debug, Clone, Copy)]
pub(crate) struct First<R> {
    pub(crate) e: R,
    pub(crate) d: R,
}

/// The second partial derivatives of W.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Second<R> {
    pub(crate) ee: R,
    pub(crate) ed: R,
    pub(crate) dd: R,
}

/// The third partial derivatives of W.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Third<R> {
    pub(crate) eee: R,
    pub(crate) eed: R,
    pub(crate) edd: R,
    pub(crate) ddd: R,
}

impl<R: Real> Third<R> {
    /// Those of a quadratic energy, in numbers of the kind of `d`.
    #[inline(always)]
    pub(crate) fn zero(d: R) -> Self {
        let zero = d.like(0.0);
        Self {
            eee: zero,
            eed: zero,
            edd: zero,
            ddd: zero,
        }
    }
}

/// An energy W(e, d); see the [module above](super) for e and d.
///
/// The functions are called on batches: they must not branch on values, and are inlined.
pub(crate) trait Potential {
    /// Whether strains are finite (d = J − 1) or small (d = div u).
    const FINITE: bool;

    fn energy(&self, e: f64, d: f64) -> f64;
    fn first<R: Real>(&self, e: R, d: R) -> First<R>;
    fn second<R: Real>(&self, e: R, d: R) -> Second<R>;
    fn third<R: Real>(&self, e: R, d: R) -> Third<R>;
}
