//! Stress that a muscle produces along its fibres.
//!
//! ```text
//! P = τ (F f0)⊗f0,    τ = T g(λ) h(λ̇), divided by λ where T is nominal
//! ∂P/∂F : (i, J), (k, L) → K_ik f0_J f0_L,    K = τ I + f⊗(τ_E f + τ_Ė ḟ),    ∂P/∂V: τ_Ė f⊗f
//! ```
//!
//! with f = F f0, ḟ = V f0, λ² = 1 + 2 E, E = f0·E f0, Ė = f·ḟ = λ λ̇. Without a force–velocity
//! factor K is symmetric. The functions hold in the plane, where the fibres lie in it, and in space.

use super::{Dual, Real};
use crate::error::FemError;

/// The stress that T is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Tension {
    /// Second Piola–Kirchhoff: S = T g f0⊗f0, nominal stress λ T g along the fibre.
    SecondPiolaKirchhoff,
    /// Nominal: S = T g/λ f0⊗f0, nominal stress T g along the fibre.
    Nominal,
}

/// How tension depends on the fibre's stretch: the factor g(λ).
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ForceLength {
    /// g = 1.
    Constant,
    /// `g = max(0, −25/4 r² + 25/2 r − 5.25)`, r = λ/λ_opt. Source: openDiHu.
    Parabola {
        /// λ_opt.
        optimal: f64,
    },
    /// `g = exp(−|(λ/λ_opt − 1)/w|⁴)`.
    Gaussian {
        /// λ_opt.
        optimal: f64,
        /// w.
        width: f64,
    },
}

impl ForceLength {
    /// g.
    #[inline(always)]
    fn factor<R: Real>(self, stretch: R) -> R {
        match self {
            ForceLength::Constant => stretch.like(1.0),
            ForceLength::Parabola { optimal } => {
                // 1 at r = 1, zero at r = 0.6 and 1.4.
                let from_optimal = stretch * (1.0 / optimal) - stretch.like(1.0);
                let g = stretch.like(1.0) - from_optimal * from_optimal * 6.25;
                g.choose(g, stretch.like(0.0))
            }
            ForceLength::Gaussian { optimal, width } => {
                let from_optimal = (stretch * (1.0 / optimal) - stretch.like(1.0)) * (1.0 / width);
                let square = from_optimal * from_optimal;
                (-(square * square)).exp()
            }
        }
    }
}

/// How tension depends on the rate of the fibre's stretch: Hill's factor h(λ̇/v_max).
///
/// Shortening, s = λ̇/v_max in [−1, 0]: `(1 + s)/(1 − s/a)`, zero below. Lengthening:
/// `1 + (N − 1) s/(s + c)`, with c such that the slopes at 0 are equal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ForceVelocity {
    /// v_max, 1/s.
    pub v_max: f64,
    /// a.
    pub a: f64,
    /// N, the factor that fast lengthening tends to.
    pub plateau: f64,
}

impl ForceVelocity {
    /// Hill's factor with a = 0.25 and a plateau of 1.4.
    pub fn hill(v_max: f64) -> Self {
        Self {
            v_max,
            a: 0.25,
            plateau: 1.4,
        }
    }

    /// h.
    #[inline(always)]
    fn factor<R: Real>(self, stretch_rate: R) -> R {
        let s = stretch_rate * (1.0 / self.v_max);
        let (one, zero) = (s.like(1.0), s.like(0.0));
        let slow = (one + s).choose(one + s, zero);
        // Both branches stay finite where the other one counts.
        let (down, up) = (s.choose(zero, s), s.choose(s, zero));
        let shortening = slow / (one - down * (1.0 / self.a));
        let beyond = self.plateau - 1.0;
        let c = beyond * self.a / (1.0 + self.a);
        let lengthening = one + up * beyond / (up + one * c);
        s.choose(lengthening, shortening)
    }
}

/// Active stress along the fibres, for a tension T that is given at each point.
///
/// # Units
/// T in Pa.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ActiveStress {
    /// The stress that T is.
    pub tension: Tension,
    /// g.
    pub force_length: ForceLength,
    /// h; 1 if there is none.
    pub force_velocity: Option<ForceVelocity>,
}

/// τ at a point with its derivatives, and the fibre as it is deformed.
#[derive(Debug, Clone, Copy)]
pub struct ActiveFibre<R, const D: usize> {
    /// f0.
    reference: [R; D],
    /// f = F f0.
    fibre: [R; D],
    /// ḟ = V f0.
    rate: [R; D],
    /// τ.
    tau: R,
    /// ∂τ/∂E.
    by_strain: R,
    /// ∂τ/∂Ė.
    by_strain_rate: R,
}

impl ActiveStress {
    /// T itself along the fibre.
    pub const PLAIN: Self = Self {
        tension: Tension::SecondPiolaKirchhoff,
        force_length: ForceLength::Constant,
        force_velocity: None,
    };

