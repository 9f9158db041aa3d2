//! Physical constants of the muscle in addition to its material law.

use myovib_fem::Pressure;

use crate::error::ModelError;

/// Rayleigh damping and compressibility; density and material law belong to the solid.
///
/// # Units
/// SI: α in 1/s, β in s, κ in Pa.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Parameters {
    /// Mass-proportional damping α, 1/s.
    pub alpha: f64,
    /// Stiffness-proportional damping β, s.
    pub beta: f64,
    /// 1/κ, 1/Pa; 0 for the fully incompressible material.
    pub inv_kappa: f64,
    /// κ as specified by the user, because 1/(1/κ) differs by rounding.
    kappa: f64,
}

impl Parameters {
    /// Checks the ranges; `kappa` may be infinite.
    ///
    /// # Errors
    /// [`ModelError::OutOfRange`] for κ ≤ 0, a negative or infinite α or β, or a NaN.
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

    /// Returns the bulk modulus κ, Pa; infinite for the incompressible material.
    pub fn kappa(&self) -> f64 {
        self.kappa
    }

    /// Returns the source of the volumetric stress: the given pressure, or κ without a pressure.
    pub(crate) fn pressure<'p>(&self, nodal: Option<&'p [f64]>) -> Pressure<'p> {
        let penalty = Pressure::Penalty { kappa: self.kappa };
        nodal.map_or(penalty, Pressure::Nodal)
    }

    /// Returns whether κ = ∞.
    pub fn is_incompressible(&self) -> bool {
        self.inv_kappa == 0.0
    }

    /// Returns whether β > 0.
    pub fn is_damped(&self) -> bool {
        self.beta > 0.0
    }
}
