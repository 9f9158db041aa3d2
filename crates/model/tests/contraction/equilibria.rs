//! Equilibria of contracted bodies compared with closed forms.

use std::sync::Arc;

use myovib_fem::material::{ActiveStress, ForceLength, Tension};
use myovib_fem::{AddedStress, DofMap, Solid, Space, SupportDirection, generate, load};
use myovib_model::statics::equilibrium;
use myovib_model::{
    Activation, Formulation, Load, Muscle, Parameters, Probe, RobinSupport, Signal,
};

use crate::common::{INF, neo_hooke};

/// μ of the neo-Hookean body, Pa.
const SHEAR: f64 = 2e4;
/// T, Pa.
const TENSION: f64 = 6e3;

const CURVE: ForceLength = ForceLength::Gaussian { optimal: 1.05, width: 0.6 };

/// Returns an incompressible block with fibers along x that is free to slide on the planes x = 0, y = 0, z = 0.
fn block(active: ActiveStress) -> Muscle {
    let mesh = generate::block([0.0; 3], [1.0, 0.7, 0.5], [2, 1, 1]).unwrap();
    let all: Vec<usize> = (0..mesh.n_elements()).collect();
    let space = Arc::new(Space::taylor_hood(&mesh));
    let points = space.node_points::<3>().to_vec();
    let held = (0..space.n_nodes()).flat_map(|node| [0, 1, 2].map(|axis| (node, axis)));
    let held: Vec<_> = held.filter(|&(node, axis)| points[node][axis] == 0.0).collect();
    let dofs = DofMap::new(&space, &held).unwrap();
    let stress = AddedStress { active: Some(active), viscosity: 0.0 };
    let solid = Solid::uniform(space, dofs, neo_hooke(SHEAR), 1e3)
        .unwrap()
        .with_added_stresses(&[(all, stress)])
        .unwrap();
    Muscle {
        activations: vec![(0, Activation::Given(Signal::constant(TENSION)))],
        ..Muscle::unloaded(solid, Parameters::new(0.0, 0.0, INF).unwrap())
    }
}

/// Returns the stretch along the fibers at rest.
fn stretch(muscle: &Muscle) -> f64 {
    let state = equilibrium(muscle, Formulation::Position, 0.0).unwrap();
    let space = muscle.solid.space();
    let mut u = vec![0.0; space.n_components()];
    muscle.solid.dofs().expand(&state.displacement, &mut u);
    let end = Probe::at(space, [1.0, 0.35, 0.25]).unwrap();
    1.0 + end.vector(&u)[0]
}

/// Returns the nominal stress along the fiber of an incompressible body with free sides, without active stress.
fn passive(stretch: f64) -> f64 {
    SHEAR * (stretch - stretch.powi(-2))
}

/// Returns the factor g exp(…) as written in the formula.
fn gaussian(stretch: f64) -> f64 {
    (-((stretch / 1.05 - 1.0) / 0.6).powi(4)).exp()
}

#[test]
fn a_free_muscle_shortens_until_its_elasticity_balances_the_tension() {
    for tension in [Tension::SecondPiolaKirchhoff, Tension::Nominal] {
        let found =
            stretch(&block(ActiveStress { tension, force_length: CURVE, force_velocity: None }));
        assert!(found < 0.97, "{found}");
        let nominal = match tension {
            Tension::SecondPiolaKirchhoff => found * TENSION * gaussian(found),
            Tension::Nominal => TENSION * gaussian(found),
        };
        // Newton's method converges to rounding; slopes are about 3 μ.
        let left = passive(found) + nominal;
        assert!(left.abs() < 1e-10 * SHEAR, "{tension:?}: {left:e}");
    }
}

