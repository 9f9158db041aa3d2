//! The statistics of a run as JSON, under the contract's names, with all settings used.

use std::collections::BTreeMap;
use std::ops::Add;

use myovib_model::linear::LinearWork;
use myovib_model::{Formulation, IntegratorKind, Outcome, Settings, Statistics};
use myovib_radau::Work;
use serde::{Deserialize, Serialize};
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
    #[serde(skip_serializing_if = "Option::is_none")]
    pub radau_work: Option<RadauWorkJson>,
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
            radau_work: statistics.radau_work.map(RadauWorkJson::from),
            t_reached: statistics.t_reached,
            outcome: statistics.outcome.name(),
            reason: statistics.outcome.reason().map(|reason| reason.name()),
            message,
            cpu_seconds: statistics.cpu_seconds,
            wall_seconds: statistics.wall_seconds,
        }
    }
}

/// The linear algebra of Radau IIA.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
#[allow(missing_docs)] // the names are those of Work, documented there
pub struct RadauWorkJson {
    pub real_factorizations: u64,
    pub complex_factorizations: u64,
    pub real_solves: u64,
    pub complex_solves: u64,
}

impl From<Work> for RadauWorkJson {
    fn from(work: Work) -> Self {
        let Work {
            real_factorizations,
            complex_factorizations,
            real_solves,
            complex_solves,
        } = work;
        Self {
            real_factorizations,
            complex_factorizations,
            real_solves,
            complex_solves,
        }
    }
}

impl Add for RadauWorkJson {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            real_factorizations: self.real_factorizations + other.real_factorizations,
            complex_factorizations: self.complex_factorizations + other.complex_factorizations,
            real_solves: self.real_solves + other.real_solves,
            complex_solves: self.complex_solves + other.complex_solves,
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

/// The settings that one integrator has and the others have not.
#[derive(Debug, Clone, Serialize)]
#[serde(untagged)]
#[allow(missing_docs)] // the names are the contract's, documented with Settings
pub enum MethodJson<'a> {
    Bdf {
        max_order: u8,
        delta_cj: f64,
        multiplier_weights: &'a str,
        project_every: Option<f64>,
    },
    RadauIia {
        stages: usize,
        order: u8,
    },
}

impl<'a> MethodJson<'a> {
    /// Those of the integrator of `settings`.
    pub fn new(settings: &'a Settings) -> Self {
        Self::radau_iia(settings.integrator).unwrap_or_else(|| Self::Bdf {
            max_order: settings.max_order,
            delta_cj: settings.delta_cj,
            multiplier_weights: settings.multiplier_weights.name(),
            project_every: settings.project_every,
        })
    }

    /// Those of a Radau IIA method.
    pub fn radau_iia(integrator: IntegratorKind) -> Option<Self> {
        let (stages, order) = (integrator.stages()?, integrator.order()?);
        Some(Self::RadauIia { stages, order })
    }
}

/// Statistics and settings, to be flattened into a document.
#[derive(Debug, Clone, Serialize)]
#[allow(missing_docs)] // the names are the contract's, documented with Settings
pub struct StatisticsJson<'a> {
    #[serde(flatten)]
    pub counts: CountsJson<'a>,
    pub integrator: &'a str,
    #[serde(flatten)]
    pub method: MethodJson<'a>,
    pub suppressed: Vec<&'a str>,
    pub rtol: f64,
    pub atol: BTreeMap<&'a str, f64>,
    pub linear_solver: &'a str,
    pub ordering: &'a str,
    pub btf: bool,
    pub initial_step: Option<f64>,
    pub max_step: Option<f64>,
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
            method: MethodJson::new(settings),
            suppressed: settings
                .suppressed
                .iter()
                .map(|field| field.symbol())
                .collect(),
            rtol: settings.relative_tolerance,
            atol: formulation
                .rows()
                .iter()
                .map(|(field, _)| (field.symbol(), settings.absolute_tolerances.of(*field)))
                .collect(),
            linear_solver: settings.linear_solver.name(),
            ordering: ordering_name(settings.ordering),
            btf: settings.btf,
            initial_step: settings.initial_step,
            max_step: settings.max_step,
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
