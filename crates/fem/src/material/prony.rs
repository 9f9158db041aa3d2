//! Viscoelasticity described by Prony series. The internal stresses are eliminated at each point.
//!
//! The passive second Piola–Kirchhoff stress S (without the pressure term) is replaced by S + Σ H_k, where
//! `Ḣ_k + H_k/τ_k = g_k Ṡ` and H_k = 0 initially. The variables Q_k = g_k S − H_k avoid the rate of S:
//!
//! ```text
//! Q̇_k = (g_k S − Q_k)/τ_k,    stress: (1 + Σ g_k) S − Σ Q_k
//! ```
//!
//! Each term has one symmetric tensor Q_k per quadrature point. Let γ be the shift in the Newton equations of an
//! implicit integrator, which replace ẏ by γ δy. The shift is real for BDF, and real or complex for Radau IIA.
//! With the residual r_k of Q̇_k + Q_k/τ_k − g_k S/τ_k,
//!
//! ```text
//! δQ_k = (g_k δS − τ_k r_k)/(1 + γ τ_k)
//! δ(stress) = φ(γ) δS + Σ τ_k r_k/(1 + γ τ_k),    φ = 1 + Σ g_k γ τ_k/(1 + γ τ_k)
//! ```
//!
//! The material part of the tangent (∂P/∂F without its geometric part δ_ik S_JL) is therefore multiplied by φ(γ),
//! and the geometric part contains the total stress. Source: FEBio, uncoupled viscoelasticity.

use std::ops::Mul;

use num_complex::ComplexFloat;

use super::{Range, Real};
use crate::error::FemError;

/// Term of a Prony series.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PronyTerm {
    /// Weight g, the relaxing stress relative to the long-term stress.
    pub weight: f64,
    /// Relaxation time τ, in s.
    pub time: f64,
}

/// Fractional (springpot) stress in parallel to the law, for harmonic motions only. It adds w s^a to the factor of
/// the law's linearized stress. For s = iω, s^a = ω^a (cos(πa/2) + i sin(πa/2)).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Springpot {
    /// Weight w, in s^a.
    pub weight: f64,
    /// Exponent a.
    pub exponent: f64,
}

/// Prony series of a material, and an optional springpot. Both are empty for an elastic material.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Prony {
    terms: Vec<PronyTerm>,
    springpot: Option<Springpot>,
}

impl Prony {
    /// Creates a series.
    ///
    /// # Errors
    /// Returns [`FemError::Parameter`] if a weight is negative or a time is not positive.
    pub fn new(terms: Vec<PronyTerm>) -> Result<Self, FemError> {
        for term in &terms {
            Range::NotNegative.check("Prony weight", term.weight)?;
            Range::Positive.check("Prony time", term.time)?;
        }
        Ok(Self { terms, springpot: None })
    }

    /// Adds a springpot.
    ///
    /// # Errors
    /// Returns [`FemError::Parameter`] if the weight is negative, or if the exponent is outside (0, 1).
    pub fn with_springpot(self, springpot: Springpot) -> Result<Self, FemError> {
        Range::NotNegative.check("springpot weight", springpot.weight)?;
        let value = springpot.exponent;
        if !(value > 0.0 && value < 1.0) {
            return Err(FemError::Parameter {
                name: "springpot exponent",
                value,
                condition: "between 0 and 1",
            });
        }
        Ok(Self { springpot: Some(springpot), ..self })
    }

    /// Returns whether the material is elastic.
    pub fn is_empty(&self) -> bool {
        self.terms.is_empty() && self.springpot.is_none()
    }

    /// Returns the terms.
    pub fn terms(&self) -> &[PronyTerm] {
        &self.terms
    }

    /// Returns 1 + Σ g, the factor of S in the instantaneous response.
    pub fn instantaneous(&self) -> f64 {
        1.0 + self.terms.iter().map(|term| term.weight).sum::<f64>()
    }

    /// Returns φ(γ), the factor of the material tangent for the shift γ.
    pub fn tangent_factor<T>(&self, shift: T) -> T
    where
        T: ComplexFloat<Real = f64> + Mul<f64, Output = T>,
    {
        let fractional = self
            .springpot
            .map_or(T::zero(), |springpot| shift.powf(springpot.exponent) * springpot.weight);
        self.terms.iter().fold(T::one() + fractional, |sum, term| {
            let scaled = shift * term.time;
            sum + scaled * term.weight / (T::one() + scaled)
        })
    }
}

