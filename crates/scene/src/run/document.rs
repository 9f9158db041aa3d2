//! Contents of `run.json`: input, program, settings and statistics of a run.

use std::time::{Duration, Instant};

use myovib_model::advice::Advice;
use myovib_model::{
    CpuClock, EndReason, EvaluationTimes, Formulation, Integrator, Muscle, Outcome, Statistics,
};
use myovib_sparse::resources;
use serde_json::{Value, json};

use super::options::RunResult;
use super::outputs::Outputs;
use crate::Error;
use crate::json::{self, extend};
use crate::result_folder::{self, ResultFolder};
use crate::scene_file::integrator::MaxOrder;
use crate::statistics;
use crate::system::System;
use crate::{Body, Scene};

/// Wall-clock times of a run.
#[derive(Debug, Clone, Copy)]
pub(super) struct Timing {
    pub(super) setup: Duration,
    /// Evaluations that the integrator requested from the body.
    pub(super) evaluations: EvaluationTimes,
    /// Integration, including evaluations and outputs.
    pub(super) integration: Duration,
    pub(super) output: Duration,
}

impl Timing {
    /// Returns the time (s) of each part. All parts except the setup add up to the integration time; `other` contains
    /// the rest, for example step size control and the oscillators.
    fn by_part(&self) -> Value {
        let EvaluationTimes { residuals, tangents, factorizations, solves } = self.evaluations;
        let other = self.integration.saturating_sub(self.output + self.evaluations.total());
        json!({
            "setup": self.setup.as_secs_f64(),
            "residuals": residuals.as_secs_f64(),
            "tangents": tangents.as_secs_f64(),
            "factorizations": factorizations.as_secs_f64(),
            "solves": solves.as_secs_f64(),
            "other": other.as_secs_f64(),
            "output": self.output.as_secs_f64(),
        })
    }
}

/// Clocks of an analysis that writes its results at the end.
pub(super) struct Clocks {
    wall: Instant,
    cpu: CpuClock,
}

impl Clocks {
    pub(super) fn start() -> Self {
        Self { wall: Instant::now(), cpu: CpuClock::start() }
    }

    /// Returns the document of the analysis, with the scene, the outcome, the mesh and the elapsed times.
    pub(super) fn document(&self, scene: &Scene, outcome: &Outcome) -> Value {
        json!({
            "scene": scene.file,
            "analysis": scene.file.analysis,
            "outcome": outcome.name(),
            "reason": outcome.reason().map(EndReason::name),
            "message": outcome.message(),
            "mesh": scene.body.as_ref().map(|body| mesh(&body.muscle)),
            "cpu_seconds": self.cpu.elapsed().as_secs_f64(),
            "wall_seconds": self.wall.elapsed().as_secs_f64(),
        })
    }
}

/// Returns the document of a dynamic run.
pub(super) fn dynamic<P: System>(
    scene: &Scene,
    integrator: &dyn Integrator<P>,
    statistics: &Statistics,
    outputs: &Outputs<'_>,
    timing: &Timing,
) -> Result<Value, Error> {
    let system = integrator.problem();
    let chains = system.chain_counts();
    let total = outputs.before.plus(integrator.counts(), chains);
    let mut document = json!({
        "scene": scene.file,
        "analysis": "dynamic",
        "unknowns": system.state_len(),
        "t_end": scene.t_end,
        "resumed": total.resumed,
        "work": system.counters(),
        "output_work": outputs.work,
        "wall_seconds_by_part": timing.by_part(),
        "peak_memory_bytes": resources::peak(),
    });
    if chains.is_some() {
        extend(&mut document, json!({ "chains": total.chains }));
    }
    // Counts are totals over all parts of a resumed run.
    let whole = Statistics { counts: total.counts, ..statistics.clone() };
    extend(
        &mut document,
        match &scene.body {
            Some(body) => of_body(scene, body, &whole, outputs.drift),
            None => of_states(scene, &whole),
        },
    );
    let probes: Vec<&str> = scene.file.probe.iter().map(|p| p.name.as_str()).collect();
    extend(
        &mut document,
        json!({
            "seed": seed(scene),
            "energy": outputs.energy(),
            "error_indicator": outputs.indicator.document(&outputs.recorders, &probes),
            "stop": stop(&whole.outcome),
            "inversion": outputs.volumes.inversion(),
            "volume_ratios": outputs.volumes.ratios(),
            "not_finite": outputs.not_finite(),
        }),
    );
    Ok(document)
}

