//! Checks for all contributions that the stress in the output is the stress in the equations: in a block under tension
//! it equals the force divided by the area, and is zero on the free sides.

use std::sync::Arc;

use myovib_fem::{AddedStress, DofMap, Solid, Space, generate};
use myovib_model::{
    Formulation, InitialValues, IntegratorKind, Measurement, Muscle, MuscleDae, Outcome,
    Parameters, Prescribed, Quantity, Signal, formula, run, start_from,
};

use crate::common::{INF, neo_hooke};
use crate::energy::settings;
use crate::relaxation::series;

const MODULUS: f64 = 2e4;
/// Stretch to which the block is pulled by a smooth step; rise time and time of the measurement during the rise, s.
const STRETCH: f64 = 1.2;
const RISE: f64 = 0.05;
const READ: f64 = 0.03;
const DENSITY: f64 = 1e-3;
/// Allowed error of a stress of 1e4 Pa, in Pa. The contribution of inertia is ρ L² λ̈ with λ̈ < 6 · 0.2/RISE². The
/// contribution of the integration with a relative tolerance of 1e-6 is ten times the tolerance, for a modulus that
/// includes β/RISE and Prony terms.
const TOLERANCE: f64 = DENSITY * 480.0 + 1e-5 * MODULUS * 5.0;

/// A block in 2D, or in 3D with one side free or fixed.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Block {
    Plane,
    Free,
    Held,
}

impl Block {
    fn dimension(self) -> usize {
        if self == Block::Plane { 2 } else { 3 }
    }
}

