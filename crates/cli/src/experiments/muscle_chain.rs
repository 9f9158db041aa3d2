//! The muscle of section 3.2 and its chain as one system.

use std::sync::Mutex;

use myovib_fem::Mesh;
use myovib_model::coupling::{CoupledDae, ErrorTest, Oscillators, Source, StateTolerances};
use myovib_model::{Formulation, IdaIntegrator, MuscleDae, Probe, Settings, ida, paper};
use sundials_wrap::{DaeProblem, IdaOptions};

use super::chain_run::pair;
use super::{ChainRun, ChainSetup};
use crate::progress::Progress;

/// The formulation of Figure 7.
const FORMULATION: Formulation = Formulation::Rate;

/// Highest order, one for the whole system. The muscle's modes are damped so little that orders
/// 4 and 5, unstable near the imaginary axis, take twice the steps of order 3; order 2 needs three
/// times as many for the chain's tolerance.
const MAX_ORDER: usize = 3;

/// The chain's tolerances beside a muscle integrated to 1e-3: its forcing has no more digits.
const TOLERANCES: StateTolerances = StateTolerances {
    relative: 1e-5,
    absolute: 1e-8,
    tested: true,
};

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
    let settings = Settings::paper(FORMULATION);
    let muscle = paper::muscle(mesh, paper::KAPPA, paper::BETA)?;
    let probe = Probe::at(muscle.solid.space(), point)?;
    let muscle = MuscleDae::new(muscle, FORMULATION)?;
    let options = IdaOptions {
        max_order: MAX_ORDER,
        ..ida::options(&muscle, &settings)
    };
    let test = ErrorTest::of_muscle(&muscle, &settings);
    let source = Source::Body(muscle.displacement_at(&probe, 1));
    let oscillators = Oscillators::new(setup.network()?, setup.drive(), vec![source])?;
    let dae = CoupledDae::new(muscle, vec![oscillators]);
    let test = test.with_oscillators(&dae, TOLERANCES);
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
        tolerances: blocks.chain([("chain", pair(TOLERANCES))]).collect(),
        suppressed: settings.suppressed.iter().map(|f| f.symbol()).collect(),
        max_order: MAX_ORDER,
        t_end,
    })
}
