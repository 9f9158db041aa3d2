//! Tests of the derivatives of contact forces, and of forces with closed forms.

use std::sync::Arc;

use super::*;
use crate::dofs::DofMap;
use crate::material::Law;
use crate::mesh::generate;
use crate::space::Space;

const STRETCH: f64 = 1e-3;

fn block(dimension: usize) -> Solid {
    let mesh = match dimension {
        2 => generate::rectangle([0.0; 2], [0.1; 2], [2, 2]).unwrap(),
        _ => generate::block([0.0; 3], [0.1; 3], [2, 2, 2]).unwrap(),
    };
    let space = Arc::new(Space::taylor_hood(&mesh));
    let dofs = DofMap::clamped(&space, &[]).unwrap();
    let law = Law::MooneyRivlin { c10: 1e4, c01: 0.0 };
    Solid::uniform(space, dofs, law, 1e3).unwrap()
}

fn obstacles(dimension: usize) -> Vec<Obstacle> {
    let (center, normal) = match dimension {
        2 => ([0.04, 0.13, 0.0], [0.6, -0.8, 0.0]),
        _ => ([0.04, 0.05, 0.13], [0.0, 0.6, -0.8]),
    };
    let mut all = vec![
        Obstacle::Plane { point: center.map(|x| 0.75 * x), normal },
        Obstacle::Sphere { center, radius: 0.05 },
    ];
    if dimension == 3 {
        all.push(Obstacle::Cylinder { point: center, axis: [0.8, 0.6, 0.0], radius: 0.05 });
    }
    all
}

/// Returns contacts of the top of `solid` with each obstacle, without and with multipliers. Multipliers press on
/// some points before these touch the obstacle.
fn contacts(solid: &Solid, stiffness: Option<f64>) -> Vec<(Obstacle, RigidContact)> {
    let mut all = Vec::new();
    for obstacle in obstacles(solid.space().dimension()) {
        let contact = RigidContact::new(solid, "top", obstacle, stiffness).unwrap();
        let depths = (0..contact.n_points()).map(|i| STRETCH * (0.7 * i as f64).sin().abs());
        let mut augmented = contact.clone();
        augmented.set_depths(depths.collect());
        all.extend([(obstacle, contact), (obstacle, augmented)]);
    }
    all
}

/// A deformation without symmetry.
fn deformed(solid: &Solid) -> Vec<f64> {
    let n = solid.dofs().n_full();
    (0..n).map(|i| STRETCH * (1.3 * i as f64).sin()).collect()
}

/// Checks that the stiffness is the derivative of the force. Forces of 10 N have a rounding error of 1e-15. Their
/// quotients by 1e-8 m therefore have errors of 1e-6 N/m, for stiffnesses above 1e3 N/m.
#[test]
fn the_stiffness_is_the_derivative_of_the_force() {
    for dimension in [2, 3] {
        let solid = block(dimension);
        let u = deformed(&solid);
        for (obstacle, contact) in contacts(&solid, None) {
            let offset = [2e-3, -1e-3, 1e-3];
            let pattern = solid.displacement_pattern();
            let mut values = vec![0.0; pattern.nnz()];
            contact.add_stiffness(&offset, &u, &mut values);
            let force = |u: &[f64]| {
                let mut force = vec![0.0; u.len()];
                contact.add_force(&offset, 1.0, u, &mut force);
                force
            };
            assert!(force(&u).iter().any(|f| *f != 0.0), "{obstacle:?}");
            let scale = values.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
            let mut starts = 0;
            for column in 0..u.len() {
                let step = 1e-8;
                let shifted = |step: f64| {
                    let mut u = u.clone();
                    u[column] += step;
                    force(&u)
                };
                let (plus, minus) = (shifted(step), shifted(-step));
                for &row in pattern.lane(column) {
                    let difference = (plus[row] - minus[row]) / (2.0 * step);
                    let found = values[starts];
                    starts += 1;
                    assert!(
                        (found - difference).abs() < 1e-7 * scale,
                        "{obstacle:?} {row} {column}: {found} {difference}"
                    );
                }
            }
        }
    }
}

