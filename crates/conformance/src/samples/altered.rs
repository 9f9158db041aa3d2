//! Samples with a wrong Jacobian.

use myovib_dae::{Problem, SparsityPattern, StepError, VariableKind};

use super::{Sample, Start};

/// A sample with one entry of its Jacobian multiplied by a factor.
#[derive(Debug, Clone, Copy)]
pub struct Altered<S> {
    /// Sample with the correct Jacobian.
    pub sample: S,
    /// Position of the entry in the pattern.
    pub place: usize,
    /// Factor of the entry.
    pub factor: f64,
}

impl<S: Sample> Sample for Altered<S> {
    fn start(&self) -> Start {
        self.sample.start()
    }
}

impl<S: Problem> Problem for Altered<S> {
    fn n_unknowns(&self) -> usize {
        self.sample.n_unknowns()
    }

    fn residual(&mut self, t: f64, y: &[f64], v: &[f64], r: &mut [f64]) -> Result<(), StepError> {
        self.sample.residual(t, y, v, r)
    }

    fn jacobian_pattern(&self) -> SparsityPattern {
        self.sample.jacobian_pattern()
    }

    fn jacobian(
        &mut self,
        t: f64,
        y: &[f64],
        v: &[f64],
        a: f64,
        b: f64,
        values: &mut [f64],
    ) -> Result<(), StepError> {
        self.sample.jacobian(t, y, v, a, b, values)?;
        values[self.place] *= self.factor;
        Ok(())
    }

    fn kinds(&self) -> Option<Vec<VariableKind>> {
        self.sample.kinds()
    }

    fn indices(&self) -> Option<Vec<u8>> {
        self.sample.indices()
    }
}
