//! Contracting bodies used by several tests.

use std::sync::Arc;

use myovib_fem::material::{ActiveStress, Bestel, ForceLength, ForceVelocity, Tension};
use myovib_fem::{
    AddedStress, DofMap, Fibers, Law, Mesh, Solid, Space, SupportDirection, generate,
};
use myovib_model::{Activation, Muscle, Parameters, RobinSupport, Signal, paper};

pub(crate) const INF: f64 = f64::INFINITY;

/// Stress that depends on stretch and its rate.
pub(crate) const HILL: ActiveStress = ActiveStress {
    tension: Tension::Nominal,
    force_length: ForceLength::Parabola { optimal: 1.1 },
    force_velocity: Some(ForceVelocity { v_max: 10.0, a: 0.25, plateau: 1.4 }),
};

/// Returns a block of the requested dimension whose cells are divided into two halves.
pub(crate) fn block(dimension: usize) -> Mesh {
    match dimension {
        2 => generate::rectangle([0.0; 2], [1.0, 0.8], [2, 2]).unwrap(),
        _ => generate::block([0.0; 3], [1.0, 0.8, 0.6], [2, 1, 1]).unwrap(),
    }
}

/// Returns the elements of the left half and of the right half.
pub(crate) fn halves(mesh: &Mesh) -> [Vec<usize>; 2] {
    let is_left = |element: usize| {
        let middle = mesh.element(element).iter();
        let x: f64 = middle.map(|&v| mesh.coordinates()[mesh.dimension() * v]).sum();
        x < 0.5 * mesh.element(element).len() as f64
    };
    let (left, right) = (0..mesh.n_elements()).partition(|&element| is_left(element));
    [left, right]
}

/// Returns a block with oblique fibers, fixed on its left, with foundations on its right and on its top. One
/// half contracts by a given tension, the other by an activation model.
pub(crate) fn contracting(
    dimension: usize,
    kappa: f64,
    beta: f64,
    stresses: [AddedStress; 2],
) -> Muscle {
    let parameters = Parameters::new(1.0, beta, kappa).unwrap();
    on_mesh(&block(dimension), parameters, stresses)
}

/// Returns such a body on another mesh.
pub(crate) fn on_mesh(mesh: &Mesh, parameters: Parameters, stresses: [AddedStress; 2]) -> Muscle {
    let [left, right] = halves(mesh);
    let mut fibers = Fibers::new(mesh);
    let askew = match mesh.dimension() {
        2 => [0.8, 0.6, 0.0],
        _ => [2.0, 1.0, -1.0],
    };
    fibers.set_constant(mesh, &left, askew, None).unwrap();
    let space = Arc::new(Space::taylor_hood(mesh));
    let dofs = DofMap::clamped(&space, &space.nodes_of("left").unwrap()).unwrap();
    let solid = Solid::uniform(space, dofs, paper::LAW, paper::DENSITY)
        .unwrap()
        .with_added_stresses(&[(left, stresses[0]), (right, stresses[1])])
        .unwrap()
        .with_fibers(fibers);
    let foundations = [
        RobinSupport::new(&solid, "right", SupportDirection::Normal, [3e4, 2e2]).unwrap(),
        RobinSupport::new(&solid, "top", SupportDirection::All, [1e4, 1e2]).unwrap(),
    ];
    let mut activations = Vec::new();
    for (number, stress) in stresses.iter().enumerate() {
        if stress.active.is_some() {
            let activation = match number {
                0 => Activation::Given(Signal::constant(8e3)),
                _ => Activation::Bestel(Bestel {
                    systole: 0.02,
                    diastole: 0.3,
                    rise: 30.0,
                    ..Bestel::ventricle(2e4)
                }),
            };
            activations.push((number, activation));
        }
    }
    Muscle { foundations: foundations.into(), activations, ..Muscle::unloaded(solid, parameters) }
}

/// Returns both kinds of stress, with and without dependence on the velocity.
pub(crate) fn viscous() -> [AddedStress; 2] {
    [
        AddedStress { active: Some(HILL), viscosity: 40.0 },
        AddedStress { active: Some(ActiveStress::PLAIN), viscosity: 90.0 },
    ]
}

/// Active stresses with an energy.
pub(crate) fn elastic() -> [AddedStress; 2] {
    let active = [ActiveStress { force_velocity: None, ..HILL }, ActiveStress::PLAIN];
    active.map(|active| AddedStress { active: Some(active), viscosity: 0.0 })
}

pub(crate) fn neo_hooke(shear_modulus: f64) -> Law {
    Law::MooneyRivlin { c10: 0.5 * shear_modulus, c01: 0.0 }
}

/// Returns a contracting block whose halves differ in κ, α and β and have separate pressures.
pub(crate) fn graded(dimension: usize, kappa: f64, beta: f64) -> Muscle {
    let plain = contracting(dimension, kappa, beta, elastic());
    let mesh = block(dimension);
    let halves = halves(&mesh);
    let mut region = vec![0; mesh.n_elements()];
    for &element in &halves[1] {
        region[element] = 1;
    }
    let own = [
        Parameters::new(1.0, beta, 0.3 * kappa).unwrap(),
        Parameters::new(7.0, 0.4 * beta, kappa).unwrap(),
    ];
    let space = Space::taylor_hood(&mesh).with_regions(&region).unwrap();
    let dofs = plain.solid.dofs().clone();
    let stresses = halves.into_iter().zip(elastic());
    let solid = Solid::uniform(Arc::new(space), dofs, paper::LAW, paper::DENSITY)
        .unwrap()
        .with_added_stresses(&stresses.collect::<Vec<_>>())
        .unwrap();
    let elements: Vec<Parameters> = region.iter().map(|&region| own[region]).collect();
    Muscle {
        foundations: plain.foundations,
        activations: plain.activations,
        ..Muscle::graded(solid, &elements).unwrap()
    }
}
