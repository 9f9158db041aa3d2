//! Settings of the integrator, as plain values.
//!
//! [`IdaOptions::default`] contains the defaults of IDAS. Settings that are functions (root functions, weights,
//! quadratures) are passed to the [`IdaBuilder`](crate::IdaBuilder).

use myovib_dae::checks::{
    expect, expect_count, expect_finite_value, expect_length, expect_not_negative, expect_positive,
    expect_tolerances,
};
use myovib_dae::{Direction, IntegratorError, Suppressed, Tolerances, VariableKind};
use myovib_sparse::{Ordering, SparseOptions};

/// Returns the vector that IDAS expects: 1 for a component included in the error test, 0 for an excluded component.
/// Returns `None` if all components are included.
pub(crate) fn error_test_id(
    suppressed: &Suppressed,
    kinds: &[VariableKind],
    indices: Option<&[u8]>,
) -> Result<Option<Vec<f64>>, IntegratorError> {
    if let Suppressed::Components(excluded) = suppressed {
        expect_length("suppressed components", kinds.len(), excluded.len())?;
    }
    let excluded = suppressed.excluded(kinds, indices)?;
    let id = || excluded.iter().map(|out| f64::from(u8::from(!out))).collect();
    Ok(excluded.contains(&true).then(id))
}

/// Returns the code for `IDASetRootDirection`.
pub(crate) fn direction_code(direction: Direction) -> i32 {
    match direction {
        Direction::Both => 0,
        Direction::Rising => 1,
        Direction::Falling => -1,
    }
}

/// Returns the `id` vector of IDAS: 1 for a differential variable, 0 for an algebraic variable.
pub(crate) fn differential(kinds: &[VariableKind]) -> Vec<f64> {
    kinds.iter().map(|kind| f64::from(u8::from(*kind == VariableKind::Differential))).collect()
}

/// Inequality that a component must satisfy. A step that violates it is repeated with a smaller size.
///
/// IDAS accepts violations smaller than the fraction of the tolerance that is allowed for Newton's method.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[non_exhaustive]
pub enum Constraint {
    /// No constraint.
    #[default]
    None,
    /// y_i ≥ 0.
    NonNegative,
    /// y_i ≤ 0.
    NonPositive,
    /// y_i > 0.
    Positive,
    /// y_i < 0.
    Negative,
}

impl Constraint {
    pub(crate) fn code(self) -> f64 {
        match self {
            Self::None => 0.0,
            Self::NonNegative => 1.0,
            Self::NonPositive => -1.0,
            Self::Positive => 2.0,
            Self::Negative => -2.0,
        }
    }
}

/// Implementation of the vector arithmetic of IDAS.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[non_exhaustive]
pub enum VectorArithmetic {
    /// This crate's own arithmetic, which uses the vector instructions of the processor. Sums are computed in a
    /// different order than in SUNDIALS.
    #[default]
    Simd,
    /// Arithmetic of SUNDIALS' serial vectors, entry by entry. Intended for comparisons.
    Serial,
}

