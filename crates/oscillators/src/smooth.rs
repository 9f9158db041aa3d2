//! A differentiable phase coherence, which is also defined at rest.
//!
//! If the stiffness of a tissue depends on the coherence, Newton's method needs |χ| and its derivative. Neither
//! exists for oscillators at rest, so the radii are smoothed.

use num_complex::Complex64;

use crate::coherence::{mean, phasors};
use crate::error::Error;

/// The squared phase coherence with smoothed radii, and its gradient.
///
/// `S = |χ_ε|²`, `χ_ε = (1/N) Σ z_n / sqrt(|z_n|² + ε²)`, `z_n = y_n + i ẏ_n/ω_n`. S is smooth for all states, 0 at
/// rest, and tends to |χ|² of eq. (23) as ε → 0: a radius r contributes 1 − ε²/(2r²) + … The paper mentions the need
/// for such a measure (section 1.3, two-way coupling) but does not define one. The square is smooth, whereas |χ_ε| has
/// a kink at its zeros.
///
/// # Examples
/// ```
/// use myovib_oscillators::SmoothCoherence;
/// # fn main() -> Result<(), myovib_oscillators::Error> {
/// let smooth = SmoothCoherence::new(1e-3)?;
/// assert_eq!(smooth.squared(&[50.0], &[0.0], &[0.0]), 0.0);
/// assert!((smooth.squared(&[50.0], &[2.0], &[0.0]) - 1.0).abs() < 1e-6);
/// # Ok(())
/// # }
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SmoothCoherence {
    radius: f64,
}

impl SmoothCoherence {
    /// Creates the measure with the smoothing radius ε, in the unit of the positions of the oscillators.
    ///
    /// # Errors
    /// Returns [`Error::SmoothingRadius`] unless ε is positive and finite.
    pub fn new(radius: f64) -> Result<Self, Error> {
        if radius > 0.0 && radius.is_finite() {
            Ok(Self { radius })
        } else {
            Err(Error::SmoothingRadius { value: radius })
        }
    }

    /// Returns S for frequencies `omega`, positions `y` and velocities `w`.
    ///
    /// # Panics
    /// Panics if the slices are empty or their lengths differ.
    pub fn squared(&self, omega: &[f64], y: &[f64], w: &[f64]) -> f64 {
        self.order_parameter(omega, y, w).norm_sqr()
    }

    /// Evaluates ∂S/∂y and ∂S/∂w into `by_position` and `by_velocity`, overwriting them.
    ///
    /// # Panics
    /// Panics if the slices are empty or their lengths differ.
    pub fn gradient(
        &self,
        omega: &[f64],
        y: &[f64],
        w: &[f64],
        by_position: &mut [f64],
        by_velocity: &mut [f64],
    ) {
        assert_eq!(by_position.len(), omega.len(), "gradient by the positions");
        assert_eq!(by_velocity.len(), omega.len(), "gradient by the velocities");
        let chi = self.order_parameter(omega, y, w);
        let scale = 2.0 / omega.len() as f64;
        for (n, z) in phasors(omega, y, w).enumerate() {
            // d(z/ρ) = dz/ρ − z Re(z̄ dz)/ρ³, and dS = 2 Re(χ̄ dχ).
            let rho = self.rounded(z);
            let along = (chi.conj() * z).re / rho.powi(3);
            let by_z = chi / rho - z * along;
            by_position[n] = scale * by_z.re;
            by_velocity[n] = scale * by_z.im / omega[n];
        }
    }

    fn order_parameter(&self, omega: &[f64], y: &[f64], w: &[f64]) -> Complex64 {
        mean(phasors(omega, y, w).map(|z| z / self.rounded(z)))
    }

    fn rounded(&self, z: Complex64) -> f64 {
        (z.norm_sqr() + self.radius * self.radius).sqrt()
    }
}
