//! The rod of section 3.1 and its chain: as one system, or recorded once and replayed.

use std::collections::BTreeMap;
use std::sync::Arc;

use anyhow::Context;
use myovib_dae::Problem;
use myovib_fem::rod::EndLoad;
use myovib_model::coupling::{
    Body, CoupledDae, CoupledOptions, ErrorTest, NoBody, Oscillators, Recording, Source,
    StateTolerances, start_coupled,
};
use myovib_model::paper;
use serde_json::{Map, Value, json};

use super::chain_run::{max_order, pair};
use super::recording::record;
use super::{ChainRun, ChainSetup, Course};

/// Point and load of the rod under a load of `frequency` Hz, for JSON.
pub fn rod_json(x: f64, frequency: f64) -> Map<String, Value> {
    let load = match paper::ROD_END_LOAD {
        EndLoad::Strain => "strain",
        EndLoad::Traction => "traction",
    };
    Map::from_iter([
        ("body".to_owned(), json!("rod")),
        ("point".to_owned(), json!([x])),
        ("load".to_owned(), json!(load)),
        (
            "load_amplitude".to_owned(),
            json!(paper::ROD_LOAD_AMPLITUDE),
        ),
        ("load_frequency".to_owned(), json!(frequency)),
    ])
}

/// Rod and chain as one system, coupled at the rod's point `x`, from rest.
///
/// # Errors
/// A point beside the rod; fatal errors of the run.
pub fn rod_chain(setup: &ChainSetup, x: f64, course: Course) -> anyhow::Result<ChainRun> {
    let rod = paper::rod()?;
    let point = rod.displacement_at(x).context("--point")?;
    let dae = coupled(rod, setup, Source::Body(point))?;
    let body = rod_json(x, paper::LOAD_FREQUENCY);
    let run = finish(dae, "rod and chain", &["rod", "chain"], course)?;
    Ok(ChainRun { body, ..run })
}

/// The motion of the rod's point `x` under a load of `frequency` Hz, from rest.
///
/// # Errors
/// A point beside the rod; a run that does not reach its end.
pub fn record_rod(frequency: f64, x: f64, course: Course) -> anyhow::Result<Arc<Recording>> {
    let rod = paper::rod_driven_at(frequency)?;
    let point = rod.displacement_at(x).context("--point")?;
    let dae = CoupledDae::new(rod, Vec::new());
    let n = dae.n_unknowns();
    let test = ErrorTest::of_states(n, StateTolerances::default());
    let options = CoupledOptions::of_states(course.integrator);
    let mut integrator = start_coupled(dae, test, options, course.t_end, &vec![0.0; n])?;
    record(
        &mut *integrator,
        &format!("rod at {frequency} Hz"),
        point,
        course,
    )
}

/// A chain alone, driven by a recorded motion.
///
/// # Errors
/// Fatal errors of the run.
pub fn replay(
    setup: &ChainSetup,
    recording: Arc<Recording>,
    course: Course,
) -> anyhow::Result<ChainRun> {
    let dae = coupled(NoBody, setup, Source::Recorded(recording))?;
    finish(dae, "chain", &["chain"], course)
}

fn coupled<B: Problem>(
    body: B,
    setup: &ChainSetup,
    source: Source,
) -> anyhow::Result<CoupledDae<B>> {
    let oscillators = Oscillators::new(setup.network()?, setup.drive(), vec![source])?;
    Ok(CoupledDae::new(body, vec![oscillators]))
}

/// Runs a system all of whose states have the default tolerances.
fn finish<B: Body + 'static>(
    dae: CoupledDae<B>,
    name: &str,
    blocks: &[&'static str],
    course: Course,
) -> anyhow::Result<ChainRun> {
    let tolerances = StateTolerances::default();
    let unknowns = dae.n_unknowns();
    let test =
        ErrorTest::of_states(dae.body_range().len(), tolerances).with_oscillators(&dae, tolerances);
    let options = CoupledOptions::of_states(course.integrator);
    let (max_order, linear_solver) = (max_order(&options), options.linear_solver);
    let mut integrator = start_coupled(dae, test, options, course.t_end, &vec![0.0; unknowns])?;
    let (history, statistics) = ChainRun::observe(&mut *integrator, name, course)?;
    Ok(ChainRun {
        history,
        statistics,
        unknowns,
        integrator: course.integrator,
        tolerances: blocks
            .iter()
            .map(|block| (*block, pair(tolerances)))
            .collect::<BTreeMap<_, _>>(),
        suppressed: Vec::new(),
        max_order,
        t_end: course.t_end,
        linear_solver: linear_solver.name(),
        body: Map::new(),
    })
}
