//! Settings of the integrator, as plain values.

use myovib_dae::checks::{
    expect, expect_count, expect_finite_value, expect_length, expect_positive, expect_tolerances,
};
use myovib_dae::{IntegratorError, Suppressed, Tolerances, VariableKind};
use myovib_sparse::SparseOptions;

use crate::control::Control;

/// Lower bound for the factor by which steps may grow if the measured errors of multipliers are only rounding errors.
const GROWTH_IN_NOISE: f64 = 2.0;

/// Factor by which the ratio of the absolute tolerance to y is multiplied to obtain the requested accuracy. It is less
/// than 1, because absolute tolerances are often chosen for larger variables.
const ABSOLUTE_FRACTION: f64 = 0.1;
/// Largest relative accuracy derived from absolute tolerances.
const MAX_ACCURACY: f64 = 1e-6;

/// Selection of the step size.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum StepSize {
    /// Determined by the estimated error.
    Adaptive,
    /// Constant, except that a step is shortened to meet a stop time. The error is not estimated. If the stage
    /// equations of a step cannot be solved, the integration stops.
    Fixed(f64),
}

/// Selects the variables whose errors are multiplied by (h/T)^(k−1), where k is the index of the variable and T is the
/// [`time_scale`](RadauOptions::time_scale).
///
/// The error of a variable of index k is larger than the errors of the variables that determine it by a factor of
/// h^(1−k), and contributes to their errors only with the factor h^(k−1) (Hairer & Wanner VII.7).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum IndexScaling {
    /// Errors of all variables of index 2 and 3, as in RADAU5.
    All,
    /// Errors of algebraic variables of index 2 and 3. The error of a velocity of index 2 is not reduced, because the
    /// next step corrects only the part that violates the constraint.
    #[default]
    Algebraic,
    /// No errors.
    None,
}

/// Maximum local error of an algebraic variable of index 2 or 3, in units of the tolerance. Such a variable may
/// therefore have two correct digits fewer than other variables.
const OWN_ERROR: f64 = 100.0;

impl IndexScaling {
    /// Returns the power of h for each variable.
    pub(crate) fn powers(self, kinds: &[VariableKind], indices: &[u8]) -> Vec<i32> {
        let scaled = |kind| match self {
            Self::All => true,
            Self::Algebraic => kind == VariableKind::Algebraic,
            Self::None => false,
        };
        let variables = kinds.iter().zip(indices);
        variables
            .map(|(&kind, &index)| match scaled(kind) {
                true => i32::from(index.max(1)) - 1,
                false => 0,
            })
            .collect()
    }
}