impl PronyTerm {
    /// Returns Q̇ = (g S − Q)/τ of one component.
    #[inline(always)]
    pub fn rate<R: Real>(&self, stress: R, state: R) -> R {
        (stress * self.weight - state) * (1.0 / self.time)
    }

    /// Returns δQ of one component from δS and the residual of Q̇ − (g S − Q)/τ for the shift γ.
    #[inline(always)]
    pub fn update<T>(&self, shift: T, stress: T, residual: T) -> T
    where
        T: ComplexFloat + Mul<f64, Output = T>,
    {
        (stress * self.weight - residual * self.time) / (T::one() + shift * self.time)
    }

    /// Returns τ r/(1 + γ τ), the contribution of the residual of Q to the stress in the Newton equations.
    #[inline(always)]
    pub fn residual_stress<T>(&self, shift: T, residual: T) -> T
    where
        T: ComplexFloat + Mul<f64, Output = T>,
    {
        residual * self.time / (T::one() + shift * self.time)
    }
}

#[cfg(test)]
mod tests {
    use num_complex::Complex64;

    use super::{FemError, Prony, PronyTerm};

    fn series() -> Prony {
        let term = |weight, time| PronyTerm { weight, time };
        Prony::new(vec![term(0.5, 0.1), term(0.2, 2.0)]).unwrap()
    }

    #[test]
    fn step_response_is_a_sum_of_exponentials() {
        // S jumps to 1 at t = 0, where Q = 0, so the stress is 1 + Σ g e^{−t/τ}. The equations are integrated with
        // Heun's method.
        let prony = series();
        let (steps, end) = (20_000, 1.0);
        let h = end / f64::from(steps);
        let mut states = [0.0; 2];
        for _ in 0..steps {
            for (state, term) in states.iter_mut().zip(prony.terms()) {
                let first = term.rate(1.0, *state);
                let second = term.rate(1.0, *state + h * first);
                *state += 0.5 * h * (first + second);
            }
        }
        let found = prony.instantaneous() - states.iter().sum::<f64>();
        let exact: f64 = prony.terms().iter().map(|t| t.weight * (-end / t.time).exp()).sum();
        // The error of Heun's method is 0.5 (h/τ)²/6.
        assert!((found - 1.0 - exact).abs() < 1e-8, "{found}");
    }

    #[test]
    fn elimination_solves_the_newton_equations() {
        let prony = series();
        for shift in [Complex64::new(30.0, 0.0), Complex64::new(12.0, -7.0)] {
            let stress = Complex64::new(3.0, 1.5);
            let residuals = [Complex64::new(0.2, -0.1), Complex64::new(-0.4, 0.3)];
            let mut total = stress * prony.instantaneous();
            let mut eliminated = prony.tangent_factor(shift) * stress;
            for (term, residual) in prony.terms().iter().zip(residuals) {
                let state = term.update(shift, stress, residual);
                // The update must satisfy γ δQ + δQ/τ − g δS/τ = −r.
                let left = shift * state + (state - stress * term.weight) / term.time;
                assert!((left + residual).norm() < 1e-13);
                total -= state;
                eliminated += term.residual_stress(shift, residual);
            }
            assert!((total - eliminated).norm() < 1e-13);
        }
    }

    #[test]
    fn tangent_factor_has_the_limits_of_slow_and_fast_changes() {
        let prony = series();
        assert_eq!(prony.tangent_factor(0.0), 1.0);
        assert!((prony.tangent_factor(1e12) - prony.instantaneous()).abs() < 1e-10);
        assert_eq!(Prony::default().tangent_factor(5.0), 1.0);
    }

    #[test]
    fn invalid_constants_are_rejected() {
        let invalid = |weight, time| match Prony::new(vec![PronyTerm { weight, time }]) {
            Err(FemError::Parameter { name, .. }) => name,
            other => panic!("{other:?} instead of an invalid parameter"),
        };
        assert_eq!(invalid(0.5, -2.0), "Prony time");
        assert_eq!(invalid(f64::NAN, 1.0), "Prony weight");
        assert_eq!(invalid(-0.1, 1.0), "Prony weight");
    }
}
