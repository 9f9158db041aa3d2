//! Findings for a motion without inertia.

use myovib_model::Field;
use myovib_model::check::QuasiStaticReport;
use myovib_report::table::{Align, Table, colored_stdout, kappa};
use myovib_scene::{Body, Scene};

use super::cost::Cost;
use super::document::{BlockJson, QuasiStaticJson};
use super::{added, bound, held, in_words, memory, size_of, warnings, writes};

/// Formats the findings as text.
pub(super) fn text(scene: &Scene, body: &Body, report: &QuasiStaticReport, cost: &Cost) -> String {
    let mut table = Table::new(&[
        ("unknowns", Align::Left),
        ("number", Align::Right),
        ("index", Align::Right),
        ("error test", Align::Left),
    ]);
    for (field, number, index) in &report.unknowns {
        let tested = match body.settings.suppressed.contains(field) {
            true => "left out",
            false => "in",
        };
        table.row([
            in_words(*field).into(),
            number.to_string().into(),
            index.to_string().into(),
            tested.into(),
        ]);
    }
    let has_pressure = body.formulation.has(Field::Pressure);
    let lines = [size_of(scene, body)]
        .into_iter()
        .chain(added(&scene.file))
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
        table.render(colored_stdout()),
        lines.collect::<Vec<_>>().join("\n"),
        warnings(&report.findings)
    )
}

/// Returns the findings for the JSON document.
pub(super) fn document(body: &Body, report: &QuasiStaticReport, cost: &Cost) -> QuasiStaticJson {
    let blocks = report.unknowns.iter().map(|(field, unknowns, index)| BlockJson {
        field: field.name(),
        unknowns: *unknowns,
        index: *index,
        left_out: body.settings.suppressed.contains(field),
        better_left_out: false,
    });
    QuasiStaticJson {
        formulation: body.formulation.name(),
        unknowns: total(report),
        blocks: blocks.collect(),
        inf_sup: report.held.map(|held| held.inf_sup),
        nullity: report.held.map(|held| held.nullity),
        factors: report.factors.map(Into::into),
        cost: cost.json(),
        warnings: report.findings.iter().map(Into::into).collect(),
    }
}

fn total(report: &QuasiStaticReport) -> usize {
    report.unknowns.iter().map(|(_, number, _)| number).sum()
}