/// Checks that nodal forces add up to the sums, and that the pressure of a flat contact follows from its
/// penetration.
#[test]
fn a_plane_presses_with_the_pressure_of_its_penetration() {
    for dimension in [2, 3] {
        let solid = block(dimension);
        let up = dimension - 1;
        let (mut point, mut normal) = ([0.0; 3], [0.0; 3]);
        (point[up], normal[up]) = (0.1, -1.0);
        let plane = Obstacle::Plane { point, normal };
        let contact = RigidContact::new(&solid, "top", plane, Some(1e6)).unwrap();
        let u = vec![0.0; solid.dofs().n_full()];
        let mut offset = [0.0; 3];
        offset[up] = -1e-3;
        let sums = contact.sums(&offset, &u);
        let area = 0.1_f64.powi(up as i32);
        // The full stiffness is reached at a thousandth of the size of a facet.
        let size = if dimension == 2 { 0.05 } else { 0.05 / 2_f64.sqrt() };
        let expected = -1e6 * (1e-3 - 0.5e-3 * size) * area;
        assert!((sums.force[up] - expected).abs() < 1e-12 * expected.abs());
        assert!((contact.area(&offset, &u) - area).abs() < 1e-14);
        assert!((sums.penetration - 1e-3).abs() < 1e-15);
        let mut total = vec![0.0; u.len()];
        contact.add_force(&offset, 1.0, &u, &mut total);
        let sum: f64 = total.iter().skip(up).step_by(dimension).sum();
        assert!((sum - expected).abs() < 1e-12 * expected.abs());
    }
}

/// Checks that the derivatives of the force of a driven obstacle agree with difference quotients, and that the
/// displacement of the obstacle balances its force. The quotients have the errors stated above.
#[test]
fn a_driven_obstacle_balances_its_force() {
    for dimension in [2, 3] {
        let solid = block(dimension);
        let u = deformed(&solid);
        let mut direction = vec![0.6; dimension];
        direction[0] = 0.0;
        direction[dimension - 1] = if dimension == 2 { -1.0 } else { -0.8 };
        for (obstacle, contact) in contacts(&solid, None) {
            let force_at = |s: f64, u: &[f64]| {
                let offset: Vec<f64> = direction.iter().map(|e| s * e).collect();
                let force = contact.sums(&offset, u).force;
                direction.iter().zip(force).map(|(e, f)| e * f).sum::<f64>()
            };
            let touching = contact.displacement_under(0.0, &direction, &u);
            assert_eq!(force_at(touching - 1e-9, &u), 0.0);
            let distance = touching + 2e-3;
            let force = force_at(distance, &u);
            let found = contact.displacement_under(force, &direction, &u);
            assert!((found - distance).abs() < 1e-13, "{obstacle:?}: {found}");
            let too_large = contact.displacement_under(1e300, &direction, &u);
            assert!(too_large.is_nan(), "{obstacle:?}: {too_large}");
            let slope = contact.driven_slope(&direction, distance, &u);
            let step = 1e-8;
            let quotient = |plus: f64, minus: f64| (plus - minus) / (2.0 * step);
            let by_obstacle =
                quotient(force_at(distance + step, &u), force_at(distance - step, &u));
            let error = (slope.by_obstacle - by_obstacle).abs();
            assert!(error < 1e-6 * by_obstacle, "{obstacle:?}: {error:e}");
            for (i, by_node) in slope.by_nodes.iter().enumerate() {
                let at = |change: f64| {
                    let mut u = u.clone();
                    u[i] += change;
                    force_at(distance, &u)
                };
                let error = (by_node - quotient(at(step), at(-step))).abs();
                assert!(error < 1e-6 * by_obstacle, "{obstacle:?} {i}: {error:e}");
            }
        }
    }
}

