//! JSON document of the run of a chain: the chain, its body, statistics and settings.

use std::collections::BTreeMap;

use myovib_model::Signal;
use myovib_model::coupling::CoupledOptions;
use myovib_scene::json::extend;
use myovib_scene::scene_file::integrator::MaxOrder;
use myovib_scene::{Body, Scene, statistics};
use serde_json::{Value, json};

use super::ChainRun;

/// Returns the chain, the body that drives it, the statistics, and the settings of a run.
pub fn chain_document(run: &ChainRun) -> Value {
    let mut document = match (&run.scene.body, run.has_body) {
        (Some(body), true) => with_a_muscle(run, body),
        _ => of_states(run),
    };
    extend(&mut document, body(&run.scene));
    extend(&mut document, chain(&run.scene));
    document["unknowns"] = json!(run.unknowns);
    document
}

fn chain(scene: &Scene) -> Value {
    let chain = &scene.file().chain[0];
    json!({
        "oscillators": chain.oscillators,
        "frequency_spread": chain.frequency_spread,
        "generator": chain.generator,
        "seed": chain.seed,
        "gamma": chain.gain,
        "coupling": chain.coupling,
        "van_der_pol": chain.van_der_pol,
        "duffing": chain.duffing,
        "ends": chain.ends,
        "driven": chain.driven,
        "frequencies": scene.chains[0].chain.omega,
    })
}

/// Describes the body and its load. The document also states whether the body moved together with the chain or its
/// motion was recorded before.
fn body(scene: &Scene) -> Value {
    let chain = &scene.file().chain[0];
    match (&scene.body, &scene.file().rod) {
        (Some(Body { muscle, .. }), _) => json!({
            "body": "muscle",
            "kappa": scene.file().solid.as_ref().map(|solid| &solid.bulk_modulus),
            "beta": muscle.parameters.beta,
            "point": chain.at,
            "component": chain.component,
            "load": "traction",
            "load_frequency": muscle.forcing_frequency(),
        }),
        (None, rod) => json!({
            "body": "rod",
            "point": [&chain.at],
            "load": rod.as_ref().map(|rod| rod.load_type),
            "load_frequency": scene.rod.as_ref().map(|rod| rod.signal()).and_then(Signal::frequency),
        }),
    }
}

fn with_a_muscle(run: &ChainRun, body: &Body) -> Value {
    let of_chain = &run.scene.file().integrator.oscillators;
    let mut document = statistics::of_body(&run.statistics, &body.settings, body.formulation);
    document["atol"]["chain"] = json!(of_chain.atol);
    let blocks = body.formulation.rows().iter();
    let rtol = blocks.map(|(field, _)| (field.name(), body.settings.relative_tolerance));
    document["rtol"] = json!(rtol.chain([("chain", of_chain.rtol)]).collect::<BTreeMap<_, _>>());
    document["formulation"] = json!(body.formulation.name());
    document
}

/// Returns the document of a run without a muscle: only oscillators and, if it moves with them, a rod are integrated.
fn of_states(run: &ChainRun) -> Value {
    let wanted = &run.scene.file().integrator;
    let integrator = wanted.method;
    let blocks: &[&str] = if run.has_body { &["rod", "chain"] } else { &["chain"] };
    let each = |value: f64| blocks.iter().map(|block| (*block, value)).collect::<BTreeMap<_, _>>();
    let mut document = statistics::counts(&run.statistics);
    document["integrator"] = json!(integrator.name());
    document["suppressed"] = json!([]);
    document["rtol"] = json!(each(wanted.oscillators.rtol));
    document["atol"] = json!(each(wanted.oscillators.atol));
    extend(&mut document, json!(wanted.steps));
    document["t_end"] = json!(run.scene.t_end);
    document["linear_solver"] = json!(CoupledOptions::of_states(integrator).linear_solver.name());
    if integrator.stages().is_none() {
        document["max_order"] = json!(wanted.max_order.unwrap_or(MaxOrder::Fixed(5)));
    }
    document
}
