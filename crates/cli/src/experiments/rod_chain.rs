//! The rod of section 3.1 and its chain: as one system, or recorded once and replayed.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex};

use anyhow::Context;
use myovib_fem::rod::{EndLoad, Rod, RodData};
use myovib_model::coupling::{
    Body, CoupledDae, ErrorTest, NoBody, Oscillators, Recorder, Recording, Source, StateTolerances,
};
use myovib_model::{IdaIntegrator, Limits, LinearSolver, Outcome, RodDae, Signal, paper, run};
use serde_json::{Map, Value, json};
use sundials_wrap::{DaeProblem, IdaOptions};

use super::chain_run::pair;
use super::{ChainRun, ChainSetup};
use crate::interrupt;
use crate::progress::Progress;
use crate::watch::Watch;

/// A rod has no shorter way than its own small matrix.
const LINEAR_SOLVER: LinearSolver = LinearSolver::Full;

/// How the load is read.
const END_LOAD: EndLoad = EndLoad::Strain;

/// Amplitude of the load.
const LOAD_AMPLITUDE: f64 = 1.0;

/// Point and load of the rod under a load of `frequency` Hz, for JSON.
pub fn rod_json(x: f64, frequency: f64) -> Map<String, Value> {
    let load = match END_LOAD {
        EndLoad::Strain => "strain",
        EndLoad::Traction => "traction",
    };
    Map::from_iter([
        ("body".to_owned(), json!("rod")),
        ("point".to_owned(), json!([x])),
        ("load".to_owned(), json!(load)),
        ("load_amplitude".to_owned(), json!(LOAD_AMPLITUDE)),
        ("load_frequency".to_owned(), json!(frequency)),
    ])
}

/// The paper's rod under its load with another frequency (Hz).
fn rod(frequency: f64) -> anyhow::Result<RodDae> {
    let mut load = Signal::paper(LOAD_AMPLITUDE);
    if let Signal::RampedSine { frequency: f, .. } = &mut load {
        *f = frequency;
    }
    Ok(RodDae::new(Rod::new(RodData::default())?, END_LOAD, load))
}

/// Rod and chain as one system, coupled at the rod's point `x`, from rest to `t_end`.
///
/// # Errors
/// A point beside the rod; fatal errors of the run.
pub fn rod_chain(
    setup: &ChainSetup,
    x: f64,
    t_end: f64,
    progress: &Mutex<Progress>,
) -> anyhow::Result<ChainRun> {
    let rod = paper::rod()?;
    let point = rod.displacement_at(x).context("--point")?;
    let dae = coupled(rod, setup, Source::Body(point))?;
    let body = rod_json(x, paper::LOAD_FREQUENCY);
    let run = finish(dae, "rod and chain", &["rod", "chain"], t_end, progress)?;
    Ok(ChainRun { body, ..run })
}

/// The motion of the rod's point `x` under a load of `frequency` Hz, from rest to `t_end`.
///
/// # Errors
/// A point beside the rod; a run that does not reach its end.
pub fn record_rod(
    frequency: f64,
    x: f64,
    t_end: f64,
    progress: &Mutex<Progress>,
) -> anyhow::Result<Arc<Recording>> {
    let rod = rod(frequency)?;
    let point = rod.displacement_at(x).context("--point")?;
    let dae = CoupledDae::new(rod, Vec::new());
    let n = dae.n_unknowns();
    let test = ErrorTest::of_states(n, StateTolerances::default());
    let mut recorder = Recorder::new(point, n);
    let mut watch = Watch::new(format!("rod at {frequency} Hz"), t_end, progress);
    let mut limits = Limits::new(f64::INFINITY, Some(interrupt::flag()));
    let mut integrator = IdaIntegrator::coupled(
        dae,
        test,
        IdaOptions::default(),
        LINEAR_SOLVER,
        t_end,
        &vec![0.0; n],
    )?;
    let statistics = run(
        &mut integrator,
        &mut [&mut recorder, &mut watch, &mut limits],
    )?;
    if let Outcome::Stopped { message, .. } = statistics.outcome {
        anyhow::bail!("the rod at {frequency} Hz stopped: {message}");
    }
    Ok(Arc::new(recorder.finish()))
}

/// A chain alone, driven by a recorded motion.
///
/// # Errors
/// Fatal errors of the run.
pub fn replay(
    setup: &ChainSetup,
    recording: Arc<Recording>,
    t_end: f64,
    progress: &Mutex<Progress>,
) -> anyhow::Result<ChainRun> {
    let dae = coupled(NoBody, setup, Source::Recorded(recording))?;
    finish(dae, "chain", &["chain"], t_end, progress)
}

fn coupled<B: DaeProblem>(
    body: B,
    setup: &ChainSetup,
    source: Source,
) -> anyhow::Result<CoupledDae<B>> {
    let oscillators = Oscillators::new(setup.network()?, setup.drive(), vec![source])?;
    Ok(CoupledDae::new(body, vec![oscillators]))
}

/// Runs a system all of whose states have the default tolerances.
fn finish<B: Body>(
    dae: CoupledDae<B>,
    name: &str,
    blocks: &[&'static str],
    t_end: f64,
    progress: &Mutex<Progress>,
) -> anyhow::Result<ChainRun> {
    let tolerances = StateTolerances::default();
    let unknowns = dae.n_unknowns();
    let test =
        ErrorTest::of_states(dae.body_range().len(), tolerances).with_oscillators(&dae, tolerances);
    let options = IdaOptions::default();
    let max_order = options.max_order;
    let mut integrator = IdaIntegrator::coupled(
        dae,
        test,
        options,
        LINEAR_SOLVER,
        t_end,
        &vec![0.0; unknowns],
    )?;
    let (history, statistics) = ChainRun::observe(&mut integrator, name, t_end, progress)?;
    Ok(ChainRun {
        history,
        statistics,
        unknowns,
        tolerances: blocks
            .iter()
            .map(|block| (*block, pair(tolerances)))
            .collect::<BTreeMap<_, _>>(),
        suppressed: Vec::new(),
        max_order,
        t_end,
        linear_solver: LINEAR_SOLVER.name(),
        body: Map::new(),
    })
}
