//! The conformance suite: tests that any implementation of [`Integrator`] must pass.
//!
//! A crate with an integrator implements [`Method`] to build it, and generates the tests by
//! [`conformance_tests!`](crate::conformance_tests).
#![allow(clippy::unwrap_used)] // a test may panic

mod accuracy;
mod constraints;
mod failures;
mod jacobian;
mod output;
mod problems;
mod quadratures;
pub mod samples;
mod starts;
mod stepping;
mod units;

pub use accuracy::*;
pub use constraints::*;
pub use failures::*;
pub use jacobian::jacobian_error;
pub use output::*;
pub use quadratures::*;
pub use starts::*;
pub use stepping::*;
pub use units::*;

use myovib_dae::{
    Direction, Integrator, Outcome, Problem, StepError, Stop, StopReason, Suppressed, Tolerances,
};

/// Function that writes g(t, y, ẏ) into the last argument.
pub type Function<P> =
    Box<dyn FnMut(&mut P, f64, &[f64], &[f64], &mut [f64]) -> Result<(), StepError> + Send>;

/// Function that writes the error weights for y into the last argument.
pub type Weights<P> = Box<dyn FnMut(&mut P, &[f64], &mut [f64]) -> Result<(), StepError> + Send>;

/// Relative tolerance of a [`Request`].
const RELATIVE: f64 = 1e-6;
/// Absolute tolerance of a [`Request`].
const ABSOLUTE: f64 = 1e-9;

/// Specification of an integration; `None` selects the defaults of the method.
pub struct Request<P> {
    /// The problem.
    pub problem: P,
    /// Initial values of t, y and ẏ.
    pub start: (f64, Vec<f64>, Vec<f64>),
    /// The tolerances.
    pub tolerances: Tolerances,
    /// Time that no step may pass.
    pub stop_time: Option<f64>,
    /// Maximum number of steps of one call.
    pub max_steps: Option<usize>,
    /// The first step.
    pub initial_step: Option<f64>,
    /// The smallest step.
    pub min_step: f64,
    /// The largest step.
    pub max_step: Option<f64>,
    /// Error weights instead of tolerances.
    pub weights: Option<Weights<P>>,
    /// Root functions, with one direction for each.
    pub roots: Option<(Vec<Direction>, Function<P>)>,
    /// Components excluded from the error test.
    pub suppressed: Suppressed,
    /// Initial values and integrands of quadratures, which are excluded from the error test.
    pub quadrature: Option<(Vec<f64>, Function<P>)>,
}

impl<P> Request<P> {
    /// Creates a request with the tolerances `RELATIVE` and `ABSOLUTE`.
    pub fn new(problem: P, t0: f64, y0: &[f64], y_dot0: &[f64]) -> Self {
        Self {
            problem,
            start: (t0, y0.to_vec(), y_dot0.to_vec()),
            tolerances: Tolerances::scalar(RELATIVE, ABSOLUTE),
            stop_time: None,
            max_steps: None,
            initial_step: None,
            min_step: 0.0,
            max_step: None,
            weights: None,
            roots: None,
            suppressed: Suppressed::Nothing,
            quadrature: None,
        }
    }
}

/// Creates the integrators of one kind for the tests.
pub trait Method {
    /// The integrator.
    type Integrator<P: Problem + 'static>: Integrator<P>;

    /// Returns the factor f such that error weights 1/(f (r |y| + a)) have the same effect as the tolerances r and a,
    /// where r is `relative`.
    fn weight_factor(&self, _relative: f64) -> f64 {
        1.0
    }

    /// Builds an integrator.
    fn build<P: Problem + 'static>(&self, request: Request<P>) -> Self::Integrator<P>;
}

/// Generates one test for each behavior; the expression creates the [`Method`](crate::Method) under test.
#[macro_export]
macro_rules! conformance_tests {
    ($method:expr) => {
        $crate::conformance_tests!(@each $method;
            solves_exact_problems_to_tolerance,
            treats_tolerances_as_error_weights,
            needs_no_more_than_a_residual,
            starts_from_consistent_values,
            refuses_values_that_contradict_the_equations,
            weighs_a_start_by_the_tolerances,
            refuses_values_off_the_constraints_stated,
            takes_values_found_behind_an_event,
            corrects_derivatives_over_the_time_to_the_output,
            answers_at_the_time_reached,
            finds_where_an_event_arrives_at_zero,
            tests_differential_variables_in_any_unit,
            corrects_initial_values_in_any_unit,
            answers_with_times_that_are_its_own,
            refuses_times_behind_and_values_that_are_no_numbers,
            holds_a_stop_time_once,
            limits_the_steps_of_each_call,
            starts_afresh,
            counts_what_it_does,
            gives_dense_output_within_the_last_step_only,
            reports_missing_quadratures,
            integrates_quadratures_along_with_the_solution,
            stops_where_a_quadrature_fails,
            moves_onto_the_constraints_that_a_problem_states,
            refuses_constraints_that_are_not_there_or_wrong,
            leaves_components_out_by_their_index,
            excludes_components_from_the_error_test,
            finds_events_in_their_order,
            starts_anew_after_an_event,
            recovers_from_recoverable_errors,
            names_the_function_that_failed,
            stops_before_a_wall,
            hands_back_fatal_errors,
            stops_at_the_smallest_step,
            names_a_remedy_for_a_jump,
            keeps_its_statistics_when_a_weight_is_lost,
            stays_where_it_is_when_a_root_function_fails,
            lets_a_panic_pass,
        );
    };
    (@each $method:expr; $($behavior:ident),* $(,)?) => {
        $(
            #[test]
            fn $behavior() {
                $crate::$behavior(&$method);
            }
        )*
    };
}

#[track_caller]
fn stopped(outcome: Outcome) -> Box<Stop> {
    match outcome {
        Outcome::Stopped(stop) => stop,
        other => panic!("{other:?} is no stop"),
    }
}

#[track_caller]
fn assert_stop(stop: &Stop, reason: StopReason, printed: &str) {
    assert_eq!(stop.reason, reason, "{stop}");
    assert!(stop.message.contains(printed), "{stop}");
}
