//! The statistics of a run as JSON, under the contract's names, with all settings used.

use std::collections::BTreeMap;

use myovib_model::linear::LinearWork;
use myovib_model::{Formulation, Outcome, Settings, Statistics};
use serde::Serialize;
use sundials_wrap::klu::Ordering;

/// The counts and the outcome of a run.
#[derive(Debug, Clone, Serialize)]
#[allow(missing_docs)] // the names are the contract's, documented with Statistics
pub struct CountsJson<'a> {
    pub steps: u64,
    pub error_test_failures: u64,
    pub step_solve_failures: u64,
    pub newton_failures: u64,
    pub newton_iterations: u64,
    pub residual_evaluations: u64,
    pub jacobian_evaluations: u64,
    pub linear_setups: u64,
    pub last_order: u32,
    pub last_step: f64,
    pub t_reached: f64,
    pub outcome: &'a str,
    pub reason: Option<&'a str>,
    pub message: Option<&'a str>,
    pub cpu_seconds: f64,
    pub wall_seconds: f64,
}

impl<'a> CountsJson<'a> {
    /// The counts of a run.
    pub fn new(statistics: &'a Statistics) -> Self {
        let message = match &statistics.outcome {
            Outcome::Finished => None,
            Outcome::Stopped { message, .. } => Some(message.as_str()),
        };
        Self {
            steps: statistics.steps,
            error_test_failures: statistics.error_test_failures,
            step_solve_failures: statistics.step_solve_failures,
            newton_failures: statistics.newton_failures,
            newton_iterations: statistics.newton_iterations,
            residual_evaluations: statistics.residual_evaluations,
            jacobian_evaluations: statistics.jacobian_evaluations,
            linear_setups: statistics.linear_setups,
            last_order: statistics.last_order,
            last_step: statistics.last_step,
            t_reached: statistics.t_reached,
            outcome: statistics.outcome.name(),
            reason: statistics.outcome.reason().map(|reason| reason.name()),
            message,
            cpu_seconds: statistics.cpu_seconds,
            wall_seconds: statistics.wall_seconds,
        }
    }
}

/// What the condensed linear solver did; all zero where it was not used.
#[derive(Debug, Clone, Serialize)]
#[allow(missing_docs)] // the names are those of LinearWork, documented there
pub struct LinearWorkJson {
    pub factorizations: u64,
    pub pivoted: u64,
    pub factor_entries: u64,
    pub solves: u64,
    pub refinements: u64,
    pub largest_backward_error: f64,
}

impl LinearWorkJson {
    /// The counts of a run.
    pub fn new(work: &LinearWork) -> Self {
        let LinearWork {
            factorizations,
            pivoted,
            factor_entries,
            solves,
            refinements,
            largest_backward_error,
        } = *work;
        Self {
            factorizations,
            pivoted,
            factor_entries,
            solves,
            refinements,
            largest_backward_error,
        }
    }
}

/// Statistics and settings, to be flattened into a document.
#[derive(Debug, Clone, Serialize)]
#[allow(missing_docs)] // the names are the contract's, documented with Settings
pub struct StatisticsJson<'a> {
    #[serde(flatten)]
    pub counts: CountsJson<'a>,
    pub integrator: &'a str,
    pub suppressed: Vec<&'a str>,
    pub multiplier_weights: &'a str,
    pub rtol: f64,
    pub atol: BTreeMap<&'a str, f64>,
    pub max_order: u8,
    pub delta_cj: f64,
    pub linear_solver: &'a str,
    pub ordering: &'a str,
    pub btf: bool,
    pub initial_step: Option<f64>,
    pub max_step: Option<f64>,
    pub project_every: Option<f64>,
    pub t_end: f64,
    /// The seed of random draws; null where nothing is drawn.
    pub seed: Option<u32>,
}

impl<'a> StatisticsJson<'a> {
    /// The statistics of a run of `formulation` with `settings`.
    pub fn new(
        statistics: &'a Statistics,
        settings: &'a Settings,
        formulation: Formulation,
    ) -> Self {
        Self {
            counts: CountsJson::new(statistics),
            integrator: settings.integrator.name(),
            suppressed: settings
                .suppressed
                .iter()
                .map(|field| field.symbol())
                .collect(),
            multiplier_weights: settings.multiplier_weights.name(),
            rtol: settings.relative_tolerance,
            atol: formulation
                .rows()
                .iter()
                .map(|(field, _)| (field.symbol(), settings.absolute_tolerances.of(*field)))
                .collect(),
            max_order: settings.max_order,
            delta_cj: settings.delta_cj,
            linear_solver: settings.linear_solver.name(),
            ordering: ordering_name(settings.ordering),
            btf: settings.btf,
            initial_step: settings.initial_step,
            max_step: settings.max_step,
            project_every: settings.project_every,
            t_end: settings.t_end,
            seed: None,
        }
    }
}

/// An ordering by its name in scenes and documents.
pub(crate) fn ordering_name(ordering: Ordering) -> &'static str {
    match ordering {
        Ordering::Amd => "amd",
        Ordering::Colamd => "colamd",
        Ordering::Natural => "natural",
    }
}