/// Settings of one integration. Settings that also exist in Hairer and Wanner's code RADAU5 have the same defaults as
/// in RADAU5. Settings that also exist in IDAS have the same names as in `sundials_wrap::IdaOptions`.
///
/// # Examples
/// ```
/// use myovib_radau::RadauOptions;
/// use myovib_dae::Tolerances;
///
/// let options =
///     RadauOptions { tolerances: Tolerances::scalar(1e-6, 1e-9), ..RadauOptions::default() };
/// assert_eq!(options.stages, 3);
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct RadauOptions {
    /// Number of stages: 1 (implicit Euler), 3 (order 5, the default), 5 or 7.
    pub stages: usize,
    /// Relative and absolute tolerances; 1e-4 and 1e-8 by default.
    pub tolerances: Tolerances,
    /// Whether the tolerances apply to the error of the solution (the default). The order of the estimate is only
    /// s + 1, two less than the order of the local error for s = 3. Therefore, the estimate is compared with
    /// 0.1 rtol^((s+1)/(2s)), with atol in proportion (Hairer & Wanner IV.8). If `false`, or if the relative tolerance
    /// is 0, the estimate is compared with the tolerances without this conversion.
    pub tolerances_for_solution: bool,
    /// Selects the variables of index k whose errors are multiplied by (h/T)^(k−1) in the error test and in Newton's
    /// convergence test; [`IndexScaling::Algebraic`] by default.
    pub index_scaling: IndexScaling,
    /// Time T in which an error of a variable of index 2 as large as its tolerance changes other variables by their
    /// tolerances; 1 by default. If T is converted together with the unit of time, the steps do not depend on this
    /// unit.
    pub time_scale: f64,
    /// Components excluded from the error test, but not from Newton's convergence test; none by default.
    pub suppressed: Suppressed,
    /// Whether the error of dense output limits the step size; true by default. If there are no root functions, steps
    /// of [`integrate_to`](crate::RadauSolver::integrate_to) are not limited, because the last step ends at the output
    /// time. Multipliers of index 2 are excluded in the step that contains their jump, and whenever rounding errors
    /// divided by the step size exceed their tolerance.
    pub dense_output: bool,
    /// Whether the error of dense output limits steps of 5 or 7 stages to ten tolerances even if dense output is not
    /// used; false by default. This limit detects kinks and pulses within steps.
    pub detect_kinks: bool,
    /// Whether rapidly growing steps are tested for inputs between their stages, and repeated if an input is found;
    /// true by default. A test costs at least ten evaluations of the residual. It is unnecessary if all steps are short
    /// enough to resolve the inputs. There is no test if `max_step` is set, or if the problem has multipliers or
    /// internal variables.
    pub detect_inputs: bool,
    /// Step-size control; [`StepSize::Adaptive`] by default.
    pub step_size: StepSize,
    /// Size of the first step. The default is the smaller of (t_out − t_0)/1000 and 1/(2 τ^(1/4) ‖ẏ_0‖), where τ is the
    /// relative tolerance of the estimate and the norm is in units of the tolerances. If there are multipliers of index
    /// 3, the size is increased, up to (t_out − t_0)/10, until the rounding error of these multipliers, which is
    /// proportional to 1/h², is within the tolerances.
    pub initial_step: Option<f64>,
    /// Minimum step size; 0 by default, so that only rounding of t limits the step size.
    pub min_step: f64,
    /// Maximum step size; unlimited by default.
    pub max_step: Option<f64>,
    /// Maximum number of steps in one call of [`integrate_to`](crate::RadauSolver::integrate_to); unlimited by default.
    /// The limit does not apply to a single [`step`](crate::RadauSolver::step).
    pub max_steps: Option<usize>,
    /// Time at which a step must end, so that no step passes it; none by default.
    pub stop_time: Option<f64>,
    /// Maximum number of error-test failures in one step; 10 by default.
    pub max_error_test_failures: usize,
    /// Maximum number of failures to solve the stage equations in one step; 10 by default.
    pub max_convergence_failures: usize,
    /// Maximum number of Newton iterations in one solve. The default is 7 for up to 3 stages, 12 for 5 stages, and 17
    /// for 7 stages.
    pub max_newton_iterations: Option<usize>,
    /// Newton's method has converged if its estimated error is below this fraction of the tolerance for the estimate.
    /// The default is 1/30 of the tolerance for the solution, or a tenth of this value if a variable has index 2 or 3.
    /// If the fraction is specified, it also applies to sensitivities.
    pub newton_tolerance: Option<f64>,
    /// A Jacobian is reused for the next step if the contraction rate of Newton's method is at most this value; 0.001
    /// by default. Use a larger value if evaluations of the Jacobian are expensive. With 0, the Jacobian is reused only
    /// after steps in which one iteration was sufficient.
    pub jacobian_reuse: f64,
    /// Interval of the ratio of the proposed step size to the last step size in which the step size and the factors are
    /// kept; 1 to 1.2 by default.
    pub step_window: (f64, f64),
    /// Safety factor of the step-size control; 0.9 by default.
    pub safety: f64,
    /// Whether an integration that stops [compares](myovib_dae::check_jacobian) the Jacobian of the problem with
    /// difference quotients, to find a [wrong entry](myovib_dae::Stop::wrong_entry); true by default.
    pub check_jacobian_at_stop: bool,
    /// Settings of the sparse solver; [`SparseOptions::default`] by default.
    pub sparse: SparseOptions,
}

impl Default for RadauOptions {
    fn default() -> Self {
        Self {
            stages: 3,
            tolerances: Tolerances::scalar(1e-4, 1e-8),
            tolerances_for_solution: true,
            index_scaling: IndexScaling::default(),
            time_scale: 1.0,
            suppressed: Suppressed::Nothing,
            dense_output: true,
            detect_kinks: false,
            detect_inputs: true,
            step_size: StepSize::Adaptive,
            initial_step: None,
            min_step: 0.0,
            max_step: None,
            max_steps: None,
            stop_time: None,
            max_error_test_failures: 10,
            max_convergence_failures: 10,
            max_newton_iterations: None,
            newton_tolerance: None,
            jacobian_reuse: 1e-3,
            step_window: (1.0, 1.2),
            safety: 0.9,
            check_jacobian_at_stop: true,
            sparse: SparseOptions::default(),
        }
    }
}

