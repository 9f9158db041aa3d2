//! Forward sensitivities by the staggered method.

use myovib_dae::checks::{expect_dense_output, expect_length, expect_positive, expect_vector};
use myovib_dae::{IntegratorError, LinearSolver, Outcome, Parameters, Problem, columns};

use super::block::Block;
use super::curves::Curves;
use super::operator::{Stage, StageOperator};
use super::sweep_failure::SweepFailure;
use super::work::SensitivityWork;
use crate::error::RadauError;
use crate::newton::norm;
use crate::solver::{AcceptedStep, RadauSolver};
use crate::stage_system::StageSystem;
use crate::work::Counters;

/// Sensitivities S_j = ∂y/∂p_j of the solution of a [`RadauSolver`], for all parameters at once.
///
/// After each accepted step, the differentiated stage equations
///
/// ```text
/// J_y(i) (S_j + σ_i) + h⁻¹ J_ẏ(i) Σ_k (A⁻¹)_ik σ_k + ∂F/∂p_j(i) = 0   at each stage i
/// ```
///
/// are solved for the increments σ of the sensitivities at the stages. The result is the derivative of the discrete
/// solution for the steps taken, by default with an error of a third of the solution's tolerance. The factors of the
/// step, which belong to a frozen Jacobian, are the preconditioner. The steps are the same as in a run without
/// sensitivities unless [`controlling_steps`](Self::controlling_steps) is set.
///
/// Sensitivities of multipliers of index 2 and 3 are derivatives of the collocation values. The solver removes the
/// leading error of the multipliers, but not of their sensitivities. Therefore, the order of these sensitivities is
/// lower by one.
///
/// # Examples
/// ```
/// use myovib_conformance::samples::{Oscillator, ParametricSample, Sample};
/// use myovib_radau::{ForwardSensitivities, RadauSolver};
///
/// let oscillator = Oscillator { omega: 2.0 };
/// let (start, parameters) = (oscillator.start(), oscillator.differenced());
/// let s0 = vec![oscillator.exact_sensitivity(0, 0.0)];
/// let mut solver = RadauSolver::builder(oscillator).build(start.t, &start.y, &start.y_dot)?;
/// let mut sensitivities = ForwardSensitivities::new(&solver, parameters, s0)?;
/// sensitivities.integrate_to(&mut solver, 3.0)?;
/// // d cos(ωt)/dω = −t sin ωt, to the default tolerance 1e-4.
/// assert!((sensitivities.of(0)[0] + 3.0 * 6.0_f64.sin()).abs() < 1e-3);
/// # Ok::<(), myovib_radau::RadauError>(())
/// ```
pub struct ForwardSensitivities<Q> {
    parameters: Q,
    /// Number of solver steps before the sensitivities were created.
    before: u64,
    /// Number of solver steps up to and including the last step that was followed.
    followed: u64,
    /// Number of [restarts of the solver](RadauSolver::restarts) when the sensitivities were created.
    restarts: u64,
    operator: StageOperator,
    system: StageSystem,
    block: Block,
    curves: Curves,
    image: Vec<f64>,
    /// Weights of y, and weights of all columns.
    weights: Vec<f64>,
    columns_weights: Vec<f64>,
    counters: Counters,
    work: SensitivityWork,
    tolerance: Option<f64>,
    is_controlling: bool,
}

