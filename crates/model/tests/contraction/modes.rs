//! Modes about equilibria under tensions, pressures and moved supports, compared with small motions about these
//! equilibria.

use std::f64::consts::TAU;
use std::sync::Arc;

use myovib_fem::material::ActiveStress;
use myovib_fem::{AddedStress, DofMap, Solid, Space, SupportDirection, generate, load};
use myovib_model::statics::{Equilibrium, equilibrium};
use myovib_model::{
    Activation, Field, Formulation, InitialValues, IntegratorKind, Load, ModelError, Muscle,
    MuscleDae, Outcome, Parameters, Prescribed, RobinSupport, Signal, SurfaceLoad, paper, run,
    spectrum, start_from,
};

use crate::common::{HILL, INF, contracting, viscous};
use crate::energy::settings;

/// Largest initial displacement from the equilibrium, m.
const SMALL: f64 = 1e-4;

/// Returns the ratio of the lowest mode's amplitude after `periods` of the mode to its initial
/// value, in the motion that starts from the equilibrium displaced along the mode. The mean over
/// displacements in both directions has no second-order part.
fn left_of_the_mode(muscle: &Muscle, at: &Equilibrium, periods: f64) -> f64 {
    let mode = &spectrum::lowest(muscle, at, 1).unwrap()[0];
    let formulation = Formulation::Velocity;
    let mut settings = settings(formulation, 1e-8).with_integrator(IntegratorKind::Radau9);
    settings.t_end = periods / mode.frequency().unwrap();
    let solid = &muscle.solid;
    let mut inertia = vec![0.0; solid.dofs().n_full()];
    let mut full = inertia.clone();
    solid.dofs().expand(&mode.shape, &mut full);
    solid.apply_mass(&full, &mut inertia);
    let largest = mode.shape.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
    let of_way = |sign: f64| {
        let size = sign * SMALL / largest;
        let both = at.displacement.iter().zip(&mode.shape);
        let q: Vec<f64> = both.map(|(q, u)| q + size * u).collect();
        let mut dae = MuscleDae::new(muscle.clone(), formulation).unwrap();
        let start = InitialValues::new(&mut dae, 0.0, &q, &vec![0.0; q.len()]).unwrap();
        let mut integrator = start_from(dae, &settings, 0.0, &start.y, &start.y_dot).unwrap();
        let statistics = run(&mut *integrator, &mut []).unwrap();
        assert_eq!(statistics.outcome, Outcome::Finished);
        let mut y = start.y;
        integrator.dense_output(settings.t_end, 0, &mut y).unwrap();
        let q = integrator.problem().layout().range(Field::Displacement);
        let moved = y[q.unwrap()].iter().zip(&at.displacement);
        let parts = moved.zip(solid.dofs().free_to_full());
        let part: f64 = parts.map(|((q, rest), &i)| (q - rest) * inertia[i]).sum();
        part / size
    };
    0.5 * (of_way(1.0) + of_way(-1.0))
}

/// Checks that a motion that starts along the lowest mode passes through the equilibrium after a quarter of its period.
fn expect_the_frequency(muscle: &Muscle) {
    let at = equilibrium(muscle, Formulation::Position, 0.0).unwrap();
    let quarter = left_of_the_mode(muscle, &at, 0.25);
    // A relative error d of the frequency results in π/2 d, terms of second order in 1e-8, and the tolerance divided by
    // SMALL in 1e-4.
    assert!(quarter.abs() < 2e-4, "{quarter:e}");
    // The test is only meaningful if the modes about rest have different frequencies.
    let unloaded = Equilibrium::unloaded(muscle);
    let [loaded, unloaded] = [&at, &unloaded].map(|at| {
        let modes = spectrum::lowest(muscle, at, 1).unwrap();
        modes[0].frequency().unwrap()
    });
    assert!((loaded / unloaded - 1.0).abs() > 0.02, "{loaded} {unloaded}");
}

/// Returns a body whose halves contract by stress with and without dependence on the stretch, with elastic
/// foundations and a traction.
fn contracted(
    dimension: usize,
    kappa: f64,
    stresses: [AddedStress; 2],
    foundation: [f64; 2],
) -> Muscle {
    let mut muscle = contracting(dimension, kappa, 0.0, stresses);
    muscle.parameters = Parameters::new(0.0, 0.0, kappa).unwrap();
    let solid = &muscle.solid;
    let pull = [0.0, 3e3, 1e3];
    let traction = match dimension {
        2 => load::traction(solid.space(), "right", [pull[0], pull[1]]),
        _ => load::traction(solid.space(), "right", pull),
    };
    muscle.loads = vec![Load::new(&traction.unwrap(), Signal::constant(1.0))];
    muscle.foundations =
        vec![RobinSupport::new(solid, "right", SupportDirection::Normal, foundation).unwrap()];
    let given = |number, tension| (number, Activation::Given(Signal::constant(tension)));
    muscle.activations = vec![given(0, 8e3), given(1, 5e3)];
    muscle
}

