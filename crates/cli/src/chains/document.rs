//! JSON document of a chain's run: the chain, its body, statistics and settings.

use std::collections::BTreeMap;

use myovib_model::Signal;
use myovib_model::coupling::{CoupledOptions, Settling};
use myovib_oscillators::Settled;
use myovib_scene::scene_file::integrator::MaxOrder;
use myovib_scene::statistics::{CountsJson, MethodJson, StatisticsJson};
use myovib_scene::{Body, Scene};
use serde::Serialize;
use serde_json::{Map, Value, json};

use super::ChainRun;

/// Returns the chain, the body that drives it, the statistics and the settings of a run.
pub fn chain_document(run: &ChainRun) -> anyhow::Result<Map<String, Value>> {
    let mut document = Map::new();
    let settings = match (&run.scene.body, run.has_body) {
        (Some(body), true) => with_a_muscle(run, body)?,
        _ => of_states(run)?,
    };
    for part in [settings, body(&run.scene), chain(&run.scene)] {
        if let Value::Object(part) = part {
            document.extend(part);
        }
    }
    document.insert("unknowns".to_owned(), json!(run.unknowns));
    Ok(document)
}

fn chain(scene: &Scene) -> Value {
    let chain = &scene.file.chain[0];
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

/// Describes the body and its load, and whether the body moved together with the chain or its motion was recorded
/// before.
fn body(scene: &Scene) -> Value {
    let chain = &scene.file.chain[0];
    match (&scene.body, &scene.file.rod) {
        (Some(Body { muscle, .. }), _) => json!({
            "body": "muscle",
            "kappa": scene.file.solid.as_ref().map(|solid| &solid.bulk_modulus),
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

fn with_a_muscle(run: &ChainRun, body: &Body) -> anyhow::Result<Value> {
    let of_chain = &run.scene.file.integrator.oscillators;
    let numbers = StatisticsJson::new(&run.statistics, &body.settings, body.formulation);
    let blocks = numbers.atol.keys().map(|block| (*block, numbers.rtol));
    let rtol: BTreeMap<_, _> = blocks.chain([("chain", of_chain.rtol)]).collect();
    let mut atol = numbers.atol.clone();
    atol.insert("chain", of_chain.atol);
    let mut document = serde_json::to_value(numbers)?;
    document["rtol"] = json!(rtol);
    document["atol"] = json!(atol);
    document["formulation"] = json!(body.formulation.name());
    Ok(document)
}

/// Returns the document of a run whose states belong only to a rod and to oscillators.
fn of_states(run: &ChainRun) -> anyhow::Result<Value> {
    let wanted = &run.scene.file.integrator;
    let integrator = wanted.method;
    let blocks: &[&str] = if run.has_body { &["rod", "chain"] } else { &["chain"] };
    let each = |value: f64| blocks.iter().map(|block| (*block, value)).collect::<BTreeMap<_, _>>();
    let mut document = serde_json::to_value(CountsJson::new(&run.statistics))?;
    document["integrator"] = json!(integrator.name());
    document["suppressed"] = json!([]);
    document["rtol"] = json!(each(wanted.oscillators.rtol));
    document["atol"] = json!(each(wanted.oscillators.atol));
    if let (Value::Object(all), Value::Object(steps)) =
        (&mut document, serde_json::to_value(wanted.steps)?)
    {
        all.extend(steps);
    }
    document["t_end"] = json!(run.scene.t_end);
    document["linear_solver"] = json!(CoupledOptions::of_states(integrator).linear_solver.name());
    if MethodJson::radau_iia(integrator).is_none() {
        document["max_order"] = json!(wanted.max_order.unwrap_or(MaxOrder::Fixed(5)));
    }
    Ok(document)
}

/// Settled values of a chain in a JSON document.
#[derive(Debug, Serialize)]
pub struct SettledJson {
    /// Length of the trailing window, s.
    window: f64,
    /// |Ψ|.
    psi: Settled,
    /// |χ|.
    chi: Settled,
    /// Centroid frequency, Hz.
    frequency: Settled,
}

impl From<Settling> for SettledJson {
    fn from(settling: Settling) -> Self {
        Self {
            window: settling.window,
            psi: settling.centroid,
            chi: settling.phase,
            frequency: settling.frequency,
        }
    }
}
