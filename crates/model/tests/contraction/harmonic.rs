//! Harmonic response of contracted bodies under pressure: the full equations of all formulations have the same
//! amplitudes as the reduced symmetric system.

use std::f64::consts::TAU;

use myovib_fem::load;
use myovib_model::harmonic::{
    Amplitude, DynamicStiffness, Excitation, HarmonicResponse, Neighbors,
};
use myovib_model::sensitivity::Stencil;
use myovib_model::statics::equilibrium;
use myovib_model::{
    Activation, Field, Formulation, Load, ModelError, Muscle, MuscleDae, Signal, SurfaceLoad,
};
use myovib_structure::harmonic_response;
use num_complex::Complex64;

use crate::common::{INF, contracting, graded, viscous};

const FORMULATIONS: [Formulation; 6] = [
    Formulation::Displacement,
    Formulation::Position,
    Formulation::Rate,
    Formulation::Velocity,
    Formulation::Stabilized,
    Formulation::ImplicitRate,
];
/// Hz; between the lowest modes.
const FREQUENCY: f64 = 2.3;

/// Adds prescribed tensions, a traction, and a follower pressure on the top.
fn loaded(mut muscle: Muscle, pressure: Option<f64>) -> Muscle {
    let given = |number, tension| (number, Activation::Given(Signal::constant(tension)));
    muscle.activations = vec![given(0, 2e3), given(1, 1e3)];
    muscle.loads = vec![Load::new(&pull(&muscle), Signal::constant(10.0))];
    let load = pressure
        .map(|size| SurfaceLoad::pressure(&muscle.solid, "top", Signal::constant(size)).unwrap());
    muscle.surface_loads = load.into_iter().collect();
    muscle
}

fn pull(muscle: &Muscle) -> Vec<f64> {
    let space = muscle.solid.space();
    match space.dimension() {
        2 => load::traction(space, "right", [1.0, 3.0]),
        _ => load::traction(space, "right", [1.0, 3.0, -2.0]),
    }
    .unwrap()
}

/// Returns a harmonic traction out of phase with a harmonic pressure.
fn drive(muscle: &Muscle) -> Excitation {
    let force = pull(muscle).into_iter().map(Complex64::from).collect();
    let unit = SurfaceLoad::pressure(&muscle.solid, "top", Signal::constant(1.0)).unwrap();
    Excitation {
        force,
        surface_loads: vec![(unit, Complex64::new(0.5, -2.0))],
        displacement: Vec::new(),
    }
}

fn solve(response: &HarmonicResponse) -> Amplitude {
    let read = |found: &Amplitude| Ok::<_, ModelError>(found.clone());
    response.map(&[FREQUENCY], read).unwrap().remove(0).1
}

fn largest(values: &[Complex64]) -> f64 {
    values.iter().map(|z| z.norm()).fold(0.0, f64::max)
}

/// Compares the reduced system with the linearized equations of each formulation.
fn expect_the_equations(muscle: &Muscle) {
    for formulation in FORMULATIONS {
        if formulation.check(&muscle.parameters).is_err() {
            continue;
        }
        let at = equilibrium(muscle, formulation, 0.0).unwrap();
        let drive = drive(muscle);
        let response = HarmonicResponse::about(muscle, formulation, &at, &drive).unwrap();
        let found = solve(&response);

        let mut dae = MuscleDae::new(muscle.clone(), formulation).unwrap();
        let layout = dae.layout().clone();
        let range = |field| layout.range(field).unwrap_or_default();
        let mut y = vec![0.0; layout.n_unknowns()];
        y[range(Field::Displacement)].copy_from_slice(&at.displacement);
        y[range(Field::Pressure)].copy_from_slice(&at.pressure);
        let dofs = muscle.solid.dofs();
        let mut moved = vec![0.0; dofs.n_full()];
        dofs.expand(&at.displacement, &mut moved);
        let (unit, amplitude) = &drive.surface_loads[0];
        let mut pressure = vec![0.0; moved.len()];
        unit.add_at(0.0, 1.0, &moved, &mut pressure);
        let mut expected = vec![Complex64::ZERO; y.len()];
        for (row, &i) in expected[range(Field::Velocity)].iter_mut().zip(dofs.free_to_full()) {
            *row = drive.force[i] + amplitude * pressure[i];
        }
        let s = Complex64::new(0.0, TAU * FREQUENCY);
        harmonic_response(&mut dae, (0.0, &y), s, &mut expected).unwrap();
        let free = dofs.free_to_full().iter();
        let pairs = free.map(|&i| found.displacement[i]).zip(&expected[range(Field::Displacement)]);
        let error = pairs.map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
        let scale = largest(&found.displacement);
        // The solutions are refined to a backward error of 1e-12; the condition number is about 100.
        assert!(error < 1e-10 * scale, "{formulation:?}: {error:e} of {scale:e}");
        let pairs = found.pressure.iter().zip(&expected[range(Field::Pressure)]);
        let error = pairs.map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
        let scale = largest(&found.pressure);
        assert!(error <= 1e-9 * scale, "{formulation:?}: {error:e} of {scale:e}");
    }
}

