//! One attempt at a step: Jacobian, set-up, Newton, error test.

use myovib_dae::{LinearSolver, Linearization, Problem, StopReason};

use super::state::{Jacobian, RadauSolver};
use crate::failure::{Failure, Operation, Rejection};
use crate::newton::{Newton, Step, norm};
use crate::options::StepSize;

impl<P: Problem, M: LinearSolver<P>> RadauSolver<P, M> {
    /// One attempt at a step of size h; the step proposed to follow it. Nothing but Newton's memory
    /// and the Jacobian changes.
    pub(super) fn attempt(&mut self, h: f64, repeated: bool) -> Result<f64, Failure> {
        let iterations = self.solve_stages(h)?;
        match self.options.step_size {
            StepSize::Fixed(proposal) => Ok(proposal),
            StepSize::Adaptive => self.test_error(h, repeated, iterations),
        }
    }

    /// Tests the estimated error of the step solved for; the proposal if it passes.
    fn test_error(&mut self, h: f64, repeated: bool, iterations: usize) -> Result<f64, Failure> {
        let step = Step {
            method: &self.method,
            t: self.t,
            h,
            y: &self.y,
            weights: self.weights.scaled(),
        };
        let (problem, matrices) = (&mut self.problem, &mut self.matrices);
        let (z, filter_twice) = (&self.newton.z, self.fresh || repeated);
        let counters = &mut self.counters;
        let mut error =
            self.error_test
                .estimate(problem, matrices, &step, z, filter_twice, counters)?;
        let (weights, errors) = (&self.weights, &self.error_test);
        let mut own = weights.largest_own(|i| errors.error(i));
        if error.is_finite() && error.max(own) >= 1.0 {
            let (rounding, n) = (&mut self.rounding, step.y.len());
            rounding.measure(problem, matrices, &step, &self.y_dot, counters)?;
            let beyond = |i| rounding.beyond(i, errors.error(i));
            error = norm((0..n).map(|i| beyond(i) * step.weights[i]), n);
            own = weights.largest_own(beyond);
        }
        let judged = self.control.judge(h, error);
        if judged < 1.0 {
            let power = weights.highest_power();
            let for_own = self.control.propose_for_own(h, own, power);
            let proposal = self.control.accept(h, error, iterations);
            return Ok(proposal.min(for_own));
        }
        Err(Failure::Rejected(if error.is_finite() {
            self.control.reject(h, error);
            Rejection {
                reason: StopReason::ErrorTestFailures,
                message: format!("estimated error {judged:.2e} times the tolerance at h = {h:e}"),
                // Nothing is known about the scale before a first step is accepted.
                step_factor: match self.fresh {
                    true => 0.1,
                    false => self.control.propose(h, judged, iterations) / h,
                },
            }
        } else {
            Rejection {
                reason: StopReason::LinearSolveFailed,
                message: format!("the estimated error is {error} at h = {h:e}"),
                step_factor: 0.5,
            }
        }))
    }

    /// Solves the stage equations, with a new Jacobian if the one at hand fails; the number of
    /// iterations.
    fn solve_stages(&mut self, h: f64) -> Result<usize, Failure> {
        self.weights.scale(h);
        loop {
            self.evaluate_jacobian(h)?;
            self.set_up(h)?;
            let failure = match self.iterate(h) {
                Ok(iterations) => return Ok(iterations),
                Err(failure) => failure,
            };
            let Failure::Rejected(rejection) = failure else {
                return Err(failure);
            };
            self.counters.statistics.newton_failures += 1;
            // The Jacobian of an earlier step may be to blame for slow convergence.
            let slow = rejection.reason == StopReason::ConvergenceFailures;
            if !slow || self.jacobian == Jacobian::Current {
                return Err(Failure::Rejected(rejection));
            }
            self.jacobian = Jacobian::Due;
        }
    }

    /// Newton's iterations with the matrices that are set up; the number of them.
    fn iterate(&mut self, h: f64) -> Result<usize, Failure> {
        let z = &mut self.newton.z;
        let (method, last) = (&self.method, &self.collocation);
        self.predictor.start(method, last, (self.t, h), &self.y, z);
        let step = Step {
            method: &self.method,
            t: self.t,
            h,
            y: &self.y,
            weights: self.weights.scaled(),
        };
        let (problem, matrices) = (&mut self.problem, &mut self.matrices);
        let counters = &mut self.counters;
        match self
            .newton
            .solve(problem, matrices, &step, &self.weights, counters)?
        {
            Newton::Converged { iterations } => Ok(iterations),
            Newton::Failed { step_factor } => {
                let (rounding, newton) = (&mut self.rounding, &self.newton);
                rounding.measure(problem, matrices, &step, &self.y_dot, counters)?;
                let (corrections, n) = (newton.correction(), step.y.len());
                let left = (0..n).map(|i| rounding.beyond(i, corrections[i]) * step.weights[i]);
                if norm(left, n) <= newton.tolerance() {
                    return Ok(self.options.newton_limit());
                }
                Err(Failure::Rejected(Rejection {
                    reason: StopReason::ConvergenceFailures,
                    message: format!("Newton does not converge at h = {h:e}"),
                    step_factor,
                }))
            }
        }
    }

    /// Evaluates the Jacobian at the beginning of the step, if it is due.
    fn evaluate_jacobian(&mut self, h: f64) -> Result<(), Failure> {
        if self.jacobian == Jacobian::Due {
            self.counters.statistics.jacobian_evaluations += 1;
            self.set_up_for = None;
            let at = Linearization {
                t: self.t,
                y: &self.y,
                y_dot: &self.y_dot,
                step: h,
                weights: self.weights.plain(),
            };
            self.matrices
                .evaluate(&mut self.problem, &at)
                .map_err(Operation::Jacobian.failed())?;
            self.jacobian = Jacobian::Current;
        }
        Ok(())
    }

    /// Sets up J_y + λ/h J_ẏ for all eigenvalues λ of A⁻¹, if h or the Jacobian is new.
    fn set_up(&mut self, h: f64) -> Result<(), Failure> {
        if self.set_up_for == Some(h) {
            return Ok(());
        }
        self.set_up_for = None;
        self.counters.statistics.linear_setups += 1;
        self.counters.work.real_factorizations += 1;
        self.counters.work.complex_factorizations += self.shifts.len() as u64;
        for (shift, mode) in self.shifts.iter_mut().zip(self.method.complex_modes()) {
            *shift = mode.lambda / h;
        }
        let real = self.method.real_mode().lambda / h;
        self.matrices
            .set_up(&mut self.problem, real, &self.shifts)
            .map_err(Operation::LinearSetUp.failed())?;
        self.set_up_for = Some(h);
        Ok(())
    }
}
