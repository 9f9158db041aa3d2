//! Data of a run, stored for the backward pass.

use myovib_dae::{IntegratorError, LinearSolver, Outcome, Problem};

use crate::dense::Collocation;
use crate::error::RadauError;
use crate::solver::{RadauSolver, RadauState};

/// Accepted steps of a run, which an [`Adjoint`](super::Adjoint) traverses backward.
///
/// A recording stores either the stages of all steps or only a few states of the solver. In the latter case, the steps
/// between these states are reproduced bitwise when they are needed.
#[derive(Debug)]
pub struct Recording {
    recorded_steps: RecordedSteps,
    /// Arguments and result of each step.
    steps: Vec<StepRequest>,
    /// Number of [restarts](RadauSolver::restarts) of the solver before the recorded steps.
    restarts: u64,
}

/// Arguments of a step, and the resulting size.
#[derive(Debug, Clone, Copy)]
struct StepRequest {
    time_limits: ([f64; 2], bool),
    h: f64,
    /// End time of the step.
    end: f64,
}

#[derive(Debug)]
enum RecordedSteps {
    Stages(Vec<Collocation>),
    /// States before every `spacing`-th step, and the stages of the steps since the last state.
    Checkpoints {
        states: Vec<RadauState>,
        spacing: usize,
        recent: Vec<Collocation>,
    },
}

/// Callback for groups of successive steps in the backward pass. The arguments are the solver, the zero-based index of
/// the first step, and the stages of the steps.
type Visit<'v, P, M> =
    dyn FnMut(&mut RadauSolver<P, M>, usize, &[Collocation]) -> Result<(), RadauError> + 'v;

impl Recording {
    /// Creates a recording that stores the stages of all steps. A step requires s + 2 vectors.
    ///
    /// # Errors
    /// Returns [`IntegratorError::AfterTheStart`] if the solver has already taken steps, and
    /// [`RadauError::InternalVariables`] if it has internal variables.
    pub fn of_stages<P: Problem, M: LinearSolver<P>>(
        solver: &RadauSolver<P, M>,
    ) -> Result<Self, RadauError> {
        Self::new(solver, RecordedSteps::Stages(Vec::new()))
    }

    /// Creates a recording with two levels of checkpoints. For N steps, it stores at most √N states, and the stages of
    /// the √N to 2 √N steps between two of these states. In return, almost all steps are computed twice.
    ///
    /// The solver must not be modified between steps, so that it can replay them.
    ///
    /// # Errors
    /// Returns the same errors as [`of_stages`](Self::of_stages).
    pub fn of_checkpoints<P: Problem, M: LinearSolver<P>>(
        solver: &RadauSolver<P, M>,
    ) -> Result<Self, RadauError> {
        let recorded_steps = RecordedSteps::Checkpoints {
            states: vec![solver.save()],
            spacing: 2,
            recent: Vec::new(),
        };
        Self::new(solver, recorded_steps)
    }

    fn new<P: Problem, M: LinearSolver<P>>(
        solver: &RadauSolver<P, M>,
        recorded_steps: RecordedSteps,
    ) -> Result<Self, RadauError> {
        if solver.statistics().steps > 0 {
            return Err(IntegratorError::AfterTheStart { t: solver.t() }.into());
        }
        solver.expect_no_internal_variables()?;
        Ok(Self { recorded_steps, steps: Vec::new(), restarts: solver.restarts() })
    }

    /// Returns the number of recorded steps.
    pub fn n_steps(&self) -> usize {
        self.steps.len()
    }

    /// Returns the maximum memory in bytes used during the run and the backward pass.
    pub fn n_bytes(&self) -> usize {
        let of_stages = |steps: &[Collocation]| {
            let numbers: usize = steps.iter().map(Collocation::n_numbers).sum();
            numbers * size_of::<f64>()
        };
        let n_bytes = match &self.recorded_steps {
            RecordedSteps::Stages(steps) => of_stages(steps),
            RecordedSteps::Checkpoints { states, spacing, recent } => {
                let of_states: usize = states.iter().map(RadauState::n_bytes).sum();
                // There are `spacing` steps between two states unless the run is shorter.
                let of_one = recent.first().map_or(0, |step| of_stages(std::slice::from_ref(step)));
                of_states + of_one * self.steps.len().min(*spacing)
            }
        };
        n_bytes + size_of_val(&self.steps[..])
    }

