//! `run.json`: what was computed, with what, and how it went.

use myovib_model::{Integrator, MuscleDae, Statistics};
use serde::Serialize;
use serde_json::{Value, json};
use sundials_wrap::DaeProblem;

use super::folder::Folder;
use super::outputs::Outputs;
use crate::json;
use crate::report::{Align, Table};
use crate::scene::{Body, Scene};
use crate::statistics::StatisticsJson;

/// Wall-clock seconds by part.
#[derive(Debug, Clone, Copy, Serialize)]
pub(super) struct Timing {
    pub(super) setup: f64,
    pub(super) integration: f64,
    pub(super) output: f64,
}

/// The document of a motion.
pub(super) fn dynamic(
    scene: &Scene,
    body: &Body,
    integrator: &impl Integrator<MuscleDae>,
    statistics: &Statistics,
    outputs: &Outputs<'_>,
    timing: &Timing,
) -> anyhow::Result<Value> {
    let total = outputs.before.plus(&integrator.counts());
    // Counts are those of all parts of a resumed run.
    let whole = Statistics {
        steps: total.steps,
        error_test_failures: total.error_test_failures,
        step_solve_failures: total.step_solve_failures,
        newton_failures: total.newton_failures,
        newton_iterations: total.newton_iterations,
        residual_evaluations: total.residual_evaluations,
        jacobian_evaluations: total.jacobian_evaluations,
        linear_setups: total.linear_setups,
        ..statistics.clone()
    };
    let parameters = &body.muscle.parameters;
    let indices = body.formulation.rows().iter().map(|(field, _)| {
        (
            field.symbol().to_owned(),
            json!(body.formulation.variable_index(*field, parameters)),
        )
    });
    let mut document = json!({
        "scene": scene.file,
        "analysis": "dynamic",
        "formulation": body.formulation.name(),
        "equation": body.formulation.equation(),
        "index": body.formulation.index(parameters),
        "indices": indices.collect::<serde_json::Map<_, _>>(),
        "unknowns": integrator.problem().n_unknowns(),
        "unknowns_paper": body.muscle.n_unknowns_paper(),
        "mesh": mesh(body),
        "constraint_drift": outputs.drift.0,
        "constraint_drift_at": outputs.drift.1,
        "resumed": total.resumed,
        "work": {
            "residual_passes": integrator.problem().counters().residual_passes,
            "force_rate_passes": integrator.problem().counters().force_rate_passes,
            "tangent_passes": integrator.problem().counters().tangent_passes,
            "rate_tangent_passes": integrator.problem().counters().rate_tangent_passes,
            "matrix_sums": integrator.problem().counters().matrix_sums,
        },
        "output_work": outputs.work,
        "wall_seconds_by_part": timing,
    });
    let statistics = serde_json::to_value(StatisticsJson::new(
        &whole,
        &body.settings,
        body.formulation,
    ))?;
    if let (Some(document), Value::Object(statistics)) = (document.as_object_mut(), statistics) {
        document.extend(statistics);
    }
    Ok(document)
}

/// Size of the mesh.
pub(super) fn mesh(body: &Body) -> Value {
    let space = body.muscle.solid.space();
    json!({
        "vertices": space.n_vertices(),
        "triangles": space.n_elements(),
        "nodes": space.n_nodes(),
        "free_components": body.muscle.solid.dofs().n_free(),
        "groups": space.mesh().groups().keys().collect::<Vec<_>>(),
    })
}

/// Writes `run.json`.
pub(super) fn write(folder: &Folder, document: &Value) -> anyhow::Result<()> {
    folder.write("run.json", &json::document("run", document)?)
}

/// The outcome for people.
pub(super) fn text(document: &Value) -> String {
    let mut table = Table::new(&[("run", Align::Left), ("", Align::Left)]);
    let plain = |value: &Value| match value {
        Value::String(text) => text.clone(),
        other => other.to_string(),
    };
    for (key, label) in [
        ("outcome", "outcome"),
        ("message", "why"),
        ("formulation", "formulation"),
        ("index", "index"),
        ("unknowns", "unknowns"),
        ("t_reached", "t reached, s"),
        ("steps", "steps"),
        ("error_test_failures", "error-test failures"),
        ("step_solve_failures", "step-solve failures"),
        ("newton_iterations", "Newton iterations"),
        ("constraint_drift", "constraint drift"),
        ("cpu_seconds", "CPU, s"),
    ] {
        match &document[key] {
            Value::Null => {}
            value => table.row([label.into(), plain(value).into()]),
        }
    }
    table.render(false)
}
