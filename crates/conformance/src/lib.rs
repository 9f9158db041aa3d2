//! The conformance suite: tests that any implementation of [`Integrator`] must pass.
//!
//! A crate that defines an integrator implements [`Method`], which builds the integrator, and generates the tests with
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

/// Problem selected at run time. With this type, integrators are compiled only once for all problems.
pub type AnyProblem = Box<dyn Problem>;

/// Function that writes g(t, y, ẏ) into the last argument.
pub type Function = Box<
    dyn FnMut(&mut AnyProblem, f64, &[f64], &[f64], &mut [f64]) -> Result<(), StepError> + Send,
>;

/// Function that writes the error weights for y into the last argument.
pub type Weights =
    Box<dyn FnMut(&mut AnyProblem, &[f64], &mut [f64]) -> Result<(), StepError> + Send>;

/// Relative tolerance of a [`Request`].
const RELATIVE: f64 = 1e-6;
/// Absolute tolerance of a [`Request`].
const ABSOLUTE: f64 = 1e-9;

/// Specification of an integration. An option that is `None` has the default of the method.
pub struct Request {
    /// The problem.
    pub problem: AnyProblem,
    /// Initial values of t, y and ẏ.
    pub start: (f64, Vec<f64>, Vec<f64>),
    /// The tolerances.
    pub tolerances: Tolerances,
    /// Time that no step may exceed.
    pub stop_time: Option<f64>,
    /// Maximum number of steps in one call.
    pub max_steps: Option<usize>,
    /// Size of the first step.
    pub initial_step: Option<f64>,
    /// Minimum size of a step.
    pub min_step: f64,
    /// Maximum size of a step.
    pub max_step: Option<f64>,
    /// Error weights, which replace the tolerances.
    pub weights: Option<Weights>,
    /// Root functions, and the direction in which each is observed.
    pub roots: Option<(Vec<Direction>, Function)>,
    /// Components excluded from the error test.
    pub suppressed: Suppressed,
    /// Initial values and integrands of quadratures. The quadratures are excluded from the error test.
    pub quadrature: Option<(Vec<f64>, Function)>,
}

/// Returns root functions g(t, y), and the directions in which they are observed.
fn roots(
    directions: &[Direction],
    mut function: impl FnMut(f64, &[f64], &mut [f64]) -> Result<(), StepError> + Send + 'static,
) -> Option<(Vec<Direction>, Function)> {
    let function =
        move |_: &mut AnyProblem, t: f64, y: &[f64], _: &[f64], g: &mut [f64]| function(t, y, g);
    Some((directions.to_vec(), Box::new(function)))
}

impl Request {
    /// Creates a request with the tolerances `RELATIVE` and `ABSOLUTE`.
    pub fn new(problem: impl Problem + 'static, t0: f64, y0: &[f64], y_dot0: &[f64]) -> Self {
        Self {
            problem: Box::new(problem),
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

/// Integration method to be tested.
pub trait Method {
    /// Type of the integrator.
    type Integrator: Integrator<AnyProblem>;

    /// Returns the factor f for which the error weights 1/(f (r |y| + a)) have the same effect as the tolerances r and
    /// a, where r is `relative`.
    fn weight_factor(&self, _relative: f64) -> f64 {
        1.0
    }

    /// Builds an integrator.
    fn build(&self, request: Request) -> Self::Integrator;
}

/// Generates one test for each behavior. The expression creates the [`Method`](crate::Method) under test.
#[macro_export]
macro_rules! conformance_tests {
    ($method:expr) => {
        $crate::conformance_tests!(@each $method;
            solves_exact_problems_to_tolerance,
            treats_tolerances_as_error_weights,
            works_without_jacobian_kinds_and_indices,
            corrects_inconsistent_initial_values,
            rejects_initial_values_that_contradict_the_equations,
            accepts_errors_of_initial_values_below_the_tolerances,
            rejects_initial_values_that_violate_stated_constraints,
            accepts_the_values_at_an_event_as_initial_values,
            corrects_derivatives_for_the_time_to_the_first_output,
            handles_an_output_time_equal_to_the_current_time,
            finds_events_where_a_root_function_becomes_zero,
            tests_differential_variables_in_any_unit,
            corrects_initial_values_in_any_unit,
            reaches_output_times_exactly_with_consistent_values,
            rejects_past_times_and_non_finite_values,
            applies_a_stop_time_once,
            limits_the_steps_of_each_call,
            a_restart_equals_a_new_integrator,
            counts_steps_and_evaluations,
            limits_dense_output_to_the_last_step,
            reports_missing_quadratures,
            integrates_quadratures_with_the_solution,
            stops_if_a_quadrature_fails,
            projects_initial_values_onto_stated_constraints,
            rejects_a_search_for_index_1_at_a_higher_index,
            rejects_missing_or_wrong_constraints,
            excludes_components_by_their_index,
            excludes_components_from_the_error_test,
            finds_events_in_order,
            restarts_after_an_event,
            recovers_from_recoverable_errors,
            names_the_function_that_failed,
            stops_before_a_wall,
            returns_fatal_errors,
            stops_at_the_smallest_step,
            names_a_remedy_for_a_jump,
            keeps_statistics_if_a_weight_becomes_invalid,
            keeps_a_consistent_state_if_a_root_function_fails,
            propagates_panics,
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
        Outcome::Stopped(stop) => {
            assert_eq!(stop.wrong_entry, None, "{stop}");
            stop
        }
        other => panic!("{other:?} is no stop"),
    }
}

#[track_caller]
fn assert_stop(stop: &Stop, reason: StopReason, printed: &str) {
    assert_eq!(stop.reason, reason, "{stop}");
    assert!(stop.message.contains(printed), "{stop}");
}
