//! The Jacobian of a problem, evaluated by the problem or by difference quotients.

use nalgebra_sparse::pattern::SparsityPattern;

use crate::differences::Differences;
use crate::linearization::Linearization;
use crate::problem::{Problem, StepError};

/// Jacobian of one problem. It is evaluated by [`Problem::jacobian`] or, if the problem does not implement this method,
/// by difference quotients of the residual with a coloring of the pattern.
///
/// # Examples
/// ```
/// use myovib_dae::{Jacobian, Linearization, Problem, StepError};
///
/// /// ẏ + y² = 0
/// struct Square;
/// impl Problem for Square {
///     fn n_unknowns(&self) -> usize {
///         1
///     }
///     fn residual(&mut self, _: f64, y: &[f64], v: &[f64], r: &mut [f64]) -> Result<(), StepError> {
///         r[0] = v[0] + y[0] * y[0];
///         Ok(())
///     }
/// }
///
/// let mut jacobian = Jacobian::of(&Square);
/// let at = Linearization { t: 0.0, y: &[3.0], y_dot: &[-9.0], step: 0.1, weights: &[1e8] };
/// let mut value = [0.0];
/// jacobian.combined(&mut Square, &at, (1.0, 10.0), &mut value)?;
/// assert!((value[0] - 16.0).abs() < 1e-6);
/// # Ok::<(), StepError>(())
/// ```
#[derive(Debug, Clone)]
pub struct Jacobian {
    pattern: SparsityPattern,
    /// Workspace for difference quotients, used if the problem does not implement its Jacobian.
    differences: Option<Differences>,
    /// Whether difference quotients with coarse displacements are compared with quotients with fine displacements.
    refines: bool,
}

impl Jacobian {
    /// Creates the Jacobian of `problem`.
    pub fn of<P: Problem + ?Sized>(problem: &P) -> Self {
        Self::with_pattern(problem.jacobian_pattern())
    }

    /// Creates the Jacobian of a problem with this pattern.
    pub fn with_pattern(pattern: SparsityPattern) -> Self {
        Self { pattern, differences: None, refines: true }
    }

    /// Disables fine displacements. Even if entries are missing in the pattern, the quotients then describe the effect
    /// of changes by the tolerances.
    pub(crate) fn coarse(mut self) -> Self {
        self.refines = false;
        self
    }

    /// Returns the pattern in compressed-column form.
    pub fn pattern(&self) -> &SparsityPattern {
        &self.pattern
    }

    /// Evaluates a ∂F/∂y + b ∂F/∂ẏ and writes it to `values`, in the order of the pattern.
    ///
    /// # Errors
    /// Returns errors of the problem.
    pub fn combined<P: Problem + ?Sized>(
        &mut self,
        problem: &mut P,
        at: &Linearization<'_>,
        (a, b): (f64, f64),
        values: &mut [f64],
    ) -> Result<(), StepError> {
        if self.differences.is_none() {
            match problem.jacobian(at.t, at.y, at.y_dot, a, b, values) {
                Err(StepError::NoJacobian) => {}
                provided => return provided,
            }
        }
        self.difference(problem, at, (a, b), values)
    }

    /// Evaluates ∂F/∂y and ∂F/∂ẏ and writes them to the two `parts`, in the order of the pattern.
    ///
    /// # Errors
    /// Returns errors of the problem.
    pub fn parts<P: Problem + ?Sized>(
        &mut self,
        problem: &mut P,
        at: &Linearization<'_>,
        parts: [&mut [f64]; 2],
    ) -> Result<(), StepError> {
        let [df_dy, df_dyp] = parts;
        if self.differences.is_none() {
            match problem.jacobian_parts(at.t, at.y, at.y_dot, [df_dy, df_dyp]) {
                Err(StepError::NoJacobian) => {}
                provided => return provided,
            }
        }
        self.difference(problem, at, (1.0, 0.0), df_dy)?;
        self.difference(problem, at, (0.0, 1.0), df_dyp)
    }

