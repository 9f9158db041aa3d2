//! The discrete adjoint.

use myovib_dae::{LinearSolver, Linearization, Parameters, Problem, StepError};

use super::cotangents::Cotangents;
use super::krylov::{Krylov, norm};
use super::operator::{Stage, StageOperator};
use super::recording::Recording;
use super::reused_factors::ReusedFactors;
use super::sweep_failure::SweepFailure;
use super::work::AdjointWork;
use crate::dense::{Collocation, add_scaled};
use crate::error::RadauError;
use crate::method::Method;
use crate::solver::{AcceptedStep, RadauSolver};
use crate::stage_system::StageSystem;
use crate::work::Counters;

/// Computes the gradient of a misfit J of the computed solution by a backward pass over the steps. The cost does not
/// depend on the number of parameters.
///
/// Let x̄ denote ∂J/∂x. The backward pass over a step is the transpose of
/// [`ForwardSensitivities`](super::ForwardSensitivities). For the increments z of the stages,
///
/// ```text
/// Lᵀ λ = z̄,   z̄_s += ȳ_(n+1),   ȳ_n = ȳ_(n+1) − Σ_i J_y(i)ᵀ λ_i,   p̄_j −= Σ_i λ_iᵀ ∂F/∂p_j(i),
/// ```
///
/// where L is the matrix of the stage equations, linearized at the computed stages. Therefore, the result is the
/// gradient of the discrete solution for every index, not an approximation by the adjoint differential equation.
/// Systems with Lᵀ are solved by generalized conjugate residuals (GCR), preconditioned by the transposed factors of one
/// Jacobian for all stages.
///
/// # Examples
/// ```
/// use myovib_conformance::samples::{Oscillator, ParametricSample, Sample};
/// use myovib_radau::{Adjoint, RadauSolver, Recording};
///
/// let oscillator = Oscillator { omega: 2.0 };
/// let (start, parameters) = (oscillator.start(), oscillator.differenced());
/// let mut solver = RadauSolver::builder(oscillator).build(start.t, &start.y, &start.y_dot)?;
/// let mut recording = Recording::of_stages(&solver)?;
/// recording.integrate_to(&mut solver, 3.0)?;
/// // J = x(3) = x0 cos 3ω + v0/ω sin 3ω.
/// let mut adjoint = Adjoint::new(&solver, parameters);
/// let gradient = adjoint.gradient(&mut solver, &recording, &mut |step| {
///     if step.covers(3.0) {
///         step.add(3.0, 0, &[1.0, 0.0]);
///     }
///     Ok(())
/// })?;
/// // To the default tolerance 1e-4.
/// assert!((gradient.parameters[0] + 3.0 * 6.0_f64.sin()).abs() < 1e-3);
/// assert!((gradient.start[0] - 6.0_f64.cos()).abs() < 1e-3);
/// # Ok::<(), myovib_radau::RadauError>(())
/// ```
pub struct Adjoint<Q> {
    parameters: Q,
    operator: StageOperator,
    system: StageSystem,
    krylov: Krylov,
    tolerance: f64,
    factors: Option<ReusedFactors>,
    /// z̄, later replaced by the residual of the linear system.
    residual: Vec<f64>,
    /// Solution of the preconditioned system, later replaced by λ.
    adjoint: Vec<f64>,
    image: Vec<f64>,
    weights: Vec<f64>,
    counters: Counters,
    work: AdjointWork,
}

/// Gradient of a misfit.
#[derive(Debug, Clone, PartialEq)]
pub struct Gradient {
    /// ∂J/∂p_j through the equations.
    pub parameters: Vec<f64>,
    /// ∂J/∂y_0, for parameters on which the initial values depend. The gradient is 0 for algebraic variables, because
    /// their initial values do not occur in the equations.
    pub start: Vec<f64>,
}

/// Quantities passed from step to step: ȳ, the cotangent of ẏ, and the accumulated sum of λᵀ ∂F/∂p.
struct Carried {
    y: Vec<f64>,
    y_dot: Vec<f64>,
    products: Vec<f64>,
}

/// Default relative residual. Forward sensitivities and the adjoint agree to about this accuracy.
const TOLERANCE: f64 = 1e-10;

