//! Deformation at a point in 3D, and quantities that all laws share.
//!
//! ```text
//! d = J − 1 = tr H + tr cof H + det H,    N = ∂d/∂F = cof F,    E = sym H + Hᵀ H / 2
//! ```
//!
//! with H = ∇u are sums of small terms near rest. For small strains, `F = I`, `d = tr H`, `N = I` and `E = sym H`,
//! so formulas in F, E, d and N apply to finite and small strains.

use super::super::tensor::VolumeFunction;
use super::super::{Dual, Real};
use super::tensor::{Tensor3Of, cofactor3, gram3, trace3};

/// Undeformed fiber and sheet directions, which are orthogonal unit vectors. The third axis is their cross
/// product.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Axes<R> {
    /// Fiber direction f0.
    pub fiber: [R; 3],
    /// Sheet direction s0.
    pub sheet: [R; 3],
}

impl<R: Real> Axes<R> {
    /// Returns axes along the first two coordinates, with the number type of `like`.
    #[inline(always)]
    pub fn cartesian(like: R) -> Self {
        let (one, zero) = (like.like(1.0), like.like(0.0));
        Self { fiber: [one, zero, zero], sheet: [zero, one, zero] }
    }

    /// Returns the sheet normal n0 = f0 × s0.
    #[inline(always)]
    pub fn normal(&self) -> [R; 3] {
        let (f, s) = (self.fiber, self.sheet);
        [
            f[1].mul_add(s[2], -(f[2] * s[1])),
            f[2].mul_add(s[0], -(f[0] * s[2])),
            f[0].mul_add(s[1], -(f[1] * s[0])),
        ]
    }

    /// Returns the axes as dual numbers with zero derivative.
    #[inline(always)]
    pub(crate) fn constant(&self) -> Axes<Dual<R>> {
        let [f, s] = [self.fiber, self.sheet];
        Axes {
            fiber: [Dual::constant(f[0]), Dual::constant(f[1]), Dual::constant(f[2])],
            sheet: [Dual::constant(s[0]), Dual::constant(s[1]), Dual::constant(s[2])],
        }
    }
}

/// Deformation at a point.
#[derive(Debug, Clone, Copy)]
pub struct Strain3<R> {
    pub(super) h: Tensor3Of<R>,
    /// Deformation gradient F, or I for small strains.
    pub f: Tensor3Of<R>,
    /// Green strain E, or sym ∇u for small strains.
    pub green: Tensor3Of<R>,
    /// Volume change d = J − 1, or div u for small strains.
    pub d: R,
    /// Cofactor N = ∂d/∂F: cof F, or I for small strains.
    pub cofactor: Tensor3Of<R>,
    /// The difference N − I.
    pub(super) cofactor_change: Tensor3Of<R>,
    /// Invariant I1 − 3 − 2 d. It is zero and not used for small strains.
    pub(super) a: R,
    /// Fiber and sheet directions.
    pub axes: Axes<R>,
    /// Factor of the energy W. `None` means one.
    pub(crate) factor: Option<R>,
    pub(crate) volume_function: VolumeFunction,
}

impl<R: Real> Strain3<R> {
    /// Creates the finite or small strain at `h` = ∇u.
    #[inline(always)]
    pub(super) fn at(h: Tensor3Of<R>, axes: Axes<R>, is_finite: bool) -> Self {
        let trace = trace3(&h);
        let (zero, one) = (trace.like(0.0), trace.like(1.0));
        let mut f = [[zero; 3]; 3];
        let mut green = f;
        let mut cofactor_change = f;
        let (mut a, mut d) = (zero, trace);
        if is_finite {
            let (gram, cofactor) = (gram3(&h), cofactor3(&h));
            let det = h[0][2]
                .mul_add(cofactor[0][2], h[0][1].mul_add(cofactor[0][1], h[0][0] * cofactor[0][0]));
            let beyond = trace3(&cofactor) + det;
            d = trace + beyond;
            a = trace3(&gram) - beyond * 2.0;
            for i in 0..3 {
                for j in 0..3 {
                    f[i][j] = h[i][j];
                    green[i][j] = (h[i][j] + h[j][i] + gram[i][j]) * 0.5;
                    cofactor_change[i][j] = cofactor[i][j] - h[j][i];
                }
                cofactor_change[i][i] = cofactor_change[i][i] + trace;
            }
        } else {
            for i in 0..3 {
                for j in 0..3 {
                    green[i][j] = (h[i][j] + h[j][i]) * 0.5;
                }
            }
        }
        let mut cofactor = cofactor_change;
        for i in 0..3 {
            f[i][i] = f[i][i] + one;
            cofactor[i][i] = cofactor[i][i] + one;
        }
        Self {
            h,
            f,
            green,
            d,
            cofactor,
            cofactor_change,
            a,
            axes,
            factor: None,
            volume_function: VolumeFunction::Quadratic,
        }
    }

    /// Returns D = F − cof F, half the derivative of |F|² − 3 − 2 d, which vanishes at rest.
    #[inline(always)]
    pub(super) fn distortion(&self) -> Tensor3Of<R> {
        let mut out = self.h;
        for (row, change) in out.iter_mut().zip(&self.cofactor_change) {
            for (entry, change) in row.iter_mut().zip(change) {
                *entry = *entry - *change;
            }
        }
        out
    }

    /// Returns F x.
    #[inline(always)]
    pub fn push(&self, x: [R; 3]) -> [R; 3] {
        let mut out = x;
        for (out, f) in out.iter_mut().zip(&self.f) {
            *out = f[2].mul_add(x[2], f[1].mul_add(x[1], f[0] * x[0]));
        }
        out
    }

    /// Returns x·E y.
    #[inline(always)]
    pub fn green_along(&self, x: [R; 3], y: [R; 3]) -> R {
        let mut sum = x[0].like(0.0);
        for (x, green) in x.iter().zip(&self.green) {
            let along = green[2].mul_add(y[2], green[1].mul_add(y[1], green[0] * y[0]));
            sum = x.mul_add(along, sum);
        }
        sum
    }
}
