//! Kelvin–Voigt damping: `S_v = η Ė`, `P = F S_v`, dissipation η Ė:Ė.
//!
//! The functions hold in the plane and in space: in plane strain F33 = 1 adds nothing.

use super::Real;
use super::active::{apply, dot};

/// F and V = ∇v at a point with viscosity η.
#[derive(Debug, Clone, Copy)]
pub struct Viscous<R, const D: usize> {
    f: [[R; D]; D],
    v: [[R; D]; D],
    /// S_v.
    stress: [[R; D]; D],
    eta: R,
}

impl<R: Real, const D: usize> Viscous<R, D> {
    /// The damping at `f` = F, `v` = ∇v.
    ///
    /// # Units
    /// η in Pa·s.
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

    /// P = F S_v.
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

    /// The derivatives of P.
    #[inline(always)]
    pub fn slopes(&self) -> ViscousSlopes<R, D> {
        let half = self.eta * 0.5;
        let mut slopes = ViscousSlopes {
            f: self.f,
            v: self.v,
            stress: self.stress,
            half,
            f_f: self.f,
            f_v: self.v,
        };
        for i in 0..D {
            for k in 0..D {
                slopes.f_f[i][k] = half * dot(self.f[i], self.f[k]);
                slopes.f_v[i][k] = half * dot(self.f[i], self.v[k]);
            }
        }
        slopes
    }

    /// η Ė:Ė, the dissipation per reference volume.
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

/// The derivatives of P between two vectors, gradients of shape functions: with a, b and in the
/// components (i, k)
///
/// ```text
/// ∂P/∂F = δ_ik S_JL + η/2 (F_iL V_kJ + (F Vᵀ)_ik δ_JL)      (not symmetric)
/// ∂P/∂V = η/2 (F_iL F_kJ + (F Fᵀ)_ik δ_JL)
/// ```
#[derive(Debug, Clone, Copy)]
pub struct ViscousSlopes<R, const D: usize> {
    f: [[R; D]; D],
    v: [[R; D]; D],
    stress: [[R; D]; D],
    /// η/2.
    half: R,
    /// η/2 F Fᵀ.
    f_f: [[R; D]; D],
    /// η/2 F Vᵀ.
    f_v: [[R; D]; D],
}

impl<R: Real, const D: usize> ViscousSlopes<R, D> {
    /// What the derivatives ask of a vector.
    #[inline(always)]
    pub fn spread(&self, a: [R; D]) -> Spread<R, D> {
        let mut half = a;
        for a in &mut half {
            *a = *a * self.half;
        }
        Spread {
            itself: a,
            by_f: apply(&self.f, half),
            by_v: apply(&self.v, a),
            unscaled: apply(&self.f, a),
            by_stress: apply(&self.stress, a),
        }
    }

    /// a·∂P/∂F·b.
    #[inline(always)]
    pub fn by_displacement(&self, a: &Spread<R, D>, b: &Spread<R, D>) -> [[R; D]; D] {
        let mut out = pairing(&self.f_v, a.by_v, a, b);
        let geometric = dot(a.itself, b.by_stress);
        for (i, row) in out.iter_mut().enumerate() {
            row[i] = row[i] + geometric;
        }
        out
    }

    /// a·∂P/∂V·b.
    #[inline(always)]
    pub fn by_velocity(&self, a: &Spread<R, D>, b: &Spread<R, D>) -> [[R; D]; D] {
        pairing(&self.f_f, a.unscaled, a, b)
    }
}

/// η/2 (F b)_i (X a)_k + (η/2 F Xᵀ)_ik a·b.
#[inline(always)]
fn pairing<R: Real, const D: usize>(
    f_x: &[[R; D]; D],
    x_a: [R; D],
    a: &Spread<R, D>,
    b: &Spread<R, D>,
) -> [[R; D]; D] {
    let along = dot(a.itself, b.itself);
    let mut out = *f_x;
    for (row, f_b) in out.iter_mut().zip(b.by_f) {
        for (entry, x_a) in row.iter_mut().zip(x_a) {
            *entry = along.mul_add(*entry, f_b * x_a);
        }
    }
    out
}

/// A vector a with its products.
#[derive(Debug, Clone, Copy)]
pub struct Spread<R, const D: usize> {
    itself: [R; D],
    /// η/2 F a.
    by_f: [R; D],
    /// V a.
    by_v: [R; D],
    /// F a.
    unscaled: [R; D],
    /// S_v a.
    by_stress: [R; D],
}

#[cfg(test)]
mod tests {
    use super::Viscous;

    const F: [[f64; 3]; 3] = [[1.1, 0.2, -0.1], [-0.1, 0.95, 0.2], [0.05, -0.2, 1.1]];
    const V: [[f64; 3]; 3] = [[0.3, -0.8, 0.4], [0.5, 0.9, -0.2], [-0.6, 0.1, -0.7]];
    const ETA: f64 = 100.0;

    #[test]
    fn derivatives_are_those_of_the_stress() {
        let point = Viscous::new(F, V, ETA);
        let slopes = point.slopes();
        let axes = [0, 1, 2].map(|j| {
            let mut axis = [0.0; 3];
            axis[j] = 1.0;
            slopes.spread(axis)
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
                    let by_u = slopes.by_displacement(&axes[j], &axes[l]);
                    let by_v = slopes.by_velocity(&axes[j], &axes[l]);
                    for i in 0..3 {
                        // A quadratic in F and V: central differences are exact but for rounding.
                        let by_f = (plus[i][j] - minus[i][j]) / (2.0 * step);
                        assert!((by_u[i][k] - by_f).abs() < 1e-11 * ETA / step);
                        let by_rate = (faster[i][j] - slower[i][j]) / (2.0 * step);
                        assert!((by_v[i][k] - by_rate).abs() < 1e-11 * ETA / step);
                    }
                }
            }
        }
    }

    #[test]
    fn the_power_of_the_stress_is_the_dissipation() {
        let point = Viscous::new(F, V, ETA);
        let stress = point.stress();
        let power: f64 = (0..9).map(|r| stress[r / 3][r % 3] * V[r / 3][r % 3]).sum();
        assert!((power - point.dissipation()).abs() < 1e-12 * power);
        // A spin does no work: V = Ω F with a skew Ω.
        let omega = [[0.0, 0.4, -0.3], [-0.4, 0.0, 0.2], [0.3, -0.2, 0.0]];
        let spin =
            [0, 1, 2].map(|i| [0, 1, 2].map(|j| (0..3).map(|k| omega[i][k] * F[k][j]).sum()));
        assert!(Viscous::new(F, spin, ETA).dissipation() < 1e-28 * ETA);
    }

    #[test]
    fn the_plane_is_the_part_of_space_with_no_strain_across() {
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
