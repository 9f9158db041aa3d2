//! Statistics of a run as JSON, with documented names and all settings used.

use std::collections::BTreeMap;

use myovib_model::{Counts, Formulation, IntegratorKind, Settings, Statistics, StepOptions};
use myovib_sparse::Ordering;
use serde::Serialize;

/// Number of samples of the constraint drift over a run.
pub const DRIFT_SAMPLES: f64 = 100.0;

/// Counts and outcome of a run.
#[derive(Debug, Clone, Serialize)]
#[allow(missing_docs)] // the names are the contract's, documented with Statistics
pub struct CountsJson<'a> {
    #[serde(flatten)]
    pub counts: Counts,
    pub t_reached: f64,
    pub outcome: &'a str,
    pub reason: Option<&'a str>,
    pub message: Option<&'a str>,
    pub cpu_seconds: f64,
    pub wall_seconds: f64,
}

impl<'a> CountsJson<'a> {
    /// Creates this part of the document from the statistics of a run.
    pub fn new(statistics: &'a Statistics) -> Self {
        Self {
            counts: statistics.counts,
            t_reached: statistics.t_reached,
            outcome: statistics.outcome.name(),
            reason: statistics.outcome.reason().map(|reason| reason.name()),
            message: statistics.outcome.message(),
            cpu_seconds: statistics.cpu_seconds,
            wall_seconds: statistics.wall_seconds,
        }
    }
}

/// Settings specific to one integrator.
#[derive(Debug, Clone, Serialize)]
#[serde(untagged)]
#[allow(missing_docs)] // the names are the contract's, documented with Settings
pub enum MethodJson<'a> {
    Bdf {
        max_order: u8,
        delta_cj: f64,
        multiplier_weights: &'a str,
        projection_interval: Option<f64>,
    },
    RadauIia {
        stages: usize,
        order: u8,
    },
}

impl<'a> MethodJson<'a> {
    /// Returns the settings specific to the integrator of `settings`.
    pub fn new(settings: &'a Settings) -> Self {
        Self::radau_iia(settings.integrator).unwrap_or_else(|| Self::Bdf {
            max_order: settings.max_order,
            delta_cj: settings.delta_cj,
            multiplier_weights: settings.multiplier_weights.name(),
            projection_interval: settings.projection_interval,
        })
    }

    /// Returns the properties of a Radau IIA method.
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
    #[serde(flatten)]
    pub steps: StepOptions,
    pub t_end: f64,
    /// Seed of random draws; null if nothing is drawn.
    pub seed: Option<u32>,
}

impl<'a> StatisticsJson<'a> {
    /// Creates the statistics of a run of `formulation` with `settings`.
    pub fn new(
        statistics: &'a Statistics,
        settings: &'a Settings,
        formulation: Formulation,
    ) -> Self {
        Self {
            counts: CountsJson::new(statistics),
            integrator: settings.integrator.name(),
            method: MethodJson::new(settings),
            suppressed: settings.suppressed.iter().map(|field| field.name()).collect(),
            rtol: settings.relative_tolerance,
            atol: formulation
                .rows()
                .iter()
                .map(|(field, _)| (field.name(), settings.absolute_tolerances.of(*field)))
                .collect(),
            linear_solver: settings.linear_solver.name(),
            ordering: ordering_name(settings.ordering),
            btf: settings.btf,
            steps: settings.steps,
            t_end: settings.t_end,
            seed: None,
        }
    }
}

/// Returns the name of an ordering in scenes and documents.
pub fn ordering_name(ordering: Ordering) -> &'static str {
    match ordering {
        Ordering::Amd => "amd",
        Ordering::Colamd => "colamd",
        Ordering::Natural => "natural",
    }
}
