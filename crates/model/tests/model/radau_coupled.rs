//! Radau IIA for a body with the oscillators that it drives.

use myovib_dae::Problem;
use myovib_fem::Mesh;
use myovib_model::coupling::{
    Body, CoupledDae, ErrorTest, Oscillators, Source, StateTolerances, SystemMatrices,
};
use myovib_model::start::Consistent;
use myovib_model::{
    Formulation, IdaIntegrator, Integrator, IntegratorKind, LinearSolverKind, MuscleDae, Outcome,
    Probe, RadauIntegrator, Settings, ida, paper, radau, run,
};
use myovib_oscillators::Drive;
use myovib_radau::RadauOptions;

use sundials_wrap::IdaOptions;

/// Returns `body` with the paper's chain of five oscillators, driven by `source`.
fn with_chain<B: Body>(body: B, source: Source) -> CoupledDae<B> {
    let chain = paper::chain(5, 0.5).unwrap();
    let drive = Drive { gain: 1.0, reach: chain.reach };
    let oscillators = Oscillators::new(chain.network().unwrap(), drive, vec![source]).unwrap();
    CoupledDae::new(body, vec![oscillators])
}

/// Returns the paper's muscle, with the chain at its origin.
fn muscle_and_chain() -> CoupledDae<MuscleDae> {
    let mesh = include_str!("../../../../data/meshes/muscle.msh");
    let mesh = Mesh::parse_msh(mesh, "muscle.msh").unwrap();
    let muscle = paper::muscle(&mesh, paper::KAPPA, paper::BETA).unwrap();
    let muscle = MuscleDae::new(muscle, Formulation::Rate).unwrap();
    let origin = Probe::at(muscle.muscle().solid.space(), [0.0, 0.0]).unwrap();
    let source = Source::Body(muscle.displacement_at(&origin, 1));
    with_chain(muscle, source)
}

fn settings(rtol: f64, t_end: f64, linear_solver: LinearSolverKind) -> Settings {
    Settings {
        t_end,
        integrator: IntegratorKind::Radau9,
        linear_solver,
        ..Settings::paper(Formulation::Rate).with_relative_tolerance(rtol)
    }
}

type CoupledMuscle = RadauIntegrator<CoupledDae<MuscleDae>, SystemMatrices<CoupledDae<MuscleDae>>>;

fn start_muscle(settings: &Settings) -> CoupledMuscle {
    let mut dae = muscle_and_chain();
    let test = ErrorTest::of_muscle(dae.body(), settings)
        .with_oscillators(&dae, StateTolerances::default());
    let options = radau::options(dae.body(), settings);
    let rest = vec![0.0; dae.n_unknowns()];
    let linear_solver = settings.linear_solver;
    let [y, y_dot] = dae.consistent(0.0, &rest).unwrap();
    let times = [0.0, settings.t_end];
    RadauIntegrator::coupled_at(dae, test, options, linear_solver, times, &y, &y_dot).unwrap()
}

/// Runs to the end and returns the states of the chain.
fn chain_at_end<B: Body>(integrator: &mut dyn Integrator<CoupledDae<B>>, t_end: f64) -> Vec<f64> {
    let statistics = run(integrator, &mut []).unwrap();
    assert_eq!(statistics.outcome, Outcome::Finished);
    let dae = integrator.problem();
    let (n, range) = (dae.n_unknowns(), dae.range(0));
    let mut y = vec![0.0; n];
    integrator.dense_output(t_end, 0, &mut y).unwrap();
    y[range].to_vec()
}

fn distance(a: &[f64], b: &[f64]) -> f64 {
    let apart = a.iter().zip(b).map(|(a, b)| (a - b).abs());
    let size = b.iter().fold(0.0_f64, |max, b| max.max(b.abs()));
    apart.fold(0.0, f64::max) / size
}

