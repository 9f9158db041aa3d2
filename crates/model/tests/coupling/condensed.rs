//! Comparison of the condensed solver of a body with oscillators with a solution by the full matrix.

use crate::common::{backward_error, muscle_and_chain, muscle_mesh, start_muscle};
use myovib_dae::{LinearSolver as _, Linearization, Problem};
use myovib_model::coupling::{
    Body, CoupledDae, CoupledSolver, Oscillators, Source, StateTolerances,
};
use myovib_model::{
    Field, Formulation, Integrator, LinearSolverKind, MuscleDae, Outcome, Probe, Settings, paper,
    run,
};
use myovib_oscillators::{Array, Coefficients, Drive, Ends, Reach};
use myovib_sparse::SparseOptions;
use num_complex::Complex64;
use rand::rngs::StdRng;
use rand::{Rng, SeedableRng};

/// Returns the muscle with a chain and an array, strongly driven at different points.
fn coupled_muscle(formulation: Formulation, kappa: f64, beta: f64) -> CoupledDae<MuscleDae> {
    let muscle = paper::muscle(&muscle_mesh(), kappa, beta).unwrap();
    let muscle = MuscleDae::new(muscle, formulation).unwrap();
    let at = |point, axis| {
        let probe = Probe::at(muscle.muscle().solid.space(), point).unwrap();
        Source::Body(muscle.displacement_at(&probe, axis))
    };
    let drive = Drive { gain: 4e3, reach: Reach::All };
    let chain = paper::chain(5, 0.5).unwrap();
    let array = Array {
        columns: 2,
        rows: 3,
        omega: paper::chain(6, 0.5).unwrap().omega,
        coefficients: Coefficients::default(),
        ends: Ends::Open,
        reach: Reach::Boundary,
    };
    let point = [0.031, 0.004];
    let parts = vec![
        Oscillators::new(chain.network().unwrap(), drive, vec![at([0.0, 0.0], 1)]),
        Oscillators::new(array.network().unwrap(), drive, vec![at(point, 0), at(point, 1)]),
    ];
    CoupledDae::new(muscle, parts.into_iter().map(Result::unwrap).collect())
}

/// Returns a random state with small strains in which all fields have typical magnitudes of the paper's run, and its
/// derivatives.
fn random_state(dae: &CoupledDae<MuscleDae>, rng: &mut StdRng) -> (Vec<f64>, Vec<f64>) {
    let mut size = dae.body().layout().fill(|field| match field {
        Field::Displacement => 1e-4,
        Field::Velocity => 1e-2,
        Field::Pressure => 20.0,
        Field::PressureRate => 1e3,
        Field::GglMultiplier => 1.0,
        Field::Tension | Field::InternalStress => 1e3,
    });
    size.resize(dae.n_unknowns(), 2.0);
    let mut draw = |factor: f64| -> Vec<f64> {
        size.iter().map(|s| factor * s * rng.random_range(-1.0..1.0)).collect()
    };
    (draw(1.0), draw(50.0))
}

const T_NOW: f64 = 0.9;

/// A row contains about fifty products, each rounded a few times during the elimination.
const ROUNDING: f64 = 1e3 * f64::EPSILON;

fn klu() -> SparseOptions {
    SparseOptions { btf: false, ..SparseOptions::default() }
}

#[test]
fn solutions_solve_the_full_system_to_rounding() {
    let mut rng = StdRng::seed_from_u64(24);
    for (formulation, kappa, beta) in [
        (Formulation::Position, 1e5, 0.0),
        (Formulation::Rate, 1e5, 1e-4),
        (Formulation::ImplicitRate, 1e5, 1e-4),
        (Formulation::Stabilized, f64::INFINITY, 0.0),
    ] {
        let mut dae = coupled_muscle(formulation, kappa, beta);
        let n = dae.n_unknowns();
        let state = random_state(&dae, &mut rng);
        let c = 10f64.powf(rng.random_range(1.0..5.0));
        let shift = Complex64::new(c, 0.7 * c);
        let mut draw = || -> Vec<f64> { (0..n).map(|_| rng.random_range(-1.0..1.0)).collect() };
        let b = draw();

        let body = dae.body_mut().condensed_solver(klu()).unwrap().unwrap();
        let mut solver = CoupledSolver::new(body, &dae, klu()).unwrap();
        let weights = vec![1.0; n];
        let at = Linearization {
            t: T_NOW,
            y: &state.0,
            y_dot: &state.1,
            step: 1.0 / c,
            weights: &weights,
        };
        solver.evaluate(&mut dae, &at).unwrap();
        // Right-hand sides as in BDF and in Radau IIA.
        for shifts in [&[][..], &[shift]] {
            solver.set_up(&mut dae, c, shifts).unwrap();
            let mut x = b.clone();
            solver.solve_real(&mut dae, &mut x).unwrap();
            let real = backward_error(&mut dae, T_NOW, [&state.0, &state.1], c, &b, &x);
            assert!(real < ROUNDING, "{formulation}, c = {c}: {real:e}");
        }

        let pairs = b.iter().zip(draw());
        let b: Vec<Complex64> = pairs.map(|(&re, im)| Complex64::new(re, im)).collect();
        let mut x = b.clone();
        solver.solve_complex(&mut dae, 0, &mut x).unwrap();
        let complex = backward_error(&mut dae, T_NOW, [&state.0, &state.1], shift, &b, &x);
        assert!(complex < ROUNDING, "{formulation}, c = {shift}: {complex:e}");
    }
}

#[test]
fn condensed_and_full_runs_take_the_same_steps() {
    let steps = |linear_solver| {
        let dae = muscle_and_chain(&paper::chain(5, 0.5).unwrap(), 1.0);
        let settings = Settings { t_end: 1.0, linear_solver, ..Settings::paper(Formulation::Rate) };
        let mut integrator = start_muscle(dae, &settings, StateTolerances::default());
        let statistics = run(&mut integrator, &mut []).unwrap();
        assert_eq!(statistics.outcome, Outcome::Finished);
        let work = integrator.problem().body().counters().linear;
        assert_eq!(work.solves > 0, linear_solver == LinearSolverKind::Condensed);
        // The load has started, and the number of steps is large enough for the comparison.
        assert!(statistics.counts.steps > 50);
        statistics.counts.steps as f64
    };
    let (condensed, full) = (steps(LinearSolverKind::Condensed), steps(LinearSolverKind::Full));
    // Rounding changes a few Newton iterations and rejections; 2 % of 3000 steps are about 60.
    assert!((condensed / full - 1.0).abs() <= 0.02, "{condensed} and {full}");
}
