//! Orders of Radau IIA on a body, in fixed steps, in the plane and in space.

use std::sync::Arc;

use myovib_dae::{Outcome, Problem, Tolerances};
use myovib_fem::{DofMap, Law, Solid, Space, generate};
use myovib_model::linear::CondensedSolver;
use myovib_model::{
    Field, Formulation, Muscle, MuscleDae, Parameters, PressureLoad, Signal, formula,
};
use myovib_radau::{IndexScaling, RadauOptions, RadauSolver, StepSize};

const T_END: f64 = 2.0;

/// A compressible block of few elements, whose highest frequency a step of 1/16 s resolves: no order is
/// lost to stiffness. It is pressed by an amount that is smooth in time.
fn block(dimension: usize) -> MuscleDae {
    let mesh = match dimension {
        2 => generate::rectangle([0.0; 2], [1.0; 2], [1, 1]),
        _ => generate::block([0.0; 3], [1.0; 3], [1, 1, 1]),
    };
    let mesh = mesh.unwrap();
    let space = Arc::new(Space::taylor_hood(&mesh));
    let dofs = DofMap::clamped(&space, &space.nodes_of("left").unwrap()).unwrap();
    let law = Law::MooneyRivlin {
        c10: 100.0,
        c01: 10.0,
    };
    let solid = Solid::uniform(space, dofs, law, 1e3).unwrap();
    let signal = Signal::from(formula::Sine {
        amplitude: 20.0,
        frequency: 0.1,
        phase: 0.0,
    });
    let pressure = PressureLoad::new(&solid, "right", signal).unwrap();
    let parameters = Parameters::new(0.1, 0.0, 300.0).unwrap();
    let muscle = Muscle {
        pressures: vec![pressure],
        ..Muscle::unloaded(solid, parameters)
    };
    MuscleDae::new(muscle, Formulation::Position).unwrap()
}

/// The solution at the end after steps of size `h`.
fn solution(dimension: usize, stages: usize, h: f64) -> (MuscleDae, Vec<f64>) {
    let dae = block(dimension);
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
    let matrices = CondensedSolver::new(&dae, options.klu).unwrap();
    let builder = RadauSolver::builder(dae).options(options);
    let mut solver = builder.build_with(matrices, 0.0, &rest, &rest).unwrap();
    let outcome = solver.integrate_to(T_END).unwrap();
    assert_eq!(outcome, Outcome::Reached { t: T_END });
    (solver.problem().clone(), solver.y().to_vec())
}

/// The largest errors of u, v and p.
fn errors(dimension: usize, stages: usize, h: f64, exact: &[f64]) -> [f64; 3] {
    let (dae, y) = solution(dimension, stages, h);
    [Field::Displacement, Field::Velocity, Field::Pressure].map(|field| {
        let own = dae.layout().range(field).unwrap();
        let pairs = y[own.clone()].iter().zip(&exact[own]);
        pairs.fold(0.0, |m: f64, (y, exact)| m.max((y - exact).abs()))
    })
}

#[test]
fn the_methods_have_their_orders_in_the_plane_and_in_space() {
    for dimension in [2, 3] {
        let (_, exact) = solution(dimension, 7, 1.0 / 16.0);
        // Steps for which errors are far above rounding, and resolve the highest frequency.
        for (stages, h) in [(3, 1.0 / 16.0), (5, 1.0 / 4.0), (7, 1.0 / 2.0)] {
            let [coarse, fine] = [h, 0.5 * h].map(|h| errors(dimension, stages, h, &exact));
            let orders = [0, 1, 2].map(|k| (coarse[k] / fine[k]).log2());
            let order = 2.0 * stages as f64 - 1.0;
            println!("{dimension}: {order} {orders:.2?} {coarse:?} {fine:?}");
            for observed in orders {
                // What is next in h is a tenth and more; an order lost would be seen.
                assert!(
                    (observed - order).abs() < 0.6,
                    "{dimension}, {order}: {orders:?}"
                );
            }
        }
    }
}
