//! Active stress along muscle fibers.
//!
//! ```text
//! P = τ (F f0)⊗f0,    τ = T g(λ) h(λ̇), divided by λ where T is nominal
//! ∂P/∂F : (i, J), (k, L) → K_ik f0_J f0_L,    K = τ I + f⊗(τ_E f + τ_Ė ḟ),    ∂P/∂V: τ_Ė f⊗f
//! ```
//!
//! with f = F f0, ḟ = V f0, λ² = 1 + 2 E, E = f0·E f0, Ė = f·ḟ = λ λ̇. Without a force–velocity factor, K is
//! symmetric. The functions apply in 2D (with in-plane fibers) and in 3D.

use super::{Dual, Range, Real};
use crate::error::FemError;

/// Stress measure of the tension T.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Tension {
    /// Second Piola–Kirchhoff stress: S = T g f0⊗f0. The nominal stress along the fiber is λ T g.
    SecondPiolaKirchhoff,
    /// Nominal stress: S = T g/λ f0⊗f0. The nominal stress along the fiber is T g.
    Nominal,
}

/// Force–length relation, given by the factor g(λ) of the tension.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ForceLength {
    /// Constant g = 1.
    Constant,
    /// Parabola `g = max(0, −25/4 r² + 25/2 r − 5.25)` with r = λ/λ_opt. Source: openDiHu.
    Parabola {
        /// Optimal stretch λ_opt.
        optimal: f64,
    },
    /// Generalized Gaussian `g = exp(−|(λ/λ_opt − 1)/w|⁴)`.
    Gaussian {
        /// Optimal stretch λ_opt.
        optimal: f64,
        /// Width w.
        width: f64,
    },
}

impl ForceLength {
    /// Returns g.
    #[inline(always)]
    fn factor<R: Real>(self, stretch: R) -> R {
        match self {
            ForceLength::Constant => stretch.like(1.0),
            ForceLength::Parabola { optimal } => {
                // The factor is 1 at r = 1, and zero at r = 0.6 and r = 1.4.
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

/// Force–velocity relation, given by Hill's factor h(λ̇/v_max) of the tension.
///
/// For shortening, s = λ̇/v_max is in [−1, 0], and h = `(1 + s)/(1 − s/a)`. For s < −1, h is zero. For
/// lengthening, h = `1 + (N − 1) s/(s + c)`, where c is chosen such that the slopes at 0 are equal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ForceVelocity {
    /// Maximum shortening rate v_max, in 1/s.
    pub v_max: f64,
    /// Curvature parameter a.
    pub a: f64,
    /// Plateau N for fast lengthening.
    pub plateau: f64,
}

impl ForceVelocity {
    /// Returns Hill's factor with a = 0.25 and N = 1.4.
    pub fn hill(v_max: f64) -> Self {
        Self { v_max, a: 0.25, plateau: 1.4 }
    }

    /// Returns h.
    #[inline(always)]
    fn factor<R: Real>(self, stretch_rate: R) -> R {
        let s = stretch_rate * (1.0 / self.v_max);
        let (one, zero) = (s.like(1.0), s.like(0.0));
        let slow = (one + s).choose(one + s, zero);
        // Both branches are evaluated for all s, so they must be finite even where they are not selected.
        let (down, up) = (s.choose(zero, s), s.choose(s, zero));
        let shortening = slow / (one - down * (1.0 / self.a));
        let beyond = self.plateau - 1.0;
        let c = beyond * self.a / (1.0 + self.a);
        let lengthening = one + up * beyond / (up + one * c);
        s.choose(lengthening, shortening)
    }
}

/// Active stress along the fibers for a given tension T at each point.
///
/// # Units
/// T is in Pa.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ActiveStress {
    /// Stress measure of the tension T.
    pub tension: Tension,
    /// Force–length factor g.
    pub force_length: ForceLength,
    /// Force–velocity factor h. `None` means 1.
    pub force_velocity: Option<ForceVelocity>,
}

/// Deformed fiber at a point, with the tension τ and its derivatives.
#[derive(Debug, Clone, Copy)]
pub struct ActiveFiber<R, const D: usize> {
    /// Undeformed fiber f0.
    reference: [R; D],
    /// Deformed fiber f = F f0.
    fiber: [R; D],
    /// Fiber rate ḟ = V f0.
    rate: [R; D],
    /// Tension τ.
    tau: R,
    /// Derivative ∂τ/∂E.
    by_strain: R,
    /// Derivative ∂τ/∂Ė.
    by_strain_rate: R,
}

impl ActiveStress {
    /// The tension T is the second Piola–Kirchhoff stress. The force–length and force–velocity factors are 1.
    pub const PLAIN: Self = Self {
        tension: Tension::SecondPiolaKirchhoff,
        force_length: ForceLength::Constant,
        force_velocity: None,
    };

    /// Checks the ranges of the constants.
    ///
    /// # Errors
    /// Returns [`FemError::Parameter`] if a constant is out of range.
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
        constants.into_iter().try_for_each(|(name, value)| Range::Positive.check(name, value))
    }

    /// Returns τ from T, E and Ė.
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

    /// Returns the active fiber at a point for the undeformed direction `reference` = f0, `h` = ∇u, `v` = ∇v and
    /// the tension T.
    #[inline(always)]
    pub fn at<R: Real, const D: usize>(
        &self,
        reference: [R; D],
        h: &[[R; D]; D],
        v: &[[R; D]; D],
        tension: R,
    ) -> ActiveFiber<R, D> {
        let (change, rate) = (apply(h, reference), apply(v, reference));
        let mut fiber = reference;
        for (fiber, change) in fiber.iter_mut().zip(change) {
            *fiber = *fiber + change;
        }
        // The strain f0·E f0 is computed as a sum of small terms, which avoids cancellation near rest.
        let e = dot(reference, change) + dot(change, change) * 0.5;
        let e_rate = dot(fiber, rate);
        let (one, zero) = (e.like(1.0), e.like(0.0));
        let dual = |value, rate| Dual { value, rate };
        let tension = Dual::constant(tension);
        let by_strain = self.tau(tension, dual(e, one), dual(e_rate, zero));
        let by_strain_rate = match self.force_velocity {
            Some(_) => self.tau(tension, dual(e, zero), dual(e_rate, one)).rate,
            None => zero,
        };
        ActiveFiber {
            reference,
            fiber,
            rate,
            tau: by_strain.value,
            by_strain: by_strain.rate,
            by_strain_rate,
        }
    }
}

impl<R: Real, const D: usize> ActiveFiber<R, D> {
    /// Returns P.
    #[inline(always)]
    pub fn stress(&self) -> [[R; D]; D] {
        let mut out = [self.reference; D];
        for (row, fiber) in out.iter_mut().zip(self.fiber) {
            for entry in row {
                *entry = self.tau * fiber * *entry;
            }
        }
        out
    }

