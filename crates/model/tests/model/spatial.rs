//! Bodies in 3D: every formulation, its index, inf–sup constants, and a published equilibrium.

use std::sync::Arc;

use myovib_conformance::jacobian_error;
use myovib_dae::Problem;
use myovib_fem::{DofMap, Law, Mesh, Solid, Space, generate};
use myovib_model::inf_sup::{Pair, levels};
use myovib_model::statics::equilibrium;
use myovib_model::table1;
use myovib_model::{
    Field, Formulation, Muscle, MuscleDae, Parameters, Probe, Signal, SurfaceLoad, paper,
};
use rand::rngs::StdRng;
use rand::{Rng, SeedableRng};

const INF: f64 = f64::INFINITY;

fn held(mesh: &Mesh, group: &str, law: Law) -> Solid {
    let space = Arc::new(Space::taylor_hood(mesh));
    let dofs = DofMap::clamped(&space, &space.nodes_of(group).unwrap()).unwrap();
    Solid::uniform(space, dofs, law, paper::DENSITY).unwrap()
}

/// Returns a block under a follower pressure, so that all terms of the Jacobian are present.
fn dae(formulation: Formulation, law: Law, kappa: f64, beta: f64) -> MuscleDae {
    let mesh = generate::block([0.0; 3], [1.0, 0.8, 0.6], [1, 1, 1]).unwrap();
    let solid = held(&mesh, "left", law);
    let load = SurfaceLoad::pressure(&solid, "right", Signal::paper(1e3)).unwrap();
    let mut muscle = Muscle::unloaded(solid, Parameters::new(1.0, beta, kappa).unwrap());
    muscle.surface_loads.push(load);
    MuscleDae::for_analysis(muscle, formulation)
}

/// Returns max_i |J δ − dF/dε|_i relative to the sum of the row's terms, along a random direction.
fn discrepancy(dae: &mut MuscleDae, rng: &mut StdRng) -> f64 {
    let size = dae.layout().fill(|field| match field {
        Field::Displacement => 0.02,
        Field::Velocity => 1.0,
        Field::Pressure => 1e3,
        Field::PressureRate => 1e4,
        Field::GglMultiplier => 1.0,
        Field::Tension | Field::InternalStress => 1e3,
    });
    let mut draw = |factor: f64| -> Vec<f64> {
        let one = |size: &f64| factor * size * rng.random_range(-1.0..1.0);
        size.iter().map(one).collect()
    };
    let (y, y_dot, direction) = (draw(1.0), draw(10.0), draw(1.0));
    jacobian_error(dae, 0.9, [&y, &y_dot, &direction], [1.3, 70.0])
}

#[test]
fn jacobian_of_every_formulation_agrees_with_differences() {
    let mut rng = StdRng::seed_from_u64(28);
    for formulation in Formulation::ALL {
        for law in [paper::LAW, paper::SMALL_STRAIN] {
            for (kappa, beta) in [(1e5, 0.0), (1e5, 1e-2), (INF, 0.0), (INF, 1e-2)] {
                if formulation == Formulation::Displacement && kappa.is_infinite() {
                    continue;
                }
                let error = discrepancy(&mut dae(formulation, law, kappa, beta), &mut rng);
                // Truncation and rounding errors of the differences are below 1e-8, as in 2D.
                assert!(error < 1e-7, "{formulation} {law:?} {kappa} {beta}: {error:e}");
            }
        }
    }
}

/// Table 1 and the additional formulations, on a block of six tetrahedra at a state of large strain.
#[test]
fn the_index_is_that_of_the_plane() {
    let mesh = generate::block([0.0; 3], [0.05, 0.04, 0.04], [1, 1, 1]).unwrap();
    let mut groups = mesh.groups().clone();
    let left = groups["left"].clone();
    groups.insert(paper::FIXED_GROUP.to_owned(), left);
    let mesh = mesh.with_groups(groups).unwrap();
    for case in table1::cases() {
        let parameters = Parameters::new(paper::ALPHA, case.beta, case.kappa).unwrap();
        let rule = usize::from(case.formulation.index(&parameters));
        let report = case.at_random_state(&mesh, 1).unwrap();
        assert_eq!(report.decided(), Some(rule), "{case:?}");
        assert_eq!(report.decided(), case.printed.or(report.decided()), "{case:?}");
    }
}

