//! Tests of the viscoelastic overstress at points, and of batched evaluations.

use std::slice;
use std::sync::Arc;

use myovib_fem::material::{Prony, PronyTerm};
use myovib_fem::{DofMap, ElementPoint, Fields, Pressure, Solid, Space, generate};

use crate::common::{DENSITY, MUSCLE_LAW, random};

/// Magnitude of the strains. It is also the relative error of a linear stress.
const SIZE: f64 = 1e-5;

/// Returns a quadratic displacement. Its strains are linear in space with nonzero slopes.
fn displacement(x: &[f64]) -> Vec<f64> {
    let z = x.get(2).copied().unwrap_or(0.3);
    let all = [
        x[0] * x[0] + 0.7 * x[0] * x[1] - z * x[1],
        0.4 * x[0] * x[0] - 0.5 * x[1] * x[1] + 0.3 * z * z,
        0.2 * z * z + x[0] * x[1] - 0.6 * x[0] * z,
    ];
    all[..x.len()].iter().map(|u| SIZE * u).collect()
}

#[test]
fn overstress_has_the_limits_of_equilibrium_and_instantaneous_response() {
    for dimension in [2, 3] {
        let mesh = match dimension {
            2 => generate::rectangle([0.0; 2], [1.0, 0.8], [3, 2]).unwrap(),
            _ => generate::block([0.0; 3], [1.0, 0.8, 0.6], [2, 1, 1]).unwrap(),
        };
        let space = Arc::new(Space::taylor_hood(&mesh));
        let u: Vec<f64> = match dimension {
            2 => space.node_points::<2>().iter().flat_map(|x| displacement(x)).collect(),
            _ => space.node_points::<3>().iter().flat_map(|x| displacement(x)).collect(),
        };
        let dofs = DofMap::new(&space, &[]).unwrap();
        let term = |weight, time| PronyTerm { weight, time };
        // Elements alternate between two terms, one term and no terms.
        let series = [vec![term(0.5, 0.1), term(0.3, 0.2)], vec![term(0.7, 0.1)]];
        let every = |first| (first..mesh.n_elements()).step_by(3).collect();
        let regions = [0, 1].map(|k| (every(k), Prony::new(series[k].clone()).unwrap()));
        let solid = Solid::uniform(space, dofs, MUSCLE_LAW, DENSITY).unwrap();
        let solid = solid.with_relaxation(&regions).unwrap();
        let internal = solid.equilibrium_overstress(&u);
        // Without pressure and for small strains, P = S.
        let fields = Fields::new(&u, Pressure::Penalty { kappa: 0.0 });
        let scale = internal.iter().fold(0.0, |max: f64, q| max.max(q.abs()));
        for element in 0..mesh.n_elements() {
            for barycentric in mesh.shape().nodes(solid.space().degree()) {
                let at = ElementPoint { element, barycentric };
                let read = |internal: &[f64]| solid.overstress_at(&u, internal, &at);
                let Some(weight) = [0.8, 0.7].get(element % 3) else {
                    assert!(read(&internal).is_none(), "{element}");
                    continue;
                };
                for entry in read(&internal).unwrap().iter().flatten() {
                    // The error is the rounding of sums over about fifteen points.
                    assert!(entry.abs() < 1e-13 * scale, "{element}: {entry:e}");
                }
                let instantaneous = read(&vec![0.0; internal.len()]).unwrap();
                let law = solid.state_at(&fields, &at).piola;
                let entries = instantaneous.iter().flatten().zip(law.iter().flatten());
                for (found, law) in entries {
                    // The error is due to the nonlinear terms of strains up to three times `SIZE`.
                    let error = (found - weight * law).abs();
                    assert!(error < 20.0 * SIZE * scale, "{dimension} {element}: {error:e}");
                }
            }
        }
    }
}

/// For many velocities, rates are computed from the moduli of the law; for few velocities, they are computed
/// separately. Forces are always computed in the same way.
#[test]
fn batched_rates_and_forces_equal_single_ones() {
    for dimension in [2, 3] {
        let mesh = match dimension {
            2 => generate::rectangle([0.0; 2], [1.0, 0.8], [3, 2]).unwrap(),
            _ => generate::block([0.0; 3], [1.0, 0.8, 0.6], [2, 1, 1]).unwrap(),
        };
        let space = Arc::new(Space::taylor_hood(&mesh));
        let dofs = DofMap::new(&space, &[]).unwrap();
        let (law, n) = (MUSCLE_LAW, dofs.n_full());
        let prony = Prony::new(vec![PronyTerm { weight: 0.5, time: 0.1 }]).unwrap();
        let every = (0..mesh.n_elements()).collect();
        let solid = Solid::uniform(space, dofs, law, DENSITY).unwrap();
        let solid = solid.with_relaxation(&[(every, prony)]).unwrap();
        // The displacement is so large that F differs significantly from I.
        let u = random(n, 0.02, 1);
        let all: Vec<_> = (2..10).map(|seed| random(n, 1.0, seed)).collect();
        let empty = |length: usize| vec![vec![0.0; length]; all.len()];
        let (mut rates, mut forces) = (empty(solid.n_slots()), empty(n));
        solid.driving_stress_rates(&u, &all, &mut rates);
        solid.tensor_forces(&u, &rates, &mut forces);
        for (k, v) in all.iter().enumerate() {
            let mut alone = [vec![0.0; solid.n_slots()]];
            solid.driving_stress_rates(&u, slice::from_ref(v), &mut alone);
            let size = alone[0].iter().fold(0.0, |max: f64, s| max.max(s.abs()));
            for (batched, alone) in rates[k].iter().zip(&alone[0]) {
                // The error is a few roundings of sums of six terms, each of which is at most of this size.
                let error = (batched - alone).abs();
                assert!(error <= 64.0 * f64::EPSILON * size, "{dimension} {k}: {error:e}");
            }
            let mut force = [vec![0.0; n]];
            solid.tensor_forces(&u, slice::from_ref(&rates[k]), &mut force);
            assert_eq!(force[0], forces[k]);
        }
    }
}