impl RadauOptions {
    /// Checks all settings for a problem with `n` unknowns.
    pub(crate) fn validate(&self, n: usize) -> Result<(), IntegratorError> {
        self.validate_tolerances(n)?;
        self.validate_steps()?;
        self.validate_counts()?;
        let reuse = self.jacobian_reuse;
        let is_valid = (0.0..1.0).contains(&reuse);
        expect("jacobian_reuse", reuse, is_valid, "in [0, 1)")?;
        let pivots = self.sparse.pivot_tolerance;
        let fraction = (0.0..=1.0).contains(&pivots);
        expect("sparse.pivot_tolerance", pivots, fraction, "in [0, 1]")?;
        let below_one = self.safety > 0.0 && self.safety < 1.0;
        expect("safety", self.safety, below_one, "in (0, 1)")
    }

    fn validate_tolerances(&self, n: usize) -> Result<(), IntegratorError> {
        let relative = self.tolerances.relative();
        let below_one = (0.0..1.0).contains(&relative);
        expect("relative tolerance", relative, below_one, "in [0, 1)")?;
        expect_tolerances(&self.tolerances, n)?;
        if let Suppressed::Components(excluded) = &self.suppressed {
            expect_length("suppressed components", n, excluded.len())?;
        }
        let newton = self.newton_tolerance.unwrap_or(1.0);
        expect_positive("newton_tolerance", newton)?;
        expect_positive("time_scale", self.time_scale)
    }

    fn validate_steps(&self) -> Result<(), IntegratorError> {
        for (option, step) in [("initial_step", self.initial_step), ("max_step", self.max_step)] {
            expect_positive(option, step.unwrap_or(1.0))?;
        }
        let (min, max) = (self.min_step, self.max_step.unwrap_or(f64::INFINITY));
        expect("min_step", min, min >= 0.0, "≥ 0")?;
        expect("max_step", max, max > min, "above min_step")?;
        if let StepSize::Fixed(h) = self.step_size {
            expect_positive("step_size", h)?;
            let between = (min..=max).contains(&h);
            expect("step_size", h, between, "between min_step and max_step")?;
        }
        let (low, high) = self.step_window;
        let begins = low > 0.0 && low <= 1.0;
        expect("start of step_window", low, begins, "in (0, 1]")?;
        expect("end of step_window", high, high >= 1.0, "≥ 1")?;
        let stop_time = self.stop_time.unwrap_or(0.0);
        expect_finite_value("stop_time", stop_time)
    }

    fn validate_counts(&self) -> Result<(), IntegratorError> {
        let counts = [
            ("max_steps", self.max_steps.unwrap_or(1)),
            ("max_error_test_failures", self.max_error_test_failures),
            ("max_convergence_failures", self.max_convergence_failures),
            ("max_newton_iterations", self.newton_limit()),
        ];
        counts.into_iter().try_for_each(|(option, count)| expect_count(option, count))
    }

    /// Returns the relative accuracy for which the tolerances of the solution `y` are converted. This is the relative
    /// tolerance unless it is below 1e-6 and the absolute tolerances dominate in all components. Then, the accuracy is
    /// a tenth of the smallest ratio of an absolute tolerance to y, but at most 1e-6, because the factor for a very
    /// small relative tolerance would increase the absolute tolerances, and the errors, without limit.
    pub(crate) fn accuracy(&self, y: &[f64]) -> f64 {
        let relative = self.tolerances.relative();
        if relative == 0.0 || relative >= MAX_ACCURACY {
            return relative;
        }
        let ratios = y.iter().enumerate().map(|(i, y)| self.tolerances.absolute(i) / y.abs());
        (ABSOLUTE_FRACTION * ratios.fold(f64::INFINITY, f64::min)).clamp(relative, MAX_ACCURACY)
    }

    /// Returns the tolerances for the estimate at `y`: the relative tolerance, and the absolute tolerances of the
    /// components.
    pub(crate) fn internal_tolerances(&self, y: &[f64]) -> (f64, impl Fn(usize) -> f64) {
        let factor = self.internal_factor(self.accuracy(y));
        (factor * self.tolerances.relative(), move |i| factor * self.tolerances.absolute(i))
    }

    /// Returns the factor that converts tolerances for the solution to tolerances for the estimate at the `relative`
    /// tolerance: 0.1 rtol^((s+1)/(2s) − 1). The factor is 1 if
    /// [`tolerances_for_solution`](Self::tolerances_for_solution) is false.
    pub fn internal_factor(&self, relative: f64) -> f64 {
        let s = self.stages as f64;
        match self.tolerances_for_solution && relative > 0.0 {
            true => 0.1 * relative.powf((s + 1.0) / (2.0 * s) - 1.0),
            false => 1.0,
        }
    }

    /// Returns two factors: the ratio of the tolerance for the estimate to the tolerance for the solution, and
    /// [`own_weight`](Self::own_weight).
    pub(crate) fn weight_factors(&self, relative: f64) -> [f64; 2] {
        let loosened = self.internal_factor(relative).max(1.0);
        [loosened, self.own_weight(relative)]
    }