/// The constants of P2–P1 are bounded on three meshes; P1–P1 has undetermined pressures.
#[test]
fn inf_sup_constants_in_space() {
    let mesh = generate::block([0.0; 3], [1.0; 3], [1, 1, 1]).unwrap();
    let stable = levels(Pair::TaylorHood, &mesh, &["left", "right"], 3, |_, _| ()).unwrap();
    let constants: Vec<f64> = stable.iter().map(|level| level.constant).collect();
    assert!(stable.iter().all(|level| level.nullity == 0), "{constants:?}");
    // The constant of an unstable pair decreases by a factor of two to four when h is halved.
    assert!(constants[2] > 0.8 * constants[1], "{constants:?}");
    let unstable = levels(Pair::EqualOrder, &mesh, &["left", "right"], 3, |_, _| ()).unwrap();
    let held = |level: &myovib_model::inf_sup::Level| {
        // Half of the constant of the stable pair. If only boundedness were checked, both pairs would pass.
        level.nullity == 0 && level.constant > 0.5 * constants[2]
    };
    assert!(!unstable[1..].iter().any(held), "{unstable:?}");
}

/// Returns u_z at (10, 0.5, 1) mm of the beam of Land et al. (2015), problem 1.
fn land(cells: [usize; 3]) -> f64 {
    let mesh = generate::block([0.0; 3], [0.01, 0.001, 0.001], cells).unwrap();
    let law = Law::Guccione { c: 2e3, b_f: 8.0, b_t: 2.0, b_fs: 4.0 };
    let solid = held(&mesh, "left", law);
    let pressure = SurfaceLoad::pressure(&solid, "bottom", Signal::constant(4.0)).unwrap();
    let mut muscle = Muscle::unloaded(solid, Parameters::new(0.0, 0.0, INF).unwrap());
    muscle.surface_loads.push(pressure);
    let state = equilibrium(&muscle, Formulation::Position, 0.0).unwrap();
    let space = muscle.solid.space();
    let mut u = vec![0.0; space.n_components()];
    muscle.solid.dofs().expand(&state.displacement, &mut u);
    Probe::at(space, [0.01, 0.0005, 0.001]).unwrap().vector(&u)[2]
}

/// Another P2–P1 program computes 3.068 mm with ten cubes along the beam, 3.141 with twenty and 3.159 with forty; the
/// results of the benchmark's participants are between 3.15 and 3.19. The bound is half of the last digit printed.
#[test]
fn a_beam_of_fibers_bends_as_published() {
    let found = land([10, 1, 1]);
    assert!((found - 3.068e-3).abs() < 0.5e-6, "{found}");
}

/// Checks that the load on a body in 3D is applied in steps if Newton's method does not converge
/// for the full load, and that the result is in equilibrium.
#[test]
fn a_body_in_space_is_loaded_in_steps() {
    let mesh = generate::block([0.0; 3], [1.0, 0.8, 0.6], [1, 1, 1]).unwrap();
    let solid = held(&mesh, "left", paper::LAW);
    let pull = SurfaceLoad::pressure(&solid, "right", Signal::constant(-2e4)).unwrap();
    let mut muscle = Muscle::unloaded(solid, Parameters::new(0.0, 0.0, INF).unwrap());
    muscle.surface_loads.push(pull);
    let found = equilibrium(&muscle, Formulation::Position, 0.0).unwrap();
    assert!(found.load_steps > 1, "{} load steps", found.load_steps);
    let mut dae = MuscleDae::for_analysis(muscle, Formulation::Position);
    let mut y = found.displacement.clone();
    y.resize(2 * y.len(), 0.0);
    y.extend(&found.pressure);
    let zero = vec![0.0; y.len()];
    let mut residual = zero.clone();
    dae.residual(0.0, &y, &zero, &mut residual).unwrap();
    let largest = residual.iter().fold(0.0_f64, |m, r| m.max(r.abs()));
    // Rounding of forces of about 1e4 N.
    assert!(largest < 1e-9, "{largest:e}");
}
