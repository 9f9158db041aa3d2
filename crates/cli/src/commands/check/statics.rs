//! Findings for an equilibrium before it is computed.

use myovib_model::Field;
use myovib_model::check::{StaticReport, readable};
use myovib_report::table::kappa;
use myovib_scene::{Body, Scene};
use serde_json::{Value, json};

use super::document::{self, factors};
use super::{added, bound, held, in_words, memory, size_of, warnings, writes};

/// Formats the findings as text.
pub(super) fn text(scene: &Scene, body: &Body, report: &StaticReport) -> String {
    let total: usize = report.unknowns.iter().map(|(_, number)| number).sum();
    let blocks = report.unknowns.iter();
    let blocks: Vec<String> =
        blocks.map(|(field, number)| format!("{number} of {}", in_words(*field))).collect();
    let mut lines = vec![size_of(scene, body)];
    lines.extend(added(scene.file()));
    let has_pressure = report.unknowns.len() > 1;
    lines.extend(has_pressure.then(|| held(report.held)));
    let moved = report.linear_displacement.filter(|u| *u > 0.0);
    lines.extend(moved.map(|u| {
        format!(
            "response        according to linear elasticity, the load moves the body by up to {} m",
            readable(u)
        )
    }));
    lines.extend(report.factors.map(memory));
    lines.extend(report.iteration_time.map(|seconds| {
        format!("cost            {seconds:.1e} s per iteration of Newton's method; a load step takes 2 to 16")
    }));
    lines.extend(writes::lines(scene));
    format!(
        "equilibrium, κ {} {}: {total} unknowns, {}\n\n{}\n\n{}",
        bound(body, |ratios| ratios.kappa),
        kappa(body.muscle.parameters.kappa()),
        blocks.join(" and "),
        lines.join("\n"),
        warnings(&report.findings)
    )
}

/// Returns the findings for the JSON document. `inf_sup` and `nullity` are null if there are too many pressures to
/// compute them within seconds. `factors` is null if it is not known before the run. `linear_displacement` is the
/// maximum displacement (m) under the full load according to linear elasticity; null if the body is too large for this
/// computation or not sufficiently supported. `seconds_per_iteration` is the CPU time (s) per iteration; it is
/// predicted if the body is too large for a trial, and null if the body is not sufficiently supported.
pub(super) fn document(report: &StaticReport) -> Value {
    let size =
        |(field, unknowns): &(Field, usize)| json!({ "field": field.name(), "unknowns": unknowns });
    json!({
        "unknowns": report.unknowns.iter().map(|(_, number)| number).sum::<usize>(),
        "blocks": report.unknowns.iter().map(size).collect::<Vec<_>>(),
        "inf_sup": report.held.map(|held| held.inf_sup),
        "nullity": report.held.map(|held| held.nullity),
        "factors": report.factors.as_ref().map(factors),
        "linear_displacement": report.linear_displacement,
        "seconds_per_iteration": report.iteration_time,
        "warnings": document::warnings(&report.findings),
    })
}
