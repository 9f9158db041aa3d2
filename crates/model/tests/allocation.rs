//! A step of IDAS allocates nothing once the first steps are behind.
#![allow(clippy::unwrap_used)] // a test may panic

use myovib_fem::Mesh;
use myovib_model::{Advance, Formulation, IdaIntegrator, Integrator, MuscleDae, Settings, paper};

#[test]
fn steps_with_condensed_set_ups_allocate_nothing() {
    let mesh = include_str!("../../../data/meshes/muscle.msh");
    let mesh = Mesh::parse_msh(mesh, "muscle.msh").unwrap();
    for (formulation, kappa, beta) in [
        (Formulation::Position, 1e5, 0.0),
        (Formulation::Rate, f64::INFINITY, 1e-4),
    ] {
        let muscle = paper::muscle(&mesh, kappa, beta).unwrap();
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
        assert_eq!(allocations.count_total, 0, "{formulation}");
    }
}
