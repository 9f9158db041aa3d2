//! Findings for a motion without inertia.

use myovib_model::Field;
use myovib_model::check::QuasiStaticReport;
use myovib_report::table::kappa;
use myovib_scene::{Body, Scene};
use serde_json::{Value, json};

use super::cost::Cost;
use super::document::{self, block, factors};
use super::{added, bound, held, in_words, memory, size_of, table, warnings, writes};

/// Formats the findings as text.
pub(super) fn text(scene: &Scene, body: &Body, report: &QuasiStaticReport, cost: &Cost) -> String {
    let rows = report.unknowns.iter().map(|(field, number, index)| {
        let tested = match body.settings.suppressed.contains(field) {
            true => "excluded",
            false => "in",
        };
        (in_words(*field).to_owned(), *number, *index, tested)
    });
    let has_pressure = body.formulation.has(Field::Pressure);
    let lines = [size_of(scene, body)]
        .into_iter()
        .chain(added(scene.file()))
        .chain(has_pressure.then(|| held(report.held)))
        .chain(report.factors.map(memory))
        .chain([cost.line(scene)])
        .chain(writes::lines(scene));
    format!(
        "`{}` without inertia, κ {} {}: {} unknowns\n\n{}\n{}\n\n{}",
        body.formulation,
        bound(body, |ratios| ratios.kappa),
        kappa(body.muscle.parameters.kappa()),
        total(report),
        table(rows),
        lines.collect::<Vec<_>>().join("\n"),
        warnings(&report.findings)
    )
}

/// Returns the findings for the JSON document. `inf_sup` and `nullity` are null if there are no pressures, or too many
/// to compute these values within seconds. `factors` is null if it is not known before the run.
pub(super) fn document(body: &Body, report: &QuasiStaticReport, cost: &Cost) -> Value {
    let blocks = report.unknowns.iter();
    let blocks =
        blocks.map(|(field, unknowns, index)| block(body, *field, *unknowns, *index, false));
    json!({
        "formulation": body.formulation.name(),
        "unknowns": total(report),
        "blocks": blocks.collect::<Vec<_>>(),
        "inf_sup": report.held.map(|held| held.inf_sup),
        "nullity": report.held.map(|held| held.nullity),
        "factors": report.factors.as_ref().map(factors),
        "cost": cost.json(),
        "warnings": document::warnings(&report.findings),
    })
}

fn total(report: &QuasiStaticReport) -> usize {
    report.unknowns.iter().map(|(_, number, _)| number).sum()
}
