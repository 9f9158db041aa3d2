//! State of an integration, from which another solver continues with bitwise identical results.

use myovib_dae::checks::{
    expect_finite, expect_finite_value, expect_length, expect_positive, expect_vector,
};
use myovib_dae::{IntegratorError, LinearSolver, Problem, Statistics, StepError, Work};
use serde::{Deserialize, Serialize};

use super::jacobian_point::JacobianPoint;
use super::state::{JacobianAge, Pause, RadauSolver};
use crate::control::StepHistory;
use crate::dense::Collocation;
use crate::error::RadauError;
use crate::internal_variables::SavedVariables;
use crate::multipliers::PreviousMultipliers;
use crate::quadrature::QuadratureState;
use crate::work::Counters;

/// Complete state that determines the next steps of a [`RadauSolver`], excluding its problem, settings and functions. A
/// solver with the same problem, settings and functions that restores this state takes bitwise identical steps if the
/// same program runs on the same machine. Factors are not stored. They are recomputed at the points at which the
/// Jacobian was evaluated and at which pivots were selected.
///
/// A round trip through JSON is bitwise exact if numbers are written and read exactly (`float_roundtrip` of
/// `serde_json`).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RadauState {
    stages: usize,
    t: f64,
    y: Vec<f64>,
    y_dot: Vec<f64>,
    h: Option<f64>,
    fresh: bool,
    #[serde(default)]
    refused: Option<String>,
    #[serde(default)]
    near_kink: bool,
    #[serde(default)]
    jump: Option<[f64; 2]>,
    stop_time: Option<f64>,
    last: Collocation,
    /// Whether the predictor extrapolates the polynomial of the last step.
    continues: bool,
    /// State of Newton's method that determines its assumed contraction.
    newton: [f64; 2],
    /// Whether the corrections of Newton's method have contracted with the current matrices.
    #[serde(default)]
    tried_matrices: bool,
    control: StepHistory,
    multipliers: Vec<PreviousMultipliers>,
    /// Point at which the reusable Jacobian was evaluated, and the step size for which the matrices are set up.
    jacobian: Option<(JacobianPoint, Option<f64>)>,
    /// Point and step size at which all pivots were selected.
    pivots: Option<(JacobianPoint, f64)>,
    /// Other state of the linear solver.
    linear_solver: Vec<bool>,
    /// Time up to which roots were searched for, and the root functions at that time.
    roots: Option<(Option<f64>, Vec<f64>)>,
    #[serde(default)]
    quadrature: Option<QuadratureState>,
    #[serde(default)]
    internal: Option<SavedVariables>,
    pause: Option<Pause>,
    statistics: Statistics,
    work: Work,
}

impl RadauState {
    /// Returns the current time.
    pub fn t(&self) -> f64 {
        self.pause.as_ref().map_or(self.t, |pause| pause.t)
    }

    /// Returns the size of the vectors in bytes.
    pub(crate) fn n_bytes(&self) -> usize {
        let jacobian = self.jacobian.as_ref().map_or(0, |(at, _)| at.n_numbers());
        let pivots = self.pivots.as_ref().map_or(0, |(at, _)| at.n_numbers());
        let internal = self.internal.as_ref().map_or(0, SavedVariables::n_numbers);
        let own = self.y.len() + self.y_dot.len() + self.last.n_numbers() + internal;
        (own + jacobian + pivots) * size_of::<f64>() + size_of_val(&self.multipliers[..])
    }

    /// Returns y at the end of the last step, or at a pause within it.
    pub(crate) fn y(&self) -> &[f64] {
        &self.y
    }

    /// Returns the counters up to the current time.
    pub fn statistics(&self) -> Statistics {
        self.statistics
    }
}

impl<P: Problem, M: LinearSolver<P>> RadauSolver<P, M> {
    /// Returns the complete state that determines the next steps. Does not change the solver.
    pub fn save(&self) -> RadauState {
        let serves = self.jacobian != JacobianAge::Due;
        RadauState {
            stages: self.method.stages(),
            t: self.t,
            y: self.y.clone(),
            y_dot: self.y_dot.clone(),
            h: self.h,
            fresh: self.fresh,
            refused: self.refused.clone(),
            near_kink: self.near_kink,
            jump: self.jump,
            stop_time: self.options.stop_time,
            last: self.collocation.clone(),
            continues: self.predictor.continues(),
            newton: self.newton.saved(),
            tried_matrices: self.newton.has_tried_matrices(),
            control: self.control.history(),
            multipliers: self.multipliers.known(),
            jacobian: serves.then(|| (self.jacobian_point.clone(), self.set_up_for)),
            pivots: self.pivots_at.clone().filter(|_| !self.pivots_due),
            linear_solver: self.matrices.history(),
            roots: self.roots.as_ref().map(|roots| roots.saved()),
            quadrature: self.quadrature.as_ref().map(|q| q.state().clone()),
            internal: self.internal.as_ref().map(|internal| internal.state()),
            pause: self.pause.clone(),
            statistics: self.statistics(),
            work: self.counters.work,
        }
    }