/// Contributions in addition to the law: Prony terms, β, η.
type Parts = (&'static [(f64, f64)], f64, f64);

/// Returns a unit block on rollers whose side at x = 1 is pulled.
fn pulled(block: Block, kappa: f64, (terms, beta, eta): Parts) -> Muscle {
    let dimension = block.dimension();
    let mesh = match dimension {
        2 => generate::rectangle([0.0; 2], [1.0; 2], [1, 1]).unwrap(),
        _ => generate::block([0.0; 3], [1.0; 3], [1, 1, 1]).unwrap(),
    };
    let space = Arc::new(Space::taylor_hood(&mesh));
    let (mut held, mut prescribed) = (Vec::new(), Vec::new());
    let signal =
        Signal::from(formula::StepFunction { value: STRETCH - 1.0, start: 0.0, rise: RISE });
    for node in 0..space.n_nodes() {
        let place = space.node_point(node);
        for axis in 0..dimension {
            let is_pulled = axis == 0 && place[0] == 1.0;
            let is_held = block == Block::Held && axis == 2;
            if place[axis] == 0.0 || is_pulled || is_held {
                held.push((node, axis));
            }
            if is_pulled {
                prescribed.push(Prescribed { component: dimension * node, signal: signal.clone() });
            }
        }
    }
    let dofs = DofMap::new(&space, &held).unwrap();
    let all: Vec<usize> = (0..mesh.n_elements()).collect();
    let mut solid = Solid::uniform(space, dofs, neo_hooke(MODULUS), DENSITY).unwrap();
    if !terms.is_empty() {
        let regions = [(all.clone(), series(terms))];
        solid = solid.with_relaxation(&regions).unwrap();
    }
    if eta > 0.0 {
        let viscous = AddedStress { active: None, viscosity: eta };
        solid = solid.with_added_stresses(&[(all, viscous)]).unwrap();
    }
    Muscle { prescribed, ..Muscle::unloaded(solid, Parameters::new(0.0, beta, kappa).unwrap()) }
}

/// Output values.
#[derive(Debug)]
struct Read {
    /// Force on the pulled side, divided by its current area.
    traction: f64,
    /// The Cauchy stress along x, y, z.
    stress: [f64; 3],
    principal: [f64; 3],
    von_mises: f64,
}

fn read(muscle: Muscle, formulation: Formulation, kind: IntegratorKind) -> Read {
    let mut settings = settings(formulation, 1e-6).with_integrator(kind);
    settings.t_end = READ;
    settings.max_order = 5;
    let space = muscle.solid.space().clone();
    let d = space.dimension();
    let mut dae = MuscleDae::new(muscle, formulation).unwrap();
    let rest = vec![0.0; dae.muscle().solid.dofs().n_free()];
    let start = InitialValues::new(&mut dae, 0.0, &rest, &rest).unwrap();
    let mut integrator = start_from(dae, &settings, 0.0, &start.y, &start.y_dot).unwrap();
    let statistics = run(&mut *integrator, &mut []).unwrap();
    assert_eq!(statistics.outcome, Outcome::Finished);
    let n = integrator.problem().layout().n_unknowns();
    let [mut y, mut y_dot] = [vec![0.0; n], vec![0.0; n]];
    integrator.dense_output(READ, 0, &mut y).unwrap();
    integrator.dense_output(READ, 1, &mut y_dot).unwrap();
    let dae = integrator.problem_mut();
    let force = dae.unbalanced_force(READ, &y, &y_dot).unwrap();
    let pulled = (0..space.n_nodes()).filter(|&node| space.node_point(node)[0] == 1.0);
    let force: f64 = pulled.map(|node| force[d * node]).sum();
    let quantities =
        [Quantity::Displacement, Quantity::Stress, Quantity::Principal, Quantity::VonMises];
    let corner = Measurement::at(&space, &[1.0; 3][..d], &quantities).unwrap();
    let mut values = Vec::new();
    corner.read(&dae.snapshot(READ, &y, &y_dot), &mut values);
    let named = |name: &str| {
        let names = corner.names();
        values[names.iter().position(|other| *other == name).unwrap()]
    };
    let area: f64 = values[1..d].iter().map(|u| 1.0 + u).product();
    Read {
        traction: force / area,
        stress: ["stress_xx", "stress_yy", "stress_zz"].map(named),
        principal: ["principal_1", "principal_2", "principal_3"].map(named),
        von_mises: named("von_mises"),
    }
}

const PRONY: &[(f64, f64)] = &[(0.5, 0.02), (0.4, 0.2)];

/// Combinations of parts, with formulations that allow them.
const CASES: [(Formulation, f64, Parts); 7] = [
    (Formulation::Velocity, INF, (PRONY, 0.0, 0.0)),
    (Formulation::Position, 1e5, (PRONY, 0.0, 0.0)),
    (Formulation::Displacement, 1e5, (&[], 0.01, 0.0)),
    (Formulation::Rate, 1e5, (&[], 0.01, 0.0)),
    (Formulation::ImplicitRate, INF, (&[], 0.01, 0.0)),
    (Formulation::ImplicitRate, 1e5, (PRONY, 0.01, 0.0)),
    (Formulation::Displacement, 1e5, (PRONY, 0.01, 50.0)),
];

/// Returns all cases for Radau IIA. BDF is included only if there are no undamped waves, for which order 5 is unstable,
/// and if the error test includes no pressure rate, with which BDF takes 250 000 steps.
fn cases() -> impl Iterator<Item = (IntegratorKind, (Formulation, f64, Parts))> {
    let [relaxing, _, damped, _, _, _, all] = CASES;
    let by_bdf = [relaxing, damped, all].map(|case| (IntegratorKind::Bdf, case));
    CASES.map(|case| (IntegratorKind::Radau9, case)).into_iter().chain(by_bdf)
}

#[test]
fn stress_in_a_block_under_tension_is_force_divided_by_area() {
    let mut worst = 0.0_f64;
    for (kind, (formulation, kappa, parts)) in cases() {
        for block in [Block::Plane, Block::Free] {
            let found = read(pulled(block, kappa, parts), formulation, kind);
            let case = format!("{kind:?} {formulation} {kappa} {parts:?} {block:?} {found:?}");
            let mut close = |a: f64, b: f64| {
                worst = worst.max((a - b).abs());
                assert!((a - b).abs() < TOLERANCE, "{case}");
            };
            let [xx, yy, zz] = found.stress;
            assert!(xx > 5e3, "{case}");
            close(found.traction, xx);
            close(yy, 0.0);
            if block == Block::Free {
                close(zz, 0.0);
                close(found.von_mises, xx);
            }
            for (found, expected) in found.principal.iter().zip([xx, zz, yy]) {
                close(*found, expected);
            }
        }
    }
    println!("{worst:.1e} Pa of {TOLERANCE:.1e} Pa");
}

/// Checks the out-of-plane component, on which the forces of a plane body do not depend.
#[test]
fn plane_strain_equals_a_body_between_two_planes() {
    for (kind, (formulation, kappa, parts)) in cases() {
        let of = |block| read(pulled(block, kappa, parts), formulation, kind).stress;
        let (plane, space) = (of(Block::Plane), of(Block::Held));
        assert!(plane[2] > 1e3, "{plane:?}");
        for (plane, space) in plane.iter().zip(space) {
            let case = format!("{kind:?} {formulation} {kappa} {parts:?}: {plane} {space}");
            assert!((plane - space).abs() < 2.0 * TOLERANCE, "{case}");
        }
    }
}