impl<Q> Adjoint<Q> {
    /// Creates the adjoint for the `parameters` of a solver's problem.
    pub fn new<P: Problem, M: LinearSolver<P>>(solver: &RadauSolver<P, M>, parameters: Q) -> Self
    where
        Q: Parameters<P>,
    {
        let (method, n) = (solver.method(), solver.y().len());
        let stages = vec![0.0; method.stages() * n];
        Self {
            parameters,
            operator: StageOperator::new(solver.problem(), method),
            system: StageSystem::new(method, n),
            krylov: Krylov::default(),
            tolerance: TOLERANCE,
            factors: None,
            residual: stages.clone(),
            adjoint: stages.clone(),
            image: stages.clone(),
            weights: stages,
            counters: Counters::default(),
            work: AdjointWork::default(),
        }
    }

    /// Sets the relative residual to which the linear systems are solved; 1e-10 by default.
    #[must_use]
    pub fn with_tolerance(self, tolerance: f64) -> Self {
        Self { tolerance, ..self }
    }

    /// Returns the accumulated work.
    pub fn work(&self) -> AdjointWork {
        AdjointWork {
            real_solves: self.counters.work.real_solves,
            complex_solves: self.counters.work.complex_solves,
            ..self.work
        }
    }

    /// Computes the gradient. `misfit` is called for each step, from the last to the first, and adds the derivatives of
    /// the misfit in this step. Except for the counters of its linear solver, the state of the solver is the same as
    /// before.
    ///
    /// # Errors
    /// Returns errors of the `misfit`, [`RadauError::Adjoint`] if the linear systems cannot be solved,
    /// [`RadauError::NotRepeated`] if steps replayed from checkpoints differ from the run, and [`RadauError::Fatal`] if
    /// the problem fails or the linear solver does not support transposed solves.
    pub fn gradient<P: Problem, M: LinearSolver<P>>(
        &mut self,
        solver: &mut RadauSolver<P, M>,
        recording: &Recording,
        misfit: &mut dyn FnMut(&mut Cotangents<'_>) -> Result<(), RadauError>,
    ) -> Result<Gradient, RadauError>
    where
        Q: Parameters<P>,
    {
        let n = solver.y().len();
        let mut carried = Carried {
            y: vec![0.0; n],
            y_dot: vec![0.0; n],
            products: vec![0.0; self.parameters.list().len()],
        };
        let end = solver.save();
        let repeated = recording.go_back(solver, &mut |solver, first, steps| {
            // Factors from replayed steps differ from the factors of the run, but may also be reused.
            let fresh = self.factors.take().and_then(|factors| factors.fresh());
            self.factors = solver.set_up_for().map(|h| ReusedFactors::new(h, fresh));
            for (number, step) in steps.iter().enumerate().rev() {
                let number = first + number;
                let step = solver.at_step(step.clone(), number as u64 + 1);
                self.back(step, recording.end(number), &mut carried, misfit)?;
            }
            Ok(())
        });
        solver.restore(&end)?;
        self.work.repeated_steps += repeated?;
        let Carried { y, products, .. } = carried;
        Ok(Gradient { parameters: products.iter().map(|product| -product).collect(), start: y })
    }

    /// Traverses one step backward. `until` is the end time of the step.
    fn back<P: Problem, M: LinearSolver<P>>(
        &mut self,
        step: AcceptedStep<'_, P, M>,
        until: f64,
        carried: &mut Carried,
        misfit: &mut dyn FnMut(&mut Cotangents<'_>) -> Result<(), RadauError>,
    ) -> Result<(), RadauError>
    where
        Q: Parameters<P>,
    {
        let (method, is_first) = (step.method, step.number == 1);
        let (n, h, t) = (carried.y.len(), step.collocation.h, step.collocation.t0);
        let last = (method.stages() - 1) * n;
        self.residual.fill(0.0);
        add_scaled(&mut self.residual[last..], 1.0, &carried.y);
        let stages = self.residual.chunks_exact_mut(n).enumerate();
        stages.for_each(|(j, out)| {
            add_scaled(out, method.a_inverse(method.stages() - 1, j) / h, &carried.y_dot);
        });
        carried.y_dot.fill(0.0);
        misfit(&mut Cotangents {
            method,
            step: &step.collocation,
            end: until,
            is_first,
            start: &mut carried.y,
            start_slope: &mut carried.y_dot,
            stages: &mut self.residual,
        })?;
        // In the first step, ∂ẏ_0/∂p is unknown, so the initial slope of the polynomial does not depend on the initial
        // ẏ. For algebraic variables, this slope never depends on ẏ at the end of the previous step.
        let all = is_first.then_some(0..n).into_iter().flatten();
        let algebraic = step.algebraic.iter().copied().filter(|_| !is_first);
        for i in all.chain(algebraic) {
            let slope = std::mem::take(&mut carried.y_dot[i]);
            for (j, out) in self.residual.chunks_exact_mut(n).enumerate() {
                out[i] += method.basis_derivative(j, 0.0) / h * slope;
            }
        }
        if self.residual.iter().all(|z| *z == 0.0) {
            return Ok(());
        }
        self.solve(step, carried).map_err(|failure| match failure.message() {
            Ok(message) => RadauError::Adjoint { t, message },
            Err(source) => RadauError::Fatal { function: "adjoint", t, h, source },
        })
    }

    /// Solves for λ, and adds its contributions to the cotangents at the start of the step and to the gradient with
    /// respect to the parameters.
    fn solve<P: Problem, M: LinearSolver<P>>(
        &mut self,
        step: AcceptedStep<'_, P, M>,
        carried: &mut Carried,
    ) -> Result<(), SweepFailure>
    where
        Q: Parameters<P>,
    {
        let AcceptedStep { problem, matrices, method, options, weights, collocation, .. } = step;
        let (n, h) = (collocation.y0.len(), collocation.h);
        let y0 = &collocation.y0[..];
        weights
            .write_at(problem, options, y0, h, &mut self.weights[..n])
            .map_err(|failure| (0, failure))?;
        let own = &self.weights[..n];
        let old = self.factors.take().filter(|factors| factors.serve(h));
        if old.is_none() {
            set_up(problem, matrices, method, &collocation, own)?;
            self.work.factorizations += 1;
        }
        let functions = (&mut *problem, &mut self.parameters);
        self.operator.linearize(functions, method, &collocation, own, true)?;
        self.work.jacobian_evaluations += method.stages() as u64;
        // z̄ · z has the units of J, so the residual of z̄ is weighted by the tolerances of z. The powers of 1/h by
        // which the integrator increases the tolerances of velocities and multipliers are not included.
        let (first, others) = self.weights.split_at_mut(n);
        weights.write_at(problem, options, y0, 1.0, first).map_err(|failure| (0, failure))?;
        others.chunks_exact_mut(n).for_each(|w| w.copy_from_slice(first));
        self.weights.iter_mut().for_each(|w| *w = 1.0 / *w);
        let tolerance = self.tolerance * norm(&self.residual, &self.weights);
        self.adjoint.fill(0.0);
        let (operator, system, counters) =
            (&mut self.operator, &mut self.system, &mut self.counters);
        let (image, parameters) = (&mut self.image, &mut self.parameters);
        let apply = |v: &mut [f64]| -> Result<(), SweepFailure> {
            system.solve_transposed(problem, matrices, method, v, counters)?;
            image.fill(0.0);
            operator.subtract_transposed(parameters, method, v, image);
            v.iter_mut().zip(&*image).for_each(|(v, w)| *v = -w);
            Ok(())
        };
        let (adjoint, residual) = (&mut self.adjoint, &mut self.residual);
        self.krylov.solve(adjoint, residual, &self.weights, tolerance, apply)?;
        self.system.solve_transposed(problem, matrices, method, adjoint, counters)?;
        let directions = self.krylov.directions();
        let mut factors = old.unwrap_or_else(|| ReusedFactors::new(h, None));
        factors.note(directions);
        self.factors = Some(factors);
        self.operator.subtract_transposed_from_start(&mut self.parameters, adjoint, &mut carried.y);
        for (stage, adjoint) in self.operator.stages.iter().zip(adjoint.chunks_exact(n)) {
            let state = [&stage.y[..], &stage.y_dot];
            let products = &mut carried.products;
            self.parameters.add_products(problem, stage.t, state, adjoint, products)?;
        }
        self.work.steps += 1;
        Ok(())
    }
}

/// Sets up the matrices for a step with the Jacobian at its middle stage.
fn set_up<P: Problem, M: LinearSolver<P>>(
    problem: &mut P,
    matrices: &mut M,
    method: &Method,
    step: &Collocation,
    weights: &[f64],
) -> Result<(), StepError> {
    let mut stage = Stage::new(step.y0.len());
    stage.move_to(method, step, method.stages() / 2);
    let at = Linearization { t: stage.t, y: &stage.y, y_dot: &stage.y_dot, step: step.h, weights };
    matrices.evaluate(problem, &at)?;
    let real = method.real_mode().lambda / step.h;
    matrices.set_up(problem, real, &method.shifts(step.h))
}
