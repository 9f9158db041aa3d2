//! Construction of an integrator.

use myovib_dae::checks::{expect_finite, expect_length, expect_square, expect_state};
use myovib_dae::{
    Direction, IntegratorError, LinearSolver, Problem, StepError, Tolerances, VariableKind,
    kinds_at,
};

use super::jacobian_point::JacobianPoint;
use super::state::{JacobianAge, RadauSolver};
use crate::dense::Collocation;
use crate::error::RadauError;
use crate::error_test::ErrorTest;
use crate::internal_variables::{EliminatedVariables, InternalVariableProblem, InternalVariables};
use crate::interpolation::Interpolation;
use crate::matrices::SparseDirectSolver;
use crate::method::Method;
use crate::multipliers::Multipliers;
use crate::newton::NewtonSolver;
use crate::options::RadauOptions;
use crate::predictor::Predictor;
use crate::quadrature::Quadrature;
use crate::roots::{RootFunctions, Roots};
use crate::rounding::Rounding;
use crate::weights::{UserWeights, Weights};
use crate::work::Counters;

/// Name of the initial values of quadratures in messages.
pub(super) const QUADRATURES: &str = "initial values of the quadratures";

/// Builder of a [`RadauSolver`].
pub struct RadauBuilder<P> {
    problem: P,
    options: RadauOptions,
    weights: Option<UserWeights<P>>,
    roots: Option<(Vec<Direction>, Box<RootFunctions<P>>)>,
    quadrature: Option<(Vec<f64>, Box<RootFunctions<P>>)>,
    internal: Option<(InternalVariables, Eliminate<P>)>,
}

/// Function that creates the internal variables from their specification, the method, the relative tolerance, and a
/// factor by which the tolerances are multiplied.
type Eliminate<P> =
    fn(InternalVariables, &Method, (f64, f64)) -> Result<EliminatedVariables<P>, RadauError>;

impl<P: Problem> RadauSolver<P> {
    /// Creates a builder of a solver for `problem`.
    pub fn builder(problem: P) -> RadauBuilder<P> {
        RadauBuilder {
            problem,
            options: RadauOptions::default(),
            weights: None,
            roots: None,
            quadrature: None,
            internal: None,
        }
    }
}

impl<P: Problem> RadauBuilder<P> {
    /// Sets all options.
    #[must_use]
    pub fn options(mut self, options: RadauOptions) -> Self {
        self.options = options;
        self
    }

    /// Sets the tolerances.
    #[must_use]
    pub fn tolerances(mut self, tolerances: Tolerances) -> Self {
        self.options.tolerances = tolerances;
        self
    }

    /// Replaces the tolerances by a function that writes the error weights w for y. The weights must be positive. The
    /// function is called after each step, and its values are used without conversion; see
    /// [`RadauOptions::internal_factor`]. Other quantities that depend on a relative tolerance, in particular Newton's
    /// tolerance, are computed from the minimum of 1/(w |y|) or, if it is smaller, from the relative tolerance of the
    /// options.
    #[must_use]
    pub fn error_weights(
        mut self,
        weights: impl FnMut(&mut P, &[f64], &mut [f64]) -> Result<(), StepError> + Send + 'static,
    ) -> Self {
        self.weights = Some(Box::new(weights));
        self
    }

    /// Monitors root functions g(t, y, ẏ), one per entry of `directions`, as in IDAS. The integration pauses when a
    /// function crosses zero in its direction. Steps are kept short enough for accurate dense output, unless
    /// [`RadauOptions::dense_output`] is false.
    ///
    /// Crossings are located on the dense output. If a function crosses zero twice between successive nodes of a step,
    /// the two crossings are not detected.
    #[must_use]
    pub fn roots(
        mut self,
        directions: impl Into<Vec<Direction>>,
        functions: impl FnMut(&mut P, f64, &[f64], &[f64], &mut [f64]) -> Result<(), StepError>
        + Send
        + 'static,
    ) -> Self {
        self.roots = Some((directions.into(), Box::new(functions)));
        self
    }

    /// Integrates q̇ = g(t, y, ẏ) from `start` together with the solution, with the weights of the collocation method.
    /// The result has the order of the method. The function g is evaluated at each stage of each accepted step, but no
    /// equations are solved. Quadratures do not affect the steps unless g fails.
    #[must_use]
    pub fn quadrature(
        mut self,
        start: impl Into<Vec<f64>>,
        rates: impl FnMut(&mut P, f64, &[f64], &[f64], &mut [f64]) -> Result<(), StepError>
        + Send
        + 'static,
    ) -> Self {
        self.quadrature = Some((start.into(), Box::new(rates)));
        self
    }

    /// Integrates internal variables together with the unknowns. They are eliminated from the equations of Newton's
    /// method; see [`InternalVariableProblem`]. Sensitivities are not available for problems with internal variables.
    #[must_use]
    pub fn internal_variables(mut self, internal: InternalVariables) -> Self
    where
        P: InternalVariableProblem,
    {
        self.internal = Some((internal, EliminatedVariables::new));
        self
    }