    /// Checks the constants.
    ///
    /// # Errors
    /// [`FemError::Parameter`].
    pub fn check(&self) -> Result<(), FemError> {
        let mut constants = Vec::new();
        match self.force_length {
            ForceLength::Constant => {}
            ForceLength::Parabola { optimal } => constants.push(("lambda_opt", optimal)),
            ForceLength::Gaussian { optimal, width } => {
                constants.extend([("lambda_opt", optimal), ("width", width)]);
            }
        }
        if let Some(ForceVelocity { v_max, a, plateau }) = self.force_velocity {
            constants.extend([("v_max", v_max), ("a", a), ("plateau - 1", plateau - 1.0)]);
        }
        let unfit = |(_, value): &(&str, f64)| !(*value > 0.0 && value.is_finite());
        constants
            .into_iter()
            .find(unfit)
            .map_or(Ok(()), |(name, value)| {
                Err(FemError::Parameter {
                    name,
                    value,
                    condition: "positive and finite",
                })
            })
    }

    /// τ from T, E and Ė.
    #[inline(always)]
    pub fn tau<R: Real>(&self, tension: R, strain: R, strain_rate: R) -> R {
        let stretch = (strain * 2.0 + strain.like(1.0)).sqrt();
        let mut tau = tension * self.force_length.factor(stretch);
        if let Tension::Nominal = self.tension {
            tau = tau / stretch;
        }
        match self.force_velocity {
            Some(hill) => tau * hill.factor(strain_rate / stretch),
            None => tau,
        }
    }

    /// The fibre along `reference` = f0 at a point with `h` = ∇u that moves with `v` = ∇v, under the
    /// tension T.
    #[inline(always)]
    pub fn at<R: Real, const D: usize>(
        &self,
        reference: [R; D],
        h: &[[R; D]; D],
        v: &[[R; D]; D],
        tension: R,
    ) -> ActiveFibre<R, D> {
        let (change, rate) = (apply(h, reference), apply(v, reference));
        let mut fibre = reference;
        for (fibre, change) in fibre.iter_mut().zip(change) {
            *fibre = *fibre + change;
        }
        // f0·E f0 as a sum of small terms near rest.
        let e = dot(reference, change) + dot(change, change) * 0.5;
        let e_rate = dot(fibre, rate);
        let (one, zero) = (e.like(1.0), e.like(0.0));
        let dual = |value, rate| Dual { value, rate };
        let tension = Dual::constant(tension);
        let by_strain = self.tau(tension, dual(e, one), dual(e_rate, zero));
        let by_strain_rate = match self.force_velocity {
            Some(_) => self.tau(tension, dual(e, zero), dual(e_rate, one)).rate,
            None => zero,
        };
        ActiveFibre {
            reference,
            fibre,
            rate,
            tau: by_strain.value,
            by_strain: by_strain.rate,
            by_strain_rate,
        }
    }
}

impl<R: Real, const D: usize> ActiveFibre<R, D> {
    /// P.
    #[inline(always)]
    pub fn stress(&self) -> [[R; D]; D] {
        let mut out = [self.reference; D];
        for (row, fibre) in out.iter_mut().zip(self.fibre) {
            for entry in row {
                *entry = self.tau * fibre * *entry;
            }
        }
        out
    }

    /// f0, the direction J and L of the derivatives.
    #[inline(always)]
    pub fn direction(&self) -> [R; D] {
        self.reference
    }

    /// K of ∂P/∂F: not symmetric if the tension depends on the rate.
    #[inline(always)]
    pub fn by_displacement(&self) -> [[R; D]; D] {
        let mut out = [self.fibre; D];
        for (i, row) in out.iter_mut().enumerate() {
            for (k, entry) in row.iter_mut().enumerate() {
                let along = self
                    .by_strain
                    .mul_add(*entry, self.by_strain_rate * self.rate[k]);
                *entry = self.fibre[i] * along;
            }
            row[i] = row[i] + self.tau;
        }
        out
    }

    /// K of ∂P/∂V.
    #[inline(always)]
    pub fn by_velocity(&self) -> [[R; D]; D] {
        let mut out = [self.fibre; D];
        for (row, fibre) in out.iter_mut().zip(self.fibre) {
            for entry in row {
                *entry = self.by_strain_rate * fibre * *entry;
            }
        }
        out
    }

    /// P : V, the power of the fibres per reference volume: τ Ė.
    #[inline(always)]
    pub fn power(&self) -> R {
        self.tau * dot(self.fibre, self.rate)
    }
}

/// a·b.
#[inline(always)]
pub(super) fn dot<R: Real, const D: usize>(a: [R; D], b: [R; D]) -> R {
    let mut sum = a[0] * b[0];
    for i in 1..D {
        sum = a[i].mul_add(b[i], sum);
    }
    sum
}

