//! Parameters of a problem, and derivatives of its equations with respect to them.

use crate::columns;
use crate::jacobian::Jacobian;
use crate::linearization::Linearization;
use crate::problem::{Problem, StepError};

/// A number on which a problem depends.
#[derive(Debug, Clone, PartialEq)]
pub struct Parameter {
    /// Name used in messages and reports.
    pub name: String,
    /// Value p.
    pub value: f64,
    /// Typical size p̄ > 0. The product p̄ ∂y/∂p has the units and the error tolerances of y.
    pub scale: f64,
}

impl Parameter {
    /// Creates a parameter whose typical size is |value|, or 1 if the value is 0.
    pub fn new(name: impl Into<String>, value: f64) -> Self {
        Self { name: name.into(), value, scale: if value == 0.0 { 1.0 } else { value.abs() } }
    }
}

/// Parameters p of a problem `P` with F(t, y, ẏ; p) = 0.
///
/// With S_j = ∂y/∂p_j the sensitivities satisfy
///
/// ```text
/// ∂F/∂y S_j + ∂F/∂ẏ Ṡ_j + ∂F/∂p_j = 0,   S_j(t_0) = ∂y_0/∂p_j.
/// ```
///
/// [`Differenced`] implements this trait for a problem whose parameters can be read and set.
pub trait Parameters<P: ?Sized> {
    /// Returns all parameters. Parameter j has index j in the list.
    fn list(&self) -> &[Parameter];

    /// Evaluates ∂F/∂p_j at (t, y, ẏ) and writes it to `out`.
    ///
    /// # Shapes
    /// `y`, `y_dot`, `out`: the number of unknowns.
    ///
    /// # Errors
    /// Returns the same errors as [`Problem::residual`].
    fn derivative(
        &mut self,
        problem: &mut P,
        j: usize,
        t: f64,
        y: &[f64],
        y_dot: &[f64],
        out: &mut [f64],
    ) -> Result<(), StepError>;

    /// Evaluates ∂F/∂p_j at (t, y, ẏ) for all j and writes the derivatives to the columns of `out`, which is stored row
    /// by row. Override this method if the derivatives have common subexpressions.
    ///
    /// # Shapes
    /// `out`: the number of unknowns times the number of parameters.
    ///
    /// # Errors
    /// Returns the index of the parameter that failed, and the error of [`derivative`](Self::derivative).
    fn derivatives(
        &mut self,
        problem: &mut P,
        t: f64,
        [y, y_dot]: [&[f64]; 2],
        out: &mut [f64],
    ) -> Result<(), (usize, StepError)> {
        let mut column = vec![0.0; y.len()];
        let n_columns = self.list().len();
        for j in 0..n_columns {
            self.derivative(problem, j, t, y, y_dot, &mut column).map_err(|error| (j, error))?;
            columns::put(&column, out, j, n_columns);
        }
        Ok(())
    }

    /// Stores ∂F/∂y and ∂F/∂ẏ at a state for later products. Returns `false` if the caller must evaluate the matrices
    /// instead. Override this method if the problem can compute the products faster than with assembled matrices.
    ///
    /// `place` identifies the state, because tangents of several states may be stored at the same time.
    ///
    /// # Errors
    /// Returns errors of the problem.
    fn keep_tangents(
        &mut self,
        _problem: &mut P,
        _place: usize,
        _at: &Linearization<'_>,
    ) -> Result<bool, StepError> {
        Ok(false)
    }

    /// Subtracts ∂F/∂y X + ∂F/∂ẏ Ẋ from `out`, with the tangents [stored](Self::keep_tangents) under this `place`. X, Ẋ
    /// and `out` are stored row by row.
    ///
    /// # Shapes
    /// All arrays: the number of unknowns times `n_columns`.
    ///
    /// # Errors
    /// Returns errors of the problem.
    fn subtract_tangents(
        &mut self,
        _place: usize,
        _at: [&[f64]; 2],
        _out: &mut [f64],
        _n_columns: usize,
    ) -> Result<(), StepError> {
        unreachable!("only where tangents are kept");
    }

    /// Returns whether [stored](Self::keep_tangents) tangents also support products with their transposes.
    fn transposes_tangents(&self) -> bool {
        false
    }

    /// Subtracts (∂F/∂y)ᵀ x and (∂F/∂ẏ)ᵀ x from the two arrays in `out`, with the tangents
    /// [stored](Self::keep_tangents) under this `place`.
    ///
    /// # Shapes
    /// All arrays: the number of unknowns.
    fn subtract_transposed_tangents(&mut self, _place: usize, _x: &[f64], _out: [&mut [f64]; 2]) {
        unreachable!("only where tangents are transposed");
    }

    /// Adds the products λᵀ ∂F/∂p_j at (t, y, ẏ) to `products`; `adjoint` contains λ. Override this method if one pass
    /// can compute the products for many parameters, such as the values of a field.
    ///
    /// # Shapes
    /// `y`, `y_dot`, `adjoint`: the number of unknowns; `products`: the number of parameters.
    ///
    /// # Errors
    /// Returns the same errors as [`Problem::residual`].
    fn add_products(
        &mut self,
        problem: &mut P,
        t: f64,
        [y, y_dot]: [&[f64]; 2],
        adjoint: &[f64],
        products: &mut [f64],
    ) -> Result<(), StepError> {
        let mut derivative = vec![0.0; y.len()];
        for (j, product) in products.iter_mut().enumerate() {
            self.derivative(problem, j, t, y, y_dot, &mut derivative)?;
            let terms = adjoint.iter().zip(&derivative);
            *product += terms.map(|(a, d)| a * d).sum::<f64>();
        }
        Ok(())
    }