/// Settings of one integration. Except for the vector arithmetic, the defaults are the defaults of IDAS.
#[derive(Debug, Clone, PartialEq)]
pub struct IdaOptions {
    /// Relative and absolute tolerances; 1e-4 and 1e-8 by default (IDAS has no default).
    pub tolerances: Tolerances,
    /// Components excluded from the error test; none by default.
    pub suppressed: Suppressed,
    /// Maximum order of the BDF, 1 to 5; 5 by default.
    pub max_order: usize,
    /// Size of the first step; estimated by default. With [`Suppressed::FromIndex`], it is estimated by
    /// [`first_step_of_index_2`](IdaOptions::first_step_of_index_2).
    pub initial_step: Option<f64>,
    /// Minimum step size; 0 by default.
    pub min_step: f64,
    /// Maximum step size; unlimited by default.
    pub max_step: Option<f64>,
    /// Maximum number of steps in one call of [`integrate_to`](crate::IdaSolver::integrate_to); 500 by default. `None`
    /// means no limit. The limit does not apply to a single [`step`](crate::IdaSolver::step).
    pub max_steps: Option<usize>,
    /// Time that no step may pass; `None` by default.
    pub stop_time: Option<f64>,
    /// Number of error-test failures allowed in one step; 10 by default.
    pub max_error_test_failures: usize,
    /// Number of failed nonlinear solves allowed in one step; 10 by default.
    pub max_convergence_failures: usize,
    /// Newton's method has converged if its estimated error is below this fraction of the tolerance; 0.33 by default.
    pub nonlinear_coefficient: f64,
    /// Whether Newton's method, also for sensitivities, uses only convergence rates measured in the same step; `false`
    /// by default, as in IDAS. If `true`, a step has at least two iterations unless the first correction is negligible.
    /// Recommended for sensitivities, and for equations with an unknown degree of nonlinearity.
    pub strict_newton: bool,
    /// Whether to search steps for inputs that act only between the start and the end; `false` by default. This applies to
    /// each [`step`](crate::IdaSolver::step) whose end is predicted without an iteration of Newton's method. If F has
    /// large residuals within such a step, the step is repeated with a smaller size. Inputs that follow a period of
    /// rest are found in this way. Each search costs ten evaluations of F. It is disabled with sensitivities, or if components
    /// are excluded from the error test.
    pub check_within_steps: bool,
    /// Maximum number of Newton iterations in one solve; 4 by default.
    pub max_newton_iterations: usize,
    /// The matrix is set up again if c_j has changed by more than a factor (1 − δ)/(1 + δ), in either direction, since
    /// the last setup. The default of δ is 0.25.
    pub delta_cj: f64,
    /// Whether an integration that stops [compares](myovib_dae::check_jacobian) the Jacobian of the problem with
    /// difference quotients, to find a [wrong entry](myovib_dae::Stop::wrong_entry); true by default.
    pub check_jacobian_at_stop: bool,
    /// Settings of KLU. The defaults are the same as in SUNDIALS: COLAMD, block triangular form, and scaling by the
    /// largest entry of each row.
    pub sparse: SparseOptions,
    /// Implementation of the vector arithmetic; the arithmetic of this crate by default.
    pub vectors: VectorArithmetic,
    /// Inequality constraints, one per component; empty by default.
    pub constraints: Vec<Constraint>,
}

impl Default for IdaOptions {
    fn default() -> Self {
        Self {
            tolerances: Tolerances::scalar(1e-4, 1e-8),
            suppressed: Suppressed::Nothing,
            max_order: 5,
            initial_step: None,
            min_step: 0.0,
            max_step: None,
            max_steps: Some(500),
            stop_time: None,
            max_error_test_failures: 10,
            max_convergence_failures: 10,
            nonlinear_coefficient: 0.33,
            strict_newton: false,
            check_within_steps: false,
            max_newton_iterations: 4,
            delta_cj: 0.25,
            check_jacobian_at_stop: true,
            sparse: SparseOptions { ordering: Ordering::Colamd, ..SparseOptions::default() },
            vectors: VectorArithmetic::default(),
            constraints: Vec::new(),
        }
    }
}

impl IdaOptions {
    /// Returns the size of the first step if components, usually multipliers of index 2, are `excluded` from the error
    /// test. Returns `None` if the size is not below a thousandth of `span`; IDAS then chooses its own first step.
    ///
    /// The error of a first step of order 1 and this size is about one tolerance. In the first step of IDAS, the
    /// solution changes by half a tolerance. This step is so short that rounding errors of multipliers may make it
    /// fail.
    pub fn first_step_of_index_2(
        &self,
        y: &[f64],
        y_dot: &[f64],
        excluded: &[bool],
        span: f64,
    ) -> Option<f64> {
        let mut weights = vec![0.0; y.len()];
        self.tolerances.write_weights(y, &mut weights);
        let tested = (0..y.len()).filter(|&i| !excluded[i]);
        let squares: f64 = tested.clone().map(|i| (y_dot[i] * weights[i]).powi(2)).sum();
        let rate = (squares / tested.count() as f64).sqrt();
        let step = 0.5 / (rate * self.tolerances.relative().sqrt());
        (step < 1e-3 * span.abs()).then_some(step.copysign(span))
    }

