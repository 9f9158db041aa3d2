//! Physical constants of the muscle, not part of its material law.

use myovib_fem::Pressure;

use crate::error::ModelError;

/// Rayleigh damping and compressibility. Density and material law are properties of the solid.
///
/// # Units
/// SI: α in 1/s, β in s, κ in Pa.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Parameters {
    /// Mass-proportional damping α, 1/s.
    pub alpha: f64,
    /// Stiffness-proportional damping β, s.
    pub beta: f64,
    /// 1/κ, in 1/Pa; 0 for an incompressible material.
    pub inv_kappa: f64,
    /// κ as specified by the user, stored because 1/(1/κ) may differ by rounding.
    kappa: f64,
}

impl Parameters {
    /// Creates the parameters after checking their ranges. `kappa` may be infinite.
    ///
    /// # Errors
    /// [`ModelError::OutOfRange`] if κ ≤ 0, if α or β is negative or infinite, or if a value is NaN.
    pub fn new(alpha: f64, beta: f64, kappa: f64) -> Result<Self, ModelError> {
        let check = |name, value, holds: bool, allowed| {
            if holds { Ok(()) } else { Err(ModelError::OutOfRange { name, value, allowed }) }
        };
        check("bulk modulus", kappa, kappa > 0.0, "greater than 0, or inf")?;
        check(
            "mass-proportional damping",
            alpha,
            (0.0..f64::INFINITY).contains(&alpha),
            "0 or greater, finite",
        )?;
        check(
            "stiffness-proportional damping",
            beta,
            (0.0..f64::INFINITY).contains(&beta),
            "0 or greater, finite",
        )?;
        Ok(Self { alpha, beta, inv_kappa: 1.0 / kappa, kappa })
    }

    /// Returns the bulk modulus κ (Pa), which is infinite for an incompressible material.
    pub fn kappa(&self) -> f64 {
        self.kappa
    }

    /// Returns the source of the volumetric stress: the `nodal` pressure if it is given, otherwise κ.
    pub(crate) fn pressure<'p>(&self, nodal: Option<&'p [f64]>) -> Pressure<'p> {
        let penalty = Pressure::Penalty { kappa: self.kappa };
        nodal.map_or(penalty, Pressure::Nodal)
    }

    /// Returns whether κ is infinite.
    pub fn is_incompressible(&self) -> bool {
        self.inv_kappa == 0.0
    }

    /// Returns whether β > 0.
    pub fn is_damped(&self) -> bool {
        self.beta > 0.0
    }
}