impl<Q> ForwardSensitivities<Q> {
    /// Creates the sensitivities of the solution of a solver with respect to `parameters`. `starts` contains the values
    /// ∂y/∂p_j at the current time of the solver. At index 2 and 3, these values must satisfy the constraints
    /// differentiated with respect to p_j. This is not checked, and violations persist.
    ///
    /// # Shapes
    /// `starts`: the number of unknowns for each parameter.
    ///
    /// # Errors
    /// Returns [`IntegratorError::WrongLength`], [`IntegratorError::NotFinite`], [`IntegratorError::WithinStep`] if the
    /// solver pauses within a step, and [`RadauError::InternalVariables`] if the solver has internal variables.
    pub fn new<P: Problem, M: LinearSolver<P>>(
        solver: &RadauSolver<P, M>,
        parameters: Q,
        starts: Vec<Vec<f64>>,
    ) -> Result<Self, RadauError>
    where
        Q: Parameters<P>,
    {
        let n = solver.y().len();
        let list = parameters.list();
        expect_starts(&starts, list.len(), n)?;
        let scales: Vec<f64> = list.iter().map(|parameter| parameter.scale).collect();
        scales.iter().try_for_each(|scale| expect_positive("scale of a parameter", *scale))?;
        expect_end_of_step(solver)?;
        let before = solver.statistics().steps;
        solver.expect_no_internal_variables()?;
        let method = solver.method();
        let columns = vec![0.0; list.len() * n];
        Ok(Self {
            operator: StageOperator::new(solver.problem(), method),
            system: StageSystem::new(method, n),
            block: Block::default(),
            curves: Curves::new(method, solver.t(), starts),
            image: Vec::new(),
            weights: vec![0.0; n],
            columns_weights: columns,
            parameters,
            before,
            followed: before,
            restarts: solver.restarts(),
            counters: Counters::default(),
            work: SensitivityWork::default(),
            tolerance: None,
            is_controlling: false,
        })
    }

    /// Continues after a restart of the solver. `starts` contains the values ∂y/∂p_j at the current time of the solver.
    ///
    /// If [`reinit`](RadauSolver::reinit) did not change y and its time does not depend on p, these are the current
    /// values ([`of`](Self::of)). After [`restore`](RadauSolver::restore), these are the values at the time of the
    /// saved state.
    ///
    /// # Shapes
    /// `starts`: the number of unknowns for each parameter.
    ///
    /// # Errors
    /// Returns the same errors as [`new`](Self::new).
    pub fn reinit<P: Problem, M: LinearSolver<P>>(
        &mut self,
        solver: &RadauSolver<P, M>,
        starts: Vec<Vec<f64>>,
    ) -> Result<(), RadauError> {
        expect_starts(&starts, self.n_parameters(), solver.y().len())?;
        expect_end_of_step(solver)?;
        self.before = solver.statistics().steps;
        self.curves = Curves::new(solver.method(), solver.t(), starts);
        (self.followed, self.restarts) = (self.before, solver.restarts());
        Ok(())
    }

    /// Returns whether the solver was restarted without a [`reinit`](Self::reinit) of the sensitivities.
    pub fn needs_reinit<P: Problem, M: LinearSolver<P>>(&self, solver: &RadauSolver<P, M>) -> bool {
        solver.restarts() != self.restarts
    }

    /// Sets the tolerance of the linear systems as a fraction of the integration's tolerance. The default corresponds
    /// to a third of the solution's tolerance. In four cases, the default is Newton's tolerance, usually a tenth of
    /// this value: for at most three stages, with hidden constraints, if the sensitivities control the steps, and if
    /// [`newton_tolerance`](field@crate::RadauOptions::newton_tolerance) is set.
    #[must_use]
    pub fn with_tolerance(self, tolerance: f64) -> Self {
        Self { tolerance: Some(tolerance), ..self }
    }

    /// Includes the errors of the sensitivities in the step-size control. Each error is estimated in the same way as
    /// the error of y, in units of the tolerances of p̄_j S_j:
    ///
    /// ```text
    /// −(J_y + γ/h J_ẏ)⁻¹ (J_y S_j + J_ẏ σ_j'(t_n) + ∂F/∂p_j)   at (t_n, y_n, u'(t_n)).
    /// ```
    ///
    /// Steps are never repeated because of this estimate, but their sizes differ from a run without sensitivities.
    #[must_use]
    pub fn controlling_steps<P: Problem, M: LinearSolver<P>>(
        self,
        solver: &RadauSolver<P, M>,
    ) -> Self {
        let mut operator = self.operator;
        operator.add_start(solver.method());
        Self { is_controlling: true, operator, ..self }
    }

    /// Returns the parameters.
    pub fn parameters_mut(&mut self) -> &mut Q {
        &mut self.parameters
    }

    /// Returns the number of parameters.
    pub fn n_parameters(&self) -> usize {
        self.curves.count()
    }

    /// Returns ∂y/∂p_j at the end of the last step that was followed.
    ///
    /// # Panics
    /// Panics if the parameter does not exist.
    pub fn of(&self, j: usize) -> &[f64] {
        self.curves.of(j)
    }

