//! Isotropic laws in plane strain: energy as a function of e and d, with derivatives.

use super::Real;
use super::three::{Invariants, Isotropic};

/// First partial derivatives of W(e, d).
#[derive(Debug, Clone, Copy)]
pub struct PlaneSlope<R> {
    /// ∂W/∂e.
    pub e: R,
    /// ∂W/∂d.
    pub d: R,
}

/// Second partial derivatives of W(e, d).
#[derive(Debug, Clone, Copy)]
pub struct PlaneCurvature<R> {
    /// ∂²W/∂e².
    pub ee: R,
    /// ∂²W/∂e∂d.
    pub ed: R,
    /// ∂²W/∂d².
    pub dd: R,
}

/// Energy W(e, d); the [parent module](super) defines e and d.
///
/// The functions are evaluated on vector registers, so they must be inlined and must not branch on
/// values.
pub(crate) trait Potential {
    /// Whether strains are finite (d = J − 1) or small (d = div u).
    const FINITE: bool;

    /// Whether W includes the volumetric part, so that κ is not added.
    const COMPLETE: bool = false;

    fn energy(&self, e: f64, d: f64) -> f64;
    fn first<R: Real>(&self, e: R, d: R) -> PlaneSlope<R>;
    fn second<R: Real>(&self, e: R, d: R) -> PlaneCurvature<R>;
}

/// Returns the invariants in plane strain: a = e and b = e + d².
#[inline(always)]
pub(crate) fn plane_invariants<R: Real>(e: R, d: R) -> Invariants<R> {
    let b = d.mul_add(d, e);
    Invariants { a: e, b, d }
}

impl<W: Isotropic> Potential for W {
    const FINITE: bool = true;
    const COMPLETE: bool = W::COMPLETE;

    fn energy(&self, e: f64, d: f64) -> f64 {
        Isotropic::energy(self, plane_invariants(e, d))
    }

    #[inline(always)]
    fn first<R: Real>(&self, e: R, d: R) -> PlaneSlope<R> {
        self.plane_slope(e, d)
    }

    #[inline(always)]
    fn second<R: Real>(&self, e: R, d: R) -> PlaneCurvature<R> {
        self.plane_curvature(e, d)
    }
}