/// Checks that the force on the body is the negative derivative of the stored energy with respect to the motion of
/// the body: the energy changes by −f·du. The difference quotient has the errors stated above. When an obstacle
/// closes and opens the contact, the energy changes by the work of the obstacle.
#[test]
fn the_force_is_the_derivative_of_the_energy() {
    for dimension in [2, 3] {
        let solid = block(dimension);
        let u = deformed(&solid);
        let offset = [2e-3, -1e-3, 1e-3];
        for (obstacle, contact) in contacts(&solid, None) {
            let mut force = vec![0.0; u.len()];
            contact.add_force(&offset, 1.0, &u, &mut force);
            let largest = force.iter().fold(0.0_f64, |m, f| m.max(f.abs()));
            for (i, f) in force.iter().enumerate() {
                let at = |change: f64| {
                    let mut u = u.clone();
                    u[i] += change;
                    contact.sums(&offset, &u).energy
                };
                let quotient = (at(1e-8) - at(-1e-8)) / 2e-8;
                assert!((f + quotient).abs() < 1e-6 * largest, "{obstacle:?} {i}");
            }
            // The obstacle moves from an open contact to a closed contact.
            let (from, to, n) = (0.05, -0.01, 6000);
            let h = (to - from) / f64::from(n);
            let sums = |i: i32| {
                let mut offset = vec![0.0; dimension];
                offset[dimension - 1] = from + h * f64::from(i);
                contact.sums(&offset, &u)
            };
            let ends = 0.5 * (sums(0).force[dimension - 1] + sums(n).force[dimension - 1]);
            let inside: f64 = (1..n).map(|i| sums(i).force[dimension - 1]).sum();
            let (work, growth) = (h * (ends + inside), sums(n).energy - sums(0).energy);
            // Error of the trapezoidal rule: the second derivative of the force is at most k/w times the area.
            let k_by_w = contact.stiffness() / contact.smoothing;
            let area = 0.1_f64.powi(dimension as i32 - 1);
            let bound = (to - from).abs() * h * h / 12.0 * k_by_w * area;
            assert!((growth - work).abs() < bound, "{obstacle:?}: {growth} {work} {bound:e}");
        }
    }
}

/// Checks the slopes of friction, the sums of its forces, and that the force during a long slip is μ times the
/// normal force. The difference quotients have the same errors as for the stiffness.
#[test]
fn the_slopes_of_friction_are_its_derivatives() {
    let friction = Friction { coefficient: 0.4, slip_velocity: 0.02 };
    let (offset, velocity) = ([2e-3, -1e-3, 1e-3], [0.05, -0.02, 0.03]);
    for dimension in [2, 3] {
        let solid = block(dimension);
        let (u, n) = (deformed(&solid), solid.dofs().n_full());
        let v: Vec<f64> = (0..n).map(|i| 0.04 * (2.1 * i as f64).cos()).collect();
        let pattern = solid.displacement_pattern();
        for (obstacle, contact) in contacts(&solid, Some(1e6)) {
            let at = |u: &[f64], v: &[f64]| {
                let mut force = vec![0.0; n];
                let (offset, velocity) = (&offset[..], &velocity[..]);
                let sliding = Sliding { offset, velocity, u, v };
                contact.add_friction(&friction, &sliding, &mut force);
                let sums = contact.friction_sums(&friction, &sliding);
                (force, sums)
            };
            let mut slopes = [(); 2].map(|()| vec![0.0; pattern.nnz()]);
            let [by_u, by_v] = &mut slopes;
            let sliding = Sliding { offset: &offset, velocity: &velocity, u: &u, v: &v };
            contact.add_friction_slopes(&friction, &sliding, [by_u, by_v]);
            for (which, values) in slopes.iter().enumerate() {
                let scale = values.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
                assert!(scale > 0.0, "{obstacle:?}");
                let quotients = (0..n).flat_map(|column| {
                    let shifted = |step: f64| {
                        let mut motion = [u.clone(), v.clone()];
                        motion[which][column] += step;
                        at(&motion[0], &motion[1]).0
                    };
                    let (plus, minus) = (shifted(1e-8), shifted(-1e-8));
                    let rows = pattern.lane(column).iter();
                    rows.map(move |&row| (plus[row] - minus[row]) / 2e-8)
                });
                for (found, quotient) in values.iter().zip(quotients) {
                    let error = (found - quotient).abs();
                    assert!(error < 1e-6 * scale, "{obstacle:?} {which}: {error:e}");
                }
            }
            let (force, sums) = at(&u, &v);
            for axis in 0..dimension {
                let sum: f64 = force.iter().skip(axis).step_by(dimension).sum();
                assert!((sum - sums.force[axis]).abs() < 1e-12, "{obstacle:?}");
            }
            // In 2D and 3D, the power dissipated by friction is the force times the relative velocity.
            let relative = v.iter().enumerate().map(|(i, v)| v - velocity[i % dimension]);
            let power: f64 = force.iter().zip(relative).map(|(f, v)| f * v).sum();
            assert!((power - sums.dissipation).abs() < 1e-12 && power > 0.0);
            if let Obstacle::Plane { normal, .. } = obstacle {
                let mut fast = [-1e6 * normal[1], 1e6 * normal[0], 0.0];
                if dimension == 3 {
                    fast = [1e6, 0.0, 0.0];
                }
                let sliding = Sliding { velocity: &fast, ..sliding };
                let [tangential, normal] = [
                    contact.friction_sums(&friction, &sliding).force,
                    contact.sums(&offset, &u).force,
                ]
                .map(|force| dot(&force, &force).sqrt());
                assert!((tangential / (0.4 * normal) - 1.0).abs() < 1e-12);
            }
        }
    }
}

