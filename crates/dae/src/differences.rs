//! Jacobians by difference quotients.

use nalgebra_sparse::pattern::SparsityPattern;

use crate::colouring::colour;
use crate::linearization::Linearization;
use crate::problem::{Problem, StepError};

/// Workspace of a Jacobian by one-sided differences, one evaluation a colour.
///
/// Unknown j is moved by
///
/// ```text
/// δ_j = max(√ε |y_j|, √ε |h ẏ_j|, 1/w_j), in the direction of h ẏ_j,
/// ```
///
/// as IDA moves it for its own dense and banded Jacobians (SUNDIALS, IDALS). For a ∂F/∂y + b ∂F/∂ẏ,
/// y_j moves by a σ and ẏ_j by b σ with σ = δ_j / max(|a|, |b h|), so that neither moves further
/// than the step itself would take it.
#[derive(Debug, Clone)]
pub(crate) struct Differences {
    groups: Vec<Vec<usize>>,
    y: Vec<f64>,
    y_dot: Vec<f64>,
    base: Vec<f64>,
    moved: Vec<f64>,
    increments: Vec<f64>,
    /// Evaluations of the residual so far.
    pub(crate) evaluations: u64,
}

impl Differences {
    pub(crate) fn new(pattern: &SparsityPattern) -> Self {
        let n = pattern.major_dim();
        Self {
            groups: colour(pattern),
            y: vec![0.0; n],
            y_dot: vec![0.0; n],
            base: vec![0.0; n],
            moved: vec![0.0; n],
            increments: vec![0.0; n],
            evaluations: 0,
        }
    }

    /// Differences a ∂F/∂y + b ∂F/∂ẏ into `values`, in the order of the pattern.
    pub(crate) fn evaluate<P: Problem + ?Sized>(
        &mut self,
        problem: &mut P,
        pattern: &SparsityPattern,
        at: &Linearization<'_>,
        (a, b): (f64, f64),
        values: &mut [f64],
    ) -> Result<(), StepError> {
        self.y.copy_from_slice(at.y);
        self.y_dot.copy_from_slice(at.y_dot);
        self.evaluations += 1;
        problem.residual(at.t, at.y, at.y_dot, &mut self.base)?;
        let scale = a.abs().max((b * at.step).abs());
        for group in &self.groups {
            for &j in group {
                let wanted = displacement(at, j) / scale;
                self.y[j] = at.y[j] + a * wanted;
                // What y can represent of it, so that the quotient is of what was done.
                let sigma = match a {
                    0.0 => wanted,
                    _ => (self.y[j] - at.y[j]) / a,
                };
                self.y_dot[j] = at.y_dot[j] + b * sigma;
                self.increments[j] = sigma;
            }
            self.evaluations += 1;
            problem.residual(at.t, &self.y, &self.y_dot, &mut self.moved)?;
            for &j in group {
                let entries = pattern.major_offsets()[j]..pattern.major_offsets()[j + 1];
                for (value, &i) in values[entries].iter_mut().zip(pattern.lane(j)) {
                    *value = (self.moved[i] - self.base[i]) / self.increments[j];
                }
                (self.y[j], self.y_dot[j]) = (at.y[j], at.y_dot[j]);
            }
        }
        Ok(())
    }
}

/// δ_j, with its sign.
fn displacement(at: &Linearization<'_>, j: usize) -> f64 {
    let motion = at.step * at.y_dot[j];
    let size = f64::EPSILON.sqrt() * at.y[j].abs().max(motion.abs());
    size.max(1.0 / at.weights[j]).copysign(motion)
}