#[test]
fn a_contracted_body_vibrates_at_the_frequencies_about_its_equilibrium() {
    let still = [ActiveStress { force_velocity: None, ..HILL }, ActiveStress::PLAIN];
    let stresses = still.map(|active| AddedStress { active: Some(active), viscosity: 0.0 });
    for (dimension, kappa) in [(2, 1e5), (2, INF), (3, INF)] {
        expect_the_frequency(&contracted(dimension, kappa, stresses, [3e4, 0.0]));
    }
}

/// Hill's curve under a tension, viscosity and a foundation dissipate the energy that the motion
/// loses in a period.
#[test]
fn a_contracted_body_has_the_damping_of_its_mode() {
    let muscle = contracted(2, 1e5, viscous(), [3e4, 2e2]);
    let at = equilibrium(&muscle, Formulation::Position, 0.0).unwrap();
    let mode = &spectrum::lowest(&muscle, &at, 1).unwrap()[0];
    let ratio = spectrum::damping_ratio(&muscle, &at, mode).unwrap().unwrap();
    let lost = -left_of_the_mode(&muscle, &at, 1.0).ln() / TAU;
    // Damping couples the other modes to this one, which causes a deviation of second order in the damping.
    assert!((lost / ratio - 1.0).abs() < 2.0 * ratio, "{lost} {ratio}");
    let unloaded = Equilibrium::unloaded(&muscle);
    let passive = spectrum::damping_ratio(&muscle, &unloaded, mode).unwrap();
    assert!(ratio > 1.1 * passive.unwrap(), "{ratio} {passive:?}");
}

/// Returns a strip with both ends fixed, the right one displaced, and a follower pressure on its lower side.
fn pressed(held: &[&str], kappa: f64, pressure: f64) -> Muscle {
    let mesh = generate::rectangle([0.0; 2], [1.0, 0.2], [10, 2]).unwrap();
    let space = Arc::new(Space::taylor_hood(&mesh));
    let nodes = |group: &&str| space.nodes_of(group).unwrap();
    let ends: Vec<usize> = held.iter().flat_map(nodes).collect();
    let dofs = DofMap::clamped(&space, &ends).unwrap();
    let right = held.contains(&"right").then(|| nodes(&"right"));
    let right = right.into_iter().flatten();
    let prescribed =
        right.map(|node| Prescribed { component: 2 * node, signal: Signal::constant(0.1) });
    let solid = Solid::uniform(space.clone(), dofs, paper::LAW, 1e3).unwrap();
    let pressure = SurfaceLoad::pressure(&solid, "bottom", Signal::constant(pressure)).unwrap();
    Muscle {
        prescribed: prescribed.collect(),
        surface_loads: vec![pressure],
        ..Muscle::unloaded(solid, Parameters::new(0.0, 0.0, kappa).unwrap())
    }
}

#[test]
fn a_body_under_pressure_vibrates_at_the_frequencies_about_its_equilibrium() {
    for kappa in [1e5, INF] {
        expect_the_frequency(&pressed(&["left", "right"], kappa, 1e3));
    }
}

/// If the edge of the loaded side moves, the pressure has no energy.
#[test]
fn pressures_on_free_edges_are_refused() {
    let muscle = pressed(&["left"], 1e5, 20.0);
    let at = equilibrium(&muscle, Formulation::Position, 0.0).unwrap();
    let refused = spectrum::vibration(&muscle, &at);
    assert!(matches!(refused, Err(ModelError::NoEnergy)), "{refused:?}");
    assert!(spectrum::lowest(&muscle, &Equilibrium::unloaded(&muscle), 1).is_ok());
}

/// Regression: a support with a nonzero position at t = 0 deformed the body at rest.
#[test]
fn moved_supports_do_nothing_to_the_modes_about_rest() {
    let moved = pressed(&["left", "right"], 1e5, 1e3);
    let still = Muscle { prescribed: Vec::new(), ..moved.clone() };
    let [moved, still] = [&moved, &still].map(|muscle| {
        let modes = spectrum::lowest(muscle, &Equilibrium::unloaded(muscle), 2).unwrap();
        (modes, spectrum::fastest(muscle).unwrap())
    });
    assert_eq!(moved, still);
}
