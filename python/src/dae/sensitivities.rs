//! Forward sensitivities, computed together with the steps of an integrator.

use myovib_dae::{Parameter, Parameters, StepError};
use myovib_radau::{ForwardSensitivities, RadauSolver};
use sundials_wrap::IdaSolver;

use super::Failure;
use crate::problem::PythonDae;

/// Sensitivities ∂y/∂p_j of the solution that an integrator `I` computes.
pub(super) trait Sensitivities<I> {
    fn n_parameters(&self) -> usize;

    /// Returns whether the errors of the sensitivities limit the step size.
    fn are_in_error_test(&self) -> bool {
        false
    }

    /// Returns the number of evaluations of F for difference quotients that the integrator's statistics do not include.
    fn difference_evaluations(&self) -> u64 {
        0
    }

    /// Advances the sensitivities over the last step.
    fn follow(&mut self, solver: &mut I) -> Result<(), Failure>;

    /// Writes ∂y/∂p_j at a time within the last step.
    fn write(&self, solver: &mut I, j: usize, t: f64, out: &mut [f64]) -> Result<(), Failure>;
}

/// Integration without sensitivities.
pub(super) struct NoSensitivities;

impl<I> Sensitivities<I> for NoSensitivities {
    fn n_parameters(&self) -> usize {
        0
    }

    fn follow(&mut self, _: &mut I) -> Result<(), Failure> {
        Ok(())
    }

    fn write(&self, _: &mut I, _: usize, _: f64, _: &mut [f64]) -> Result<(), Failure> {
        Ok(())
    }
}

/// Sensitivities that IDAS integrates together with the solution.
pub(super) struct IdaSensitivities {
    pub(super) n_parameters: usize,
}

impl Sensitivities<IdaSolver<PythonDae>> for IdaSensitivities {
    fn n_parameters(&self) -> usize {
        self.n_parameters
    }

    fn are_in_error_test(&self) -> bool {
        true
    }

    fn follow(&mut self, _: &mut IdaSolver<PythonDae>) -> Result<(), Failure> {
        Ok(())
    }

    fn write(
        &self,
        solver: &mut IdaSolver<PythonDae>,
        j: usize,
        t: f64,
        out: &mut [f64],
    ) -> Result<(), Failure> {
        solver.sensitivity_dense_output(j, t, 0, out).map_err(Failure::of)
    }
}

impl Sensitivities<RadauSolver<PythonDae>> for ForwardSensitivities<PythonParameters> {
    fn n_parameters(&self) -> usize {
        Self::n_parameters(self)
    }

    fn difference_evaluations(&self) -> u64 {
        self.work().difference_evaluations
    }

    fn follow(&mut self, solver: &mut RadauSolver<PythonDae>) -> Result<(), Failure> {
        Self::follow(self, solver).map_err(Failure::of)
    }

    fn write(
        &self,
        solver: &mut RadauSolver<PythonDae>,
        j: usize,
        t: f64,
        out: &mut [f64],
    ) -> Result<(), Failure> {
        self.dense_output(solver, j, t, 0, out).map_err(Failure::of)
    }
}

/// Parameters of a DAE defined by Python functions.
pub(super) struct PythonParameters(Vec<Parameter>);

impl PythonParameters {
    /// Creates parameters from their values and typical sizes.
    pub(super) fn new(values: &[(f64, f64)]) -> Self {
        let parameter = |(j, &(value, scale)): (usize, &(f64, f64))| {
            let name = format!("parameters[{j}]");
            Parameter { name, value, scale }
        };
        Self(values.iter().enumerate().map(parameter).collect())
    }
}

impl Parameters<PythonDae> for PythonParameters {
    fn list(&self) -> &[Parameter] {
        &self.0
    }

    fn derivative(
        &mut self,
        problem: &mut PythonDae,
        j: usize,
        t: f64,
        y: &[f64],
        y_dot: &[f64],
        out: &mut [f64],
    ) -> Result<(), StepError> {
        let n_columns = self.0.len();
        let mut matrix = vec![0.0; y.len() * n_columns];
        problem.df_dp(t, [y, y_dot], &mut matrix)?;
        out.iter_mut().zip(matrix.chunks_exact(n_columns)).for_each(|(out, row)| *out = row[j]);
        Ok(())
    }

    fn derivatives(
        &mut self,
        problem: &mut PythonDae,
        t: f64,
        state: [&[f64]; 2],
        out: &mut [f64],
    ) -> Result<(), (usize, StepError)> {
        problem.df_dp(t, state, out).map_err(|error| (0, error))
    }
}
