//! Linear internal variables with one driving quantity each. As the integrator eliminates these variables, they are not
//! part of the unknowns.

mod form;
mod kernel;
mod specification;

use std::ops::Range;

use myovib_dae::checks::{expect_finite, expect_length, expect_vector};
use myovib_dae::{IntegratorError, Problem, StepError};
use serde::{Deserialize, Serialize};

use crate::dense::Collocation;
use crate::error::RadauError;
use crate::failure::{Failure, Operation};
use crate::method::Method;
use form::{BEGIN, CHANGE, Form, N_DRIVING, SHIFTED, SHIFTED_CHANGE, TermStep};
use kernel::Driven;
pub use specification::{
    InternalVariableGroup, InternalVariableProblem, InternalVariables, RelaxationTerm,
};

/// Name of the initial states in messages.
const START: &str = "initial internal variables";

/// Function that writes the driving quantities for a given time and given unknowns.
type DrivingQuantity<P> = fn(&mut P, f64, &[f64], &mut [f64]) -> Result<(), StepError>;

/// Functions of a problem with internal variables.
struct Functions<P> {
    driving_quantity: DrivingQuantity<P>,
    driving_change: fn(&mut P, &[f64], &mut [f64]),
    response: fn(&mut P) -> &mut [f64],
}

/// Internal variables (states) of a solver, which are eliminated from the stage equations.
///
/// At the stages of a step, both the states and the responses are linear functions of the initial states q and of the
/// driving quantities at all stages ([`TermStep::stage`]). The contribution of q is summed over the terms once per
/// step. Therefore, the cost of Newton's method does not depend on the number of terms.
pub(crate) struct EliminatedVariables<P> {
    functions: Functions<P>,
    parts: Vec<InternalVariableGroup>,
    /// Relative and absolute tolerances.
    tolerances: (f64, f64),
    /// States at the beginning of the current step.
    states: Vec<f64>,
    /// Driving quantities in the current step, in the order of the forms.
    driving: Vec<Vec<f64>>,
    /// Contributions of the states to the responses at the stages.
    constants: Vec<Vec<f64>>,
    /// Response at the beginning of the step.
    present: Vec<f64>,
    last: LastStep,
    /// Norm of the last estimated error.
    error: f64,
}

/// Last accepted step, for dense output.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct LastStep {
    /// States at the beginning of the step.
    states: Vec<f64>,
    driving: Vec<Vec<f64>>,
}

/// Saved internal variables, which are sufficient to compute further steps and dense output.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct SavedVariables {
    states: Vec<f64>,
    last: LastStep,
}

impl SavedVariables {
    pub(crate) fn n_states(&self) -> usize {
        self.states.len()
    }

    pub(crate) fn n_numbers(&self) -> usize {
        let driving = self.last.driving.iter().map(Vec::len);
        2 * self.states.len() + driving.sum::<usize>()
    }
}

impl<P> std::fmt::Debug for EliminatedVariables<P> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("EliminatedVariables").field("parts", &self.parts).finish_non_exhaustive()
    }
}

