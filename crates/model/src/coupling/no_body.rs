//! An empty body for systems of oscillators alone.

use myovib_dae::{LinearSolver, Linearization, Problem, StepError, VariableKind};
use nalgebra_sparse::pattern::SparsityPattern;
use num_complex::Complex64;

/// A body without unknowns or equations. Its oscillators are free or driven by a given motion.
#[derive(Debug, Clone, Copy, Default)]
pub struct NoBody;

impl Problem for NoBody {
    fn n_unknowns(&self) -> usize {
        0
    }

    fn residual(&mut self, _: f64, _: &[f64], _: &[f64], _: &mut [f64]) -> Result<(), StepError> {
        Ok(())
    }

    fn jacobian_pattern(&self) -> SparsityPattern {
        SparsityPattern::zeros(0, 0)
    }

    fn jacobian(
        &mut self,
        _: f64,
        _: &[f64],
        _: &[f64],
        _: f64,
        _: f64,
        _: &mut [f64],
    ) -> Result<(), StepError> {
        Ok(())
    }

    fn kinds(&self) -> Option<Vec<VariableKind>> {
        Some(Vec::new())
    }

    fn indices(&self) -> Option<Vec<u8>> {
        Some(Vec::new())
    }
}

/// Solves the Newton systems of an empty body, which have no unknowns.
impl LinearSolver<Self> for NoBody {
    fn evaluate(&mut self, _: &mut Self, _: &Linearization<'_>) -> Result<(), StepError> {
        Ok(())
    }

    fn set_up(&mut self, _: &mut Self, _: f64, _: &[Complex64]) -> Result<(), StepError> {
        Ok(())
    }

    fn solve_real(&mut self, _: &mut Self, _: &mut [f64]) -> Result<(), StepError> {
        Ok(())
    }

    fn solve_complex(
        &mut self,
        _: &mut Self,
        _: usize,
        _: &mut [Complex64],
    ) -> Result<(), StepError> {
        Ok(())
    }
}