#[test]
fn all_formulations_have_the_same_response() {
    for (dimension, kappa, beta) in [
        (2, 1e5, 0.0),
        (2, 1e5, 1e-3),
        (2, INF, 0.0),
        (2, INF, 1e-3),
        (3, 1e5, 1e-3),
        (3, INF, 0.0),
    ] {
        let muscle = contracting(dimension, kappa, beta, viscous());
        expect_the_equations(&loaded(muscle.clone(), None));
        expect_the_equations(&loaded(muscle, Some(200.0)));
    }
    expect_the_equations(&loaded(graded(2, 1e5, 1e-3), None));
}

/// The operator on all nodal components balances the solution of the matrix, so the reactions at
/// free components are zero; the reactions at the supports balance inertia, foundations and loads.
#[test]
fn shaken_supports_leave_no_force_at_free_components() {
    for (dimension, kappa, beta, pressure) in
        [(2, 1e5, 1e-3, Some(200.0)), (2, INF, 0.0, None), (3, INF, 1e-3, Some(200.0))]
    {
        let muscle = loaded(contracting(dimension, kappa, beta, viscous()), pressure);
        let at = equilibrium(&muscle, Formulation::Position, 0.0).unwrap();
        let shaken = muscle.solid.space().nodes_of("left").unwrap();
        let amplitude = Complex64::new(1e-3, 2e-3);
        let drive = Excitation {
            displacement: shaken.iter().map(|node| (dimension * node + 1, amplitude)).collect(),
            ..drive(&muscle)
        };
        let response =
            HarmonicResponse::about(&muscle, Formulation::Position, &at, &drive).unwrap();
        let found = solve(&response);
        assert_eq!(found.displacement[dimension * shaken[0] + 1], amplitude);
        let forces = response.stiffness().reactions(&found).unwrap();
        let free = muscle.solid.dofs().free_to_full();
        let unbalanced: Vec<_> = free.iter().map(|&i| forces[i]).collect();
        // Central differences of active stress and pressure have an error of 1e-10.
        let [unbalanced, largest] = [largest(&unbalanced), largest(&forces)];
        assert!(unbalanced < 1e-9 * largest, "{unbalanced:e} of {largest:e}");
    }
}

/// Derivatives use the factors of the response: each costs one solve for each frequency, independently of the number of
/// outputs.
#[test]
fn derivatives_add_no_factorizations() {
    let (formulation, frequencies) = (Formulation::ImplicitRate, [1.0, FREQUENCY, 4.0]);
    let muscle = loaded(contracting(2, 1e5, 1e-3, viscous()), Some(200.0));
    let drive = drive(&muscle);
    let at = equilibrium(&muscle, formulation, 0.0).unwrap();
    let neighbors = |_| {
        let step = 1e-3 * muscle.parameters.beta;
        let body = |(distance, _): &(f64, f64)| {
            let mut near = muscle.clone();
            near.parameters.beta += distance * step;
            DynamicStiffness::about(&near, formulation, &at, &drive).unwrap()
        };
        let bodies = Stencil::Central.points().iter().map(body);
        Neighbors::new(Stencil::Central, step, bodies.collect())
    };
    for n_parameters in [0, 1, 5, 20] {
        let response = HarmonicResponse::about(&muscle, formulation, &at, &drive).unwrap();
        let neighbors: Vec<Neighbors> = (0..n_parameters).map(neighbors).collect();
        let read =
            |_: &Amplitude, derivatives: &[Amplitude]| Ok::<_, ModelError>(derivatives.len());
        let found = response.map_with_derivatives(&frequencies, &neighbors, read).unwrap();
        assert!(found.iter().all(|(_, count)| *count == n_parameters));
        assert_eq!(response.work(), [3, 3 * (1 + n_parameters as u64)]);
    }
}
