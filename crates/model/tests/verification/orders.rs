//! Orders of convergence of Radau IIA for a body, with fixed steps, in 2D and in 3D.

use std::f64::consts::TAU;
use std::sync::Arc;

use myovib_dae::{Outcome, Problem, Tolerances};
use myovib_fem::{DofMap, Law, Solid, Space, generate};
use myovib_model::linear::CondensedSolver;
use myovib_model::{
    Field, Formulation, Muscle, MuscleDae, Parameters, Signal, SurfaceLoad, formula,
};
use myovib_radau::{IndexScaling, RadauOptions, RadauSolver, StepSize};

const T_END: f64 = 2.0;

/// Formulation, κ in Pa, β in s.
type Case = (Formulation, f64, f64);

/// Returns a block of few elements whose highest frequency is resolved by a step of 1/16 s, so that stiffness does not
/// reduce the order. A smooth displacement in time compresses it from rest.
fn block(dimension: usize, (formulation, kappa, beta): Case) -> MuscleDae {
    let mesh = match dimension {
        2 => generate::rectangle([0.0; 2], [1.0; 2], [1, 1]),
        _ => generate::block([0.0; 3], [1.0; 3], [1, 1, 1]),
    };
    let mesh = mesh.unwrap();
    let space = Arc::new(Space::taylor_hood(&mesh));
    let dofs = DofMap::clamped(&space, &space.nodes_of("left").unwrap()).unwrap();
    let law = Law::MooneyRivlin { c10: 100.0, c01: 10.0 };
    let solid = Solid::uniform(space, dofs, law, 1e3).unwrap();
    // 20 Pa (1 − cos ωt)
    let falling =
        Signal::from(formula::Sine { amplitude: 20.0, frequency: 0.1, phase: -0.25 * TAU });
    let pressures = [Signal::constant(20.0), falling];
    let pressures = pressures.map(|signal| SurfaceLoad::pressure(&solid, "right", signal).unwrap());
    let parameters = Parameters::new(0.1, beta, kappa).unwrap();
    let muscle = Muscle { surface_loads: pressures.into(), ..Muscle::unloaded(solid, parameters) };
    MuscleDae::new(muscle, formulation).unwrap()
}

/// Returns the solution at the end of a run with steps of size `h`.
fn solution(dimension: usize, case: Case, stages: usize, h: f64) -> (MuscleDae, Vec<f64>) {
    let dae = block(dimension, case);
    let options = RadauOptions {
        stages,
        tolerances: Tolerances::scalar(1e-13, 1e-13),
        tolerances_for_solution: false,
        newton_tolerance: Some(0.01),
        max_newton_iterations: Some(40),
        index_scaling: IndexScaling::All,
        step_size: StepSize::Fixed(h),
        ..RadauOptions::default()
    };
    let rest = vec![0.0; dae.n_unknowns()];
    let matrices = CondensedSolver::new(&dae, options.sparse).unwrap();
    let builder = RadauSolver::builder(dae).options(options);
    let mut solver = builder.build_with(matrices, 0.0, &rest, &rest).unwrap();
    let outcome = solver.integrate_to(T_END).unwrap();
    assert_eq!(outcome, Outcome::Reached { t: T_END });
    (solver.problem().clone(), solver.y().to_vec())
}

/// Returns the largest errors of u, v and p.
fn errors(dimension: usize, case: Case, stages: usize, h: f64, exact: &[f64]) -> [f64; 3] {
    let (dae, y) = solution(dimension, case, stages, h);
    [Field::Displacement, Field::Velocity, Field::Pressure].map(|field| {
        let Some(own) = dae.layout().range(field) else {
            return 0.0;
        };
        let pairs = y[own.clone()].iter().zip(&exact[own]);
        pairs.fold(0.0, |m: f64, (y, exact)| m.max((y - exact).abs()))
    })
}

/// Returns the orders of u, v and p with s stages: 2 s − 1 for finite κ, because the index is at most 1. For infinite
/// κ, velocities of index 2 have order s and multipliers of index 2 and 3 orders s and s − 1, and one more if their
/// leading error is removed (Hairer, Lubich, Roche 1989).
fn orders((formulation, kappa, _): Case, s: f64) -> [Order; 3] {
    use Order::{AtLeast, Exactly};
    let full = Exactly(2.0 * s - 1.0);
    match formulation {
        _ if kappa.is_finite() => [full; 3],
        Formulation::Velocity | Formulation::Stabilized => [full, full, AtLeast(s + 1.0)],
        _ => [full, AtLeast(s), AtLeast(s)],
    }
}

#[derive(Clone, Copy)]
enum Order {
    Exactly(f64),
    /// Errors of a higher order may dominate the lowest order for a while. At the transition they
    /// may cancel: the observed order is first above, then below (velocities of index 3 with seven
    /// stages: 9.2, 5.5, 6.7 in steps from 1 to 1/8 s). Seven tenths of the order are required.
    AtLeast(f64),
}

/// Allowed deviation of an order: the next term in h may be a tenth of an error or more; the loss of one order is
/// detected.
const TOLERANCE: f64 = 0.6;

/// Rounding of u, v and p, which are about 0.05 m, 0.05 m/s and 20 Pa: 2e-14 of these values, a hundred units in the
/// last place, from about thirty Newton iterations in sixteen steps.
const ROUNDING: [f64; 3] = [1e-15, 1e-15, 4e-13];

#[test]
fn the_methods_have_their_orders_in_all_formulations_in_the_plane_and_in_space() {
    use Formulation::{Displacement, ImplicitRate, Position, Rate, Stabilized, Velocity};
    const INFINITE: f64 = f64::INFINITY;
    let cases = [
        (Displacement, 300.0, 0.0),
        (Position, 300.0, 0.0),
        (Velocity, 300.0, 0.0),
        (Rate, 300.0, 0.02),
        (ImplicitRate, 300.0, 0.02),
        (Position, INFINITE, 0.0),
        (Velocity, INFINITE, 0.0),
        (Stabilized, INFINITE, 0.0),
        (Rate, INFINITE, 0.02),
        (ImplicitRate, INFINITE, 0.02),
    ];
    for (dimension, case) in [2, 3].iter().flat_map(|d| cases.map(|case| (*d, case))) {
        // In shorter steps, rounding of multipliers of index 4 exceeds the tolerance of Newton's method.
        let h = match case {
            (Rate | ImplicitRate, INFINITE, _) => 1.0 / 8.0,
            _ => 1.0 / 16.0,
        };
        let (_, exact) = solution(dimension, case, 7, h);
        // Steps for which errors are far above rounding, and resolve the highest frequency.
        for (stages, h) in [(3, 1.0 / 16.0), (5, 1.0 / 4.0), (7, 1.0 / 2.0)] {
            let [coarse, fine] = [h, 0.5 * h].map(|h| errors(dimension, case, stages, h, &exact));
            let reported = format!("{dimension}, {case:?}, {stages}: {coarse:?} {fine:?}");
            for (k, order) in orders(case, stages as f64).into_iter().enumerate() {
                let observed = (coarse[k] / fine[k]).log2();
                let holds = match order {
                    _ if fine[k] < ROUNDING[k] => true,
                    Order::Exactly(order) => (observed - order).abs() < TOLERANCE,
                    Order::AtLeast(order) => observed > 0.7 * order,
                };
                assert!(holds, "{reported}: {k} {observed}");
            }
        }
    }
}