    /// Builds a solver at (t0, y0, ẏ0) that solves the linear systems by sparse factorization.
    ///
    /// # Shapes
    /// `y0`, `y_dot0`: [`n_unknowns`](Problem::n_unknowns).
    ///
    /// # Errors
    /// Returns [`IntegratorError::WrongLength`], [`IntegratorError::NotFinite`], [`IntegratorError::InvalidOption`],
    /// [`RadauError::Stages`], [`RadauError::Empty`] or [`RadauError::Factorization`] if an argument is invalid, and
    /// [`IntegratorError::TimeBehind`] if the stop time is before t0.
    pub fn build(self, t0: f64, y0: &[f64], y_dot0: &[f64]) -> Result<RadauSolver<P>, RadauError> {
        let (n, pattern) = (self.problem.n_unknowns(), self.problem.jacobian_pattern());
        expect_square(n, &pattern)?;
        let matrices = SparseDirectSolver::new(&pattern, self.options.sparse)?;
        self.build_with(matrices, t0, y0, y_dot0)
    }

    /// Builds a solver with a custom linear solver for this problem.
    ///
    /// # Shapes
    /// The same as for [`build`](RadauBuilder::build).
    ///
    /// # Errors
    /// Returns the same errors as [`build`](RadauBuilder::build).
    pub fn build_with<M: LinearSolver<P>>(
        self,
        matrices: M,
        t0: f64,
        y0: &[f64],
        y_dot0: &[f64],
    ) -> Result<RadauSolver<P, M>, RadauError> {
        let Self { mut problem, mut options, weights, roots, quadrature, internal } = self;
        let n = problem.n_unknowns();
        expect_state(n, t0, y0, y_dot0)?;
        if n == 0 {
            return Err(RadauError::Empty);
        }
        options.validate(n)?;
        let kinds = kinds_at(&mut problem, t0, y0, y_dot0).map_err(|error| RadauError::Fatal {
            function: "Jacobian",
            t: t0,
            h: 0.0,
            source: error.into(),
        })?;
        // If the indices are unknown, errors are not scaled by powers of h.
        let stated = problem.indices();
        let indices = stated.clone().unwrap_or_else(|| vec![1; n]);
        expect_length("indices", n, indices.len())?;
        expect_length("kinds", n, kinds.len())?;
        options.tolerances = (options.suppressed)
            .loosened(options.tolerances, stated.as_deref())
            .map_err(IntegratorError::from)?;
        let mask = options.error_mask(&kinds, stated.as_deref())?;
        if let Some(stop_time) = options.stop_time.filter(|stop_time| *stop_time < t0) {
            return Err(IntegratorError::TimeBehind { t_out: stop_time, t: t0 }.into());
        }
        let method = Method::radau_iia(options.stages)?;
        if let Some((start, _)) = &quadrature {
            expect_finite(QUADRATURES, start)?;
        }
        let quadrature = quadrature
            .filter(|(start, _)| !start.is_empty())
            .map(|(start, rates)| Quadrature::new(&method, (t0, &start), rates, n));
        let relative = options.tolerances.relative();
        let tolerance = (relative, options.internal_factor(relative));
        let internal = internal.map(|(variables, make)| make(variables, &method, tolerance));
        let internal = internal.transpose()?;
        if let Some(internal) = &internal {
            internal.expect_response(&mut problem)?;
        }
        let powers = options.index_scaling.powers(&kinds, &indices);

        let mut counters = Counters::default();
        counters.statistics.t_reached = t0;
        let (limit, relative) = (options.newton_limit(), options.tolerances.relative());
        let multipliers = Multipliers::new(&kinds, &indices, y0);
        let tolerance = options.newton_tolerance(relative, multipliers.any());
        let mut solver = RadauSolver {
            collocation: Collocation::line(&method, t0, y0, y_dot0),
            predictor: Predictor::new(&method, n),
            newton: NewtonSolver::new(&method, n, tolerance, limit, multipliers.any()),
            error_test: ErrorTest::new(mask),
            rounding: Rounding::new(&indices, &powers),
            interpolation: Interpolation::new(options.dense_output, n),
            corrected: vec![0.0; if multipliers.any() { method.stages() * n } else { 0 }],
            control: options.control(multipliers.any()),
            multipliers,
            jacobian: JacobianAge::Due,
            set_up_for: None,
            jacobian_point: JacobianPoint::default(),
            pivots_at: None,
            pivots_due: true,
            pivot_choices: 0,
            shifts: method.shifts(1.0),
            algebraic: (0..n).filter(|&i| kinds[i] == VariableKind::Algebraic).collect(),
            kinds,
            weights: Weights::new(
                weights,
                powers,
                options.time_scale,
                options.weight_factors(relative),
            ),
            weights_result: Ok(()),
            quadrature,
            internal,
            roots: roots.map(|(directions, functions)| Roots::new(directions, functions, n)),
            time_limits: [t0; 2],
            pause: None,
            y: y0.to_vec(),
            y_dot: y_dot0.to_vec(),
            t: t0,
            h: None,
            start: Ok(()),
            fresh: true,
            began_afresh: false,
            refused: None,
            near_kink: false,
            jump: None,
            problem,
            matrices,
            method,
            options,
            counters,
            restarts: 0,
            differences_before: 0,
        };
        solver.update_weights();
        solver.restart_internal_variables();
        solver.check_start();
        Ok(solver)
    }
}