/// Returns the formulation, drift, statistics and settings of a run with a muscle.
fn of_body(
    scene: &Scene,
    Body { muscle, formulation, settings, opposed_fibers, .. }: &Body,
    whole: &Statistics,
    (drift, drift_at): (f64, f64),
) -> Value {
    let mut document = body(muscle, *formulation);
    extend(
        &mut document,
        json!({
            "constraint_drift": drift,
            "constraint_drift_at": drift_at,
            "opposed_fibers": opposed_fibers,
        }),
    );
    extend(&mut document, statistics::of_body(whole, settings, *formulation));
    if scene.file.integrator.max_order == Some(MaxOrder::Auto) {
        let advice = Advice::new(muscle, *formulation, settings);
        let reason = advice.max_order_reason();
        extend(&mut document, json!({ "max_order_reason": reason }));
    }
    document
}

/// Returns the statistics and settings of a run without a body.
fn of_states(scene: &Scene, whole: &Statistics) -> Value {
    let wanted = &scene.file.integrator;
    let integrator = wanted.method;
    let mut document = statistics::counts(whole);
    extend(
        &mut document,
        json!({
            "index": 0,
            "rtol": wanted.oscillators.rtol,
            "atol": wanted.oscillators.atol,
            "integrator": integrator.name(),
        }),
    );
    let max_order = || json!({ "max_order": wanted.max_order.unwrap_or(MaxOrder::Fixed(5)) });
    extend(&mut document, statistics::radau_iia(integrator).unwrap_or_else(max_order));
    document
}

/// Returns the inverted element at which a run stopped, if any.
fn stop(outcome: &Outcome) -> Value {
    match outcome {
        Outcome::Stopped { inverted: Some(at), .. } => json!({
            "element": at.element,
            "barycentric": at.barycentric[..],
            "J": at.jacobian,
        }),
        _ => Value::Null,
    }
}

fn seed(scene: &Scene) -> Value {
    match &scene.file.chain[..] {
        [] => Value::Null,
        [one] => json!(one.seed),
        several => several.iter().map(|chain| chain.seed).collect(),
    }
}

fn body(muscle: &Muscle, formulation: Formulation) -> Value {
    let indices = formulation.rows().iter().map(|(field, _)| {
        let index = muscle.variable_index(formulation, *field);
        (field.name().to_owned(), json!(index))
    });
    json!({
        "formulation": formulation.name(),
        "equation": formulation.equation(),
        "index": muscle.index(formulation),
        "indices": indices.collect::<serde_json::Map<_, _>>(),
        "unknowns_paper": muscle.n_unknowns_paper(),
        "mesh": mesh(muscle),
    })
}

fn mesh(muscle: &Muscle) -> Value {
    let space = muscle.solid.space();
    json!({
        "dimension": space.dimension(),
        "vertices": space.mesh().n_points(),
        (space.mesh().shape().plural): space.n_elements(),
        "nodes": space.n_nodes(),
        "free_components": muscle.solid.dofs().n_free(),
        "groups": space.mesh().groups().keys().collect::<Vec<_>>(),
    })
}

/// Adds the notes on the scene and on its run to the document, and writes the document. The returned result contains no
/// modes, response or periodic state.
pub(super) fn finish(
    folder: &ResultFolder,
    scene: &Scene,
    mut document: Value,
    outcome: Outcome,
    notes: Vec<String>,
) -> Result<RunResult, Error> {
    document["notes"] = json!([&scene.notes()[..], &notes].concat());
    write(folder, &document)?;
    Ok(RunResult { document, outcome, notes, modes: None, response: None, periodic: None })
}

/// Writes `run.json`.
pub(super) fn write(folder: &ResultFolder, document: &Value) -> Result<(), Error> {
    folder.write(result_folder::DOCUMENT, json::document("run", document)?)
}