    /// Writes ∂y/∂p_j or its time derivative at a time within the last step to `out`.
    ///
    /// # Shapes
    /// `out`: the number of unknowns.
    ///
    /// # Errors
    /// Returns [`IntegratorError::NoDenseOutput`] if `t` is outside the last step or if `derivative` is above 1.
    ///
    /// # Panics
    /// Panics if the parameter does not exist.
    pub fn dense_output<P: Problem, M: LinearSolver<P>>(
        &self,
        solver: &RadauSolver<P, M>,
        j: usize,
        t: f64,
        derivative: usize,
        out: &mut [f64],
    ) -> Result<(), RadauError> {
        expect_length("dense output", self.curves.of(j).len(), out.len())?;
        expect_dense_output(t, derivative, 1, solver.last_step_interval())?;
        let column = (j, self.n_parameters());
        let step = &self.curves.step;
        step.evaluate_column(solver.method(), t, derivative, column, out);
        Ok(())
    }

    /// Returns the accumulated work.
    pub fn work(&self) -> SensitivityWork {
        SensitivityWork {
            real_solves: self.counters.work.real_solves,
            complex_solves: self.counters.work.complex_solves,
            difference_evaluations: self.operator.difference_evaluations(),
            ..self.work
        }
    }

    /// Integrates the solution and the sensitivities up to `t_out`, as [`RadauSolver::integrate_to`] does.
    ///
    /// # Errors
    /// Returns errors of [`RadauSolver::integrate_to`] and of [`follow`](Self::follow).
    pub fn integrate_to<P: Problem, M: LinearSolver<P>>(
        &mut self,
        solver: &mut RadauSolver<P, M>,
        t_out: f64,
    ) -> Result<Outcome, RadauError>
    where
        Q: Parameters<P>,
    {
        solver.integrate_watched(t_out, &mut |solver| self.follow(solver))
    }

    /// Advances the sensitivities over the last accepted step of the solver. Does nothing if the solver has not taken a
    /// new step. Must be called after each [`RadauSolver::step`].
    ///
    /// # Errors
    /// Returns [`RadauError::Sensitivity`] if the linear equations cannot be solved, [`RadauError::Missed`] if more
    /// than one step was taken since the last call, [`RadauError::StartedAgain`] if the solver was restarted without a
    /// [`reinit`](Self::reinit) of the sensitivities, and [`RadauError::Fatal`] if the problem fails.
    pub fn follow<P: Problem, M: LinearSolver<P>>(
        &mut self,
        solver: &mut RadauSolver<P, M>,
    ) -> Result<(), RadauError>
    where
        Q: Parameters<P>,
    {
        let has_new_step = solver.has_new_step(self.restarts, self.followed)?;
        if solver.began_afresh() {
            self.curves.forget();
        }
        if !has_new_step {
            return Ok(());
        }
        let (contraction, is_constrained) = (solver.contraction(), solver.is_constrained());
        let step = solver.accepted();
        let (t, h) = (step.collocation.t0, step.collocation.h);
        let error = self.advance(step, contraction, is_constrained).map_err(|failure| {
            let parameter = self.parameters.list()[failure.parameter()].name.clone();
            let function = "derivative with respect to a parameter";
            match failure.message() {
                Ok(message) => RadauError::Sensitivity { parameter, t, message },
                Err(source) => RadauError::Fatal { function, t, h, source },
            }
        })?;
        self.followed += 1;
        self.work.steps += 1;
        if self.is_controlling {
            solver.limit_next_step_by_error(error);
        }
        Ok(())
    }

