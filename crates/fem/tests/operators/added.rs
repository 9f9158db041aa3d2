//! Active and viscous stresses and Robin matrices in homogeneous states, and their tangents compared with
//! differences.

use std::sync::Arc;

use myovib_fem::material::{ActiveStress, ForceVelocity, Viscous};
use myovib_fem::output::StressContext;
use myovib_fem::{
    AddedMotion, AddedStress, AddedTangents, Barycentric, DofMap, ElementPoint, FemError, Fibers,
    Fields, Mesh, Pressure, RobinMatrix, Solid, Space, SupportDirection, generate,
};

use crate::common::{DENSITY, MUSCLE_LAW, SMALL_LAW, dense, random};

const FIBER: [f64; 3] = [0.6, 0.8, 0.0];
const STRESS: AddedStress = AddedStress {
    active: Some(ActiveStress {
        force_velocity: Some(ForceVelocity { v_max: 5.0, a: 0.25, plateau: 1.4 }),
        ..ActiveStress::PLAIN
    }),
    viscosity: 70.0,
};
const TENSION: f64 = 3e3;

fn mesh(dimension: usize) -> Mesh {
    match dimension {
        2 => generate::rectangle([0.0; 2], [1.0, 0.8], [2, 1]).unwrap(),
        _ => generate::block([0.0; 3], [1.0, 0.8, 0.6], [1, 1, 1]).unwrap(),
    }
}

/// Returns a free block of muscle in which every second element has the added stress.
fn block(dimension: usize) -> Solid {
    let mesh = mesh(dimension);
    let space = Arc::new(Space::taylor_hood(&mesh));
    let dofs = DofMap::new(&space, &[(0, 0), (0, 1)]).unwrap();
    let all: Vec<usize> = (0..mesh.n_elements()).collect();
    let mut fibers = Fibers::new(&mesh);
    fibers.set_constant(&mesh, &all, FIBER, None).unwrap();
    let even = all.into_iter().step_by(2).collect();
    Solid::uniform(space, dofs, MUSCLE_LAW, DENSITY)
        .unwrap()
        .with_fibers(fibers)
        .with_added_stresses(&[(even, STRESS)])
        .unwrap()
}

const H: [[f64; 3]; 3] = [[0.1, 0.2, 0.0], [-0.1, -0.05, 0.0], [0.0; 3]];
const V: [[f64; 3]; 3] = [[0.3, -0.8, 0.0], [0.5, 0.9, 0.0], [0.0; 3]];

/// Returns the linear displacement field with the given gradient.
fn linear(space: &Space, gradient: [[f64; 3]; 3]) -> Vec<f64> {
    let d = space.dimension();
    let nodes = space.coordinates().chunks(d);
    let field = nodes.flat_map(|x| {
        let row = move |i: usize| (0..d).map(|j| gradient[i][j] * x[j]).sum::<f64>();
        (0..d).map(row)
    });
    field.collect()
}

#[test]
fn power_of_a_homogeneous_motion_is_stress_times_rate_times_volume() {
    let mut f = H;
    for (i, row) in f.iter_mut().enumerate() {
        row[i] += 1.0;
    }
    let active = STRESS.active.unwrap().at(FIBER, &H, &V, TENSION).power();
    let viscous = Viscous::new(f, V, STRESS.viscosity).dissipation();
    for dimension in [2, 3] {
        let solid = block(dimension);
        let [u, v] = [H, V].map(|gradient| linear(solid.space(), gradient));
        let power = |force: &[f64]| force.iter().zip(&v).map(|(f, v)| f * v).sum::<f64>();
        let mut force = vec![0.0; u.len()];
        let tensions = &vec![TENSION; solid.space().n_elements()][..];
        solid.added_force(&AddedMotion { u: &u, v: &v, tensions }, &mut force);
        // Half of the elements have the added stress, and all elements have the same size.
        let volume = 0.5 * solid.volume();
        let expected = volume * (active + viscous);
        // The error is the rounding of a few hundred terms.
        assert!((power(&force) / expected - 1.0).abs() < 1e-12, "{dimension}");
        let motion = AddedMotion { u: &u, v: &v, tensions };
        solid.active_force(&motion, &mut force);
        assert!((power(&force) / (volume * active) - 1.0).abs() < 1e-12);
    }
}

