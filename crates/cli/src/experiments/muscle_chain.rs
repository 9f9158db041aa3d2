//! The muscle of section 3.2 and its chain as one system.

use std::sync::Arc;

use myovib_dae::Problem;
use myovib_fem::Mesh;
use myovib_model::coupling::{
    CoupledDae, CoupledOptions, ErrorTest, Oscillators, Recording, Source, StateTolerances,
    start_coupled,
};
use myovib_model::{
    Formulation, IntegratorKind, MuscleDae, Probe, Settings, Signal, paper, start_at_rest,
};
use serde_json::{Map, Value, json};

use super::chain_run::{max_order, pair};
use super::recording::record;
use super::{ChainRun, ChainSetup, Course};
use myovib_scene::statistics::ordering_name;

/// The formulation of Figure 7.
const FORMULATION: Formulation = Formulation::Rate;

/// Highest order, one for the whole system; the chain's tolerances ask for it (note 0003 of the
/// model).
const MAX_ORDER: u8 = 5;

/// The settings of the muscle with its chain.
pub fn muscle_chain_settings(integrator: IntegratorKind) -> Settings {
    Settings {
        max_order: MAX_ORDER,
        ..Settings::paper(FORMULATION).with_integrator(integrator)
    }
}

/// Muscle and chain as one system, coupled at `point` by u_y, from rest.
///
/// # Errors
/// A point outside the mesh, a mesh without the groups needed; fatal errors of the run.
pub fn muscle_chain(
    mesh: &Mesh,
    setup: &ChainSetup,
    point: [f64; 2],
    course: Course,
) -> anyhow::Result<ChainRun> {
    let settings = muscle_chain_settings(course.integrator);
    let muscle = paper::muscle(mesh, paper::KAPPA, paper::BETA)?;
    let probe = Probe::at(muscle.solid.space(), point)?;
    let muscle = MuscleDae::new(muscle, FORMULATION)?;
    let options = CoupledOptions::of_muscle(&muscle, &settings);
    let max_order = max_order(&options);
    let test = ErrorTest::of_muscle(&muscle, &settings);
    let source = Source::Body(muscle.displacement_at(&probe, 1));
    let oscillators = Oscillators::new(setup.network()?, setup.drive(), vec![source])?;
    let dae = CoupledDae::new(muscle, vec![oscillators]);
    let tolerances = StateTolerances::default();
    let test = test.with_oscillators(&dae, tolerances);
    let unknowns = dae.n_unknowns();
    let rest = vec![0.0; unknowns];
    let mut integrator = start_coupled(dae, test, options, course.t_end, &rest)?;
    let (history, statistics) = ChainRun::observe(&mut *integrator, "muscle and chain", course)?;
    let blocks = FORMULATION.rows().iter().map(|(field, _)| {
        let absolute = settings.absolute_tolerances.of(*field);
        (field.symbol(), [settings.relative_tolerance, absolute])
    });
    Ok(ChainRun {
        history,
        statistics,
        unknowns,
        integrator: course.integrator,
        tolerances: blocks.chain([("chain", pair(tolerances))]).collect(),
        suppressed: settings.suppressed.iter().map(|f| f.symbol()).collect(),
        max_order,
        t_end: course.t_end,
        linear_solver: settings.linear_solver.name(),
        body: muscle_json(point, paper::LOAD_FREQUENCY, course.integrator),
    })
}

/// The u_y of the muscle's `point` under its load with another `frequency` (Hz), from rest.
///
/// # Errors
/// As [`muscle_chain`]; a run that does not reach its end.
pub fn record_muscle(
    mesh: &Mesh,
    frequency: f64,
    point: [f64; 2],
    course: Course,
) -> anyhow::Result<Arc<Recording>> {
    let signal = Signal::paper_at(paper::LOAD_AMPLITUDE, frequency);
    let muscle = paper::muscle_with_load(mesh, paper::LAW, paper::KAPPA, paper::BETA, signal)?;
    let probe = Probe::at(muscle.solid.space(), point)?;
    let muscle = MuscleDae::new(muscle, FORMULATION)?;
    let point = muscle.displacement_at(&probe, 1);
    let settings = Settings {
        t_end: course.t_end,
        ..muscle_chain_settings(course.integrator)
    };
    let mut integrator = start_at_rest(muscle, &settings)?;
    record(
        &mut *integrator,
        &format!("muscle at {frequency} Hz"),
        point,
        course,
    )
}

/// Point, load and settings of the muscle under a load of `frequency` Hz, for JSON.
pub fn muscle_json(
    point: [f64; 2],
    frequency: f64,
    integrator: IntegratorKind,
) -> Map<String, Value> {
    let settings = muscle_chain_settings(integrator);
    let mut json = Map::from_iter([
        ("body".to_owned(), json!("muscle")),
        ("formulation".to_owned(), json!(FORMULATION.name())),
        ("kappa".to_owned(), json!(paper::KAPPA)),
        ("beta".to_owned(), json!(paper::BETA)),
        ("point".to_owned(), json!(point)),
        ("component".to_owned(), json!("y")),
        ("load".to_owned(), json!("traction")),
        ("load_amplitude".to_owned(), json!(paper::LOAD_AMPLITUDE)),
        ("load_frequency".to_owned(), json!(frequency)),
        (
            "ordering".to_owned(),
            json!(ordering_name(settings.ordering)),
        ),
        ("btf".to_owned(), json!(settings.btf)),
    ]);
    if integrator == IntegratorKind::Ida {
        json.insert("delta_cj".to_owned(), json!(settings.delta_cj));
    }
    json
}