    /// Returns the weight for the separate test of the local error of a variable whose errors are multiplied by
    /// h^(k−1), as a fraction of the unscaled weight. Returns 0 if there is no such test.
    ///
    /// The unscaled weight applies to the estimate, which has order s + 1. The estimate for an algebraic variable has
    /// the order of its error, and may be [`OWN_ERROR`] times the tolerance for the solution.
    pub(crate) fn own_weight(&self, relative: f64) -> f64 {
        let loosened = self.internal_factor(relative);
        match self.index_scaling {
            IndexScaling::Algebraic => (loosened / OWN_ERROR).min(1.0),
            IndexScaling::All | IndexScaling::None => 0.0,
        }
    }

    /// Returns Newton's tolerance as a fraction of the tolerance for the estimate.
    ///
    /// The remaining error of Newton's method is an error of the solution, independent of the order of the method.
    /// Newton's tolerance is therefore a fraction of the tolerance for the solution. For s = 3, it is 0.1^(3/2) rtol as
    /// in RADAU5, which is (0.1 rtol^(2/3))^(1/2) times the tolerance for the estimate, 0.1 rtol^(2/3). If there is a
    /// hidden `constraint`, the estimate of the next step amplifies this error, by a factor of two for three stages and
    /// six for seven stages.
    pub(crate) fn newton_tolerance(&self, relative: f64, constraint: bool) -> f64 {
        let internal = relative * self.internal_factor(relative);
        let fraction = if constraint { 0.1 } else { 1.0 };
        self.newton_tolerance.unwrap_or_else(|| match relative > 0.0 {
            true => {
                let tolerance = (0.1_f64.powf(1.5) / self.internal_factor(relative)).min(0.03);
                (fraction * tolerance).max(10.0 * f64::EPSILON / internal)
            }
            // The requested number of digits is unknown, so the value for 1e-6 is used.
            false => 1e-3,
        })
    }

    /// Returns Newton's tolerance for sensitivities that do not affect the steps, as a fraction of the tolerance for
    /// the estimate. It is ten times the value for the solution without hidden constraints, which is a third of the
    /// tolerance for the solution, as in IDAS. In two cases, it is not multiplied by ten: for at most three stages,
    /// because the many steps would accumulate these errors, and with a hidden `constraint`, which amplifies them.
    pub(crate) fn sensitivity_tolerance(&self, relative: f64, constraint: bool) -> f64 {
        let newton = self.newton_tolerance(relative, false);
        match self.newton_tolerance {
            None if self.stages > 3 && !constraint => (10.0 * newton).min(1.0 / 3.0),
            _ => newton,
        }
    }

    /// Returns the relative tolerance for the solution that corresponds to the tolerance `internal` for the estimate,
    /// or the relative tolerance of the options if it is smaller.
    pub(crate) fn relative_for(&self, internal: f64) -> f64 {
        let s = self.stages as f64;
        let relative = match self.tolerances_for_solution {
            true => (10.0 * internal).powf(2.0 * s / (s + 1.0)),
            false => internal,
        };
        match self.tolerances.relative() {
            0.0 => relative,
            own => relative.min(own),
        }
    }

    /// Returns the step-size control for these options, with or without a hidden `constraint`.
    pub(crate) fn control(&self, constraint: bool) -> Control {
        let loosened = self.internal_factor(self.tolerances.relative());
        let limit = self.newton_limit();
        Control::new(self.stages, self.safety, limit, loosened, constraint)
    }

    /// Returns the factor by which a step may grow if the measured errors of multipliers are only rounding errors. The
    /// factor exceeds the upper end of the interval in which the last step size is kept. Otherwise, a short step, in
    /// which rounding errors are larger, would never become longer.
    pub(crate) fn growth_in_noise(&self) -> f64 {
        let (_, window_end) = self.step_window;
        GROWTH_IN_NOISE.max(1.01 * window_end / self.safety)
    }

    /// Returns the maximum number of Newton iterations.
    pub(crate) fn newton_limit(&self) -> usize {
        self.max_newton_iterations.unwrap_or(7 + self.stages.saturating_sub(3) * 5 / 2)
    }

    /// Returns 1 for components included in the error test, 0 for excluded components.
    pub(crate) fn error_mask(
        &self,
        kinds: &[VariableKind],
        indices: Option<&[u8]>,
    ) -> Result<Vec<f64>, IntegratorError> {
        let excluded = self.suppressed.excluded(kinds, indices)?;
        let tested = |excluded: &bool| f64::from(u8::from(!excluded));
        Ok(excluded.iter().map(tested).collect())
    }
}
