//! The condensed solver as IDAS calls it.

use myovib_dae::{StepError, StructuredSolver};
use myovib_sparse::klu::{KluError, KluOptions};

use super::{Reduced, Reduction};
use crate::muscle_dae::MuscleDae;

/// Solves the Newton systems of a [`MuscleDae`] by a [`Reduction`].
#[derive(Debug)]
pub struct CondensedSolver {
    matrix: Reduced<f64>,
}

impl CondensedSolver {
    /// Lays out the reduction.
    ///
    /// # Errors
    /// Those of the analysis.
    pub fn new(dae: &MuscleDae, options: KluOptions) -> Result<Self, KluError> {
        Ok(Self {
            matrix: Reduction::new(dae, options)?.matrix(),
        })
    }
}

impl StructuredSolver<MuscleDae> for CondensedSolver {
    fn setup(
        &mut self,
        dae: &mut MuscleDae,
        t: f64,
        y: &[f64],
        y_dot: &[f64],
        c_j: f64,
    ) -> Result<(), StepError> {
        dae.update_matrices(t, y, y_dot)?;
        let mut work = dae.counters().linear;
        let result = self
            .matrix
            .set_up(c_j, |matrix| dae.matrix_values(matrix), &mut work);
        dae.counters_mut().linear = work;
        Ok(result?)
    }

    fn solve(&mut self, dae: &mut MuscleDae, rhs: &mut [f64]) -> Result<(), StepError> {
        Ok(self.matrix.solve(rhs, &mut dae.counters_mut().linear)?)
    }
}
