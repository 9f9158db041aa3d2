//! Restarts and consistent initial values.

use myovib_dae::checks::{expect, expect_finite_value, expect_state, expect_vector};
use myovib_dae::{
    ConsistencyMode, Inconsistent, IntegratorError, LinearSolver, Problem, StepError, check_start,
};

use super::builder::QUADRATURES;
use super::state::{JacobianAge, RadauSolver};
use crate::dense::Collocation;
use crate::error::RadauError;
use crate::newton::NewtonSolver;
use crate::predictor::Predictor;
use crate::work::Counters;

impl<P: Problem, M: LinearSolver<P>> RadauSolver<P, M> {
    /// Restarts at (t0, y0, ẏ0) with the same problem, settings and functions. Statistics are reset to zero, and a stop
    /// time before or at t0 is discarded.
    ///
    /// Quadratures continue from their values at the current time. The sensitivities of the new values must be passed
    /// to [`ForwardSensitivities`](crate::ForwardSensitivities). A [`Recording`](crate::Recording) of the previous
    /// steps cannot be continued.
    ///
    /// # Errors
    /// Returns [`IntegratorError::WrongLength`] or [`IntegratorError::NotFinite`].
    pub fn reinit(&mut self, t0: f64, y0: &[f64], y_dot0: &[f64]) -> Result<(), RadauError> {
        let mut q = vec![0.0; self.n_quadratures()];
        if !q.is_empty() {
            self.quadrature(&mut q)?;
        }
        self.reinit_with(t0, y0, y_dot0, &q)
    }

    /// Restarts as [`reinit`](RadauSolver::reinit) does, with quadratures that start from `q0`.
    ///
    /// # Errors
    /// Returns [`IntegratorError::WrongLength`] or [`IntegratorError::NotFinite`].
    pub fn reinit_with(
        &mut self,
        t0: f64,
        y0: &[f64],
        y_dot0: &[f64],
        q0: &[f64],
    ) -> Result<(), RadauError> {
        let n = self.y.len();
        expect_state(n, t0, y0, y_dot0)?;
        expect_vector(QUADRATURES, self.n_quadratures(), q0)?;
        if let Some(quadrature) = &mut self.quadrature {
            quadrature.restart(&self.method, t0, q0);
        }
        let goes_on = self.counters.statistics.steps > 0 && t0 == self.t();
        let limit = self.options.newton_limit();
        let tolerance = self
            .options
            .newton_tolerance(self.options.tolerances.relative(), self.multipliers.any());
        self.t = t0;
        self.y.copy_from_slice(y0);
        self.y_dot.copy_from_slice(y_dot0);
        self.h = None;
        self.collocation = Collocation::line(&self.method, t0, y0, y_dot0);
        self.predictor = Predictor::new(&self.method, n);
        self.newton = NewtonSolver::new(&self.method, n, tolerance, limit, self.multipliers.any());
        self.control = self.options.control(self.multipliers.any());
        self.multipliers.restart(y0);
        (self.fresh, self.refused) = (true, None);
        (self.near_kink, self.jump) = (false, None);
        self.jacobian = JacobianAge::Due;
        self.set_up_for = None;
        self.pause = None;
        self.counters = Counters::default();
        self.restarts += 1;
        self.differences_before = self.matrices.difference_evaluations();
        self.counters.statistics.t_reached = t0;
        self.options.stop_time = self.options.stop_time.filter(|stop| *stop > t0);
        if let Some(roots) = &mut self.roots {
            roots.restart();
        }
        self.update_weights();
        self.restart_internal_variables();
        self.start = Ok(());
        if !goes_on {
            self.check_start();
        }
        Ok(())
    }

    /// Checks whether the initial values are consistent, and stores the result.
    pub(super) fn check_start(&mut self) {
        let factor = match self.weights.are_given() {
            true => 1.0,
            false => self.options.internal_factor(self.options.accuracy(&self.y)),
        };
        let weights: Vec<f64> = self.weights.plain().iter().map(|w| w * factor).collect();
        let at = (self.t, &self.y[..], &self.y_dot[..]);
        self.start = match self.weights_result {
            Ok(()) => check_start(&mut self.problem, at, &weights),
            Err(_) => Ok(()),
        };
    }

    /// Continues from [`t`](RadauSolver::t) with a small first step, as at the start. Call this method at times at
    /// which a function of the problem has a jump or a kink. Statistics continue. If the solution itself jumps, use
    /// [`reinit`](RadauSolver::reinit).
    ///
    /// Algebraic variables may still have their values from before the jump. If the initial values are from before a
    /// jump, call this method before the first step; the consistency of the initial values is then not checked.
    pub fn restart(&mut self) {
        if let Some(pause) = self.pause.take() {
            self.t = pause.t;
            self.y.copy_from_slice(&pause.y);
            self.y_dot.copy_from_slice(&pause.y_dot);
            self.multipliers.restart(&self.y);
            if let Some(quadrature) = &mut self.quadrature {
                quadrature.cut(&self.method, pause.t);
            }
            if let Some(internal) = &mut self.internal {
                internal.cut(&self.method, &self.collocation, pause.t);
            }
            self.update_weights();
        }
        self.start_afresh();
        (self.h, self.refused) = (None, None);
        // Algebraic variables may jump at this time.
        self.jump = Some([self.collocation.t0, 0.0]);
        self.start = Ok(());
    }

    /// Restarts the internal variables at (t, y) with their current values. If the driving quantities cannot be
    /// evaluated at (t, y), the next step fails.
    pub(super) fn restart_internal_variables(&mut self) {
        if let Some(internal) = &mut self.internal {
            let begun = internal.restart(&mut self.problem, &self.method, self.t, &self.y);
            self.weights_result = std::mem::replace(&mut self.weights_result, Ok(())).and(begun);
        }
    }

    /// Corrects the initial values so that F(t0, y0, ẏ0) = 0, by Newton's method with a line search. Must be called
    /// before the first step. `t_first` is the first output time, which determines the time scale.
    ///
    /// # Errors
    /// Returns [`IntegratorError::Inconsistent`] if consistent values are not found or if an index is too high for the
    /// mode, [`IntegratorError::AfterTheStart`] if steps were already taken, and [`RadauError::Fatal`] if the problem
    /// returns a fatal error.
    pub fn correct_initial_values(
        &mut self,
        mode: ConsistencyMode,
        t_first: f64,
    ) -> Result<(), RadauError> {
        expect_finite_value("t_first", t_first)?;
        let is_other = t_first != self.t;
        expect("t_first", t_first, is_other, "not the initial time")?;
        if self.counters.statistics.steps > 0 {
            return Err(IntegratorError::AfterTheStart { t: self.t }.into());
        }
        let (t, mut y, mut y_dot) = (self.t, self.y.clone(), self.y_dot.clone());
        let weights = self.weights.plain();
        let (problem, matrices) = (&mut self.problem, &mut self.matrices);
        let distance = match self.weights.are_given() {
            true => weights.to_vec(),
            false => self.options.tolerances.distance(weights),
        };
        let corrected = myovib_dae::correct_initial_values(
            problem,
            matrices,
            mode,
            &self.kinds,
            (t, t_first),
            &mut y,
            &mut y_dot,
            weights,
            &distance,
        );
        match corrected {
            Ok(()) => self.reinit(t, &y, &y_dot),
            Err(Inconsistent::Failed(StepError::Fatal(source))) => {
                Err(RadauError::Fatal { function: "residual or Jacobian", t, h: 0.0, source })
            }
            Err(source) => Err(IntegratorError::Inconsistent { t, source }.into()),
        }
    }
}