/// Returns the forms of the terms of a group in a step of size h.
fn forms(
    part: &InternalVariableGroup,
    (method, h): (&Method, f64),
    form: impl Fn(TermStep<'_>) -> Form,
) -> Vec<Form> {
    let terms = part.terms.iter();
    terms.map(|&term| form(TermStep { term, method, h })).collect()
}

impl<P: Problem> EliminatedVariables<P> {
    pub(crate) fn new(
        variables: InternalVariables,
        method: &Method,
        (relative, factor): (f64, f64),
    ) -> Result<Self, RadauError>
    where
        P: InternalVariableProblem,
    {
        variables.validate()?;
        let n_slots = variables.parts.last().map_or(0, |part| part.slots.end);
        let of_part = |part: &InternalVariableGroup| part.slots.len() * part.terms.len();
        let n_states = variables.parts.iter().map(of_part).sum();
        expect_length(START, n_states, variables.start.len())?;
        expect_finite(START, &variables.start)?;
        let (zeros, stages) = (vec![0.0; n_slots], method.stages());
        let is_used = |m: usize| m <= stages || m >= CHANGE;
        let driving = |m| if is_used(m) { zeros.clone() } else { Vec::new() };
        let driving: Vec<_> = (0..N_DRIVING).map(driving).collect();
        Ok(Self {
            functions: Functions {
                driving_quantity: P::driving_quantity,
                driving_change: P::driving_change,
                response: P::response,
            },
            parts: variables.parts,
            tolerances: (factor * relative, factor * variables.absolute),
            constants: vec![zeros.clone(); stages],
            present: zeros,
            last: LastStep { states: variables.start.clone(), driving: driving.clone() },
            driving,
            states: variables.start,
            error: 0.0,
        })
    }

    fn driven<'a>(
        parts: &'a [InternalVariableGroup],
        states: &'a [f64],
        driving: &'a [Vec<f64>],
    ) -> impl Iterator<Item = (&'a InternalVariableGroup, Range<usize>, Driven<'a>)> {
        let mut end = 0;
        parts.iter().map(move |part| {
            let own = end..end + part.slots.len() * part.terms.len();
            end = own.end;
            let driven = Driven { slots: &part.slots, states: &states[own.clone()], driving };
            (part, own, driven)
        })
    }

    /// Evaluates `form` for each term and writes the sum over the terms at each slot to `out`.
    fn sum(&self, step: (&Method, f64), form: impl Fn(TermStep<'_>) -> Form, out: &mut [f64]) {
        out.fill(0.0);
        for (part, _, driven) in Self::driven(&self.parts, &self.states, &self.driving) {
            driven.add_sum(&forms(part, step, &form), out);
        }
    }

    /// Starts an attempt at a step of size `h` from (t, y).
    pub(crate) fn begin(
        &mut self,
        problem: &mut P,
        (method, h): (&Method, f64),
        t: f64,
        y: &[f64],
    ) -> Result<(), Failure> {
        (self.functions.driving_quantity)(problem, t, y, &mut self.driving[BEGIN])
            .map_err(Operation::Residual.failed())?;
        let mut constants = std::mem::take(&mut self.constants);
        for (i, constant) in constants.iter_mut().enumerate() {
            let of_state = |term: TermStep<'_>| term.response(i).of_state;
            self.sum((method, h), |term| Form::state() * of_state(term), constant);
        }
        self.constants = constants;
        let mut present = std::mem::take(&mut self.present);
        let response = |term: TermStep<'_>| term.response_of(Form::driving(BEGIN), Form::state());
        self.sum((method, h), response, &mut present);
        self.present = present;
        self.show_present(problem);
        Ok(())
    }

    /// Sets the problem's response to its value at the beginning of the step.
    pub(crate) fn show_present(&self, problem: &mut P) {
        (self.functions.response)(problem).copy_from_slice(&self.present);
    }

    /// Returns the response at the beginning of the step.
    pub(crate) fn present(&self) -> &[f64] {
        &self.present
    }

    /// Sets the problem's response.
    pub(crate) fn show(&self, problem: &mut P, response: &[f64]) {
        (self.functions.response)(problem).copy_from_slice(response);
    }

    /// Evaluates the driving quantity at stage i, given its time t and unknowns y.
    pub(crate) fn evaluate_driving_quantity(
        &mut self,
        problem: &mut P,
        i: usize,
        (t, y): (f64, &[f64]),
    ) -> Result<(), Failure> {
        (self.functions.driving_quantity)(problem, t, y, &mut self.driving[1 + i])
            .map_err(Operation::Residual.failed())
    }

    /// Sets the problem's response to its value at stage i, which is computed from the driving quantities at all
    /// stages.
    pub(crate) fn show_stage(&self, problem: &mut P, i: usize, step: (&Method, f64)) {
        let response = (self.functions.response)(problem);
        response.copy_from_slice(&self.constants[i]);
        for (part, _, driven) in Self::driven(&self.parts, &self.states, &self.driving) {
            let of_driving = |term: TermStep<'_>| Form { of_state: 0.0, ..term.response(i) };
            driven.add_sum(&forms(part, step, of_driving), response);
        }
    }

    /// Sets the problem's response to its value in the equations of the error estimate after elimination of the states.
    /// If `again` is true, the estimate is repeated: the equations are evaluated at (t, y), where y is the initial
    /// value minus its estimated error.
    pub(crate) fn show_condensed(
        &mut self,
        problem: &mut P,
        step: (&Method, f64),
        again: Option<(f64, &[f64])>,
    ) -> Result<(), Failure> {
        let response = (self.functions.response)(problem);
        let Some((t, y)) = again else {
            let first = |term: TermStep<'_>| term.condensed(Form::driving(BEGIN), Form::state());
            self.sum(step, first, response);
            return Ok(());
        };
        (self.functions.driving_quantity)(problem, t, y, &mut self.driving[SHIFTED])
            .map_err(Operation::Residual.failed())?;
        let shifted = |term: TermStep<'_>| {
            term.condensed(Form::driving(SHIFTED), Form::state() + first_error(term))
        };
        self.sum(step, shifted, (self.functions.response)(problem));
        Ok(())
    }

    /// Returns the norm of the estimated error of the states, given the `error` of y.
    pub(crate) fn estimate(
        &mut self,
        problem: &mut P,
        step: (&Method, f64),
        error: &[f64],
        again: bool,
    ) -> f64 {
        let change = if again { SHIFTED_CHANGE } else { CHANGE };
        (self.functions.driving_change)(problem, error, &mut self.driving[change]);
        self.error = self.norm(step, last_error(again));
        self.error
    }

    /// Returns the norm of the last estimated error.
    pub(crate) fn error(&self) -> f64 {
        self.error
    }

    /// Returns the norm of q̇ at the beginning of the step.
    pub(crate) fn rate(&self, method: &Method) -> f64 {
        self.norm((method, 1.0), |term| {
            term.response_of(Form::driving(BEGIN), Form::state()) * (1.0 / term.term.time)
        })
    }

    fn norm(&self, step: (&Method, f64), form: impl Fn(TermStep<'_>) -> Form) -> f64 {
        let (relative, absolute) = self.tolerances;
        let absolute = absolute.max(f64::MIN_POSITIVE);
        let driven = Self::driven(&self.parts, &self.states, &self.driving);
        let squares = driven
            .map(|(part, _, driven)| driven.square(&forms(part, step, &form), relative, absolute));
        (squares.sum::<f64>() / self.states.len().max(1) as f64).sqrt()
    }

    /// Accepts the current step, which becomes the last step.
    pub(crate) fn accept(&mut self, (method, h): (&Method, f64)) {
        let end = method.stages() - 1;
        let Self { parts, states, driving, last, .. } = self;
        for (part, own, driven) in Self::driven(parts, states, driving) {
            let at_end = forms(part, (method, h), |term| term.stage(end));
            driven.write(&at_end, &mut last.states[own]);
        }
        std::mem::swap(states, &mut last.states);
        std::mem::swap(driving, &mut last.driving);
    }

    /// Truncates the last accepted `step` at `t`, where the next step will start.
    pub(crate) fn cut(&mut self, method: &Method, step: &Collocation, t: f64) {
        let mut states = std::mem::take(&mut self.states);
        self.evaluate(method, step, t, 0, &mut states);
        self.states = states;
    }

    /// Evaluates the states (`derivative` = 0) or their derivatives (1) at a time within the last accepted `step`.
    pub(crate) fn evaluate(
        &self,
        method: &Method,
        step: &Collocation,
        t: f64,
        derivative: usize,
        out: &mut [f64],
    ) {
        let LastStep { states, driving } = &self.last;
        for (part, own, driven) in Self::driven(&self.parts, states, driving) {
            let form = |term: TermStep<'_>| {
                term.between(derivative, step.coefficients(method, t, derivative))
            };
            driven.write(&forms(part, (method, step.h), form), &mut out[own]);
        }
    }

    /// Restarts at (t, y) with unchanged states.
    pub(crate) fn restart(
        &mut self,
        problem: &mut P,
        method: &Method,
        t: f64,
        y: &[f64],
    ) -> Result<(), Failure> {
        self.begin(problem, (method, 1.0), t, y)?;
        self.last.states.copy_from_slice(&self.states);
        let (begin, stages) = self.driving.split_at_mut(1);
        for driving in &mut stages[..method.stages()] {
            driving.copy_from_slice(&begin[0]);
        }
        self.last.driving.clone_from(&self.driving);
        Ok(())
    }

    pub(crate) fn n_states(&self) -> usize {
        self.states.len()
    }

    pub(crate) fn state(&self) -> SavedVariables {
        SavedVariables { states: self.states.clone(), last: self.last.clone() }
    }

    /// Checks that the problem has one response per slot.
    pub(crate) fn expect_response(&self, problem: &mut P) -> Result<(), IntegratorError> {
        let n_response = (self.functions.response)(problem).len();
        expect_length("response of the internal variables", self.present.len(), n_response)
    }

    /// Validates the lengths and values of a saved state.
    pub(crate) fn validate(&self, state: &SavedVariables) -> Result<(), IntegratorError> {
        const WHAT: &str = "saved internal variables";
        expect_vector(WHAT, self.states.len(), &state.states)?;
        expect_vector(WHAT, self.states.len(), &state.last.states)?;
        expect_length(WHAT, self.driving.len(), state.last.driving.len())?;
        let driving = self.driving.iter().zip(&state.last.driving);
        for (own, driving) in driving {
            expect_vector(WHAT, own.len(), driving)?;
        }
        Ok(())
    }

    pub(crate) fn restore(&mut self, state: &SavedVariables) {
        self.states.clone_from(&state.states);
        self.last = state.last.clone();
    }
}

/// Returns the form of the estimated error of a state. `twice` states whether the estimate was repeated.
fn last_error(twice: bool) -> fn(TermStep<'_>) -> Form {
    match twice {
        false => first_error,
        true => |term| {
            let state = Form::state() + first_error(term);
            term.error(Form::driving(SHIFTED), state, Form::driving(SHIFTED_CHANGE))
        },
    }
}

/// Returns the first estimate of the error of a state.
fn first_error(term: TermStep<'_>) -> Form {
    term.error(Form::driving(BEGIN), Form::state(), Form::driving(CHANGE))
}
