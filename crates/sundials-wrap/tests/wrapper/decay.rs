//! The problem ẏ = −y with functions that can be made to fail.

use myovib_dae::{Outcome, Problem, StepError, VariableKind};
use nalgebra_sparse::pattern::SparsityPattern;

use sundials_wrap::{Error, IdaSolver};

/// ẏ = −y with a residual and a Jacobian that can be made to fail.
pub(crate) struct Decay {
    pub(crate) pattern: SparsityPattern,
    pub(crate) residual: Box<dyn FnMut(f64, f64) -> Result<f64, StepError> + Send>,
    pub(crate) jacobian: Box<dyn FnMut(f64) -> Result<f64, StepError> + Send>,
}

impl Decay {
    pub(crate) fn new() -> Self {
        Self {
            pattern: SparsityPattern::try_from_offsets_and_indices(1, 1, vec![0, 1], vec![0])
                .unwrap(),
            residual: Box::new(|_, y| Ok(y)),
            jacobian: Box::new(|_| Ok(1.0)),
        }
    }

    pub(crate) fn residual(
        f: impl FnMut(f64, f64) -> Result<f64, StepError> + Send + 'static,
    ) -> Self {
        Self { residual: Box::new(f), ..Self::new() }
    }

    pub(crate) fn jacobian(f: impl FnMut(f64) -> Result<f64, StepError> + Send + 'static) -> Self {
        Self { jacobian: Box::new(f), ..Self::new() }
    }

    pub(crate) fn solver(self) -> IdaSolver<Self> {
        IdaSolver::builder(self).build(0.0, &[1.0], &[-1.0]).unwrap()
    }
}

impl Problem for Decay {
    fn n_unknowns(&self) -> usize {
        1
    }
    fn residual(
        &mut self,
        t: f64,
        y: &[f64],
        y_dot: &[f64],
        r: &mut [f64],
    ) -> Result<(), StepError> {
        r[0] = y_dot[0] + (self.residual)(t, y[0])?;
        Ok(())
    }
    fn jacobian_pattern(&self) -> SparsityPattern {
        self.pattern.clone()
    }
    fn jacobian(
        &mut self,
        t: f64,
        _y: &[f64],
        _y_dot: &[f64],
        a: f64,
        b: f64,
        values: &mut [f64],
    ) -> Result<(), StepError> {
        let slope = (self.jacobian)(t)?;
        values.fill(a * slope + b);
        Ok(())
    }
    fn kinds(&self) -> Option<Vec<VariableKind>> {
        Some(vec![VariableKind::Differential])
    }
    fn indices(&self) -> Option<Vec<u8>> {
        Some(vec![0])
    }
    fn component_name(&self, _: usize) -> String {
        "amount".to_owned()
    }
}

/// Returns the details of the stop; the integration must have stopped.
pub(crate) fn stop(outcome: Result<Outcome, Error>) -> myovib_dae::Stop {
    match outcome.unwrap() {
        Outcome::Stopped(stop) => *stop,
        other => panic!("did not stop: {other:?}"),
    }
}
