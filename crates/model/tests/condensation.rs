//! The reduced Newton systems against the full ones, real and complex.
#![allow(clippy::unwrap_used)] // a test may panic

use myovib_dae::Problem;
use myovib_fem::{Law, Mesh};
use myovib_model::linear::{LinearWork, Number, Reduction};
use myovib_model::{
    Field, Formulation, IdaIntegrator, Integrator, LinearSolver, MuscleDae, Outcome, Settings,
    Signal, default_ordering, paper, run,
};
use myovib_sparse::klu::KluOptions;
use num_complex::Complex64;
use rand::rngs::StdRng;
use rand::{Rng, SeedableRng};

const LAWS: [Law; 2] = [
    paper::LAW,
    Law::SmallStrain {
        shear_modulus: 2.04e4,
    },
];

fn muscle_mesh() -> Mesh {
    Mesh::parse_msh(
        include_str!("../../../data/meshes/muscle.msh"),
        "muscle.msh",
    )
    .unwrap()
}

/// All that can be run, on the paper's mesh.
fn daes() -> Vec<MuscleDae> {
    let mut daes = Vec::new();
    for formulation in Formulation::ALL {
        for law in LAWS {
            for kappa in [1e5, f64::INFINITY] {
                for beta in [0.0, 1e-4] {
                    let muscle = paper::muscle_with_load(
                        &muscle_mesh(),
                        law,
                        kappa,
                        beta,
                        Signal::paper(100.0),
                    );
                    daes.extend(MuscleDae::new(muscle.unwrap(), formulation));
                }
            }
        }
    }
    daes
}

/// A state at small strain of all fields' natural size in a run of the paper.
fn random_state(dae: &MuscleDae, rng: &mut StdRng) -> (Vec<f64>, Vec<f64>) {
    let size = dae.layout().fill(|field| match field {
        Field::Displacement => 1e-4,
        Field::Velocity => 1e-2,
        Field::Pressure => 20.0,
        Field::PressureRate => 1e3,
        Field::GglMultiplier => 1.0,
        Field::Tension | Field::InternalStress => 1e3,
    });
    let mut draw = |factor: f64| -> Vec<f64> {
        size.iter()
            .map(|s| factor * s * rng.random_range(-1.0..1.0))
            .collect()
    };
    (draw(1.0), draw(50.0))
}

/// max_i |b - A x|_i / (|A||x| + |b|)_i in the full system,
/// with the (column, row) of each entry.
fn backward_error<T: Number>(
    entries: impl Iterator<Item = (usize, usize)>,
    values: &[T],
    b: &[T],
    x: &[T],
) -> f64 {
    let (mut residual, mut scale) = (b.to_vec(), vec![0.0; b.len()]);
    for ((column, row), &a) in entries.zip(values) {
        residual[row] -= a * x[column];
        scale[row] += a.abs() * x[column].abs();
    }
    residual
        .iter()
        .zip(b)
        .zip(&scale)
        .map(|((r, b), scale)| r.abs() / (scale + b.abs()))
        .fold(0.0, f64::max)
}

/// Solves with the reduced matrix for `c`, and with its transpose, and measures the solutions in the
/// full system.
fn solve_and_measure<T: Number>(
    dae: &mut MuscleDae,
    c: T,
    right_hand_side: impl Fn(&mut StdRng) -> T,
    rng: &mut StdRng,
) -> [f64; 2] {
    let pattern = dae.jacobian_pattern();
    let (y, y_dot) = random_state(dae, rng);
    let mut at = |a, b| {
        let mut values = vec![0.0; pattern.nnz()];
        dae.jacobian(0.9, &y, &y_dot, a, b, &mut values).unwrap();
        values
    };
    let (of_value, of_rate) = (at(1.0, 0.0), at(0.0, 1.0));
    let values: Vec<T> = of_value
        .iter()
        .zip(&of_rate)
        .map(|(&v, &r)| T::one() * v + c * r)
        .collect();

    let options = KluOptions {
        btf: false,
        ..KluOptions::default()
    };
    let mut reduced = Reduction::new(dae, options).unwrap().matrix();
    let mut work = LinearWork::default();
    reduced
        .set_up(c, |matrix| dae.matrix_values(matrix), &mut work)
        .unwrap();
    let b: Vec<T> = y.iter().map(|_| right_hand_side(rng)).collect();
    let mut x = b.clone();
    reduced.solve(&mut x, &mut work).unwrap();
    let error = backward_error(pattern.entries(), &values, &b, &x);
    x.copy_from_slice(&b);
    reduced.solve_transposed(&mut x, &mut work).unwrap();
    let transposed = pattern.entries().map(|(column, row)| (row, column));
    [error, backward_error(transposed, &values, &b, &x)]
}

