//! Tests of the power of each element, compared with the forces and with differences of the energy.

use std::collections::BTreeMap;
use std::sync::Arc;

use myovib_fem::{
    DofMap, ElementScale, Fibers, Fields, Law, Pressure, Solid, Space, Vectors, generate,
};

use crate::common::{DENSITY, MUSCLE_LAW, SMALL_LAW, random};

const HEART: Law = Law::Guccione { c: 2e3, b_f: 8.0, b_t: 2.0, b_fs: 4.0 };

/// Returns a body with curved and straight elements, three laws (one with fibers) and scaled damping.
fn body(dimension: usize) -> Solid {
    let (mesh, edge, midside) = match dimension {
        2 => {
            let mesh = generate::rectangle([0.0; 2], [1.5, 1.0], [2, 2]).unwrap();
            (mesh, [0, 1], vec![0.41, -0.05])
        }
        _ => {
            let mesh = generate::block([0.0; 3], [1.5, 1.0, 0.8], [2, 1, 1]).unwrap();
            (mesh, [0, 4], vec![0.41, 0.53, -0.05])
        }
    };
    let mesh = match *midside {
        [x, y] => mesh.with_midside_nodes(BTreeMap::from([(edge, [x, y])])),
        [x, y, z] => mesh.with_midside_nodes(BTreeMap::from([(edge, [x, y, z])])),
        _ => unreachable!(),
    };
    let mesh = mesh.unwrap();
    let n = mesh.n_elements();
    let all: Vec<usize> = (0..n).collect();
    let mut fibers = Fibers::new(&mesh);
    fibers.set_constant(&mesh, &all, [0.6, 0.8, 0.0], None).unwrap();
    let space = Arc::new(Space::taylor_hood(&mesh));
    assert!((0..n).any(|e| space.is_curved(e)) && !(0..n).all(|e| space.is_curved(e)));
    let dofs = DofMap::new(&space, &[(0, 0), (0, 1)]).unwrap();
    let laws = [HEART, SMALL_LAW, MUSCLE_LAW];
    let laws = (0..n).map(|e| laws[e % 3]).collect();
    let scale = ElementScale { beta: 3.0, ..ElementScale::ONE };
    let solid = Solid::new(space, dofs, laws, DENSITY).unwrap();
    let solid = solid.with_element_scales(&vec![scale; n]).unwrap();
    solid.with_fibers(fibers)
}

#[test]
fn element_powers_match_forces_and_energy_differences() {
    for dimension in [2, 3] {
        let solid = body(dimension);
        let (n, n_elements) = (solid.space().n_components(), solid.space().n_elements());
        let [u, v, w] = [(0.02, 1), (1.0, 2), (0.02, 3)].map(|(size, seed)| random(n, size, seed));
        let none = vec![0.0; solid.space().n_pressures()];
        let powers = |beta: f64, pressure| {
            let mut powers = vec![2.0; n_elements];
            let fields = Fields { v: Some(&v), ..Fields::new(&u, pressure) };
            solid.add_powers(&fields, beta, &w, &mut powers).unwrap();
            powers.iter().map(|sum| sum - 2.0).collect::<Vec<f64>>()
        };
        let elastic = powers(0.0, Pressure::Nodal(&none));
        let damped = powers(0.3, Pressure::Nodal(&none));
        // Neither the penalty nor the pressure contributes to the power.
        assert_eq!(damped, powers(0.3, Pressure::Penalty { kappa: 1e5 }));
        let pressures = vec![1e3; none.len()];
        assert_eq!(damped, powers(0.3, Pressure::Nodal(&pressures)));
        let largest = |values: &[f64]| values.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
        for element in 0..n_elements {
            // The law contributes in this element only.
            let n_corners = dimension + 1;
            let mut factors = vec![0.0; n_corners * n_elements];
            factors[n_corners * element..][..n_corners].fill(1.0);
            let (mut force, mut rate) = (vec![0.0; n], vec![0.0; n]);
            let mut out = Vectors {
                force: Some(&mut force),
                force_rate: Some(&mut rate),
                ..Vectors::default()
            };
            let fields = Fields {
                v: Some(&v),
                factors: Some(&factors),
                ..Fields::new(&u, Pressure::Nodal(&none))
            };
            solid.evaluate(&fields, &mut out).unwrap();
            let power_of = |force: &[f64]| force.iter().zip(&w).map(|(f, w)| f * w).sum::<f64>();
            let expected = [power_of(&force), power_of(&force) + 0.3 * power_of(&rate)];
            for (powers, expected) in [&elastic, &damped].into_iter().zip(expected) {
                // About a thousand terms are summed in two different orders. The power of an element may be a
                // hundredth of the largest power.
                let error = (powers[element] - expected).abs();
                assert!(error < 1e-12 * largest(powers), "{element}: {error:e}");
            }
            let energy = |s: f64| {
                let u: Vec<f64> = u.iter().zip(&w).map(|(u, w)| u + s * w).collect();
                solid.strain_energy(&Fields { u: &u, ..fields })
            };
            // The error is the square of the step times the change of the slopes over a motion with a few percent
            // strain.
            let slope = (energy(1e-4) - energy(-1e-4)) / 2e-4;
            let error = (elastic[element] - slope).abs();
            assert!(error < 1e-6 * largest(&elastic), "{element}: {error:e}");
        }
    }
}

#[test]
fn inverted_elements_are_errors() {
    for dimension in [2, 3] {
        let solid = body(dimension);
        // F = diag(−1, 1, …).
        let coordinates = solid.space().coordinates().chunks(dimension);
        let u: Vec<f64> = coordinates
            .flat_map(|x| (0..dimension).map(|i| if i == 0 { -2.0 * x[0] } else { 0.0 }))
            .collect();
        let fields = Fields::new(&u, Pressure::Penalty { kappa: 0.0 });
        let mut powers = vec![0.0; solid.space().n_elements()];
        let inverted = solid.add_powers(&fields, 0.0, &u, &mut powers).unwrap_err();
        // The error is the rounding of sums of a dozen products.
        assert!((inverted.jacobian + 1.0).abs() < 1e-13, "{inverted}");
    }
}
