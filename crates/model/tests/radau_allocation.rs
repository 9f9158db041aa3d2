//! A step of Radau IIA with condensed set-ups allocates nothing.
#![allow(clippy::unwrap_used)] // a test may panic

use myovib_dae::Problem;
use myovib_fem::Mesh;
use myovib_model::{
    Advance, Formulation, Integrator, IntegratorKind, MuscleDae, RadauIntegrator, Settings, paper,
    radau,
};
use myovib_radau::RadauOptions;

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
        let settings = Settings {
            integrator: IntegratorKind::Radau,
            suppressed: Vec::new(),
            ..Settings::paper(formulation)
        };
        let options = RadauOptions {
            // A new Jacobian wherever Newton takes two iterations; messages of rejected steps,
            // which allocate, are avoided by small ones.
            jacobian_reuse: 0.0,
            newton_tolerance: Some(1e-6),
            max_step: Some(4e-3),
            ..radau::options(&dae, &settings)
        };
        let matrices = radau::matrices(&dae, &options, settings.linear_solver).unwrap();
        let zero = vec![0.0; dae.n_unknowns()];
        let mut integrator =
            RadauIntegrator::new(dae, matrices, options, (0.0, 1.0), &zero, &zero).unwrap();
        // The load must have set in: at rest one iteration is enough, and no new Jacobian is due.
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
        assert_eq!(allocations.count_total, 0, "{formulation}");
    }
}
