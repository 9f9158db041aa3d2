//! Creation of a solver from a problem and settings.

use crate::adjoint::Checkpoints;
use crate::error::Error;
use crate::ffi::ida::Ida;
use crate::options::{Constraint, IdaOptions, direction_code, error_test_id};
use myovib_dae::checks::{
    expect, expect_finite, expect_length, expect_not_negative, expect_square, expect_state,
};
use myovib_dae::{
    Direction, IntegratorError, Jacobian, LinearSolver, Parameters, Problem, StepError, Suppressed,
    Tolerances, kinds_at,
};

use super::IdaSolver;
use super::callbacks::{
    FailureLog, Function, QuadratureSensitivities, Repetitions, UserFunctions, Weighing, Weights,
};
use super::linear::{Linear, WholeLu};
use super::newton::NewtonTest;
use super::registered::Repeating;
use super::sensitivity::{SensitivityEquations, SensitivityOptions};
use super::within::WithinStep;
use super::zeros::ZeroSides;

/// Collects a problem, [`IdaOptions`] and user functions; see [`IdaSolver::builder`](crate::IdaSolver::builder).
pub struct IdaBuilder<P> {
    problem: P,
    options: IdaOptions,
    weights: Option<Box<Weights<P>>>,
    root_directions: Vec<Direction>,
    roots: Option<Box<Function<P>>>,
    quadrature: Quadrature,
    quadrature_rates: Option<Box<Function<P>>>,
    linear_solver: Option<Box<dyn LinearSolver<P> + Send>>,
    sensitivities: Option<Wanted<P>>,
    quadrature_sensitivities: Option<Box<QuadratureSensitivities<P>>>,
    checkpoints: Option<Checkpoints>,
}

/// Parameters, settings, and the initial values of S and Ṡ.
type Wanted<P> = (Box<dyn Parameters<P> + Send>, SensitivityOptions, Vec<[Vec<f64>; 2]>);

/// Quadratures integrated along with the solution; empty by default.
#[derive(Default)]
struct Quadrature {
    start: Vec<f64>,
    /// Relative and absolute tolerances, if the quadratures are included in the error test.
    tolerances: Option<(f64, f64)>,
}

impl Quadrature {
    fn validate(&self) -> Result<(), IntegratorError> {
        expect_finite("initial values of the quadratures", &self.start)?;
        match self.tolerances {
            Some((relative, absolute)) => validate_quadrature_tolerances(relative, absolute),
            None => Ok(()),
        }
    }
}

pub(super) fn validate_quadrature_tolerances(
    relative: f64,
    absolute: f64,
) -> Result<(), IntegratorError> {
    expect_not_negative("relative tolerance of the quadratures", relative)?;
    expect_not_negative("absolute tolerance of the quadratures", absolute)?;
    let both = "relative and absolute tolerance of the quadratures";
    expect(both, 0.0, relative + absolute > 0.0, "not both zero")
}

impl<P: Problem> IdaSolver<P> {
    /// Creates a builder of a solver for `problem`.
    pub fn builder(problem: P) -> IdaBuilder<P> {
        IdaBuilder {
            problem,
            options: IdaOptions::default(),
            weights: None,
            root_directions: Vec::new(),
            roots: None,
            quadrature: Quadrature::default(),
            quadrature_rates: None,
            linear_solver: None,
            sensitivities: None,
            quadrature_sensitivities: None,
            checkpoints: None,
        }
    }
}

impl<P: Problem> IdaBuilder<P> {
    /// Sets all settings given by plain values.
    #[must_use]
    pub fn options(mut self, options: IdaOptions) -> Self {
        self.options = options;
        self
    }

    /// Sets only the tolerances.
    #[must_use]
    pub fn tolerances(mut self, tolerances: Tolerances) -> Self {
        self.options.tolerances = tolerances;
        self
    }

    /// Replaces the tolerances by a function that writes the error weights w for y. A local error e is accepted if the
    /// root mean square of w_i e_i is at most 1. The weights must be positive.
    #[must_use]
    pub fn error_weights(
        mut self,
        weights: impl FnMut(&mut P, &[f64], &mut [f64]) -> Result<(), StepError> + Send + 'static,
    ) -> Self {
        self.weights = Some(Box::new(weights));
        self
    }

    /// Monitors root functions g(t, y, ẏ), one per entry of `directions`. The integration pauses when a function
    /// crosses zero in its direction.
    #[must_use]
    pub fn roots(
        mut self,
        directions: impl Into<Vec<Direction>>,
        functions: impl FnMut(&mut P, f64, &[f64], &[f64], &mut [f64]) -> Result<(), StepError>
        + Send
        + 'static,
    ) -> Self {
        self.root_directions = directions.into();
        self.roots = Some(Box::new(functions));
        self
    }

