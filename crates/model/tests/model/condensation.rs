//! The reduced Newton systems compared with the full systems, real and complex.

use std::sync::Arc;

use myovib_dae::Problem;
use myovib_fem::{DofMap, Law, Mesh, Solid, Space, generate};
use myovib_model::linear::{LinearWork, Reduction, Scalar};
use myovib_model::{
    Field, Formulation, IdaIntegrator, Integrator, LinearSolverKind, Muscle, MuscleDae, Outcome,
    Parameters, Settings, Signal, SurfaceLoad, default_ordering, paper, run,
};
use myovib_sparse::SparseOptions;
use num_complex::Complex64;
use rand::rngs::StdRng;
use rand::{Rng, SeedableRng};

const LAWS: [Law; 2] = [paper::LAW, Law::SmallStrain { shear_modulus: 2.04e4 }];

fn muscle_mesh() -> Mesh {
    Mesh::parse_msh(include_str!("../../../../data/meshes/muscle.msh"), "muscle.msh").unwrap()
}

/// Returns all combinations that can be run, on the paper's mesh.
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

/// Returns a random state with small strains in which all fields have typical magnitudes of the paper's run, and its
/// derivatives.
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
        size.iter().map(|s| factor * s * rng.random_range(-1.0..1.0)).collect()
    };
    (draw(1.0), draw(50.0))
}

