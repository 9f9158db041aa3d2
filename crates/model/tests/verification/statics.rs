//! Static equilibrium: published values, and equal equilibria in all formulations.

use myovib_dae::Problem;
use myovib_fem::Mesh;
use myovib_model::statics::equilibrium;
use myovib_model::{Formulation, MuscleDae, Probe, Signal, check, paper};

use crate::common::{LAWS, blocks, loaded_block};

#[test]
fn the_muscle_under_its_constant_load() {
    let text = include_str!("../../../../data/meshes/muscle.msh");
    let mesh = Mesh::parse_msh(text, "muscle.msh").unwrap();
    // u_y and p at the origin from an independent program, with all its printed digits.
    for (kappa, u_y, p) in [(1e5, 6.5395e-4, -19.769), (f64::INFINITY, 5.7108e-4, -22.170)] {
        let load = Signal::constant(paper::LOAD_AMPLITUDE);
        let muscle = paper::muscle_with_load(&mesh, paper::LAW, kappa, 0.0, load).unwrap();
        let solution = equilibrium(&muscle, Formulation::Position, 0.0).unwrap();
        let mut full = vec![0.0; muscle.solid.space().n_components()];
        muscle.solid.dofs().expand(&solution.displacement, &mut full);
        let origin = Probe::at(muscle.solid.space(), [0.0, 0.0]).unwrap();
        let value = origin.read(&full, Some(&solution.pressure));
        assert!((value.displacement[1] - u_y).abs() < 0.5e-8, "{value:?}");
        assert!((value.pressure - p).abs() < 0.5e-3, "{value:?}");
        assert_eq!(solution.load_steps, 1);
        assert!(solution.newton_iterations <= 4, "{}", solution.newton_iterations);
    }
}

#[test]
fn an_equilibrium_is_one_in_every_formulation() {
    for law in LAWS {
        for kappa in [1e5, f64::INFINITY] {
            let muscle = loaded_block(1, law, kappa, 1e-3, Signal::constant(300.0));
            let solution = equilibrium(&muscle, Formulation::Position, 0.0).unwrap();
            for formulation in Formulation::ALL {
                if formulation == Formulation::Displacement {
                    continue; // has no pressure field: another discretization, tested below
                }
                let mut dae = MuscleDae::for_analysis(muscle.clone(), formulation);
                let y = blocks(&dae, &solution.displacement, &solution.pressure);
                let zero = vec![0.0; y.len()];
                let mut residual = zero.clone();
                dae.residual(0.0, &y, &zero, &mut residual).unwrap();
                let largest = residual.iter().fold(0.0_f64, |m, r| m.max(r.abs()));
                // Nodal forces are of order 300 N/m. Newton's method converges to the rounding of their terms, which
                // are a hundred times as large.
                assert!(largest < 1e-9, "{formulation} {law:?} kappa={kappa}: {largest:e}");
            }
        }
    }
}

/// Regression: the equilibrium for `displacement` was computed with the pressure field, which it
/// does not have.
#[test]
fn without_a_pressure_the_penalty_holds_the_load() {
    for law in LAWS {
        let muscle = loaded_block(1, law, 1e5, 1e-3, Signal::constant(300.0));
        let solution = equilibrium(&muscle, Formulation::Displacement, 0.0).unwrap();
        assert!(solution.pressure.is_empty());
        let mut dae = MuscleDae::for_analysis(muscle.clone(), Formulation::Displacement);
        let y = blocks(&dae, &solution.displacement, &[]);
        let zero = vec![0.0; y.len()];
        let mut residual = zero.clone();
        dae.residual(0.0, &y, &zero, &mut residual).unwrap();
        let largest = residual.iter().fold(0.0_f64, |m, r| m.max(r.abs()));
        // As above.
        assert!(largest < 1e-9, "{law:?}: {largest:e}");
    }
    let incompressible = loaded_block(1, paper::LAW, f64::INFINITY, 0.0, Signal::constant(1.0));
    assert!(equilibrium(&incompressible, Formulation::Displacement, 0.0).is_err());
}

#[test]
fn a_load_too_great_for_one_step_is_applied_in_steps() {
    let muscle = loaded_block(1, paper::LAW, f64::INFINITY, 0.0, Signal::constant(1.0e6));
    let solution = equilibrium(&muscle, Formulation::Position, 0.0).unwrap();
    assert!(solution.load_steps > 1, "{} load steps", solution.load_steps);
}

/// The linear response in `check` equals ten thousand times the equilibrium under 1/10000 of the load. It also detects
/// a confusion of Pa and kPa.
#[test]
fn the_linear_response_is_that_of_a_small_load() {
    let strong = 1e5;
    let report = |size: f64| {
        let muscle = loaded_block(1, paper::LAW, 1e5, 0.0, Signal::constant(size));
        check::check_static(&muscle, Formulation::Position, 0.0).unwrap()
    };
    let found = report(strong);
    let muscle = loaded_block(1, paper::LAW, 1e5, 0.0, Signal::constant(1e-4 * strong));
    let small = equilibrium(&muscle, Formulation::Position, 0.0).unwrap();
    let mut full = vec![0.0; muscle.solid.space().n_components()];
    muscle.solid.dofs().expand(&small.displacement, &mut full);
    let lengths = full.chunks(2).map(|u| u[0].hypot(u[1]));
    let expected = 1e4 * lengths.fold(0.0, f64::max);
    let linear = found.linear_displacement.unwrap();
    // Second-order effect of a load that displaces the body by a thousandth of its size.
    assert!((linear / expected - 1.0).abs() < 1e-2, "{linear} {expected}");
    assert!(found.iteration_time.unwrap() > 0.0);
    assert!(found.findings.is_empty(), "{:?}", found.findings);
    let wrong = report(1e3 * strong).findings;
    assert!(wrong.len() == 1, "{wrong:?}");
}
