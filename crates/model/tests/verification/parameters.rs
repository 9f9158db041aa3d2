//! Parameters out of range, and formulations that do not go with them.

use myovib_model::{Formulation, MuscleDae, Parameters, Probe, Signal, paper};

use crate::common::loaded_block;

#[test]
fn parameters_out_of_range_are_named_with_the_range() {
    for (alpha, beta, kappa, words) in [
        (0.0, 0.0, 0.0, "kappa = 0"),
        (0.0, 0.0, -1e5, "kappa = -100000"),
        (0.0, 0.0, f64::NAN, "kappa = NaN"),
        (0.0, -1e-4, 1e5, "beta = -0.0001"),
        (0.0, f64::INFINITY, 1e5, "beta = inf"),
        (-1.0, 0.0, 1e5, "alpha = -1"),
    ] {
        let message = Parameters::new(alpha, beta, kappa).unwrap_err().to_string();
        assert!(message.starts_with(words), "{message}");
    }
    assert!(
        Parameters::new(1.0, 0.0, f64::INFINITY)
            .unwrap()
            .is_incompressible()
    );
}

#[test]
fn formulations_that_do_not_go_with_kappa_and_beta_say_what_does() {
    use Formulation::{Displacement, ImplicitRate, Position, Rate, Stabilized, Velocity};
    const INF: f64 = f64::INFINITY;
    for (formulation, kappa, beta, words) in [
        (Displacement, INF, 0.0, "finite kappa"),
        (Position, 1e5, 1e-4, "beta = 0"),
        (Velocity, INF, 1e-4, "beta = 0"),
        (Rate, INF, 0.0, "beta > 0"),
        (Rate, 1e5, 0.0, "beta > 0"),
        (Stabilized, 1e5, 0.0, "kappa = inf"),
        (Stabilized, INF, 1e-4, "beta = 0"),
        (ImplicitRate, INF, 0.0, "beta > 0"),
    ] {
        let muscle = loaded_block(0, paper::LAW, kappa, beta, Signal::Constant(0.0));
        let message = MuscleDae::new(muscle, formulation).unwrap_err().to_string();
        assert!(
            message.contains(formulation.name()) && message.contains(words),
            "{message}"
        );
    }
}

#[test]
fn a_point_outside_the_mesh_is_named() {
    let muscle = loaded_block(0, paper::LAW, 1e5, 0.0, Signal::Constant(0.0));
    let message = Probe::at(muscle.solid.space(), [3.0, 0.5])
        .unwrap_err()
        .to_string();
    assert_eq!(message, "the point (3, 0.5) lies outside the mesh");
}