/// A body that only touches an obstacle has no contact area, although rounding moves points into the obstacle.
#[test]
fn an_obstacle_that_only_touches_has_no_contact_area() {
    for dimension in [2, 3] {
        let solid = block(dimension);
        let obstacle = match dimension {
            2 => Obstacle::Plane { point: [0.0, 0.1, 0.0], normal: [0.0, -1.0, 0.0] },
            _ => Obstacle::Plane { point: [0.0, 0.0, 0.1], normal: [0.0, 0.0, -1.0] },
        };
        let contact = RigidContact::new(&solid, "top", obstacle, None).unwrap();
        let mut u = vec![0.0; solid.dofs().n_full()];
        let mut area = |lift: f64| {
            u.iter_mut().skip(dimension - 1).step_by(dimension).for_each(|u| *u = lift);
            contact.area(&[0.0; 3], &u)
        };
        assert_eq!([area(0.0), area(1e-17)], [0.0; 2]);
        // At a penetration of 1e-6 of the facet size, the whole group with side length 0.1 m is in contact. The
        // sum of 16 weights has a rounding error below 16 ε.
        let whole = 0.1_f64.powi(dimension as i32 - 1);
        assert!((area(5e-8) / whole - 1.0).abs() < 16.0 * f64::EPSILON, "{}", area(5e-8));
    }
}

/// Points between pressed points are in contact if their gap is below a twentieth of a facet and small for the
/// pressure and the shear modulus. A plane presses on the middle nodes of the facets, and the vertices are at the
/// distance `gap`.
#[test]
fn the_contact_area_includes_points_between_pressed_points() {
    for dimension in [2, 3] {
        let (up, solid) = (dimension - 1, block(dimension));
        let (mut point, mut normal) = ([0.0; 3], [0.0; 3]);
        (point[up], normal[up]) = (0.1, -1.0);
        let obstacle = Obstacle::Plane { point, normal };
        let area = |solid: &Solid, stiffness: f64, gap: f64| {
            let mut contact = RigidContact::new(solid, "top", obstacle, None).unwrap();
            contact.stiffness *= stiffness;
            let size = contact.facet_size();
            let mut u = vec![0.0; solid.dofs().n_full()];
            for nodes in &contact.boundary.facets {
                let (vertices, middles) = nodes.split_at(dimension);
                vertices.iter().for_each(|node| u[dimension * node + up] = -gap * size);
                middles.iter().for_each(|node| u[dimension * node + up] = 3e-4 * size);
            }
            contact.area(&[0.0; 3], &u) / 0.1_f64.powi(dimension as i32 - 1)
        };
        // At a small pressure, the gap of some points is too large.
        let pressed = area(&solid, 1e-6, 1e-3);
        assert!(pressed > 0.4 && pressed < 0.9, "{pressed}");
        // The sum of 96 weights has a rounding error below 96 ε.
        let rounding = 96.0 * f64::EPSILON;
        let all = area(&solid, 64.0, 1e-3);
        assert!((all - 1.0).abs() < rounding, "{all}");
        // The pressure on the middle nodes is many shear moduli, but the vertices are far from the plane.
        let far = area(&solid, 64.0, 0.2);
        assert!((far - pressed).abs() < rounding, "{far} {pressed}");
        // In the half with a large shear modulus, these gaps are too large.
        let space = solid.space();
        let factors = (0..space.n_elements()).flat_map(|element| {
            let vertices = space.mesh().element(element);
            let at = |vertex: usize| space.coordinates()[dimension * vertex];
            let x: f64 = vertices.iter().map(|&vertex| at(vertex)).sum();
            vec![if x < 0.05 * vertices.len() as f64 { 1.0 } else { 1e9 }; vertices.len()]
        });
        let mixed = solid.clone().with_factors(factors.collect()).unwrap();
        let stiffness = 64e-9;
        let half = area(&mixed, stiffness, 1e-3);
        assert!((half - 0.5 * (1.0 + pressed)).abs() < rounding, "{half}");
    }
}