/// A row holds some fifty products, each rounded a few times on its way through the elimination.
const ROUNDING: f64 = 1e3 * f64::EPSILON;

/// Transposed solves are not refined, and have what pivots that are fixed leave: the other solves are
/// refined from 1e-12 on.
const UNCHECKED: f64 = 1e-12;

#[test]
fn reduced_solution_solves_the_full_system_to_rounding() {
    let mut rng = StdRng::seed_from_u64(29);
    let daes = daes();
    // Two laws of: displacement with and without damping, position, velocity with both κ, rate and
    // implicit-rate with both κ, stabilized.
    assert_eq!(daes.len(), 2 * (2 + 2 + 2 + 2 + 2 + 1));
    // Below and above the fastest vibrations of the mesh, where stiffness or inertia prevails.
    let decades = [1.0..3.0, 3.0..5.0];
    for (mut dae, decades) in daes
        .iter()
        .flat_map(|dae| decades.clone().map(|d| (dae.clone(), d)))
    {
        let c = 10f64.powf(rng.random_range(decades));
        let case = format!("{} {:?}", dae.formulation(), dae.muscle().parameters);
        let real = solve_and_measure(&mut dae, c, |rng| rng.random_range(-1.0..1.0), &mut rng);
        assert!(real[0] < ROUNDING, "{case}, c = {c}: {real:?}");
        assert!(real[1] < UNCHECKED, "{case}, c = {c}: {real:?}");
        let complex = solve_and_measure(
            &mut dae,
            Complex64::new(c, 0.7 * c),
            |rng| Complex64::new(rng.random_range(-1.0..1.0), rng.random_range(-1.0..1.0)),
            &mut rng,
        );
        assert!(
            complex[0] < ROUNDING,
            "{case}, c = {c}(1 + 0.7i): {complex:?}"
        );
        assert!(
            complex[1] < UNCHECKED,
            "{case}, c = {c}(1 + 0.7i): {complex:?}"
        );
    }
}

#[test]
fn condensed_and_full_runs_take_the_same_steps() {
    for (formulation, kappa, beta) in [
        (Formulation::Position, 1e5, 0.0),
        (Formulation::Rate, 1e5, 1e-4),
        (Formulation::Velocity, f64::INFINITY, 0.0),
        (Formulation::Stabilized, f64::INFINITY, 0.0),
    ] {
        let steps = |linear_solver| {
            let muscle = paper::muscle(&muscle_mesh(), kappa, beta).unwrap();
            let dae = MuscleDae::new(muscle, formulation).unwrap();
            let settings = Settings {
                t_end: 1.0,
                linear_solver,
                ordering: default_ordering(formulation, linear_solver),
                ..Settings::paper(formulation)
            };
            let mut integrator = IdaIntegrator::from_rest(dae, &settings).unwrap();
            let statistics = run(&mut integrator, &mut []).unwrap();
            assert_eq!(statistics.outcome, Outcome::Finished);
            let work = integrator.problem().counters().linear;
            assert_eq!(work.solves > 0, linear_solver == LinearSolver::Condensed);
            // The load has set in: this is no handful of steps.
            assert!(statistics.counts.steps > 50);
            statistics.counts.steps as f64
        };
        let (condensed, full) = (steps(LinearSolver::Condensed), steps(LinearSolver::Full));
        // Rounding moves single Newton iterations and rejections; 2 % is some 60 of 3000 steps.
        assert!(
            (condensed / full - 1.0).abs() <= 0.02,
            "{formulation}: {condensed} and {full}"
        );
    }
}
