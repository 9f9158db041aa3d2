//! Radau IIA for all formulations: they have the same motion, including index 3.

use myovib_dae::Problem;
use myovib_fem::Mesh;
use myovib_model::{
    AbsoluteTolerances, Field, Formulation, IntegratorKind, LinearSolverKind, MuscleDae, Outcome,
    Settings, Signal, StepOptions, paper, run, start_at_rest,
};

const RTOL: f64 = 1e-6;

/// Returns the displacement at t = 1 of an incompressible block under the paper's load.
fn displacement(formulation: Formulation) -> Vec<f64> {
    let mesh =
        Mesh::parse_msh(include_str!("../../../../data/meshes/block.msh"), "small.msh").unwrap();
    let signal = Signal::paper(1e3);
    let muscle = paper::muscle_with_load(&mesh, paper::LAW, f64::INFINITY, 0.0, signal).unwrap();
    let dae = MuscleDae::new(muscle, formulation).unwrap();
    let range = dae.layout().range(Field::Displacement).unwrap();
    let settings = Settings {
        integrator: IntegratorKind::Radau5,
        t_end: 1.0,
        relative_tolerance: RTOL,
        // Tolerances relative to the magnitudes of the fields: 1e-2 m, 1 m/s, 1e3 Pa.
        absolute_tolerances: AbsoluteTolerances {
            displacement: 1e-2 * RTOL,
            velocity: RTOL,
            pressure: 1e3 * RTOL,
            multiplier: RTOL,
        },
        suppressed: Vec::new(),
        // Below the steps required by the tolerance, so that the first step adds no significant
        // error.
        steps: StepOptions { initial_step: Some(1e-3), ..StepOptions::default() },
        ..Settings::paper(formulation)
    };
    let mut out = vec![0.0; dae.n_unknowns()];
    let mut integrator = start_at_rest(dae, &settings).unwrap();
    let statistics = run(integrator.as_mut(), &mut []).unwrap();
    assert_eq!(statistics.outcome, Outcome::Finished, "{formulation:?}");
    integrator.dense_output(1.0, 0, &mut out).unwrap();
    out[range].to_vec()
}

#[test]
fn index_3_moves_as_the_reduced_formulations_do() {
    let pure = displacement(Formulation::Position);
    let size = pure.iter().fold(0.0_f64, |max, u| max.max(u.abs()));
    for formulation in [Formulation::Velocity, Formulation::Stabilized] {
        let reduced = displacement(formulation);
        let difference = pure.iter().zip(&reduced).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        // Local errors of the order of the tolerance (see above for displacements) add up over a
        // few hundred steps, but most are far smaller.
        let tolerance = RTOL * (1e-2 + size);
        assert!(difference < 10.0 * tolerance, "{formulation:?}: {difference:e} of {size:e}");
    }
}

/// ∂F/∂y and ∂F/∂ẏ are computed in one element pass, with and without condensation.
#[test]
fn a_jacobian_takes_one_pass_over_the_elements() {
    let mesh =
        Mesh::parse_msh(include_str!("../../../../data/meshes/block.msh"), "small.msh").unwrap();
    for linear_solver in [LinearSolverKind::Condensed, LinearSolverKind::Full] {
        let muscle = paper::muscle(&mesh, f64::INFINITY, 0.0).unwrap();
        let dae = MuscleDae::new(muscle, Formulation::Position).unwrap();
        let settings = Settings {
            t_end: 1.0,
            linear_solver,
            ..Settings::paper(Formulation::Position).with_integrator(IntegratorKind::Radau5)
        };
        let mut integrator = start_at_rest(dae, &settings).unwrap();
        let statistics = run(integrator.as_mut(), &mut []).unwrap();
        let passes = integrator.problem().counters().tangent_passes;
        assert_eq!(passes, statistics.counts.jacobian_evaluations);
        let work = statistics.counts.radau_work.unwrap();
        assert_eq!(work.real_factorizations, statistics.counts.linear_setups);
    }
}