    /// Advances all sensitivities over a step. Returns their largest estimated error, if requested.
    fn advance<P: Problem, M: LinearSolver<P>>(
        &mut self,
        step: AcceptedStep<'_, P, M>,
        contraction: f64,
        is_constrained: bool,
    ) -> Result<f64, SweepFailure>
    where
        Q: Parameters<P>,
    {
        let AcceptedStep {
            problem,
            matrices,
            method,
            options,
            weights,
            mask,
            algebraic,
            collocation,
            number,
        } = step;
        let (n, h, is_first) = (collocation.y0.len(), collocation.h, number == self.before + 1);
        let relative = options.tolerances.relative();
        let tolerance = self.tolerance.unwrap_or_else(|| match self.is_controlling {
            true => options.newton_tolerance(relative, false),
            false => options.sensitivity_tolerance(relative, is_constrained),
        });
        let n_columns = self.curves.count();
        if n_columns == 0 {
            return Ok(0.0);
        }
        let Self { parameters, operator, curves, work, counters, system, image, .. } = self;
        weights
            .write_at(problem, options, &collocation.y0, h, &mut self.weights)
            .map_err(|failure| (0, failure))?;
        let functions = (&mut *problem, &mut *parameters);
        operator.linearize(functions, method, &collocation, &self.weights, false)?;
        work.jacobian_evaluations += operator.stages.len() as u64;
        let stages = operator.stages.iter().take(method.stages());
        for (Stage { t, y, y_dot }, rows) in
            stages.zip(curves.residual.chunks_exact_mut(n * n_columns))
        {
            parameters.derivatives(problem, *t, [y, y_dot], rows)?;
            rows.iter_mut().for_each(|r| *r = -*r);
            work.parameter_derivatives += n_columns as u64;
        }
        // The residual −∂F/∂p − J_y (S + σ) − h⁻¹ J_ẏ A⁻¹ σ is later replaced by the resulting correction of σ.
        let both = [&self.columns_weights[..], &self.weights];
        curves.begin(method, &collocation, both, tolerance);
        let at = (Some(&curves.s[..]), &curves.step.increments[..]);
        operator.subtract(parameters, method, at, &mut curves.residual, n_columns)?;
        let residual = (&mut curves.residual[..], n_columns);
        system.solve_columns(problem, matrices, method, residual, counters)?;
        // p̄ S has the units of y and the same weights.
        for j in 0..n_columns {
            let scale = parameters.list()[j].scale;
            let mut size = vec![0.0; n];
            curves.size(j, scale, &mut size);
            weights
                .write_at(problem, options, &size, h, &mut self.weights)
                .map_err(|failure| (j, failure))?;
            self.weights.iter_mut().for_each(|w| *w *= scale);
            columns::put(&self.weights, &mut self.columns_weights, j, n_columns);
        }
        let apply = |v: &[f64], image: &mut [f64]| -> Result<(), SweepFailure> {
            image.fill(0.0);
            operator.subtract(parameters, method, (None, v), image, n_columns)?;
            let stages = (image, n_columns);
            Ok(system.solve_columns(problem, matrices, method, stages, counters)?)
        };
        let (increments, residual) = (&mut curves.step.increments, &mut curves.residual);
        let weighted = (&self.columns_weights[..], n_columns);
        self.block.solve(increments, residual, weighted, [tolerance, contraction], apply)?;
        let mut largest = 0.0_f64;
        if self.is_controlling {
            image.resize(n * n_columns, 0.0);
            let Stage { t, y, y_dot } = &operator.stages[method.stages()];
            parameters.derivatives(problem, *t, [y, y_dot], image)?;
            work.parameter_derivatives += n_columns as u64;
            image.iter_mut().for_each(|e| *e = -*e);
            operator.subtract_at_start(parameters, method, &curves.step, image, n_columns)?;
            matrices.solve_real_columns(problem, image, n_columns)?;
            counters.work.real_solves += n_columns as u64;
            for j in 0..n_columns {
                let column = |of: &'_ [f64], i: usize| of[i * n_columns + j];
                let error = |i| column(image, i) * mask[i] * column(&self.columns_weights, i);
                largest = largest.max(norm((0..n).map(error), n));
            }
        }
        curves.end(method, &collocation, &self.columns_weights, (is_first, algebraic));
        Ok(largest)
    }
}

fn expect_end_of_step<P: Problem, M: LinearSolver<P>>(
    solver: &RadauSolver<P, M>,
) -> Result<(), IntegratorError> {
    match solver.t() == solver.step_end() {
        true => Ok(()),
        false => Err(IntegratorError::WithinStep { t: solver.t() }),
    }
}

fn expect_starts(
    starts: &[Vec<f64>],
    n_parameters: usize,
    n: usize,
) -> Result<(), IntegratorError> {
    expect_length("starts of sensitivities", n_parameters, starts.len())?;
    for start in starts {
        expect_vector("start of a sensitivity", n, start)?;
    }
    Ok(())
}
