//! Derivatives of equilibria with respect to parameters.

use super::Equilibrium;
use super::newton::Newton;
use crate::error::ModelError;
use crate::formulation::Formulation;
use crate::muscle::Muscle;

/// Derivatives of equilibria with respect to parameters.
///
/// G(x, p) = 0 gives `∂G/∂x ∂x/∂p = −∂G/∂p`. One factorization is sufficient for all parameters. A parameter is given
/// as a stencil of muscles with different values of the parameter. ∂G/∂p is the weighted sum of the residuals G of
/// these muscles at the same x.
pub struct EquilibriumDerivatives<'a> {
    newton: Newton<'a>,
    parameters: Vec<Vec<(f64, Newton<'a>)>>,
}

impl<'a> EquilibriumDerivatives<'a> {
    /// Prepares the derivatives of equilibria of `muscle` under its loads at time `t`.
    ///
    /// # Errors
    /// Fails if the matrices do not fit in memory.
    pub fn new(
        muscle: &'a Muscle,
        formulation: Formulation,
        t: f64,
        parameters: &[Vec<(f64, &'a Muscle)>],
    ) -> Result<Self, ModelError> {
        let newton = |muscle| Newton::new(muscle, formulation, t);
        let stencil = |stencil: &Vec<(f64, &'a Muscle)>| {
            let muscles = stencil.iter();
            muscles.map(|(weight, muscle)| Ok((*weight, newton(muscle)?))).collect()
        };
        Ok(Self {
            newton: newton(muscle)?,
            parameters: parameters.iter().map(stencil).collect::<Result<_, ModelError>>()?,
        })
    }

    /// Computes ∂x/∂p of the equilibrium `x` (displacements, then pressures) under the fraction `part` of the loads,
    /// for each parameter.
    ///
    /// # Errors
    /// [`ModelError::Factorization`] at a limit point; [`ModelError::Inverted`] if a muscle of a stencil moves its
    /// supports too far.
    pub fn at(&mut self, x: &[f64], part: f64) -> Result<Vec<Vec<f64>>, ModelError> {
        let Self { newton, parameters } = self;
        newton.tangent(x, part)?;
        newton.factorize()?;
        let mut residual = vec![0.0; x.len()];
        let of_parameter = |stencil: &mut Vec<(f64, Newton<'a>)>| {
            let mut derivative = vec![0.0; x.len()];
            for (weight, other) in stencil {
                other.residual(x, part, &mut residual)?;
                let sum = derivative.iter_mut().zip(&residual);
                sum.for_each(|(sum, r)| *sum -= *weight * r);
            }
            newton.solve_linear(&mut derivative)?;
            Ok(derivative)
        };
        parameters.iter_mut().map(of_parameter).collect()
    }
}

impl Equilibrium {
    /// Computes ∂x/∂p (displacements, then pressures) of the equilibrium of `muscle` at time `t` for each of
    /// `parameters`. See [`EquilibriumDerivatives`].
    ///
    /// # Errors
    /// Errors of [`EquilibriumDerivatives::at`].
    pub fn derivatives(
        &self,
        muscle: &Muscle,
        formulation: Formulation,
        t: f64,
        parameters: &[Vec<(f64, &Muscle)>],
    ) -> Result<Vec<Vec<f64>>, ModelError> {
        let x = [&self.displacement[..], &self.pressure].concat();
        EquilibriumDerivatives::new(muscle, formulation, t, parameters)?.at(&x, 1.0)
    }
}
