//! A step of IDAS allocates nothing once the first steps are behind.
#![allow(clippy::unwrap_used)] // a test may panic

use std::sync::Arc;

use myovib_fem::{DofMap, Mesh, Solid, Space, generate};
use myovib_model::{
    Advance, Formulation, IdaIntegrator, Integrator, Load, Muscle, MuscleDae, Parameters, Settings,
    Signal, paper,
};

/// A block in space, held on its left, under the paper's load along z in all of it.
fn block(kappa: f64, beta: f64) -> Muscle {
    let mesh = generate::block([0.0; 3], [0.2, 0.04, 0.04], [4, 1, 1]).unwrap();
    let space = Arc::new(Space::taylor_hood(&mesh));
    let dofs = DofMap::clamped(&space, &space.nodes_of("left").unwrap()).unwrap();
    let down: Vec<f64> = (0..space.n_components())
        .map(|i| if i % 3 == 2 { 1e-4 } else { 0.0 })
        .collect();
    let solid = Solid::uniform(space, dofs, paper::LAW, paper::DENSITY).unwrap();
    let parameters = Parameters::new(1.0, beta, kappa).unwrap();
    let load = Load::new(&down, Signal::paper(paper::LOAD_AMPLITUDE));
    Muscle {
        loads: vec![load],
        ..Muscle::unloaded(solid, parameters)
    }
}

#[test]
fn steps_with_condensed_set_ups_allocate_nothing() {
    let mesh = include_str!("../../../data/meshes/muscle.msh");
    let mesh = Mesh::parse_msh(mesh, "muscle.msh").unwrap();
    let plane = |kappa, beta| paper::muscle(&mesh, kappa, beta).unwrap();
    for (formulation, muscle) in [
        (Formulation::Position, plane(1e5, 0.0)),
        (Formulation::Rate, plane(f64::INFINITY, 1e-4)),
        (Formulation::Position, block(1e5, 0.0)),
        (Formulation::Rate, block(f64::INFINITY, 1e-4)),
    ] {
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
        // The steps measured must hold residuals, Jacobians, factorisations and solves.
        let after = integrator.counts();
        assert!(after.jacobian_evaluations > before.jacobian_evaluations);
        assert_eq!(allocations.count_total, 0, "{formulation}, {dimension}");
    }
}