    /// Integrates q̇ = r(t, y, ẏ) from `start` along with the solution. If `tolerances` (relative, absolute) are given,
    /// the quadratures are included in the error test.
    #[must_use]
    pub fn quadrature(
        mut self,
        start: impl Into<Vec<f64>>,
        tolerances: Option<(f64, f64)>,
        rates: impl FnMut(&mut P, f64, &[f64], &[f64], &mut [f64]) -> Result<(), StepError>
        + Send
        + 'static,
    ) -> Self {
        self.quadrature = Quadrature { start: start.into(), tolerances };
        self.quadrature_rates = Some(Box::new(rates));
        self
    }

    /// Uses `solver` for the linear systems instead of the sparse LU of the whole matrix.
    #[must_use]
    pub fn linear_solver(mut self, solver: impl LinearSolver<P> + Send + 'static) -> Self {
        self.linear_solver = Some(Box::new(solver));
        self
    }

    /// Integrates the sensitivities ∂y/∂p_j to `parameters` along with the solution, from the given initial values S
    /// and Ṡ. [`correct_initial_values`](IdaSolver::correct_initial_values) also corrects the initial sensitivities, but
    /// not onto constraints.
    #[must_use]
    pub fn sensitivities(
        mut self,
        parameters: impl Parameters<P> + Send + 'static,
        options: SensitivityOptions,
        starts: Vec<[Vec<f64>; 2]>,
    ) -> Self {
        self.sensitivities = Some((Box::new(parameters), options, starts));
        self
    }

    /// Also integrates the sensitivities of the quadratures, which start at zero. `rates` writes ∂r/∂y S + ∂r/∂ẏ Ṡ +
    /// ∂r/∂p_j; its arguments are j, (t, y, ẏ) and (S, Ṡ). The sensitivities of the quadratures are included in the
    /// error test if the quadratures and the sensitivities are both included.
    #[must_use]
    pub fn quadrature_sensitivities(
        mut self,
        rates: impl FnMut(
            &mut P,
            usize,
            (f64, &[f64], &[f64]),
            [&[f64]; 2],
            &mut [f64],
        ) -> Result<(), StepError>
        + Send
        + 'static,
    ) -> Self {
        self.quadrature_sensitivities = Some(Box::new(rates));
        self
    }

    /// Stores the solution for [backward problems](crate::adjoint).
    #[must_use]
    pub fn checkpoints(mut self, checkpoints: Checkpoints) -> Self {
        self.checkpoints = Some(checkpoints);
        self
    }