#[test]
fn the_rods_chain_moves_as_under_idas() {
    let t_end = 10.0;
    let tolerances = StateTolerances::default();
    let system = || {
        let rod = paper::rod().unwrap();
        let source = Source::Body(rod.displacement_at(paper::ROD_POINT).unwrap());
        let dae = with_chain(rod, source);
        let test = ErrorTest::of_states(dae.body_range().len(), tolerances)
            .with_oscillators(&dae, tolerances);
        (dae, test)
    };
    let (mut dae, test) = system();
    let times = [0.0, t_end];
    let rest = vec![0.0; dae.n_unknowns()];
    let full = LinearSolverKind::Full;
    let options = IdaOptions::default();
    let [y, y_dot] = dae.consistent(0.0, &rest).unwrap();
    let mut ida = IdaIntegrator::coupled_at(dae, test, options, full, times, &y, &y_dot).unwrap();
    let theirs = chain_at_end(&mut ida, t_end);
    for stages in [3, 5] {
        let (dae, test) = system();
        let options = RadauOptions { stages, ..RadauOptions::default() };
        let mut radau =
            RadauIntegrator::coupled_at(dae, test, options, full, times, &y, &y_dot).unwrap();
        let ours = chain_at_end(&mut radau, t_end);
        let apart = distance(&ours, &theirs);
        // The local errors of IDAS, 1e-7 per step, accumulate to 1e-5 over 13 000 steps (9.4e-6 compared with 3 and 5
        // stages).
        assert!(apart < 2e-5, "{stages} stages: {apart:e}");
    }
}

#[test]
fn idas_on_the_muscles_chain_tends_to_the_same_motion() {
    let t_end = 1.0;
    let ours = |rtol| {
        let wanted = settings(rtol, t_end, LinearSolverKind::Condensed);
        chain_at_end(&mut start_muscle(&wanted), t_end)
    };
    let theirs = |rtol| {
        let wanted = settings(rtol, t_end, LinearSolverKind::Condensed);
        let mut dae = muscle_and_chain();
        let test = ErrorTest::of_muscle(dae.body(), &wanted)
            .with_oscillators(&dae, StateTolerances::default());
        let options = ida::options(dae.body(), &wanted);
        let rest = vec![0.0; dae.n_unknowns()];
        let solver = wanted.linear_solver;
        let [y, y_dot] = dae.consistent(0.0, &rest).unwrap();
        let times = [0.0, t_end];
        let mut ida =
            IdaIntegrator::coupled_at(dae, test, options, solver, times, &y, &y_dot).unwrap();
        chain_at_end(&mut ida, t_end)
    };
    let limit = ours(1e-7);
    // The chain has only just started to move and amplifies the errors of the muscle. With Radau IIA they are small
    // compared with BDF of order 2: observed errors are 1.4e-4 for Radau IIA at 1e-5, and 1.3e-2, 7.3e-3 and 2.0e-3 for
    // IDAS at 1e-5, 1e-6 and 1e-7.
    let radau = distance(&ours(1e-5), &limit);
    let (coarse, fine) = (distance(&theirs(1e-5), &limit), distance(&theirs(1e-7), &limit));
    assert!(radau < 3e-4, "{radau:e}");
    assert!(fine < 3e-3 && coarse > 4.0 * fine, "{coarse:e} {fine:e}");
}

#[test]
fn condensed_and_full_matrices_give_the_same_run() {
    let t_end = 0.6;
    let states = [LinearSolverKind::Condensed, LinearSolverKind::Full]
        .map(|solver| chain_at_end(&mut start_muscle(&settings(1e-5, t_end, solver)), t_end));
    let apart = distance(&states[0], &states[1]);
    // Newton's method stops at the rounding that it measures, which differs between the two
    // matrices. One iteration more or less changes the run by a fraction of the tolerance, 1e-5
    // (observed: 2.7e-6).
    assert!(apart < 1e-5, "{apart:e}");
}

#[test]
fn a_run_goes_on_from_its_state() {
    let (half, t_end) = (0.5, 1.0);
    let wanted = |t_end| settings(1e-5, t_end, LinearSolverKind::Condensed);
    let whole = chain_at_end(&mut start_muscle(&wanted(t_end)), t_end);

    let mut first = start_muscle(&wanted(half));
    run(&mut first, &mut []).unwrap();
    let n = first.problem().n_unknowns();
    let mut state = [vec![0.0; n], vec![0.0; n]];
    for (derivative, values) in state.iter_mut().enumerate() {
        first.dense_output(half, derivative as u32, values).unwrap();
    }
    let settings = wanted(t_end);
    let dae = muscle_and_chain();
    let test = ErrorTest::of_muscle(dae.body(), &settings)
        .with_oscillators(&dae, StateTolerances::default());
    let options = radau::options(dae.body(), &settings);
    let (solver, times) = (settings.linear_solver, [half, t_end]);
    let mut second =
        RadauIntegrator::coupled_at(dae, test, options, solver, times, &state[0], &state[1])
            .unwrap();
    let apart = distance(&chain_at_end(&mut second, t_end), &whole);
    // With different steps, the motion of the muscle differs by the tolerance, 1e-5. The chain, which has only just
    // started to move, amplifies this difference by a factor of ten (observed: 9e-5).
    assert!(apart < 2e-4, "{apart:e}");
}
