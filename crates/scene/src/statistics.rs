//! Statistics of a run in JSON format, with documented names and all settings of the run.

use std::collections::BTreeMap;

use myovib_model::{EndReason, Formulation, IntegratorKind, Settings, Statistics};
use myovib_sparse::Ordering;
use serde_json::{Value, json};

use crate::json::extend;

/// Number of times at which the constraint drift is sampled during a run.
pub const DRIFT_SAMPLES: f64 = 100.0;

/// Returns the counters and the outcome of a run.
pub fn counts(statistics: &Statistics) -> Value {
    let mut document = json!(statistics.counts);
    let outcome = &statistics.outcome;
    extend(
        &mut document,
        json!({
            "t_reached": statistics.t_reached,
            "outcome": outcome.name(),
            "reason": outcome.reason().map(EndReason::name),
            "message": outcome.message(),
            "cpu_seconds": statistics.cpu_seconds,
            "wall_seconds": statistics.wall_seconds,
        }),
    );
    document
}

/// Returns the settings specific to a Radau IIA method; `None` for BDF.
pub fn radau_iia(integrator: IntegratorKind) -> Option<Value> {
    let (stages, order) = (integrator.stages()?, integrator.order()?);
    Some(json!({ "stages": stages, "order": order }))
}

/// Returns the statistics and settings of a run with a body. The random `seed` is null because the run uses no random
/// numbers.
pub fn of_body(statistics: &Statistics, settings: &Settings, formulation: Formulation) -> Value {
    let atol = formulation
        .rows()
        .iter()
        .map(|(field, _)| (field.name(), settings.absolute_tolerances.of(*field)));
    let suppressed = settings.suppressed.iter().map(|field| field.name());
    let method = radau_iia(settings.integrator).unwrap_or_else(|| {
        json!({
            "max_order": settings.max_order,
            "delta_cj": settings.delta_cj,
            "multiplier_weights": settings.multiplier_weights.name(),
            "projection_interval": settings.projection_interval,
        })
    });
    let mut document = counts(statistics);
    extend(&mut document, method);
    extend(&mut document, json!(settings.steps));
    extend(
        &mut document,
        json!({
            "integrator": settings.integrator.name(),
            "suppressed": suppressed.collect::<Vec<_>>(),
            "rtol": settings.relative_tolerance,
            "atol": atol.collect::<BTreeMap<_, _>>(),
            "linear_solver": settings.linear_solver.name(),
            "ordering": ordering_name(settings.ordering),
            "btf": settings.btf,
            "t_end": settings.t_end,
            "seed": null,
        }),
    );
    document
}

/// Returns the name that scenes and documents use for an ordering.
fn ordering_name(ordering: Ordering) -> &'static str {
    match ordering {
        Ordering::Amd => "amd",
        Ordering::Colamd => "colamd",
        Ordering::Natural => "natural",
    }
}
