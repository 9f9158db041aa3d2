//! Problems whose equations are written only once. Dual numbers provide the Jacobian.

use super::dual::{Differentiable, Dual};
use super::{Sample, Start};
use myovib_dae::{Problem, StepError, VariableKind};

/// Function F(t, y, ẏ) for any scalar type, and the properties of the variables of a [`Problem`].
pub trait Equations {
    /// Returns the number of equations and unknowns.
    fn n_unknowns(&self) -> usize;

    /// Evaluates F(t, y, ẏ) into `residual`.
    fn residual<S: Differentiable>(&self, t: f64, y: &[S], y_dot: &[S], residual: &mut [S]);

    /// Returns the number of differential variables, which precede the algebraic variables.
    fn n_differential(&self) -> usize {
        self.n_unknowns()
    }

    /// Returns the perturbation index of each variable.
    fn indices(&self) -> Vec<u8> {
        vec![1; self.n_unknowns()]
    }

    /// Returns consistent initial values.
    fn start(&self) -> Start;

    /// Returns the exact solution, if it is known in closed form.
    fn exact(&self, _t: f64) -> Option<Vec<f64>> {
        None
    }
}

/// [`Problem`] defined by some [`Equations`], with a full Jacobian.
#[derive(Debug, Clone)]
pub struct Differentiated<E> {
    equations: E,
    y: Vec<Dual<f64>>,
    y_dot: Vec<Dual<f64>>,
    residual: Vec<Dual<f64>>,
}

impl<E: Equations> Differentiated<E> {
    /// Creates the problem defined by these equations.
    pub fn new(equations: E) -> Self {
        let zero = vec![Dual::from(0.0); equations.n_unknowns()];
        Self { equations, y: zero.clone(), y_dot: zero.clone(), residual: zero }
    }
}

impl<E: Equations> Problem for Differentiated<E> {
    fn n_unknowns(&self) -> usize {
        self.equations.n_unknowns()
    }

    fn residual(
        &mut self,
        t: f64,
        y: &[f64],
        y_dot: &[f64],
        residual: &mut [f64],
    ) -> Result<(), StepError> {
        self.equations.residual(t, y, y_dot, residual);
        Ok(())
    }

    /// Computes the Jacobian by columns; column j is the derivative of F along (a e_j, b e_j).
    fn jacobian(
        &mut self,
        t: f64,
        y: &[f64],
        y_dot: &[f64],
        a: f64,
        b: f64,
        values: &mut [f64],
    ) -> Result<(), StepError> {
        for (j, column) in values.chunks_exact_mut(y.len()).enumerate() {
            let seed = |i: usize, slope: f64| if i == j { slope } else { 0.0 };
            for i in 0..y.len() {
                self.y[i] = Dual::new(y[i], seed(i, a));
                self.y_dot[i] = Dual::new(y_dot[i], seed(i, b));
            }
            let residual = &mut self.residual;
            self.equations.residual(t, &self.y, &self.y_dot, residual);
            for (value, r) in column.iter_mut().zip(residual) {
                *value = r.slope;
            }
        }
        Ok(())
    }

    fn kinds(&self) -> Option<Vec<VariableKind>> {
        let mut kinds = vec![VariableKind::Differential; self.equations.n_differential()];
        kinds.resize(self.equations.n_unknowns(), VariableKind::Algebraic);
        Some(kinds)
    }

    fn indices(&self) -> Option<Vec<u8>> {
        Some(self.equations.indices())
    }
}

impl<E: Equations> Sample for Differentiated<E> {
    fn start(&self) -> Start {
        self.equations.start()
    }

    fn exact(&self, t: f64) -> Option<Vec<f64>> {
        self.equations.exact(t)
    }
}