    /// Evaluates ∂F/∂y and ∂F/∂ẏ and writes them to the two `parts`, as [`Jacobian::central_parts`] does. Override this
    /// method if an evaluation would overwrite matrices of the problem that the integrator still needs.
    ///
    /// # Errors
    /// Returns errors of the problem.
    fn linearize(
        &mut self,
        problem: &mut P,
        jacobian: &mut Jacobian,
        at: &Linearization<'_>,
        parts: [&mut [f64]; 2],
    ) -> Result<(), StepError>
    where
        P: Problem,
    {
        jacobian.central_parts(problem, at, parts)
    }
}

/// Parameters that one function reads and another function changes. ∂F/∂p is computed by central differences about the
/// current values of the problem.
///
/// The displacement is ε^(1/3) times |p| or the scale, whichever is larger. The relative truncation and rounding errors
/// are then about ε^(2/3) = 4e-11.
pub struct Differenced<P> {
    list: Vec<Parameter>,
    get: Box<Getter<P>>,
    set: Box<Setter<P>>,
    below: Vec<f64>,
}

/// Function that returns the value of parameter j.
type Getter<P> = dyn Fn(&P, usize) -> f64 + Send;
/// Function that sets parameter j.
type Setter<P> = dyn FnMut(&mut P, usize, f64) + Send;

impl<P> std::fmt::Debug for Differenced<P> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Differenced").field("list", &self.list).finish_non_exhaustive()
    }
}

impl<P> Differenced<P> {
    /// Creates the parameters in `list`. `get` returns the value of the parameter with the given index, and `set`
    /// changes it.
    ///
    /// The values in `list` are the initial values. A parameter that is changed later, for instance through
    /// [`Integrator::problem_mut`](crate::Integrator::problem_mut), keeps its new value.
    pub fn new(
        list: Vec<Parameter>,
        get: impl Fn(&P, usize) -> f64 + Send + 'static,
        set: impl FnMut(&mut P, usize, f64) + Send + 'static,
    ) -> Self {
        Self { list, get: Box::new(get), set: Box::new(set), below: Vec::new() }
    }
}

impl<P: Problem> Parameters<P> for Differenced<P> {
    fn list(&self) -> &[Parameter] {
        &self.list
    }

    fn derivative(
        &mut self,
        problem: &mut P,
        j: usize,
        t: f64,
        y: &[f64],
        y_dot: &[f64],
        out: &mut [f64],
    ) -> Result<(), StepError> {
        let value = (self.get)(problem, j);
        self.list[j].value = value;
        let scale = self.list[j].scale;
        let wanted = f64::EPSILON.cbrt() * value.abs().max(scale);
        let (low, high) = (value - wanted, value + wanted);
        self.below.resize(out.len(), 0.0);
        (self.set)(problem, j, high);
        let above = problem.residual(t, y, y_dot, out);
        (self.set)(problem, j, low);
        let below = problem.residual(t, y, y_dot, &mut self.below);
        // Restore the problem, whether or not the evaluation succeeded.
        (self.set)(problem, j, value);
        above.and(below)?;
        // Use the displacement after rounding of the parameter, so that the quotient refers to the actual change.
        let distance = high - low;
        for (out, below) in out.iter_mut().zip(&self.below) {
            *out = (*out - below) / distance;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// ẏ + exp(p) y = 0; the residual cannot be evaluated for p > 2.
    struct Decay(f64);

    impl Problem for Decay {
        fn n_unknowns(&self) -> usize {
            1
        }

        fn residual(
            &mut self,
            _: f64,
            y: &[f64],
            y_dot: &[f64],
            r: &mut [f64],
        ) -> Result<(), StepError> {
            if self.0 > 2.0 {
                return Err(StepError::Recoverable("p > 2".into()));
            }
            r[0] = y_dot[0] + self.0.exp() * y[0];
            Ok(())
        }
    }

    fn decay(p: f64) -> Differenced<Decay> {
        let list = vec![Parameter::new("p", p)];
        Differenced::new(
            list,
            |problem: &Decay, _| problem.0,
            |problem, _, p| {
                *problem = Decay(p);
            },
        )
    }

    /// Regression test: a parameter changed after the creation of the list was reset to the value in the list.
    #[test]
    fn a_parameter_that_was_changed_keeps_its_value() {
        let mut parameters = decay(0.5);
        let (mut problem, mut out) = (Decay(1.0), [0.0]);
        parameters.derivative(&mut problem, 0, 0.0, &[3.0], &[0.0], &mut out).unwrap();
        // The truncation error is 1e-11 and the rounding error 9e-11, as below.
        assert!((out[0] - 3.0 * 1.0_f64.exp()).abs() < 1e-9, "{out:?}");
        assert_eq!((problem.0, parameters.list()[0].value), (1.0, 1.0));
    }

    #[test]
    fn the_quotient_is_the_derivative_and_the_problem_stays_as_it_was() {
        let mut parameters = decay(0.5);
        let (mut problem, mut out) = (Decay(0.5), [0.0]);
        parameters.derivative(&mut problem, 0, 0.0, &[3.0], &[0.0], &mut out).unwrap();
        // The truncation error is δ²/6 = 6e-12 and the rounding error ε/δ = 4e-11, for a residual of 5.
        assert!((out[0] - 3.0 * 0.5_f64.exp()).abs() < 1e-9, "{out:?}");
        assert_eq!(problem.0, 0.5);
    }

    #[test]
    fn failures_are_returned_and_the_problem_is_unchanged() {
        let mut parameters = decay(2.0);
        let mut problem = Decay(2.0);
        let failed = parameters.derivative(&mut problem, 0, 0.0, &[3.0], &[0.0], &mut [0.0]);
        assert!(matches!(failed, Err(StepError::Recoverable(_))));
        assert_eq!(problem.0, 2.0);
    }
}