    /// Returns f0. The derivatives depend on the indices J and L only through this direction.
    #[inline(always)]
    pub fn direction(&self) -> [R; D] {
        self.reference
    }

    /// Returns the matrix K in ∂P/∂F, defined at the top of this module. It is not symmetric if the tension depends on the
    /// strain rate.
    #[inline(always)]
    pub fn by_displacement(&self) -> [[R; D]; D] {
        let mut out = [self.fiber; D];
        for (i, row) in out.iter_mut().enumerate() {
            for (k, entry) in row.iter_mut().enumerate() {
                let change = self.by_strain.mul_add(*entry, self.by_strain_rate * self.rate[k]);
                *entry = self.fiber[i] * change;
            }
            row[i] = row[i] + self.tau;
        }
        out
    }

    /// Returns the matrix K in ∂P/∂V.
    #[inline(always)]
    pub fn by_velocity(&self) -> [[R; D]; D] {
        let mut out = [self.fiber; D];
        for (row, fiber) in out.iter_mut().zip(self.fiber) {
            for entry in row {
                *entry = self.by_strain_rate * fiber * *entry;
            }
        }
        out
    }

    /// Returns the power P : V = τ Ė per reference volume.
    #[inline(always)]
    pub fn power(&self) -> R {
        self.tau * dot(self.fiber, self.rate)
    }
}

/// Returns a·b.
#[inline(always)]
pub(super) fn dot<R: Real, const D: usize>(a: [R; D], b: [R; D]) -> R {
    let mut sum = a[0] * b[0];
    for i in 1..D {
        sum = a[i].mul_add(b[i], sum);
    }
    sum
}

/// Returns M x.
#[inline(always)]
pub(super) fn apply<R: Real, const D: usize>(matrix: &[[R; D]; D], x: [R; D]) -> [R; D] {
    let mut out = x;
    for (out, row) in out.iter_mut().zip(matrix) {
        *out = dot(*row, x);
    }
    out
}

#[cfg(test)]
mod tests;
