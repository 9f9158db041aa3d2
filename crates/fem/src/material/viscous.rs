//! Kelvin–Voigt damping: `S_v = η Ė`, `P = F S_v`, with the dissipation η Ė:Ė.
//!
//! The functions apply in 2D and 3D. In plane strain, F33 = 1 does not contribute.

use super::Real;
use super::active::{apply, dot};

/// Viscous stress at a point for given F, V = ∇v and viscosity η.
#[derive(Debug, Clone, Copy)]
pub struct Viscous<R, const D: usize> {
    f: [[R; D]; D],
    v: [[R; D]; D],
    /// Second Piola–Kirchhoff stress S_v.
    stress: [[R; D]; D],
    eta: R,
}

impl<R: Real, const D: usize> Viscous<R, D> {
    /// Creates the viscous stress at `f` = F and `v` = ∇v.
    ///
    /// # Units
    /// `eta` is in Pa·s.
    #[inline(always)]
    pub fn new(f: [[R; D]; D], v: [[R; D]; D], eta: R) -> Self {
        let mut stress = f;
        for i in 0..D {
            for j in i..D {
                // Ė = sym Fᵀ V
                let mut sum = eta.like(0.0);
                for (f, v) in f.iter().zip(&v) {
                    sum = f[i].mul_add(v[j], f[j].mul_add(v[i], sum));
                }
                stress[i][j] = eta * sum * 0.5;
                stress[j][i] = stress[i][j];
            }
        }
        Self { f, v, stress, eta }
    }

    /// Returns P = F S_v.
    #[inline(always)]
    pub fn stress(&self) -> [[R; D]; D] {
        let mut out = self.f;
        for (row, f) in out.iter_mut().zip(&self.f) {
            for (j, entry) in row.iter_mut().enumerate() {
                let mut sum = self.eta.like(0.0);
                for (f, stress) in f.iter().zip(&self.stress) {
                    sum = f.mul_add(stress[j], sum);
                }
                *entry = sum;
            }
        }
        out
    }

    /// Returns the derivatives of P.
    #[inline(always)]
    pub fn tangents(&self) -> ViscousTangents<R, D> {
        let half = self.eta * 0.5;
        let mut tangents = ViscousTangents {
            f: self.f,
            v: self.v,
            stress: self.stress,
            half,
            f_f: self.f,
            f_v: self.v,
        };
        for i in 0..D {
            for k in 0..D {
                tangents.f_f[i][k] = half * dot(self.f[i], self.f[k]);
                tangents.f_v[i][k] = half * dot(self.f[i], self.v[k]);
            }
        }
        tangents
    }

    /// Returns the dissipation η Ė:Ė per reference volume.
    #[inline(always)]
    pub fn dissipation(&self) -> R {
        let mut sum = self.eta.like(0.0);
        for row in &self.stress {
            for entry in row {
                sum = entry.mul_add(*entry, sum);
            }
        }
        sum / self.eta
    }
}

/// Derivatives of P contracted with two vectors a and b, which are gradients of shape functions. With the
/// components (i, k),
///
/// ```text
/// ∂P/∂F = δ_ik S_JL + η/2 (F_iL V_kJ + (F Vᵀ)_ik δ_JL)      (not symmetric)
/// ∂P/∂V = η/2 (F_iL F_kJ + (F Fᵀ)_ik δ_JL)
/// ```
#[derive(Debug, Clone, Copy)]
pub struct ViscousTangents<R, const D: usize> {
    f: [[R; D]; D],
    v: [[R; D]; D],
    stress: [[R; D]; D],
    /// Half viscosity η/2.
    half: R,
    /// Tensor η/2 F Fᵀ.
    f_f: [[R; D]; D],
    /// Tensor η/2 F Vᵀ.
    f_v: [[R; D]; D],
}

impl<R: Real, const D: usize> ViscousTangents<R, D> {
    /// Returns the products of a vector from which the derivatives are computed.
    #[inline(always)]
    pub fn products(&self, a: [R; D]) -> GradientProducts<R, D> {
        let mut half = a;
        for a in &mut half {
            *a = *a * self.half;
        }
        GradientProducts {
            vector: a,
            f_half: apply(&self.f, half),
            by_v: apply(&self.v, a),
            unscaled: apply(&self.f, a),
            by_stress: apply(&self.stress, a),
        }
    }

    /// Returns a·∂P/∂F·b.
    #[inline(always)]
    pub fn by_displacement(
        &self,
        a: &GradientProducts<R, D>,
        b: &GradientProducts<R, D>,
    ) -> [[R; D]; D] {
        let mut out = pairing(&self.f_v, a.by_v, a, b);
        let geometric = dot(a.vector, b.by_stress);
        for (i, row) in out.iter_mut().enumerate() {
            row[i] = row[i] + geometric;
        }
        out
    }

    /// Returns a·∂P/∂V·b.
    #[inline(always)]
    pub fn by_velocity(
        &self,
        a: &GradientProducts<R, D>,
        b: &GradientProducts<R, D>,
    ) -> [[R; D]; D] {
        pairing(&self.f_f, a.unscaled, a, b)
    }
}

/// Returns η/2 (F b)_i (X a)_k + (η/2 F Xᵀ)_ik a·b.
#[inline(always)]
fn pairing<R: Real, const D: usize>(
    f_x: &[[R; D]; D],
    x_a: [R; D],
    a: &GradientProducts<R, D>,
    b: &GradientProducts<R, D>,
) -> [[R; D]; D] {
    let product = dot(a.vector, b.vector);
    let mut out = *f_x;
    for (row, f_b) in out.iter_mut().zip(b.f_half) {
        for (entry, x_a) in row.iter_mut().zip(x_a) {
            *entry = product.mul_add(*entry, f_b * x_a);
        }
    }
    out
}

