//! How an equilibrium moves with parameters.

use super::Equilibrium;
use super::newton::Newton;
use crate::error::ModelError;
use crate::formulation::Formulation;
use crate::muscle::Muscle;

impl Equilibrium {
    /// Computes ∂x/∂p of the equilibrium of `muscle` at time `t` for each of `parameters`:
    /// displacements, then pressures.
    ///
    /// G(x, p) = 0 gives `∂G/∂x ∂x/∂p = −∂G/∂p`, with one factorization for all. A parameter is a
    /// stencil of muscles with different values of the parameter: the weighted sum of their G at
    /// this x is ∂G/∂p.
    ///
    /// # Errors
    /// [`ModelError::Factorization`] at a limit point, [`ModelError::Inverted`] for a muscle of a
    /// stencil that moves its supports too far.
    pub fn derivatives(
        &self,
        muscle: &Muscle,
        formulation: Formulation,
        t: f64,
        parameters: &[Vec<(f64, &Muscle)>],
    ) -> Result<Vec<Vec<f64>>, ModelError> {
        let mut newton = Newton::new(muscle, formulation, t)?;
        let x = [&self.displacement[..], &self.pressure].concat();
        newton.tangent(&x, 1.0)?;
        newton.system.renew(&mut newton.work)?;
        let mut residual = vec![0.0; x.len()];
        let mut of_parameter = |stencil: &Vec<(f64, &Muscle)>| {
            let mut derivative = vec![0.0; x.len()];
            for (weight, other) in stencil {
                Newton::new(other, formulation, t)?.residual(&x, 1.0, &mut residual)?;
                let sum = derivative.iter_mut().zip(&residual);
                sum.for_each(|(sum, r)| *sum -= weight * r);
            }
            newton.system.solve(&mut derivative, &mut newton.work)?;
            Ok(derivative)
        };
        parameters.iter().map(&mut of_parameter).collect()
    }
}
