//! Jacobians compared with differences, and reduced Newton systems with full systems.

use myovib_conformance::jacobian_error;
use myovib_dae::Problem;
use myovib_fem::AddedStress;
use myovib_model::linear::{LinearWork, Reduction, Scalar};
use myovib_model::{Field, Formulation, MuscleDae};
use myovib_sparse::SparseOptions;
use num_complex::Complex64;
use rand::rngs::StdRng;
use rand::{Rng, SeedableRng};

use crate::common::{INF, contracting, elastic, graded, viscous};

/// Returns every formulation with all permitted κ and β: with viscous stress, without it, and with different halves.
fn daes(dimension: usize) -> Vec<MuscleDae> {
    let mut daes = Vec::new();
    for (kappa, beta) in [(1e5, 0.0), (1e5, 1e-2), (INF, 0.0), (INF, 1e-2)] {
        let muscles = [
            contracting(dimension, kappa, beta, viscous()),
            contracting(dimension, kappa, beta, elastic()),
            graded(dimension, kappa, beta),
        ];
        for muscle in muscles {
            for formulation in Formulation::ALL {
                daes.extend(MuscleDae::new(muscle.clone(), formulation));
            }
        }
    }
    daes
}

struct Drawn {
    y: Vec<f64>,
    y_dot: Vec<f64>,
    direction: Vec<f64>,
}

/// Draws a state with strains of a few percent and rates of a few 1/s, times a `speed`.
fn draw(dae: &MuscleDae, speed: f64, rng: &mut StdRng) -> Drawn {
    let size = dae.layout().fill(|field| match field {
        Field::Displacement => 0.02,
        Field::Velocity => 1.0,
        Field::Pressure => 1e3,
        Field::PressureRate => 1e4,
        Field::GglMultiplier => 1.0,
        Field::Tension | Field::InternalStress => 1e4,
    });
    let mut draw = |factor: f64| -> Vec<f64> {
        let one = |size: &f64| factor * size * rng.random_range(-1.0..1.0);
        size.iter().map(one).collect()
    };
    let mut drawn = Drawn { y: draw(1.0), y_dot: draw(10.0), direction: draw(1.0) };
    let velocities = dae.layout().range(Field::Velocity).unwrap_or_default();
    let rates = drawn.y[velocities].iter_mut().chain(&mut drawn.y_dot);
    rates.for_each(|rate| *rate *= speed);
    drawn
}

/// Returns max_i |J δ − dF/dε|_i relative to the sum of the row's terms, along a random direction.
fn discrepancy(dae: &mut MuscleDae, rng: &mut StdRng) -> f64 {
    let Drawn { y, y_dot, direction } = draw(dae, 1.0, rng);
    jacobian_error(dae, 0.1, [&y, &y_dot, &direction], [1.3, 70.0])
}

#[test]
fn jacobian_of_every_formulation_agrees_with_differences() {
    let mut rng = StdRng::seed_from_u64(17);
    for dimension in [2, 3] {
        for mut dae in daes(dimension) {
            let error = discrepancy(&mut dae, &mut rng);
            let parameters = dae.muscle().parameters;
            let case = format!("{dimension} {} {parameters:?}", dae.formulation());
            // Truncation and rounding errors of the differences, as without these stresses.
            assert!(error < 1e-7, "{case}: {error:e}");
        }
    }
}

/// Returns max_i |b - A x|_i / (|A||x| + |b|)_i in the full system, where x is the solution of the reduced system.
fn backward_error<T: Scalar>(dae: &mut MuscleDae, speed: f64, c: T, rng: &mut StdRng) -> f64 {
    let pattern = dae.jacobian_pattern();
    let Drawn { y, y_dot, direction } = draw(dae, speed, rng);
    let mut at = |a, b| {
        let mut values = vec![0.0; pattern.nnz()];
        dae.jacobian(0.1, &y, &y_dot, a, b, &mut values).unwrap();
        values
    };
    let (df_dy, df_dyp) = (at(1.0, 0.0), at(0.0, 1.0));
    let mut reduced = Reduction::new(dae, SparseOptions::default()).unwrap().matrix();
    let mut work = LinearWork::default();
    reduced.set_up(c, |matrix| dae.matrix_values(matrix), &mut work).unwrap();
    let b: Vec<T> = direction.iter().map(|x| T::one() * *x).collect();
    let mut x = b.clone();
    reduced.solve(&mut x, &mut work).unwrap();
    let (mut residual, mut scale) = (b.clone(), vec![0.0; b.len()]);
    for (k, (column, row)) in pattern.entries().enumerate() {
        let a = T::one() * df_dy[k] + c * df_dyp[k];
        residual[row] -= a * x[column];
        scale[row] += a.abs() * x[column].abs();
    }
    let rows = residual.iter().zip(&b).zip(&scale);
    rows.map(|((r, b), scale)| r.abs() / (scale + b.abs())).fold(0.0, f64::max)
}

/// A row contains about fifty products, each rounded a few times during the elimination, and each
/// entry is a sum of up to ten matrices. A missing term gives an error of 1e-3 or more.
const ROUNDING: f64 = 1e4 * f64::EPSILON;

/// In 3D a matrix with β is symmetrized: for a moving body, half of β ∂(B v)/∂q is omitted,
/// compared with (1 + βc) B. Velocities differ by up to 2 m/s over the 0.25 m between nodes, in
/// three components: β |∇v| is 0.24 at most for β = 0.01, and |1 + βc| more than 5. Observed: 4e-3,
/// with Prony terms 6e-3.
pub(crate) const NEAR: f64 = 0.24 / 2.0 / 5.0;

#[test]
fn reduced_systems_solve_the_full_ones() {
    let mut rng = StdRng::seed_from_u64(18);
    for mut dae in daes(2).into_iter().chain(daes(3)) {
        let name = dae.formulation();
        let of_viscous = |stress: &AddedStress| stress.viscosity > 0.0;
        let viscous = dae.muscle().solid.added_stresses().iter().any(of_viscous);
        let undamped = dae.muscle().parameters.beta == 0.0;
        let is_symmetric = matches!(name, Formulation::Displacement | Formulation::Position);
        let in_space = dae.muscle().solid.space().dimension() == 3;
        let moving = match in_space && !undamped {
            true => NEAR,
            false => ROUNDING,
        };
        for (speed, bound) in [(0.0, ROUNDING), (1.0, moving)] {
            if viscous && undamped && is_symmetric && speed > 0.0 {
                // Here Newton's method uses the symmetric part of the viscous stiffness.
                continue;
            }
            let real = backward_error(&mut dae, speed, 500.0, &mut rng);
            let c = Complex64::new(400.0, 300.0);
            let complex = backward_error(&mut dae, speed, c, &mut rng);
            assert!(real < bound && complex < bound, "{name} {speed}: {real:e} {complex:e}");
        }
    }
}