    /// Integrates up to `t_out`, as [`RadauSolver::integrate_to`] does, and records the steps.
    ///
    /// # Errors
    /// Returns errors of [`RadauSolver::integrate_to`] and of [`follow`](Self::follow).
    pub fn integrate_to<P: Problem, M: LinearSolver<P>>(
        &mut self,
        solver: &mut RadauSolver<P, M>,
        t_out: f64,
    ) -> Result<Outcome, RadauError> {
        solver.integrate_watched(t_out, &mut |solver| self.follow(solver))
    }

    /// Records the last accepted step of the solver. Does nothing if the solver has not taken a new step. Must be
    /// called after each [`RadauSolver::step`].
    ///
    /// # Errors
    /// Returns [`RadauError::Missed`] if more than one step was taken since the last call, and
    /// [`RadauError::StartedAgain`] if the solver was restarted since this recording was created.
    pub fn follow<P: Problem, M: LinearSolver<P>>(
        &mut self,
        solver: &mut RadauSolver<P, M>,
    ) -> Result<(), RadauError> {
        if !solver.has_new_step(self.restarts, self.steps.len() as u64)? {
            return Ok(());
        }
        let time_limits = solver.time_limits();
        let (h, end) = (solver.last_step_size(), solver.step_end());
        self.steps.push(StepRequest { time_limits, h, end });
        let step = solver.accepted().collocation;
        match &mut self.recorded_steps {
            RecordedSteps::Stages(steps) => steps.push(step),
            RecordedSteps::Checkpoints { states, spacing, recent } => {
                if (self.steps.len() - 1).is_multiple_of(*spacing) {
                    recent.clear();
                }
                recent.push(step);
                if self.steps.len().is_multiple_of(*spacing) {
                    states.push(solver.save());
                }
                // If the number of states exceeds the number of steps between two states, every other state is dropped.
                if states.len() > *spacing {
                    let mut number = 0;
                    states.retain(|_| {
                        number += 1;
                        number % 2 == 1
                    });
                    *spacing *= 2;
                }
            }
        }
        Ok(())
    }

    /// Returns the end time of step `number`.
    pub(super) fn end(&self, number: usize) -> f64 {
        self.steps[number].end
    }

    /// Traverses all steps backward in groups. Returns the number of replayed steps.
    pub(super) fn go_back<P: Problem, M: LinearSolver<P>>(
        &self,
        solver: &mut RadauSolver<P, M>,
        visit: &mut Visit<'_, P, M>,
    ) -> Result<u64, RadauError> {
        match &self.recorded_steps {
            RecordedSteps::Stages(steps) => visit(solver, 0, steps).map(|()| 0),
            RecordedSteps::Checkpoints { states, spacing, recent } => {
                let (n_steps, mut n_repeated) = (self.steps.len(), 0);
                for (k, state) in states.iter().enumerate().rev() {
                    let first = k * spacing;
                    let last = (first + spacing).min(n_steps);
                    if last == n_steps && last - first <= recent.len() {
                        visit(solver, first, &recent[recent.len() - (last - first)..])?;
                        continue;
                    }
                    let steps = self.repeat(solver, state, first..last)?;
                    let is_same = |next: &RadauState| next.y() == solver.y_unpaused();
                    if !states.get(k + 1).is_none_or(is_same) {
                        return Err(RadauError::NotRepeated { t: state.t() });
                    }
                    visit(solver, first, &steps)?;
                    n_repeated += steps.len() as u64;
                }
                Ok(n_repeated)
            }
        }
    }

    /// Replays the steps in the range `numbers`, starting from the saved `state` before the first of them.
    fn repeat<P: Problem, M: LinearSolver<P>>(
        &self,
        solver: &mut RadauSolver<P, M>,
        state: &RadauState,
        numbers: std::ops::Range<usize>,
    ) -> Result<Vec<Collocation>, RadauError> {
        solver.restore(state)?;
        let mut steps = Vec::with_capacity(numbers.len());
        for requested in &self.steps[numbers] {
            let t = solver.t();
            solver.repeat(requested.time_limits)?;
            if solver.last_step_size() != requested.h {
                return Err(RadauError::NotRepeated { t });
            }
            steps.push(solver.accepted().collocation);
        }
        Ok(steps)
    }
}
