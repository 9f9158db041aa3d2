//! Green strain in the fiber axes, and its derivatives with respect to F.
//!
//! ```text
//! E_xy = x·E y,    ∂E_xy/∂F = (F x⊗y + F y⊗x)/2,    ∂²E_xy/∂F² : (i, J), (k, L) → δ_ik (x_J y_L + y_J x_L)/2
//! ```

use super::super::Real;
use super::strain::Strain3;
use super::tensor::{Symmetric3, Tensor3Of, scaled3, trace3};

/// Axes of the six strains ff, ss, nn, sn, fn, fs.
const PAIRS: [[usize; 2]; 6] = [[0, 0], [1, 1], [2, 2], [1, 2], [0, 2], [0, 1]];

/// Green strain E_xy of two unit vectors, with the quantities that occur in its derivatives.
#[derive(Debug, Clone, Copy)]
pub struct FiberStrain<R> {
    /// Strain E_xy.
    pub value: R,
    /// Derivative ∂E_xy/∂F.
    pub gradient: Tensor3Of<R>,
    /// Dyad (x⊗y + y⊗x)/2.
    dyad: Tensor3Of<R>,
}

impl<R: Real> FiberStrain<R> {
    /// Creates the strain of the unit vectors `x` and `y`.
    #[inline(always)]
    pub fn new(strain: &Strain3<R>, x: [R; 3], y: [R; 3]) -> Self {
        Self {
            value: strain.green_along(x, y),
            gradient: symmetric_dyad(strain.push(x), y, strain.push(y), x),
            dyad: symmetric_dyad(x, y, y, x),
        }
    }

    /// Creates the mean strain of fibers dispersed about the unit vector `x`: (1 − 3κ) E_xx + κ tr E.
    #[inline(always)]
    pub fn dispersed(strain: &Strain3<R>, x: [R; 3], dispersion: f64) -> Self {
        let mut out = Self::new(strain, x, x);
        if dispersion != 0.0 {
            let (aligned, isotropic) = (1.0 - 3.0 * dispersion, out.value.like(dispersion));
            out.value = out.value * aligned + trace3(&strain.green) * isotropic;
            for i in 0..3 {
                for j in 0..3 {
                    out.gradient[i][j] =
                        strain.f[i][j].mul_add(isotropic, out.gradient[i][j] * aligned);
                    out.dyad[i][j] = out.dyad[i][j] * aligned;
                }
                out.dyad[i][i] = out.dyad[i][i] + isotropic;
            }
        }
        out
    }

    /// Adds `slope` ∂²E_xy/∂F² to a tangent.
    #[inline(always)]
    pub fn add_slope(&self, out: &mut Symmetric3<R>, slope: R) {
        let mut dyad = self.dyad;
        for row in &mut dyad {
            for entry in row {
                *entry = slope * *entry;
            }
        }
        out.add_geometric(&dyad);
    }
}

/// Six Green strains in the fiber axes: ff, ss, nn, sn, fn, fs.
#[derive(Debug, Clone, Copy)]
pub struct FiberStrains<R> {
    /// Values of the strains.
    pub values: [R; 6],
    axes: [[R; 3]; 3],
    /// Deformed axes F f0, F s0 and F n0.
    times_deformation: [[R; 3]; 3],
}

impl<R: Real> FiberStrains<R> {
    /// Creates the strains at a point.
    #[inline(always)]
    pub fn new(strain: &Strain3<R>) -> Self {
        let axes = [strain.axes.fiber, strain.axes.sheet, strain.axes.normal()];
        let mut values = [strain.d; 6];
        for (value, [x, y]) in values.iter_mut().zip(PAIRS) {
            *value = strain.green_along(axes[x], axes[y]);
        }
        let times_deformation = [strain.push(axes[0]), strain.push(axes[1]), strain.push(axes[2])];
        Self { values, axes, times_deformation }
    }

    /// Returns the derivative ∂E_xy/∂F of one strain.
    #[inline(always)]
    fn gradient(&self, [x, y]: [usize; 2]) -> Tensor3Of<R> {
        symmetric_dyad(
            self.times_deformation[x],
            self.axes[y],
            self.times_deformation[y],
            self.axes[x],
        )
    }

    /// Returns Σ slope ∂E_xy/∂F = F S with the symmetric tensor S = Σ slope (x⊗y + y⊗x)/2.
    #[inline(always)]
    pub fn combine(&self, slopes: &[R; 6]) -> Tensor3Of<R> {
        self.sum(&self.times_deformation, slopes)
    }

    /// Adds Σ slope ∂²E_xy/∂F².
    #[inline(always)]
    pub fn add_slopes(&self, out: &mut Symmetric3<R>, slopes: &[R; 6]) {
        out.add_geometric(&self.sum(&self.axes, slopes));
    }

    /// Adds Σ curvature ∂E_xy/∂F⊗∂E_xy/∂F.
    #[inline(always)]
    pub fn add_curvatures(&self, out: &mut Symmetric3<R>, curvatures: &[R; 6]) {
        for (curvature, pair) in curvatures.iter().zip(PAIRS) {
            out.add_square(*curvature, &self.gradient(pair));
        }
    }

    /// Adds `weight` (∂a/∂F⊗∂b/∂F + ∂b/∂F⊗∂a/∂F) for two strains a and b, given by their indices.
    #[inline(always)]
    pub fn add_coupling(&self, out: &mut Symmetric3<R>, weight: R, [a, b]: [usize; 2]) {
        let (a, b) = (self.gradient(PAIRS[a]), self.gradient(PAIRS[b]));
        out.add_pair(&scaled3(weight, &a), &b);
    }

    /// Returns Σ slope (l_x⊗y + l_y⊗x)/2.
    #[inline(always)]
    fn sum(&self, left: &[[R; 3]; 3], slopes: &[R; 6]) -> Tensor3Of<R> {
        let [ff, ss, nn, sn, fn_, fs] = *slopes;
        let (sn, fn_, fs) = (sn * 0.5, fn_ * 0.5, fs * 0.5);
        let in_axes = [[ff, fs, fn_], [fs, ss, sn], [fn_, sn, nn]];
        let mut out = [[ff.like(0.0); 3]; 3];
        for (left, row) in left.iter().zip(&in_axes) {
            // The sum Σ_y S_xy y.
            let mut right = [ff.like(0.0); 3];
            for (weight, axis) in row.iter().zip(&self.axes) {
                for (entry, axis) in right.iter_mut().zip(axis) {
                    *entry = weight.mul_add(*axis, *entry);
                }
            }
            for (out, left) in out.iter_mut().zip(left) {
                for (entry, right) in out.iter_mut().zip(&right) {
                    *entry = left.mul_add(*right, *entry);
                }
            }
        }
        out
    }
}

/// Returns (a⊗b + c⊗d)/2.
#[inline(always)]
fn symmetric_dyad<R: Real>(a: [R; 3], b: [R; 3], c: [R; 3], d: [R; 3]) -> Tensor3Of<R> {
    let mut out = [a, a, a];
    for (i, row) in out.iter_mut().enumerate() {
        for (j, entry) in row.iter_mut().enumerate() {
            *entry = a[i].mul_add(b[j], c[i] * d[j]) * 0.5;
        }
    }
    out
}