/// Returns max_i |b - A x|_i / (|A||x| + |b|)_i in the full system, with the (column, row) of each entry.
fn backward_error<T: Scalar>(
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

/// Solves with the reduced matrix for `c` at a state, and with its transpose, and measures the
/// errors of the solutions in the full system. Also returns the entries of the factors.
fn solve_and_measure<T: Scalar>(
    dae: &mut MuscleDae,
    (y, y_dot): (Vec<f64>, Vec<f64>),
    c: T,
    right_hand_side: impl Fn(&mut StdRng) -> T,
    rng: &mut StdRng,
) -> ([f64; 2], u64) {
    let pattern = dae.jacobian_pattern();
    let mut at = |a, b| {
        let mut values = vec![0.0; pattern.nnz()];
        dae.jacobian(0.9, &y, &y_dot, a, b, &mut values).unwrap();
        values
    };
    let (df_dy, df_dyp) = (at(1.0, 0.0), at(0.0, 1.0));
    let values: Vec<T> = df_dy.iter().zip(&df_dyp).map(|(&v, &r)| T::one() * v + c * r).collect();

    let options = SparseOptions { btf: false, ..SparseOptions::default() };
    let mut reduced = Reduction::new(dae, options).unwrap().matrix();
    let mut work = LinearWork::default();
    reduced.set_up(c, |matrix| dae.matrix_values(matrix), &mut work).unwrap();
    let b: Vec<T> = y.iter().map(|_| right_hand_side(rng)).collect();
    let mut x = b.clone();
    reduced.solve(&mut x, &mut work).unwrap();
    let error = backward_error(pattern.entries(), &values, &b, &x);
    x.copy_from_slice(&b);
    reduced.solve_transposed(&mut x, &mut work).unwrap();
    let transposed = pattern.entries().map(|(column, row)| (row, column));
    let errors = [error, backward_error(transposed, &values, &b, &x)];
    (errors, work.factor_entries)
}

/// A row contains about fifty products, each rounded a few times during the elimination.
const ROUNDING: f64 = 1e3 * f64::EPSILON;

/// Transposed solves are not refined, so they have the error of fixed pivots; other solves are refined if their error
/// exceeds 1e-12.
const UNCHECKED: f64 = 1e-12;

#[test]
fn reduced_solution_solves_the_full_system_to_rounding() {
    let mut rng = StdRng::seed_from_u64(29);
    let daes = daes();
    // For each of two laws: displacement with and without damping, position, velocity with both κ, rate and
    // implicit-rate with both κ, stabilized.
    assert_eq!(daes.len(), 2 * (2 + 2 + 2 + 2 + 2 + 1));
    // Below and above the fastest vibrations of the mesh, where stiffness or inertia dominates.
    let decades = [1.0..3.0, 3.0..5.0];
    for (mut dae, decades) in daes.iter().flat_map(|dae| decades.clone().map(|d| (dae.clone(), d)))
    {
        let c = 10f64.powf(rng.random_range(decades));
        let case = format!("{} {:?}", dae.formulation(), dae.muscle().parameters);
        let draw = |rng: &mut StdRng| rng.random_range(-1.0..1.0);
        let state = random_state(&dae, &mut rng);
        let (real, _) = solve_and_measure(&mut dae, state, c, draw, &mut rng);
        assert!(real[0] < ROUNDING, "{case}, c = {c}: {real:?}");
        assert!(real[1] < UNCHECKED, "{case}, c = {c}: {real:?}");
        let shift = Complex64::new(c, 0.7 * c);
        let draw = |rng: &mut StdRng| Complex64::new(draw(rng), draw(rng));
        let state = random_state(&dae, &mut rng);
        let (complex, _) = solve_and_measure(&mut dae, state, shift, draw, &mut rng);
        assert!(complex[0] < ROUNDING, "{case}, c = {c}(1 + 0.7i): {complex:?}");
        assert!(complex[1] < UNCHECKED, "{case}, c = {c}(1 + 0.7i): {complex:?}");
    }
}

/// Returns a block in 3D, damped by β, under a follower pressure if `pressed`.
fn block(formulation: Formulation, beta: f64, pressed: bool) -> MuscleDae {
    let mesh = generate::block([0.0; 3], [0.05, 0.04, 0.04], [2, 1, 1]).unwrap();
    let space = Arc::new(Space::taylor_hood(&mesh));
    let dofs = DofMap::clamped(&space, &space.nodes_of("left").unwrap()).unwrap();
    let solid = Solid::uniform(space, dofs, paper::LAW, paper::DENSITY).unwrap();
    let load = SurfaceLoad::pressure(&solid, "right", Signal::constant(1e3)).unwrap();
    let mut muscle = Muscle::unloaded(solid, Parameters::new(1.0, beta, 1e5).unwrap());
    muscle.surface_loads.extend(pressed.then_some(load));
    MuscleDae::new(muscle, formulation).unwrap()
}

const SHIFT: Complex64 = Complex64::new(300.0, 200.0);

fn draw_complex(rng: &mut StdRng) -> Complex64 {
    Complex64::new(rng.random_range(-1.0..1.0), rng.random_range(-1.0..1.0))
}

/// In 3D a matrix that is unsymmetric because of β is replaced by a symmetric matrix. For a body at
/// rest both are equal; for a moving body the difference is proportional to the velocity.
#[test]
fn in_space_damped_matrices_are_nearly_those_of_the_full_system() {
    for formulation in [Formulation::Rate, Formulation::ImplicitRate] {
        let mut dae = block(formulation, 1e-3, false);
        let (y, y_dot) = random_state(&dae, &mut StdRng::seed_from_u64(31));
        let mut measure = |speed: f64| {
            let slow = dae.layout().fill(|field| match field {
                Field::Displacement | Field::Pressure => 1.0,
                _ => speed,
            });
            let y: Vec<f64> = y.iter().zip(slow).map(|(y, slow)| y * slow).collect();
            let y_dot: Vec<f64> = y_dot.iter().map(|y_dot| y_dot * speed).collect();
            // The right-hand side is always the same.
            let rng = &mut StdRng::seed_from_u64(32);
            solve_and_measure(&mut dae, (y, y_dot), SHIFT, draw_complex, rng).0
        };
        let [still, transposed] = measure(0.0);
        assert!(still < ROUNDING, "{formulation}: {still:e}");
        assert!(transposed < UNCHECKED, "{formulation}: {transposed:e}");
        let [slow, fast] = [1e-2, 2e-2].map(|speed| measure(speed)[0]);
        // The difference is proportional to the velocity, up to second-order terms of a few
        // percent.
        let is_near = slow > ROUNDING && (fast / slow - 2.0).abs() < 0.1;
        assert!(is_near, "{formulation}: {slow:e} {fast:e}");
    }
}

#[test]
fn in_space_damping_and_pressures_leave_factors_of_symmetric_matrices() {
    let entries = |formulation, beta, pressed| {
        let mut dae = block(formulation, beta, pressed);
        let at_rest = vec![0.0; dae.n_unknowns()];
        let state = (at_rest.clone(), at_rest);
        let rng = &mut StdRng::seed_from_u64(33);
        solve_and_measure(&mut dae, state, SHIFT, draw_complex, rng).1
    };
    // Symmetric without help.
    let symmetric = entries(Formulation::Position, 0.0, false);
    assert_eq!(entries(Formulation::Position, 0.0, true), symmetric);
    assert_eq!(entries(Formulation::ImplicitRate, 1e-3, true), symmetric);
    // The differentiated constraint is not symmetric.
    assert!(entries(Formulation::Velocity, 0.0, false) > symmetric);
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
            assert_eq!(work.solves > 0, linear_solver == LinearSolverKind::Condensed);
            // The load has started, and the number of steps is large enough for the comparison.
            assert!(statistics.counts.steps > 50);
            statistics.counts.steps as f64
        };
        let (condensed, full) = (steps(LinearSolverKind::Condensed), steps(LinearSolverKind::Full));
        // Rounding changes a few Newton iterations and rejections; 2 % of 3000 steps are about 60.
        assert!((condensed / full - 1.0).abs() <= 0.02, "{formulation}: {condensed} and {full}");
    }
}
