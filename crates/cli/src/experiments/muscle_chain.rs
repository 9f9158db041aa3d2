//! The muscle of section 3.2 and its chain as one system.

use std::sync::Mutex;

use myovib_fem::Mesh;
use myovib_model::coupling::{CoupledDae, ErrorTest, Oscillators, Source, StateTolerances};
use myovib_model::{Formulation, IdaIntegrator, MuscleDae, Probe, Settings, ida, paper};
use serde_json::{Map, json};
use sundials_wrap::DaeProblem;

use super::chain_run::pair;
use super::{ChainRun, ChainSetup};
use crate::progress::Progress;
use crate::statistics::ordering_name;

/// The formulation of Figure 7.
const FORMULATION: Formulation = Formulation::Rate;

/// Highest order, one for the whole system; the chain's tolerances ask for it (note 0003 of the
/// model).
const MAX_ORDER: u8 = 5;

/// The settings of the muscle with its chain.
pub fn muscle_chain_settings() -> Settings {
    Settings {
        max_order: MAX_ORDER,
        ..Settings::paper(FORMULATION)
    }
}

/// Muscle and chain as one system, coupled at `point` by u_y, from rest to `t_end`.
///
/// # Errors
/// A point outside the mesh, a mesh without the groups needed; fatal errors of the run.
pub fn muscle_chain(
    mesh: &Mesh,
    setup: &ChainSetup,
    point: [f64; 2],
    t_end: f64,
    progress: &Mutex<Progress>,
) -> anyhow::Result<ChainRun> {
    let settings = muscle_chain_settings();
    let muscle = paper::muscle(mesh, paper::KAPPA, paper::BETA)?;
    let probe = Probe::at(muscle.solid.space(), point)?;
    let muscle = MuscleDae::new(muscle, FORMULATION)?;
    let options = ida::options(&muscle, &settings);
    let test = ErrorTest::of_muscle(&muscle, &settings);
    let source = Source::Body(muscle.displacement_at(&probe, 1));
    let oscillators = Oscillators::new(setup.network()?, setup.drive(), vec![source])?;
    let dae = CoupledDae::new(muscle, vec![oscillators]);
    let tolerances = StateTolerances::default();
    let test = test.with_oscillators(&dae, tolerances);
    let unknowns = dae.n_unknowns();
    let rest = vec![0.0; unknowns];
    let linear_solver = settings.linear_solver;
    let mut integrator = IdaIntegrator::coupled(dae, test, options, linear_solver, t_end, &rest)?;
    let (history, statistics) =
        ChainRun::observe(&mut integrator, "muscle and chain", t_end, progress)?;
    let blocks = FORMULATION.rows().iter().map(|(field, _)| {
        let absolute = settings.absolute_tolerances.of(*field);
        (field.symbol(), [settings.relative_tolerance, absolute])
    });
    Ok(ChainRun {
        history,
        statistics,
        unknowns,
        tolerances: blocks.chain([("chain", pair(tolerances))]).collect(),
        suppressed: settings.suppressed.iter().map(|f| f.symbol()).collect(),
        max_order: MAX_ORDER.into(),
        t_end,
        linear_solver: linear_solver.name(),
        body: Map::from_iter([
            ("body".to_owned(), json!("muscle")),
            ("formulation".to_owned(), json!(FORMULATION.name())),
            ("kappa".to_owned(), json!(paper::KAPPA)),
            ("beta".to_owned(), json!(paper::BETA)),
            ("point".to_owned(), json!(point)),
            ("component".to_owned(), json!("y")),
            ("load".to_owned(), json!("traction")),
            ("load_amplitude".to_owned(), json!(paper::LOAD_AMPLITUDE)),
            ("load_frequency".to_owned(), json!(paper::LOAD_FREQUENCY)),
            (
                "ordering".to_owned(),
                json!(ordering_name(settings.ordering)),
            ),
            ("btf".to_owned(), json!(settings.btf)),
            ("delta_cj".to_owned(), json!(settings.delta_cj)),
        ]),
    })
}