    /// Validates the settings for a problem with `n` unknowns. Covers settings that IDAS does not check, or rejects
    /// without reporting their values.
    pub(crate) fn validate(&self, n: usize) -> Result<(), IntegratorError> {
        expect_tolerances(&self.tolerances, n)?;
        expect_order("max_order", self.max_order)?;
        if let Some(step) = self.initial_step {
            expect("initial_step", step, step.is_finite() && step != 0.0, "finite and not 0")?;
        }
        expect_not_negative("min_step", self.min_step)?;
        if let Some(step) = self.max_step {
            expect_positive("max_step", step)?;
            expect("max_step", step, step >= self.min_step, "at least min_step")?;
        }
        expect_finite_value("stop_time", self.stop_time.unwrap_or(0.0))?;
        expect_count("max_error_test_failures", self.max_error_test_failures)?;
        expect_count("max_convergence_failures", self.max_convergence_failures)?;
        expect_count("max_newton_iterations", self.max_newton_iterations)?;
        expect_count("max_steps", self.max_steps.unwrap_or(1))?;
        expect_positive("nonlinear_coefficient", self.nonlinear_coefficient)?;
        let below_one = self.delta_cj > 0.0 && self.delta_cj < 1.0;
        expect("delta_cj", self.delta_cj, below_one, "in (0, 1)")?;
        let pivots = self.sparse.pivot_tolerance;
        let fraction = (0.0..=1.0).contains(&pivots);
        expect("sparse.pivot_tolerance", pivots, fraction, "in [0, 1]")?;
        if !self.constraints.is_empty() {
            expect_length("constraints", n, self.constraints.len())?;
        }
        Ok(())
    }
}

/// Checks the maximum order of the BDF.
pub(crate) fn expect_order(option: &'static str, order: usize) -> Result<(), IntegratorError> {
    expect(option, order as f64, (1..=5).contains(&order), "1 to 5")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Checks the codes documented for `IDASetConstraints` and `IDASetRootDirection`.
    #[test]
    fn codes_are_those_of_the_guide() {
        use Constraint::{Negative, NonNegative, NonPositive, Positive};
        let constraints = [Constraint::None, NonNegative, NonPositive, Positive, Negative];
        assert_eq!(constraints.map(Constraint::code), [0.0, 1.0, -1.0, 2.0, -2.0]);
        let directions = [Direction::Both, Direction::Rising, Direction::Falling];
        assert_eq!(directions.map(direction_code), [0, 1, -1]);
    }

    /// Checks that the vector for IDAS contains a 0 for an excluded component.
    #[test]
    fn excluded_variables_have_a_zero_in_the_mask() {
        let kinds = [VariableKind::Differential, VariableKind::Algebraic];
        let id = |suppressed: Suppressed| {
            error_test_id(&suppressed, &kinds, Some(&[1, 2])).expect("two components")
        };
        assert_eq!(id(Suppressed::Nothing), None);
        assert_eq!(id(Suppressed::Algebraic), Some(vec![1.0, 0.0]));
        let first = Suppressed::Components(vec![true, false]);
        assert_eq!(id(first), Some(vec![0.0, 1.0]));
        assert_eq!(id(Suppressed::FromIndex(2)), Some(vec![1.0, 0.0]));
        assert_eq!(id(Suppressed::FromIndex(3)), None);
        assert_eq!(id(Suppressed::ExcludeFromIndex(2)), None);
    }
}
