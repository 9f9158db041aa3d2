//! Tests of the frame indifference of active, viscous and viscoelastic stress.
//!
//! Under a superposed rigid motion x* = Q(t) x + c(t), forces rotate with Q. Powers and quantities in the
//! reference configuration (S, internal stresses and the rates of both) are invariant.

use std::sync::Arc;

use myovib_fem::material::three::{Tensor3, product3};
use myovib_fem::material::{ActiveStress, ForceLength, ForceVelocity, Prony, PronyTerm, Tension};
use myovib_fem::output::{PointState, StressContext};
use myovib_fem::{
    AddedMotion, AddedStress, Barycentric, DofMap, ElementPoint, Fibers, Fields, Law, Pressure,
    Solid, Space, generate,
};

use crate::common::{DENSITY, MUSCLE_LAW, random};

const HEART: Law = Law::Guccione { c: 2e3, b_f: 8.0, b_t: 2.0, b_fs: 4.0 };
const TENSION: f64 = 3e3;
const VISCOSITY: f64 = 70.0;
/// Relative rounding error of sums of a few hundred products of rotated numbers, for elements half as large as u*.
const ROUNDING: f64 = 1e-12;

/// Returns a free body. Four added stresses alternate between elements: plain tension; nominal tension with a
/// parabola and Hill's curve; second Piola–Kirchhoff tension with a Gaussian, Hill's curve and viscosity;
/// viscosity alone. The body has two laws, one with fibers. Elements have Prony series with two, one or no terms.
fn body(dimension: usize, active: bool) -> Solid {
    let mesh = match dimension {
        2 => generate::rectangle([0.0; 2], [1.0, 0.8], [3, 2]).unwrap(),
        _ => generate::block([0.0; 3], [1.0, 0.8, 0.6], [2, 1, 1]).unwrap(),
    };
    let n = mesh.n_elements();
    let all: Vec<usize> = (0..n).collect();
    let mut fibers = Fibers::new(&mesh);
    let fiber = [0.6, 0.8, 0.0];
    fibers.set_constant(&mesh, &all, fiber, None).unwrap();
    let space = Arc::new(Space::taylor_hood(&mesh));
    let dofs = DofMap::new(&space, &[]).unwrap();
    let laws = (0..n).map(|e| [MUSCLE_LAW, HEART][e % 2]).collect();

    let hill = Some(ForceVelocity::hill(5.0));
    let parabola = ActiveStress {
        tension: Tension::Nominal,
        force_length: ForceLength::Parabola { optimal: 1.1 },
        force_velocity: hill,
    };
    let gaussian = ActiveStress {
        tension: Tension::SecondPiolaKirchhoff,
        force_length: ForceLength::Gaussian { optimal: 1.1, width: 0.3 },
        force_velocity: hill,
    };
    let contracting = [Some(ActiveStress::PLAIN), Some(parabola), Some(gaussian), None];
    let viscosities = [0.0, 0.0, VISCOSITY, VISCOSITY];
    let every = |k: usize, step: usize| (k..n).step_by(step).collect();
    let added = [0, 1, 2, 3].map(|k| {
        let stress =
            AddedStress { active: contracting[k].filter(|_| active), viscosity: viscosities[k] };
        (every(k, 4), stress)
    });

    let term = |weight, time| PronyTerm { weight, time };
    let series = [vec![term(0.5, 0.1), term(0.3, 0.2)], vec![term(0.7, 0.1)]];
    let viscoelastic = [0, 1].map(|k| (every(k, 3), Prony::new(series[k].clone()).unwrap()));
    Solid::new(space, dofs, laws, DENSITY)
        .unwrap()
        .with_fibers(fibers)
        .with_added_stresses(&added)
        .unwrap()
        .with_relaxation(&viscoelastic)
        .unwrap()
}

/// Rigid motion at one point in time.
struct Rigid {
    /// Rotation Q.
    rotation: Tensor3,
    /// Rotation rate Q̇.
    rate: Tensor3,
    /// Translation c and its rate ċ.
    shift: [[f64; 3]; 2],
}

impl Rigid {
    /// Creates a rotation about all axes of the space. The angle is larger than a right angle, and the rotation is
    /// faster than the deformation.
    fn new(dimension: usize) -> Self {
        let ((s, c), (a, b)) = (2.1_f64.sin_cos(), 0.7_f64.sin_cos());
        let about_z = [[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]];
        let about_x = [[1.0, 0.0, 0.0], [0.0, b, -a], [0.0, a, b]];
        let (rotation, [x, y, z]) = match dimension {
            2 => (about_z, [0.0, 0.0, 7.0]),
            _ => (product3(&about_x, &about_z), [4.0, -5.0, 7.0]),
        };
        let spin = [[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]];
        Self {
            rotation,
            rate: product3(&spin, &rotation),
            shift: [[0.3, -0.2, 0.1], [1.5, -0.8, 0.6]],
        }
    }

