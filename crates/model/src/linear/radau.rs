//! The condensed matrices as Radau IIA asks for them: one real and some complex c at a time.

use myovib_dae::StepError;
use myovib_radau::{Method, NewtonMatrices};
use myovib_sparse::klu::{KluError, KluOptions};
use num_complex::Complex64;

use super::{Reduced, Reduction};
use crate::muscle_dae::MuscleDae;

/// Solves the Newton systems of a [`MuscleDae`] under Radau IIA by a [`Reduction`].
#[derive(Debug)]
pub struct CondensedMatrices {
    real: Reduced<f64>,
    complex: Vec<Reduced<Complex64>>,
}

impl CondensedMatrices {
    /// Lays out the reduction for `method`.
    ///
    /// # Errors
    /// Those of the analysis.
    pub fn new(dae: &MuscleDae, options: KluOptions, method: &Method) -> Result<Self, KluError> {
        let reduction = Reduction::new(dae, options)?;
        let complex = method.complex_modes().iter();
        Ok(Self {
            real: reduction.matrix(),
            complex: complex.map(|_| reduction.matrix()).collect(),
        })
    }
}

impl NewtonMatrices<MuscleDae> for CondensedMatrices {
    fn evaluate(
        &mut self,
        dae: &mut MuscleDae,
        t: f64,
        y: &[f64],
        y_dot: &[f64],
    ) -> Result<(), StepError> {
        dae.update_matrices(t, y, y_dot)
    }

    fn set_up(
        &mut self,
        dae: &mut MuscleDae,
        real: f64,
        complex: &[Complex64],
    ) -> Result<(), StepError> {
        let mut work = dae.counters().linear;
        let values = |matrix| dae.matrix_values(matrix);
        let mut matrices = self.complex.iter_mut().zip(complex);
        let result = self
            .real
            .set_up(real, values, &mut work)
            .and_then(|()| matrices.try_for_each(|(m, &c)| m.set_up(c, values, &mut work)));
        dae.counters_mut().linear = work;
        Ok(result?)
    }

    fn solve_real(&mut self, dae: &mut MuscleDae, rhs: &mut [f64]) -> Result<(), StepError> {
        Ok(self.real.solve(rhs, &mut dae.counters_mut().linear)?)
    }

    fn solve_complex(
        &mut self,
        dae: &mut MuscleDae,
        k: usize,
        rhs: &mut [Complex64],
    ) -> Result<(), StepError> {
        Ok(self.complex[k].solve(rhs, &mut dae.counters_mut().linear)?)
    }
}