    /// Builds a solver at (t0, y0, ẏ0).
    ///
    /// # Shapes
    /// `y0`, `y_dot0`: [`n_unknowns`](Problem::n_unknowns).
    ///
    /// # Errors
    /// Returns [`IntegratorError::WrongLength`], [`IntegratorError::NotFinite`], [`Error::Empty`] or
    /// [`IntegratorError::InvalidOption`] if an argument is invalid, and [`Error::Call`] if IDAS rejects an argument.
    pub fn build(mut self, t0: f64, y0: &[f64], y_dot0: &[f64]) -> Result<IdaSolver<P>, Error> {
        let n = self.problem.n_unknowns();
        let jacobian = Jacobian::of(&self.problem);
        expect_state(n, t0, y0, y_dot0)?;
        let kinds = kinds_at(&mut self.problem, t0, y0, y_dot0).map_err(|error| {
            Error::Callback { function: "Jacobian", t: t0, source: error.into() }
        })?;
        expect_length("kinds", n, kinds.len())?;
        expect_square(n, jacobian.pattern())?;
        if jacobian.pattern().nnz() == 0 {
            return Err(Error::Empty { n_unknowns: n, n_entries: 0 });
        }
        self.options.validate(n)?;
        self.quadrature.validate()?;
        let indices = self.problem.indices();
        if let Some(indices) = &indices {
            expect_length("indices", n, indices.len())?;
        }
        let suppressed = error_test_id(&self.options.suppressed, &kinds, indices.as_deref())?;
        let tolerances = self.options.tolerances.clone();
        let tolerances = (self.options.suppressed)
            .loosened(tolerances, indices.as_deref())
            .map_err(IntegratorError::from)?;

        let sensitivities = match self.sensitivities {
            Some((parameters, options, starts)) if !parameters.list().is_empty() => {
                Some(SensitivityEquations::new(&self.problem, parameters, options, (t0, starts))?)
            }
            _ => None,
        };
        let linear = match self.linear_solver {
            Some(solver) => Linear::Own(solver),
            None => Linear::Whole(Box::new(WholeLu::new(jacobian, self.options.sparse)?)),
        };
        let has_weights = self.weights.is_some();
        let weighing = match self.weights {
            Some(function) => Weighing::Function(function),
            None => Weighing::Tolerances(tolerances),
        };
        let searches =
            self.options.check_within_steps && suppressed.is_none() && sensitivities.is_none();
        let functions = UserFunctions {
            problem: self.problem,
            n_roots: self.root_directions.len(),
            roots: self.roots,
            zeros: ZeroSides::default(),
            weighing,
            weights: vec![1.0; n],
            quadrature: self.quadrature_rates,
            linear,
            newton: NewtonTest::default(),
            within: searches.then(WithinStep::default),
            sensitivities,
            quadrature_sensitivities: self.quadrature_sensitivities,
            backward: Vec::new(),
            repeating: Repeating::default(),
            repetitions: Repetitions::from(t0),
            t_called: t0,
            failures: FailureLog::default(),
        };
        let ida = Ida::new(functions, t0, y0, y_dot0, self.options.vectors)
            .map_err(|failed| super::call_error(failed, String::new()))?;
        let excludes = matches!(self.options.suppressed, Suppressed::FromIndex(_));
        let estimates = excludes && self.options.initial_step.is_none() && !has_weights;
        let first_step_of = estimates.then(|| self.options.clone());
        let mut solver = IdaSolver {
            ida,
            kinds,
            suppressed,
            t0,
            start: Default::default(),
            consistent: Ok(()),
            t: t0,
            n,
            min_step: self.options.min_step,
            checks_jacobian: self.options.check_jacobian_at_stop,
            first_step_of,
            max_steps: self.options.max_steps,
            mark: (0, t0),
            refusal: None,
            stop_time: self.options.stop_time,
            stop_time_lingers: false,
            differences_before: 0,
            sparse: self.options.sparse,
            forward_run: None,
        };
        solver.apply(&self.options)?;
        solver.attach_roots(&self.root_directions)?;
        solver.attach_quadrature(&self.quadrature)?;
        solver.attach_sensitivities()?;
        solver.attach_quadrature_sensitivities(self.quadrature.tolerances.is_some())?;
        if let Some(checkpoints) = self.checkpoints {
            solver.attach_checkpoints(checkpoints, &self.options)?;
        }
        solver.start_from(t0, [y0.to_vec(), y_dot0.to_vec()]);
        Ok(solver)
    }
}

impl<P: Problem> IdaSolver<P> {
    /// Passes the validated settings to IDAS.
    fn apply(&mut self, options: &IdaOptions) -> Result<(), Error> {
        let suppressed = self.suppressed.clone();
        self.call(|ida| {
            ida.set_weight_function()?;
            if options.strict_newton || options.check_within_steps {
                ida.set_convergence_test()?;
            }
            ida.set_max_order(options.max_order as i32)?;
            if let Some(step) = options.initial_step {
                ida.set_initial_step(step)?;
            }
            ida.set_min_step(options.min_step)?;
            if let Some(step) = options.max_step {
                ida.set_max_step(step)?;
            }
            if let Some(t) = options.stop_time {
                ida.set_stop_time(t)?;
            }
            ida.set_max_error_test_failures(options.max_error_test_failures as i32)?;
            ida.set_max_convergence_failures(options.max_convergence_failures as i32)?;
            ida.set_nonlinear_coefficient(options.nonlinear_coefficient)?;
            ida.set_max_newton_iterations(options.max_newton_iterations as i32)?;
            ida.set_delta_cj(options.delta_cj)?;
            // IDAS rejects a vector that contains no constraints.
            if options.constraints.iter().any(|c| *c != Constraint::None) {
                let codes: Vec<f64> = options.constraints.iter().map(|c| c.code()).collect();
                ida.set_constraints(&codes)?;
            }
            if let Some(id) = &suppressed {
                ida.set_id(id)?;
                ida.set_suppression(true)?;
            }
            Ok(())
        })
    }

    fn attach_roots(&mut self, directions: &[Direction]) -> Result<(), Error> {
        if directions.is_empty() {
            return Ok(());
        }
        let mut codes: Vec<i32> = directions.iter().map(|&d| direction_code(d)).collect();
        self.call(|ida| ida.set_roots(&mut codes))
    }

    fn attach_quadrature(&mut self, quadrature: &Quadrature) -> Result<(), Error> {
        if quadrature.start.is_empty() {
            return Ok(());
        }
        self.call(|ida| {
            ida.init_quadrature(&quadrature.start)?;
            let Some((relative, absolute)) = quadrature.tolerances else {
                return Ok(());
            };
            ida.set_quadrature_tolerances(relative, absolute)
        })
    }
}