    /// Returns the superposed motion u*, v* for the motion u, v.
    fn superpose(&self, space: &Space, [u, v]: [&[f64]; 2]) -> [Vec<f64>; 2] {
        let d = space.dimension();
        let rest = space.coordinates();
        let position: Vec<f64> = rest.iter().zip(u).map(|(x, u)| x + u).collect();
        let [mut moved, carried] =
            [&self.rotation, &self.rate].map(|tensor| rotated(tensor, &position, d));
        let mut rate = rotated(&self.rotation, v, d);
        for i in 0..moved.len() {
            moved[i] += self.shift[0][i % d] - rest[i];
            rate[i] += carried[i] + self.shift[1][i % d];
        }
        [moved, rate]
    }
}

/// Contracting body in a motion u, v, and in the same motion with a superposed rigid motion.
struct Motions {
    solid: Solid,
    plain: [Vec<f64>; 2],
    rotated: [Vec<f64>; 2],
}

impl Motions {
    fn new(dimension: usize, rigid: &Rigid) -> Self {
        let solid = body(dimension, true);
        let n = solid.space().n_components();
        let (u, v) = (random(n, 0.02, 1), random(n, 1.0, 2));
        Self { rotated: rigid.superpose(solid.space(), [&u, &v]), plain: [u, v], solid }
    }
}

/// Returns T x for each nodal vector x.
fn rotated(tensor: &Tensor3, field: &[f64], dimension: usize) -> Vec<f64> {
    let of_node = |x: &[f64]| {
        let row = |i: usize| (0..x.len()).map(|j| tensor[i][j] * x[j]).sum::<f64>();
        (0..x.len()).map(row).collect::<Vec<f64>>()
    };
    field.chunks(dimension).flat_map(of_node).collect()
}

fn largest(x: &[f64]) -> f64 {
    x.iter().fold(0.0, |m, x| m.max(x.abs()))
}

fn assert_same(found: &[f64], expected: &[f64], what: &str) {
    let size = largest(expected);
    assert!(size > 0.0, "{what}");
    assert_eq!(found.len(), expected.len(), "{what}");
    for (a, b) in found.iter().zip(expected) {
        assert!((a - b).abs() < ROUNDING * size, "{what}: {a} {b}");
    }
}

fn transposed(tensor: &Tensor3) -> Tensor3 {
    [0, 1, 2].map(|i| [0, 1, 2].map(|j| tensor[j][i]))
}

fn power(force: &[f64], v: &[f64]) -> f64 {
    force.iter().zip(v).map(|(f, v)| f * v).sum()
}

/// Returns the force of active and viscous stress.
fn added_force(solid: &Solid, [u, v]: [&[f64]; 2]) -> Vec<f64> {
    let tensions = &vec![TENSION; solid.n_tensions()][..];
    let mut force = vec![0.0; u.len()];
    solid.added_force(&AddedMotion { u, v, tensions }, &mut force);
    force
}

/// Returns the force of the overstress and the rates of the internal stresses.
fn relaxation_force(solid: &Solid, u: &[f64], internal: &[f64]) -> [Vec<f64>; 2] {
    let [mut force, mut rates] = [u.len(), internal.len()].map(|n| vec![0.0; n]);
    solid.relaxation_force(u, internal, Some(&mut force), &mut rates);
    [force, rates]
}

/// Returns the stresses that drive the internal stresses, and their rates.
fn driving(solid: &Solid, [u, v]: [&[f64]; 2]) -> [Vec<f64>; 2] {
    let mut stresses = vec![0.0; solid.n_slots()];
    solid.driving_stresses(u, &mut stresses);
    let mut rates = [vec![0.0; solid.n_slots()]];
    solid.driving_stress_rates(u, &[v.to_vec()], &mut rates);
    let [rates] = rates;
    [stresses, rates]
}

#[test]
fn active_and_viscous_forces_rotate_with_the_body() {
    for dimension in [2, 3] {
        let rigid = Rigid::new(dimension);
        let Motions { solid, plain: [u, v], rotated: [u_rotated, v_rotated] } =
            Motions::new(dimension, &rigid);
        let force = added_force(&solid, [&u, &v]);
        let found = added_force(&solid, [&u_rotated, &v_rotated]);
        let expected = rotated(&rigid.rotation, &force, dimension);
        assert_same(&found, &expected, &format!("force, {dimension}"));
        let [found, expected] = [power(&found, &v_rotated), power(&force, &v)];
        // The rigid part of v* is ten times as large as v, and its power is zero.
        assert!((found / expected - 1.0).abs() < 10.0 * ROUNDING, "power, {dimension}");
        // The velocity affects the force: without it, the force differs.
        let stationary = added_force(&solid, [&u, &vec![0.0; u.len()]]);
        let change: Vec<f64> = force.iter().zip(&stationary).map(|(a, b)| a - b).collect();
        assert!(largest(&change) > 0.1 * largest(&force), "{dimension}");
    }
}