/// M x.
#[inline(always)]
pub(super) fn apply<R: Real, const D: usize>(matrix: &[[R; D]; D], x: [R; D]) -> [R; D] {
    let mut out = x;
    for (out, row) in out.iter_mut().zip(matrix) {
        *out = dot(*row, x);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    const FIBRE: [f64; 3] = [2.0 / 3.0, 2.0 / 3.0, 1.0 / 3.0];
    const H: [[f64; 3]; 3] = [[0.1, 0.2, -0.1], [-0.1, -0.05, 0.2], [0.05, -0.2, 0.1]];
    const V: [[f64; 3]; 3] = [[0.3, -0.8, 0.4], [0.5, 0.9, -0.2], [-0.6, 0.1, -0.7]];

    fn at(active: &ActiveStress, h: [[f64; 3]; 3], v: [[f64; 3]; 3]) -> ActiveFibre<f64, 3> {
        active.at(FIBRE, &h, &v, 7e4)
    }

    fn kinds() -> Vec<ActiveStress> {
        let mut all = Vec::new();
        for tension in [Tension::SecondPiolaKirchhoff, Tension::Nominal] {
            for force_length in [
                ForceLength::Constant,
                ForceLength::Parabola { optimal: 1.2 },
                ForceLength::Gaussian {
                    optimal: 1.1,
                    width: 0.4,
                },
            ] {
                for force_velocity in [None, Some(ForceVelocity::hill(2.0))] {
                    all.push(ActiveStress {
                        tension,
                        force_length,
                        force_velocity,
                    });
                }
            }
        }
        all
    }

    #[test]
    fn derivatives_are_those_of_the_stress() {
        let step = 6e-6;
        // Lengthening and shortening fibres.
        for sign in [1.0, -1.0] {
            let v = V.map(|row| row.map(|v| sign * v));
            for active in kinds() {
                let point = at(&active, H, v);
                let (by_u, by_v) = (point.by_displacement(), point.by_velocity());
                for k in 0..3 {
                    for l in 0..3 {
                        let shift = |t: [[f64; 3]; 3], step: f64| {
                            let mut t = t;
                            t[k][l] += step;
                            t
                        };
                        let plus = at(&active, shift(H, step), v).stress();
                        let minus = at(&active, shift(H, -step), v).stress();
                        let faster = at(&active, H, shift(v, step)).stress();
                        let slower = at(&active, H, shift(v, -step)).stress();
                        for i in 0..3 {
                            for j in 0..3 {
                                let dyad = FIBRE[j] * FIBRE[l];
                                let by_h = (plus[i][j] - minus[i][j]) / (2.0 * step);
                                let by_rate = (faster[i][j] - slower[i][j]) / (2.0 * step);
                                // ε^(2/3) of the tension.
                                assert!((by_u[i][k] * dyad - by_h).abs() < 1e-8 * 7e4);
                                assert!((by_v[i][k] * dyad - by_rate).abs() < 1e-8 * 7e4);
                            }
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn power_is_stress_times_velocity_gradient() {
        for active in kinds() {
            let point = at(&active, H, V);
            let stress = point.stress();
            let power: f64 = (0..9).map(|r| stress[r / 3][r % 3] * V[r / 3][r % 3]).sum();
            assert!((point.power() - power).abs() < 1e-12 * 7e4);
        }
    }

    #[test]
    fn stress_along_the_fibre_is_what_its_name_says() {
        let (stretched, still) = ([[0.2, 0.0], [0.0; 2]], [[0.0; 2]; 2]);
        let along =
            |active: ActiveStress| active.at([1.0, 0.0], &stretched, &still, 100.0).stress()[0][0];
        let nominal = ActiveStress {
            tension: Tension::Nominal,
            ..ActiveStress::PLAIN
        };
        assert!((along(ActiveStress::PLAIN) - 120.0).abs() < 1e-12);
        assert!((along(nominal) - 100.0).abs() < 1e-12);
    }

    #[test]
    fn curves_have_the_values_of_their_formulas() {
        let parabola = ForceLength::Parabola { optimal: 1.2 };
        for ratio in [0.5, 0.7, 1.0, 1.3, 1.5] {
            let formula: f64 = -6.25 * ratio * ratio + 12.5 * ratio - 5.25;
            assert!((parabola.factor(1.2 * ratio) - formula.max(0.0)).abs() < 1e-14);
        }
        let gaussian = ForceLength::Gaussian {
            optimal: 1.0,
            width: 0.5,
        };
        assert!((gaussian.factor(1.5_f64) - (-1.0_f64).exp()).abs() < 1e-15);
        let hill = ForceVelocity::hill(4.0);
        assert_eq!(hill.factor(0.0), 1.0);
        assert_eq!(hill.factor(-4.0), 0.0);
        assert_eq!(hill.factor(-8.0), 0.0);
        assert!((hill.factor(-2.0_f64) - 0.5 / 3.0).abs() < 1e-15);
        assert!((hill.factor(1e9_f64) - 1.4).abs() < 1e-8);
        let slope = |rate: f64| {
            let dual = Dual {
                value: rate,
                rate: 4.0,
            };
            hill.factor(dual).rate
        };
        // 1 + 1/a on both sides.
        assert!((slope(0.0) - 5.0).abs() < 1e-14);
        assert!((slope(-1e-12) - 5.0).abs() < 1e-9);
    }
}