    /// Continues from the `state` of a solver with the same problem, settings and functions.
    ///
    /// # Errors
    /// Returns [`IntegratorError::WrongLength`] if the state belongs to another problem or method, and
    /// [`IntegratorError::NotFinite`] or [`IntegratorError::InvalidOption`] if it contains invalid values. In these
    /// cases, the solver is unchanged. Returns [`RadauError::Fatal`] if the matrices cannot be recomputed.
    pub fn restore(&mut self, state: &RadauState) -> Result<(), RadauError> {
        self.validate(state)?;
        if let (Some(quadrature), Some(state)) = (&mut self.quadrature, &state.quadrature) {
            quadrature.restore(state);
        }
        if let (Some(internal), Some(state)) = (&mut self.internal, &state.internal) {
            internal.restore(state);
        }
        (self.t, self.h, self.start) = (state.t, state.h, Ok(()));
        self.y.copy_from_slice(&state.y);
        self.y_dot.copy_from_slice(&state.y_dot);
        (self.fresh, self.refused) = (state.fresh, state.refused.clone());
        (self.near_kink, self.jump) = (state.near_kink, state.jump);
        self.options.stop_time = state.stop_time;
        self.collocation = state.last.clone();
        self.predictor.restore(state.continues);
        self.newton.restore(state.newton);
        self.newton.set_tried(state.tried_matrices);
        self.control.restore(state.control);
        self.multipliers.restore(&state.multipliers);
        if let (Some(roots), Some((t, low))) = (&mut self.roots, &state.roots) {
            roots.restore(*t, low);
        }
        self.pause = state.pause.clone();
        self.update_weights();
        self.restore_matrices(state).map_err(|error| RadauError::Fatal {
            function: "Jacobian",
            t: state.t,
            h: state.h.unwrap_or(0.0),
            source: error.into(),
        })?;
        self.restarts += 1;
        self.counters = Counters { statistics: state.statistics, work: state.work };
        let evaluations = self.matrices.difference_evaluations();
        self.differences_before = evaluations.wrapping_sub(state.statistics.difference_evaluations);
        Ok(())
    }

    /// Validates all lengths and values of a state before use, because the state may come from a damaged file.
    fn validate(&self, state: &RadauState) -> Result<(), IntegratorError> {
        let (n, stages) = (self.y.len(), self.method.stages());
        expect_length("stages of the state", stages, state.stages)?;
        expect_vector("unknowns of the state", n, &state.y)?;
        expect_vector("derivatives of the state", n, &state.y_dot)?;
        state.last.validate("last step of the state", n, stages)?;
        let times = [Some(state.t), state.stop_time];
        let times: Vec<f64> = times.into_iter().flatten().collect();
        expect_finite("times of the state", &times)?;
        expect_finite("jump of the state", state.jump.as_ref().map_or(&[], |jump| jump))?;
        let steps = [state.h, state.pivots.as_ref().map(|(_, h)| *h)];
        let set_up_for = state.jacobian.as_ref().and_then(|(_, h)| *h);
        for h in steps.into_iter().flatten().chain(set_up_for) {
            expect_positive("step of the state", h)?;
        }
        expect_finite("convergence of the state", &state.newton)?;
        state.control.validate()?;
        let n_multipliers = self.multipliers.known().len();
        expect_length("multipliers of the state", n_multipliers, state.multipliers.len())?;
        let of_multipliers: Vec<f64> =
            (state.multipliers.iter()).flat_map(PreviousMultipliers::numbers).collect();
        expect_finite("multipliers of the state", &of_multipliers)?;
        let n_response = self.internal.as_ref().map_or(0, |internal| internal.present().len());
        let jacobian = state.jacobian.as_ref().map(|(at, _)| at);
        let pivots = state.pivots.as_ref().map(|(at, _)| at);
        for at in [jacobian, pivots].into_iter().flatten() {
            at.validate(n, n_response)?;
        }
        if let Some(pause) = &state.pause {
            expect_finite_value("times of the state", pause.t)?;
            expect_vector("unknowns of the state", n, &pause.y)?;
            expect_vector("derivatives of the state", n, &pause.y_dot)?;
        }
        if let Some((t, _)) = &state.roots {
            expect_finite("times of the state", t.as_slice())?;
        }
        let of_state = state.quadrature.as_ref().map_or(0, QuadratureState::len);
        expect_length("quadratures of the state", self.n_quadratures(), of_state)?;
        if let Some(quadrature) = &state.quadrature {
            quadrature.validate(stages)?;
        }
        let of_state = state.internal.as_ref().map_or(0, SavedVariables::n_states);
        expect_length("saved internal variables", self.n_internal_variables(), of_state)?;
        match (&self.internal, &state.internal) {
            (Some(internal), Some(state)) => internal.validate(state),
            _ => Ok(()),
        }
    }

    /// Selects pivots and computes factors at the points stored in the state.
    fn restore_matrices(&mut self, state: &RadauState) -> Result<(), StepError> {
        let (problem, matrices) = (&mut self.problem, &mut self.matrices);
        matrices.set_history(&state.linear_solver)?;
        matrices.forget_pivots();
        let internal = &self.internal;
        let show = |problem: &mut P, at: &JacobianPoint| {
            if let Some(internal) = internal {
                internal.show(problem, at.response());
            }
        };
        if let Some((at, h)) = &state.pivots {
            show(problem, at);
            matrices.evaluate(problem, &at.as_linearization())?;
            let shifts = self.method.shifts(*h);
            matrices.set_up(problem, self.method.real_mode().lambda / h, &shifts)?;
        }
        (self.jacobian, self.set_up_for) = (JacobianAge::Due, None);
        if let Some((at, set_up_for)) = &state.jacobian {
            show(problem, at);
            matrices.evaluate(problem, &at.as_linearization())?;
            if let Some(h) = set_up_for {
                let shifts = self.method.shifts(*h);
                matrices.set_up(problem, self.method.real_mode().lambda / h, &shifts)?;
            }
            self.jacobian_point = at.clone();
            (self.jacobian, self.set_up_for) = (JacobianAge::Old, *set_up_for);
        }
        matrices.set_history(&state.linear_solver)?;
        self.pivots_at = state.pivots.clone();
        self.pivots_due = state.pivots.is_none();
        self.pivot_choices = matrices.pivot_choices();
        Ok(())
    }
}
