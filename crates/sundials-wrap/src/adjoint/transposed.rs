//! Adjoint of a problem with constant ∂F/∂ẏ.

use nalgebra_sparse::CscMatrix;
use nalgebra_sparse::pattern::SparsityPattern;

use super::{BackwardProblem, ForwardState};
use myovib_dae::{Jacobian, Linearization, Parameters, Problem, StepError};

/// Function that evaluates ∂g/∂y and ∂g/∂p of the integrand at a state. It writes them to the last two arguments, which
/// contain zeros on entry.
type Gradient<P> =
    dyn FnMut(&mut P, &ForwardState, &mut [f64], &mut [f64]) -> Result<(), StepError> + Send;

/// Adjoint of a problem with constant ∂F/∂ẏ, for G = ∫ g(t, y, p) dt:
///
/// ```text
/// ∂F/∂ẏᵀ λ̇ − ∂F/∂yᵀ λ + ∂g/∂yᵀ = 0,   q̇_j = λᵀ ∂F/∂p_j − ∂g/∂p_j
/// ```
///
/// so that q(t0) = ∫ (∂g/∂p − λᵀ ∂F/∂p) dt. The Jacobian of the adjoint is the transpose of the problem's Jacobian.
pub struct AdjointProblem<P> {
    gradient: Box<Gradient<P>>,
    parameters: Option<Box<dyn Parameters<P> + Send>>,
    /// Jacobian of the forward problem.
    jacobian: Jacobian,
    /// ∂F/∂y and ∂F/∂ẏ at the state `at`.
    parts: [Vec<f64>; 2],
    at: Option<ForwardState>,
    transposed: SparsityPattern,
    /// Position of each entry of the transposed pattern in the pattern of the problem.
    places: Vec<usize>,
    /// ∂g/∂y and ∂g/∂p.
    gradients: [Vec<f64>; 2],
    column: Vec<f64>,
}

impl<P: Problem> AdjointProblem<P> {
    /// Creates the adjoint of `problem` for an integrand g. The function `gradient` writes ∂g/∂y and ∂g/∂p to arrays
    /// that contain zeros on entry.
    pub fn new(
        problem: &P,
        gradient: impl FnMut(&mut P, &ForwardState, &mut [f64], &mut [f64]) -> Result<(), StepError>
        + Send
        + 'static,
    ) -> Self {
        let jacobian = Jacobian::of(problem);
        let pattern = jacobian.pattern();
        let (n, nnz) = (problem.n_unknowns(), pattern.nnz());
        let places = CscMatrix::try_from_pattern_and_values(pattern.clone(), (0..nnz).collect());
        let places = places.expect("one position for each entry").transpose();
        let (transposed, places) = places.into_pattern_and_values();
        Self {
            gradient: Box::new(gradient),
            parameters: None,
            parts: [vec![0.0; nnz], vec![0.0; nnz]],
            at: None,
            transposed,
            places,
            gradients: [vec![0.0; n], Vec::new()],
            column: vec![0.0; n],
            jacobian,
        }
    }

    /// Adds one quadrature for each of the given parameters.
    #[must_use]
    pub fn parameters(mut self, parameters: impl Parameters<P> + Send + 'static) -> Self {
        self.gradients[1] = vec![0.0; parameters.list().len()];
        self.parameters = Some(Box::new(parameters));
        self
    }

    /// Evaluates ∂F/∂y, ∂F/∂ẏ and the gradient, once for each state.
    fn linearize(&mut self, forward: &mut P, at: &ForwardState) -> Result<(), StepError> {
        if self.at.as_ref() == Some(at) {
            return Ok(());
        }
        // The stored values are incomplete until both matrices and the gradient have been evaluated.
        self.at = None;
        // Step size and tolerances are unknown here. If the problem does not implement its Jacobian, difference
        // quotients use displacements of one unit of each variable.
        let weights = vec![f64::EPSILON.sqrt().recip(); at.y.len()];
        let [df_dy, df_dyp] = &mut self.parts;
        let about =
            Linearization { t: at.t, y: &at.y, y_dot: &at.y_dot, step: 1.0, weights: &weights };
        self.jacobian.parts(forward, &about, [df_dy, df_dyp])?;
        let [of_y, of_p] = &mut self.gradients;
        of_y.fill(0.0);
        of_p.fill(0.0);
        (self.gradient)(forward, at, of_y, of_p)?;
        self.at = Some(at.clone());
        Ok(())
    }
}

impl<P: Problem> BackwardProblem<P> for AdjointProblem<P> {
    fn n_unknowns(&self) -> usize {
        self.column.len()
    }

    fn residual(
        &mut self,
        forward: &mut P,
        at: &ForwardState,
        values: &[f64],
        rates: &[f64],
        residual: &mut [f64],
    ) -> Result<(), StepError> {
        self.linearize(forward, at)?;
        residual.copy_from_slice(&self.gradients[0]);
        let [df_dy, df_dyp] = &self.parts;
        for (place, (column, row)) in self.jacobian.pattern().entries().enumerate() {
            residual[column] += df_dyp[place] * rates[row] - df_dy[place] * values[row];
        }
        Ok(())
    }

    fn jacobian_pattern(&self) -> SparsityPattern {
        self.transposed.clone()
    }

    fn jacobian(
        &mut self,
        forward: &mut P,
        at: &ForwardState,
        _lambda: [&[f64]; 2],
        (a, b): (f64, f64),
        entries: &mut [f64],
    ) -> Result<(), StepError> {
        self.linearize(forward, at)?;
        let [df_dy, df_dyp] = &self.parts;
        for (entry, &place) in entries.iter_mut().zip(&self.places) {
            *entry = b * df_dyp[place] - a * df_dy[place];
        }
        Ok(())
    }

    fn n_quadratures(&self) -> usize {
        self.gradients[1].len()
    }

    fn quadrature(
        &mut self,
        forward: &mut P,
        at: &ForwardState,
        values: &[f64],
        _rates: &[f64],
        out: &mut [f64],
    ) -> Result<(), StepError> {
        self.linearize(forward, at)?;
        let Some(parameters) = &mut self.parameters else {
            return Ok(());
        };
        for (j, (out, of_p)) in out.iter_mut().zip(&self.gradients[1]).enumerate() {
            parameters.derivative(forward, j, at.t, &at.y, &at.y_dot, &mut self.column)?;
            let product = values.iter().zip(&self.column).map(|(v, c)| v * c);
            *out = product.sum::<f64>() - of_p;
        }
        Ok(())
    }
}