#[test]
fn tangents_match_central_differences() {
    let step = 1e-6;
    for dimension in [2, 3] {
        let solid = block(dimension);
        let n = solid.space().n_components();
        let (mut u, mut v) = (random(n, 0.02, 1), random(n, 1.0, 2));
        let tensions = &vec![TENSION; solid.space().n_elements()][..];
        let nnz = solid.displacement_pattern().nnz();
        let mut values = [0, 1].map(|_| vec![f64::NAN; nnz]);
        let [by_u, by_v] = &mut values;
        let out = AddedTangents { by_displacement: Some(by_u), by_velocity: Some(by_v) };
        solid.added_tangents(&AddedMotion { u: &u, v: &v, tensions }, out);
        let matrices = values.map(|values| dense(solid.displacement_pattern(), &values));
        let force = |u: &[f64], v: &[f64]| {
            let mut force = vec![0.0; n];
            solid.added_force(&AddedMotion { u, v, tensions }, &mut force);
            force
        };
        for (column, &full) in solid.dofs().free_to_full().iter().enumerate() {
            for (k, matrix) in matrices.iter().enumerate() {
                let mut shifted = |step: f64| {
                    let field = if k == 0 { &mut u } else { &mut v };
                    let start = field[full];
                    field[full] = start + step;
                    let found = force(&u, &v);
                    let field = if k == 0 { &mut u } else { &mut v };
                    field[full] = start;
                    found
                };
                let (plus, minus) = (shifted(step), shifted(-step));
                for (row, &full) in solid.dofs().free_to_full().iter().enumerate() {
                    let slope = (plus[full] - minus[full]) / (2.0 * step);
                    // Differences lose two thirds of the digits.
                    let error = (matrix[(row, column)] - slope).abs();
                    assert!(error < 1e-7 * matrix.amax(), "{dimension} {k}: {error:e}");
                }
            }
        }
    }
}

#[test]
fn robin_matrix_integrates_supported_components() {
    for (dimension, area) in [(2, 0.8), (3, 0.48)] {
        let mesh = mesh(dimension);
        let space = Space::taylor_hood(&mesh);
        let [all, normal] = [SupportDirection::All, SupportDirection::Normal]
            .map(|direction| RobinMatrix::new(&space, "right", direction).unwrap());
        let constant = |axis: usize| -> Vec<f64> {
            (0..space.n_components())
                .map(|i| if i % dimension == axis { 2.0 } else { 0.0 })
                .collect()
        };
        for axis in 0..dimension {
            let u = constant(axis);
            assert!((all.square(&u) - 4.0 * area).abs() < 1e-13);
            let expected = if axis == 0 { 4.0 * area } else { 0.0 };
            assert!((normal.square(&u) - expected).abs() < 1e-13);
            let mut force = vec![0.0; u.len()];
            all.add_product(0.5, &u, &mut force);
            let product: f64 = force.iter().zip(&u).map(|(f, u)| f * u).sum();
            assert!((product - 0.5 * all.square(&u)).abs() < 1e-13);
        }
    }
}

#[test]
fn normal_support_of_a_rotation() {
    let mesh = generate::rectangle([-1.0, 0.0], [1.0, 1.0], [4, 2]).unwrap();
    let space = Space::taylor_hood(&mesh);
    let normal = RobinMatrix::new(&space, "bottom", SupportDirection::Normal).unwrap();
    // For the rotation u = ω × x, the normal displacement on y = 0 is ω x. The integral of its square is ∫x² =
    // 2/3.
    let rotation: Vec<f64> = space.node_points::<2>().iter().flat_map(|[x, y]| [-y, *x]).collect();
    assert!((normal.square(&rotation) - 2.0 / 3.0).abs() < 1e-13);
}

#[test]
fn small_strain_laws_reject_added_stress() {
    let mesh = mesh(2);
    let space = Arc::new(Space::taylor_hood(&mesh));
    let dofs = DofMap::new(&space, &[]).unwrap();
    let solid = Solid::uniform(space, dofs, SMALL_LAW, DENSITY).unwrap();
    let refused = solid.with_added_stresses(&[(vec![1], STRESS)]).unwrap_err();
    assert!(matches!(refused, FemError::AddedToSmallStrain { element: 1 }));
}

/// The output stress is the sum of the elastic and the added stress.
#[test]
fn stress_at_a_point_is_the_sum_of_its_parts() {
    let mut f = H;
    for (i, row) in f.iter_mut().enumerate() {
        row[i] += 1.0;
    }
    let active = STRESS.active.unwrap().at(FIBER, &H, &V, TENSION).stress();
    let viscous = Viscous::new(f, V, STRESS.viscosity).stress();
    for dimension in [2, 3] {
        let solid = block(dimension);
        let [u, v] = [H, V].map(|gradient| linear(solid.space(), gradient));
        let fields = Fields { v: Some(&v), ..Fields::new(&u, Pressure::Penalty { kappa: 1e4 }) };
        let context = StressContext {
            tensions: &vec![TENSION; solid.space().n_elements()],
            beta: 0.0,
            internal: &[],
        };
        let n_vertices = dimension + 1;
        let barycentric = Barycentric::new(&vec![1.0 / n_vertices as f64; n_vertices]);
        for (element, has_added) in [(0, 1.0), (1, 0.0)] {
            let at = ElementPoint { element, barycentric };
            let law = solid.state_at(&fields, &at);
            let all = solid.dynamic_state_at(&fields, &context, &at);
            for i in 0..3 {
                for j in 0..3 {
                    let piola = law.piola[i][j] + has_added * (active[i][j] + viscous[i][j]);
                    // The Cauchy stress is P Fᵀ/J.
                    let cauchy: f64 = (0..3).map(|k| all.piola[i][k] * f[j][k]).sum();
                    // The error is the rounding of stresses of 1e3 Pa.
                    assert!((all.piola[i][j] - piola).abs() < 1e-10, "{dimension}");
                    assert!((all.cauchy[i][j] - cauchy / all.jacobian).abs() < 1e-10);
                }
            }
        }
    }
}