#[test]
fn overstress_rotates_with_the_body_and_internal_stresses_are_invariant() {
    for dimension in [2, 3] {
        let rigid = Rigid::new(dimension);
        let Motions { solid, plain: [u, v], rotated: [u_rotated, v_rotated] } =
            Motions::new(dimension, &rigid);
        // The internal stresses are arbitrary, as after another motion.
        let internal = random(solid.n_internal(), 1e3, 3);
        let [force, rates] = relaxation_force(&solid, &u, &internal);
        let [found, same_rates] = relaxation_force(&solid, &u_rotated, &internal);
        let expected = rotated(&rigid.rotation, &force, dimension);
        assert_same(&found, &expected, &format!("force, {dimension}"));
        assert_same(&same_rates, &rates, &format!("rates, {dimension}"));
        let driven = driving(&solid, [&u, &v]);
        let found = driving(&solid, [&u_rotated, &v_rotated]);
        for (found, expected) in found.iter().zip(&driven) {
            assert_same(found, expected, &format!("S and its rate, {dimension}"));
        }
    }
}

/// Returns S = F⁻¹ P, which is symmetric.
fn second_piola_kirchhoff(state: &PointState) -> Tensor3 {
    let f = |i: usize, j: usize| f64::from(i == j) + state.gradient[i][j];
    let mut adjugate = [[0.0; 3]; 3];
    for (i, row) in adjugate.iter_mut().enumerate() {
        for (j, entry) in row.iter_mut().enumerate() {
            let ([a, b], [c, d]) = ([(j + 1) % 3, (j + 2) % 3], [(i + 1) % 3, (i + 2) % 3]);
            *entry = (f(a, c) * f(b, d) - f(a, d) * f(b, c)) / state.jacobian;
        }
    }
    product3(&adjugate, &state.piola)
}

/// Checks that S is invariant and that the Cauchy stress rotates in the output for a moving body.
#[test]
fn output_stresses_rotate_with_the_body() {
    for dimension in [2, 3] {
        let rigid = Rigid::new(dimension);
        let Motions { solid, plain: [u, v], rotated: [u_rotated, v_rotated] } =
            Motions::new(dimension, &rigid);
        let internal = random(solid.n_internal(), 1e3, 3);
        let context = StressContext {
            tensions: &vec![TENSION; solid.n_tensions()],
            // Stiffness-proportional damping is excluded, because it is not frame-indifferent.
            beta: 0.0,
            internal: &internal,
        };
        let n_corners = dimension + 1;
        let barycentric = Barycentric::new(&vec![1.0 / n_corners as f64; n_corners]);
        for element in 0..solid.space().n_elements() {
            let at = ElementPoint { element, barycentric };
            let [rest, state] = [(&u, &v), (&u_rotated, &v_rotated)].map(|(u, v)| {
                let fields =
                    Fields { v: Some(v), ..Fields::new(u, Pressure::Penalty { kappa: 1e4 }) };
                solid.dynamic_state_at(&fields, &context, &at)
            });
            let what = format!("dimension {dimension}, element {element}");
            let [found, expected] = [&state, &rest].map(second_piola_kirchhoff);
            assert_same(found.as_flattened(), expected.as_flattened(), &what);
            let symmetric = transposed(&expected);
            assert_same(symmetric.as_flattened(), expected.as_flattened(), &what);
            let cauchy = product3(&rigid.rotation, &rest.cauchy);
            let cauchy = product3(&cauchy, &transposed(&rigid.rotation));
            assert_same(state.cauchy.as_flattened(), cauchy.as_flattened(), &what);
        }
    }
}

/// A rigid rotation at a finite rate does not cause viscous or viscoelastic stress. The active force equals that
/// of the stationary body.
#[test]
fn rigid_rotation_causes_no_viscous_force() {
    for dimension in [2, 3] {
        let rigid = Rigid::new(dimension);
        let [passive, active] = [false, true].map(|active| body(dimension, active));
        let rest = vec![0.0; passive.space().n_components()];
        let [u, v] = rigid.superpose(passive.space(), [&rest, &rest]);
        // Force of a motion whose deformation is as fast as this rotation.
        let size = largest(&added_force(&passive, [&rest, &random(rest.len(), largest(&v), 1)]));
        let force = largest(&added_force(&passive, [&u, &v]));
        assert!(force < ROUNDING * size, "{dimension}: {force:e} of {size:e}");
        let [stresses, rates] = driving(&passive, [&u, &v]);
        // The scale is a tenth of the modulus 4e4 Pa at a strain of 0.1. The rotation rate is 8/s.
        assert!(largest(&stresses) < ROUNDING * 4e3, "{:e}", largest(&stresses));
        assert!(largest(&rates) < ROUNDING * 4e4 * 8.0, "{:e}", largest(&rates));
        let none = vec![0.0; passive.n_internal()];
        let [force, _] = relaxation_force(&passive, &u, &none);
        assert!(largest(&force) < ROUNDING * 4e3, "{:e}", largest(&force));

        let found = added_force(&active, [&u, &v]);
        let at_rest = added_force(&active, [&rest, &rest]);
        let expected = rotated(&rigid.rotation, &at_rest, dimension);
        assert_same(&found, &expected, &format!("tension, {dimension}"));
    }
}
