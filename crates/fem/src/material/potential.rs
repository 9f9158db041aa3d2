//! What a law must give in plane strain: its energy as a function of e and d, with derivatives.

use super::Real;
use super::three::{Invariants, Isotropic};

/// ∂W/∂e and ∂W/∂d.
#[derive(Debug, Clone, Copy)]
pub struct PlaneSlope<R> {
    /// ∂W/∂e.
    pub e: R,
    /// ∂W/∂d.
    pub d: R,
}

/// The second partial derivatives of W(e, d).
#[derive(Debug, Clone, Copy)]
pub struct PlaneCurvature<R> {
    /// ∂²W/∂e².
    pub ee: R,
    /// ∂²W/∂e∂d.
    pub ed: R,
    /// ∂²W/∂d².
    pub dd: R,
}

/// An energy W(e, d); see the [module above](super) for e and d.
///
/// The functions are called on batches: they must not branch on values, and are inlined.
pub(crate) trait Potential {
    /// Whether strains are finite (d = J − 1) or small (d = div u).
    const FINITE: bool;

    /// Whether W holds the volume's part too, so that no κ is added.
    const COMPLETE: bool = false;

    fn energy(&self, e: f64, d: f64) -> f64;
    fn first<R: Real>(&self, e: R, d: R) -> PlaneSlope<R>;
    fn second<R: Real>(&self, e: R, d: R) -> PlaneCurvature<R>;
}

/// In plane strain a = e and b = e + d².
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