/// Vector a and its products with tensors.
#[derive(Debug, Clone, Copy)]
pub struct GradientProducts<R, const D: usize> {
    vector: [R; D],
    /// Product η/2 F a.
    f_half: [R; D],
    /// Product V a.
    by_v: [R; D],
    /// Product F a.
    unscaled: [R; D],
    /// Product S_v a.
    by_stress: [R; D],
}

#[cfg(test)]
mod tests {
    use super::Viscous;

    const F: [[f64; 3]; 3] = [[1.1, 0.2, -0.1], [-0.1, 0.95, 0.2], [0.05, -0.2, 1.1]];
    const V: [[f64; 3]; 3] = [[0.3, -0.8, 0.4], [0.5, 0.9, -0.2], [-0.6, 0.1, -0.7]];
    const ETA: f64 = 100.0;

    #[test]
    fn derivatives_match_central_differences() {
        let point = Viscous::new(F, V, ETA);
        let tangents = point.tangents();
        let axes = [0, 1, 2].map(|j| {
            let mut axis = [0.0; 3];
            axis[j] = 1.0;
            tangents.products(axis)
        });
        let step = 1e-3;
        for k in 0..3 {
            for l in 0..3 {
                let shift = |t: [[f64; 3]; 3], step: f64| {
                    let mut t = t;
                    t[k][l] += step;
                    t
                };
                let plus = Viscous::new(shift(F, step), V, ETA).stress();
                let minus = Viscous::new(shift(F, -step), V, ETA).stress();
                let faster = Viscous::new(F, shift(V, step), ETA).stress();
                let slower = Viscous::new(F, shift(V, -step), ETA).stress();
                for j in 0..3 {
                    let by_u = tangents.by_displacement(&axes[j], &axes[l]);
                    let by_v = tangents.by_velocity(&axes[j], &axes[l]);
                    for i in 0..3 {
                        // P is quadratic in F and V, so central differences are exact up to
                        // rounding.
                        let f_half = (plus[i][j] - minus[i][j]) / (2.0 * step);
                        assert!((by_u[i][k] - f_half).abs() < 1e-11 * ETA / step);
                        let by_rate = (faster[i][j] - slower[i][j]) / (2.0 * step);
                        assert!((by_v[i][k] - by_rate).abs() < 1e-11 * ETA / step);
                    }
                }
            }
        }
    }

    #[test]
    fn stress_matches_closed_forms_of_stretch_and_shear() {
        // Under a stretch, P_11 = η λ² λ̇.
        let diagonal = |x: f64, y: f64| [[x, 0.0, 0.0], [0.0, y, 0.0], [0.0, 0.0, y]];
        let (stretch, rate) = (1.3_f64, 0.7);
        let f = diagonal(stretch, stretch.powf(-0.5));
        let v = diagonal(rate, -0.5 * stretch.powf(-1.5) * rate);
        let found = Viscous::new(f, v, ETA).stress()[0][0];
        assert!((found - ETA * stretch * stretch * rate).abs() < 1e-12 * ETA);
        // In simple shear, Ė_12 = γ̇/2 and Ė_22 = γ γ̇, so P_12 = η γ̇ (1/2 + γ²) and P_11 = η γ γ̇/2.
        let gamma = 0.4;
        let shear = [[1.0, gamma, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let shear_rate = [[0.0, rate, 0.0], [0.0; 3], [0.0; 3]];
        let found = Viscous::new(shear, shear_rate, ETA).stress();
        assert!((found[0][1] - ETA * rate * (0.5 + gamma * gamma)).abs() < 1e-12 * ETA);
        assert!((found[0][0] - ETA * rate * 0.5 * gamma).abs() < 1e-12 * ETA);
    }

    #[test]
    fn power_equals_dissipation() {
        let point = Viscous::new(F, V, ETA);
        let stress = point.stress();
        let power: f64 = (0..9).map(|r| stress[r / 3][r % 3] * V[r / 3][r % 3]).sum();
        assert!((power - point.dissipation()).abs() < 1e-12 * power);
        // A spin V = Ω F with a skew Ω does no work.
        let omega = [[0.0, 0.4, -0.3], [-0.4, 0.0, 0.2], [0.3, -0.2, 0.0]];
        let spin =
            [0, 1, 2].map(|i| [0, 1, 2].map(|j| (0..3).map(|k| omega[i][k] * F[k][j]).sum()));
        assert!(Viscous::new(F, spin, ETA).dissipation() < 1e-28 * ETA);
    }

    #[test]
    fn plane_stress_components_match_3d_without_out_of_plane_strain() {
        let (f, v) = ([[1.1, 0.2], [-0.1, 0.95]], [[0.3, -0.8], [0.5, 0.9]]);
        let embed = |[[a, b], [c, d]]: [[f64; 2]; 2], e| [[a, b, 0.0], [c, d, 0.0], [0.0, 0.0, e]];
        let plane = Viscous::new(f, v, ETA).stress();
        let space = Viscous::new(embed(f, 1.0), embed(v, 0.0), ETA).stress();
        for i in 0..2 {
            for j in 0..2 {
                assert_eq!(plane[i][j], space[i][j]);
            }
        }
    }
}