/// Checks that half the loads include half the tension.
#[test]
fn a_part_of_the_loads_is_a_part_of_the_tension() {
    let with = |part: f64| {
        let mut muscle = block(ActiveStress::PLAIN);
        let end = [9e3 * part, 0.0, 0.0];
        let traction = load::traction(muscle.solid.space(), "right", end).unwrap();
        muscle.loads = vec![Load::new(&traction, Signal::constant(1.0))];
        muscle.activations = vec![(0, Activation::Given(Signal::constant(TENSION * part)))];
        muscle
    };
    let (whole, half) = (with(1.0), with(0.5));
    assert_eq!(stretch(&whole.under_part_of_loads(0.5)), stretch(&half));
    assert!(stretch(&half) < stretch(&whole));
}

/// Isotonic contraction, with a dead load at the end that is as large as the tension or larger.
#[test]
fn a_loaded_muscle_balances_tension_and_elasticity() {
    let pull = 9e3;
    let mut muscle = block(ActiveStress::PLAIN);
    let traction = load::traction(muscle.solid.space(), "right", [pull, 0.0, 0.0]).unwrap();
    muscle.loads.push(Load::new(&traction, Signal::constant(1.0)));
    let found = stretch(&muscle);
    let left = passive(found) + found * TENSION - pull;
    assert!(found > 1.0 && left.abs() < 1e-10 * SHEAR, "{found} {left:e}");
}

/// A spring of stiffness k at the end, so that k (1 − λ) and the muscle's stress are in equilibrium. The foundation
/// acts in all directions or only along the normal; in the latter case the sides are free.
#[test]
fn a_muscle_shortens_against_an_elastic_bed() {
    let stiffness = 5e4;
    let mut muscle = block(ActiveStress::PLAIN);
    let foundation =
        RobinSupport::new(&muscle.solid, "right", SupportDirection::Normal, [stiffness, 0.0])
            .unwrap();
    muscle.foundations.push(foundation);
    let found = stretch(&muscle);
    let left = passive(found) + found * TENSION + stiffness * (found - 1.0);
    assert!(found < 1.0 && left.abs() < 1e-10 * SHEAR, "{found} {left:e}");
}

/// A body without fixed nodes is supported by foundations.
#[test]
fn beds_hold_a_body() {
    let mesh = generate::block([0.0; 3], [1.0; 3], [1, 1, 1]).unwrap();
    let space = Arc::new(Space::taylor_hood(&mesh));
    let dofs = DofMap::new(&space, &[]).unwrap();
    let solid = Solid::uniform(space.clone(), dofs, neo_hooke(SHEAR), 1e3).unwrap();
    let (stiffness, force) = (1e6, 40.0);
    let foundation = |along| RobinSupport::new(&solid, "left", along, [stiffness, 0.0]).unwrap();
    let push = load::traction(&space, "right", [force, 0.0, 0.0]).unwrap();
    let mut muscle = Muscle {
        loads: vec![Load::new(&push, Signal::constant(1.0))],
        foundations: vec![foundation(SupportDirection::All)],
        ..Muscle::unloaded(solid.clone(), Parameters::new(0.0, 0.0, 1e5).unwrap())
    };
    let state = equilibrium(&muscle, Formulation::Position, 0.0).unwrap();
    let mut u = vec![0.0; space.n_components()];
    solid.dofs().expand(&state.displacement, &mut u);
    let mut reaction = vec![0.0; u.len()];
    let operator = muscle.foundations[0].operator();
    operator.add_product(stiffness, &u, &mut reaction);
    let total = |axis: usize| reaction.iter().skip(axis).step_by(3).sum::<f64>();
    // The area is 1; Newton's method converges to rounding.
    assert!((total(0) / force - 1.0).abs() < 1e-9, "{}", total(0));
    assert!(total(1).abs().max(total(2).abs()) < 1e-9 * force);
    muscle.foundations = vec![foundation(SupportDirection::Normal)];
    let refused = equilibrium(&muscle, Formulation::Position, 0.0).unwrap_err();
    let free = "slide in y and slide in z and turn about x";
    assert!(refused.to_string().contains(free), "{refused}");
}
