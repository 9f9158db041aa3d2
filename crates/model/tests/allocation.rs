//! Checks that steps after the first few do not allocate memory, with IDAS and with Radau IIA, in 2D and in 3D.
#![allow(clippy::unwrap_used)] // a test may panic

use std::sync::Arc;

use myovib_dae::Problem;
use myovib_fem::{DofMap, Mesh, Solid, Space, generate};
use myovib_model::coupling::ErrorTest;
use myovib_model::{
    Advance, Formulation, IdaIntegrator, Integrator, IntegratorKind, Load, Muscle, MuscleDae,
    Parameters, RadauIntegrator, Settings, Signal, paper, radau,
};
use myovib_radau::RadauOptions;

/// Returns a block in 3D, fixed on its left, with the paper's load along z as a body force.
fn block(kappa: f64, beta: f64) -> Muscle {
    let mesh = generate::block([0.0; 3], [0.2, 0.04, 0.04], [4, 1, 1]).unwrap();
    let space = Arc::new(Space::taylor_hood(&mesh));
    let dofs = DofMap::clamped(&space, &space.nodes_of("left").unwrap()).unwrap();
    let down: Vec<f64> =
        (0..space.n_components()).map(|i| if i % 3 == 2 { 1e-4 } else { 0.0 }).collect();
    let solid = Solid::uniform(space, dofs, paper::LAW, paper::DENSITY).unwrap();
    let parameters = Parameters::new(1.0, beta, kappa).unwrap();
    let load = Load::new(&down, Signal::paper(paper::LOAD_AMPLITUDE));
    Muscle { loads: vec![load], ..Muscle::unloaded(solid, parameters) }
}

/// Returns compressible and incompressible bodies of both dimensions.
fn bodies() -> [(Formulation, Muscle); 4] {
    let mesh = include_str!("../../../data/meshes/muscle.msh");
    let mesh = Mesh::parse_msh(mesh, "muscle.msh").unwrap();
    let plane = |kappa, beta| paper::muscle(&mesh, kappa, beta).unwrap();
    [
        (Formulation::Position, plane(1e5, 0.0)),
        (Formulation::Rate, plane(f64::INFINITY, 1e-4)),
        (Formulation::Position, block(1e5, 0.0)),
        (Formulation::Rate, block(f64::INFINITY, 1e-4)),
    ]
}

#[test]
fn steps_of_idas_allocate_nothing() {
    for (formulation, muscle) in bodies() {
        let dimension = muscle.solid.space().dimension();
        let dae = MuscleDae::new(muscle, formulation).unwrap();
        let mut integrator = IdaIntegrator::from_rest(dae, &Settings::paper(formulation)).unwrap();
        integrator.advance().unwrap();
        let before = integrator.counts();
        let allocations = allocation_counter::measure(|| {
            for _ in 0..100 {
                assert_eq!(integrator.advance().unwrap(), Advance::Stepped);
            }
        });
        // The measured steps must include residuals, Jacobians, factorizations and solves.
        let after = integrator.counts();
        assert!(after.jacobian_evaluations > before.jacobian_evaluations);
        assert_eq!(allocations.count_total, 0, "{formulation}, {dimension}");
    }
}

#[test]
fn steps_of_radau_allocate_nothing() {
    for (formulation, muscle) in bodies() {
        let dimension = muscle.solid.space().dimension();
        let dae = MuscleDae::new(muscle, formulation).unwrap();
        let settings = Settings {
            integrator: IntegratorKind::Radau5,
            suppressed: Vec::new(),
            ..Settings::paper(formulation)
        };
        let options = RadauOptions {
            // A new Jacobian is evaluated whenever Newton's method takes two iterations. Small steps avoid rejected
            // steps, whose messages allocate.
            jacobian_reuse: 0.0,
            newton_tolerance: Some(1e-6),
            max_step: Some(4e-3),
            ..radau::options(&dae, &settings)
        };
        let zero = vec![0.0; dae.n_unknowns()];
        let (test, solver, times) = (None::<ErrorTest>, settings.linear_solver, [0.0, 1.0]);
        let mut integrator =
            RadauIntegrator::coupled_at(dae, test, options, solver, times, &zero, &zero).unwrap();
        // The load must have set in, because at rest one iteration is sufficient and no new Jacobian is required.
        while integrator.time() < 0.7 {
            integrator.advance().unwrap();
        }
        let before = integrator.counts();
        let mut out = zero;
        let allocations = allocation_counter::measure(|| {
            for _ in 0..50 {
                assert_eq!(integrator.advance().unwrap(), Advance::Stepped);
                let t = integrator.time();
                integrator.dense_output(t, 0, &mut out).unwrap();
            }
        });
        let after = integrator.counts();
        assert!(after.jacobian_evaluations > before.jacobian_evaluations + 10);
        assert!(after.linear_setups > before.linear_setups + 10);
        assert_eq!(after.error_test_failures, 0);
        assert_eq!(allocations.count_total, 0, "{formulation}, {dimension}");
    }
}