    /// Evaluates ∂F/∂y and ∂F/∂ẏ as [`parts`](Self::parts) does, but by central differences if the problem does not
    /// implement its Jacobian. One-sided quotients for displacements of √ε |y| have errors of √ε, which are divided by
    /// h² in sensitivities of systems of index 3.
    ///
    /// # Errors
    /// Returns errors of the problem.
    pub fn central_parts<P: Problem + ?Sized>(
        &mut self,
        problem: &mut P,
        at: &Linearization<'_>,
        [df_dy, df_dyp]: [&mut [f64]; 2],
    ) -> Result<(), StepError> {
        // Central quotients for displacements of ε^(1/3) |y| have truncation and rounding errors of about ε^(2/3).
        // Displacements of ẏ have other sizes, because F is usually linear in ẏ.
        let size =
            |i: usize| f64::EPSILON.cbrt() * at.y[i].abs().max((at.step * at.y_dot[i]).abs());
        let weights = at.weights.iter().enumerate().map(|(i, w)| 1.0 / (1.0 / w).max(size(i)));
        let weights: Vec<f64> = weights.collect();
        let at = Linearization { weights: &weights, ..*at };
        self.parts(problem, &at, [df_dy, df_dyp])?;
        if self.differences.is_none() {
            return Ok(());
        }
        let mut backward = [df_dy.to_vec(), df_dyp.to_vec()];
        // Displacements have the direction of motion, which changes with the sign of the step.
        let at = Linearization { step: -at.step, ..at };
        let [by_y, by_rate] = &mut backward;
        self.parts(problem, &at, [by_y, by_rate])?;
        for (values, others) in [df_dy, df_dyp].into_iter().zip(&backward) {
            values.iter_mut().zip(others).for_each(|(a, b)| *a = f64::midpoint(*a, *b));
        }
        Ok(())
    }

    /// Returns the number of residual evaluations used for difference quotients, or 0 if the problem implements its
    /// Jacobian.
    pub fn residual_evaluations(&self) -> u64 {
        self.differences.as_ref().map_or(0, |d| d.evaluations)
    }

    fn difference<P: Problem + ?Sized>(
        &mut self,
        problem: &mut P,
        at: &Linearization<'_>,
        coefficients: (f64, f64),
        values: &mut [f64],
    ) -> Result<(), StepError> {
        let (pattern, refines) = (&self.pattern, self.refines);
        let differences =
            self.differences.get_or_insert_with(|| Differences::new(pattern, refines));
        differences.evaluate(problem, pattern, at, coefficients, values)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// ẏ0 + y0 = 0 and y0 + y1 − 1 = 0.
    struct Sum;

    impl Problem for Sum {
        fn n_unknowns(&self) -> usize {
            2
        }

        fn residual(
            &mut self,
            _t: f64,
            y: &[f64],
            y_dot: &[f64],
            residual: &mut [f64],
        ) -> Result<(), StepError> {
            residual[0] = y_dot[0] + y[0];
            residual[1] = y[0] + y[1] - 1.0;
            Ok(())
        }
    }

    /// ẏ + y³ = 0 with a tolerance of 1e-3. One-sided quotients have a relative error of 1e-3, and central quotients
    /// have an error of the order of its square.
    #[test]
    fn central_differences_are_more_accurate_than_the_tolerance() {
        struct Cube;
        impl Problem for Cube {
            fn n_unknowns(&self) -> usize {
                1
            }

            fn residual(
                &mut self,
                _t: f64,
                y: &[f64],
                y_dot: &[f64],
                residual: &mut [f64],
            ) -> Result<(), StepError> {
                residual[0] = y_dot[0] + y[0].powi(3);
                Ok(())
            }
        }
        let mut jacobian = Jacobian::of(&Cube);
        for y_dot in [-1.0, 0.0] {
            let at =
                Linearization { t: 0.0, y: &[1.0], y_dot: &[y_dot], step: 0.1, weights: &[1e3] };
            let (mut df_dy, mut df_dyp) = ([0.0], [0.0]);
            jacobian.parts(&mut Cube, &at, [&mut df_dy, &mut df_dyp]).unwrap();
            assert!((df_dy[0] - 3.0).abs() > 1e-3, "{df_dy:?}");
            jacobian.central_parts(&mut Cube, &at, [&mut df_dy, &mut df_dyp]).unwrap();
            assert!((df_dy[0] - 3.0).abs() < 2e-6, "{df_dy:?}");
            assert!((df_dyp[0] - 1.0).abs() < 1e-6, "{df_dyp:?}");
        }
    }

    /// A variable with zero value and derivative is added to a variable of order one. If the displacement were √ε times
    /// the tolerance, it would be lost in the sum, and the column of the variable would be zero.
    #[test]
    fn increments_at_zero_follow_the_tolerance() {
        let mut jacobian = Jacobian::of(&Sum);
        let at = Linearization {
            t: 0.0,
            y: &[1.0, 0.0],
            y_dot: &[-1.0, 0.0],
            step: 1e-6,
            weights: &[1e6, 1e10],
        };
        let mut values = [0.0; 4];
        jacobian.combined(&mut Sum, &at, (1.0, 0.0), &mut values).unwrap();
        // There is one entry per column. The bound is above the rounding error of the sum, ε, divided by the smallest
        // increment, 1e-10.
        for (found, exact) in values.iter().zip([1.0, 1.0, 0.0, 1.0]) {
            assert!((found - exact).abs() < 1e-5, "{values:?}");
        }
    }
}
