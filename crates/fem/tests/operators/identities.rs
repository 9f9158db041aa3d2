//! Tests of identities that hold on any mesh: rigid motions, masses, loads, energies and equivalent evaluations.

use std::collections::BTreeMap;
use std::sync::Arc;

use myovib_fem::material::MooneyRivlin;
use myovib_fem::solid::{Fields, Inverted, Pressure, Solid, Tangents, Vectors};
use myovib_fem::{DofMap, ElementScale, FemError, Fibers, Law, Space, generate, load};

use crate::common::{DENSITY, MUSCLE_LAW, SMALL_LAW, clamped, dense, muscle_mesh, random};

fn muscle() -> Solid {
    clamped(Space::taylor_hood(&muscle_mesh()), "fixed", MUSCLE_LAW)
}

/// Returns the displacement that corresponds to a map of the plane.
fn displacement(solid: &Solid, map: impl Fn([f64; 2]) -> [f64; 2]) -> Vec<f64> {
    let displaced = |&x: &[f64; 2]| [map(x)[0] - x[0], map(x)[1] - x[1]];
    solid.space().node_points().iter().flat_map(displaced).collect()
}

fn force_and_volume_residual(solid: &Solid, u: &[f64], p: &[f64]) -> (Vec<f64>, Vec<f64>) {
    let (mut force, mut volume_residual) = (vec![0.0; u.len()], vec![0.0; p.len()]);
    let mut out = Vectors {
        force: Some(&mut force),
        volume_residual: Some(&mut volume_residual),
        ..Vectors::default()
    };
    solid.evaluate(&Fields::new(u, Pressure::Nodal(p)), &mut out).unwrap();
    (force, volume_residual)
}

fn largest(x: &[f64]) -> f64 {
    x.iter().fold(0.0, |m, x| m.max(x.abs()))
}

#[test]
fn rigid_motions_have_no_force_and_volume_residual() {
    let solid = muscle();
    let p = vec![0.0; solid.space().n_pressures()];
    let (s, c) = 0.7_f64.sin_cos();
    let u = displacement(&solid, |[x, y]| [c * x - s * y + 0.3, s * x + c * y - 0.2]);
    let (force, volume_residual) = force_and_volume_residual(&solid, &u, &p);
    // The error is the rounding of u (0.5) divided by the element size (0.005), times the modulus and the size:
    // 2e-10.
    assert!(largest(&force) < 2e-10, "{:e}", largest(&force));
    assert!(largest(&volume_residual) < 1e-16, "{:e}", largest(&volume_residual));
    let (force, volume_residual) = force_and_volume_residual(&solid, &vec![0.0; u.len()], &p);
    assert_eq!((largest(&force), largest(&volume_residual)), (0.0, 0.0));
}

#[test]
fn volume_residual_of_an_affine_map_is_its_volume_change() {
    let solid = muscle();
    let u = displacement(&solid, |[x, y]| [1.1 * x + 0.2 * y, 0.3 * x + 0.9 * y]);
    let (_, volume_residual) =
        force_and_volume_residual(&solid, &u, &vec![0.0; solid.space().n_pressures()]);
    let change = 1.1 * 0.9 - 0.2 * 0.3 - 1.0;
    for (volume_residual, weight) in volume_residual.iter().zip(solid.pressure_weights()) {
        assert!((volume_residual / weight - change).abs() < 1e-12); // rounding divided by the element size
    }
    assert!((volume_residual.iter().sum::<f64>() / solid.volume() - change).abs() < 1e-13);
}

#[test]
fn mass_matrices_sum_to_the_mass() {
    let solid = muscle();
    let n = solid.space().n_components();
    let ones: Vec<f64> = (0..n).map(|i| f64::from(i % 2 == 0)).collect();
    let mut momentum = vec![0.0; n];
    solid.apply_mass(&ones, &mut momentum);
    let mass = DENSITY * solid.volume();
    assert!((momentum.iter().sum::<f64>() / mass - 1.0).abs() < 1e-13);
    assert!(momentum.iter().skip(1).step_by(2).all(|m| *m == 0.0));
    assert!((solid.kinetic_energy(&ones) / (0.5 * mass) - 1.0).abs() < 1e-13);
    assert!((solid.pressure_weights().iter().sum::<f64>() / solid.volume() - 1.0).abs() < 1e-13);

    // The kinetic energy of a rigid rotation is ∫ ρ |x|² / 2. The integrand is quadratic, so the mass matrix and
    // the edge midpoint rule of degree 2 are exact.
    let v = displacement(&solid, |[x, y]| [x - y, y + x]);
    let mesh = solid.space().mesh();
    let moment: f64 = (0..mesh.n_elements())
        .map(|e| {
            let [a, b, c] = mesh.corners(e);
            let area = 0.5 * ((b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1]));
            let square = |p: [f64; 2], q: [f64; 2]| {
                (0.5 * (p[0] + q[0])).powi(2) + (0.5 * (p[1] + q[1])).powi(2)
            };
            area / 3.0 * (square(a, b) + square(b, c) + square(c, a))
        })
        .sum();
    assert!((solid.kinetic_energy(&v) / (0.5 * DENSITY * moment) - 1.0).abs() < 1e-12);
}

#[test]
fn matrices_match_matrix_free_products() {
    let solid = muscle();
    let (n, m) = (solid.space().n_components(), solid.space().n_pressures());
    let mut full = vec![0.0; n];
    let free = random(solid.dofs().n_free(), 1.0, 3);
    solid.dofs().expand(&free, &mut full);
    let (mut product, mut restricted) = (vec![0.0; n], vec![0.0; free.len()]);
    solid.apply_mass(&full, &mut product);
    solid.dofs().restrict(&product, &mut restricted);
    let matrix = dense(solid.displacement_pattern(), &solid.mass_values());
    let expected = &matrix * nalgebra::DVector::from_vec(free);
    let scale = expected.amax();
    for (a, b) in restricted.iter().zip(&expected) {
        assert!((a - b).abs() < 1e-14 * scale); // sums of about twenty terms in another order
    }
    let p = random(m, 1.0, 4);
    let mut product = vec![0.0; m];
    solid.apply_compliance(&p, &mut product);
    let matrix = dense(solid.pressure_pattern(), solid.pressure_mass_values());
    let expected = &matrix * nalgebra::DVector::from_vec(p);
    let scale = expected.amax();
    for (a, b) in product.iter().zip(&expected) {
        assert!((a - b).abs() < 1e-14 * scale);
    }
}

#[test]
fn loads_have_the_exact_resultant_and_moments() {
    let space = Space::taylor_hood(&generate::rectangle([0.0; 2], [2.0, 1.0], [3, 2]).unwrap());
    let sum = |load: &[f64], weight: &dyn Fn([f64; 2]) -> f64, component: usize| -> f64 {
        let nodes = space.node_points().iter().enumerate();
        nodes.map(|(node, &x)| weight(x) * load[2 * node + component]).sum()
    };
    let traction = load::traction(&space, "top", [3.0, -5.0]).unwrap();
    // The nodal sums are exact for quadratic functions: ∫_0^2 τ and ∫_0^2 x² τ.
    assert!((sum(&traction, &|_| 1.0, 0) - 6.0).abs() < 1e-13);
    assert!((sum(&traction, &|[x, _]| x * x, 1) + 5.0 * 8.0 / 3.0).abs() < 1e-13);
    let weight = load::element_body_force(&space, |_, [x, y]| [x * y, -2.0]);
    assert!((sum(&weight, &|_| 1.0, 0) - 1.0).abs() < 1e-13);
    assert!((sum(&weight, &|[x, _]| x * x, 1) + 2.0 * 8.0 / 3.0).abs() < 1e-13);
    let error = load::traction(&space, "body", [1.0, 0.0]).unwrap_err();
    assert!(matches!(error, FemError::WrongGroup { found: "triangles", needed: "edges", .. }));
}

#[test]
fn force_is_the_derivative_of_the_strain_energy() {
    for (law, kappa) in [(MUSCLE_LAW, None), (MUSCLE_LAW, Some(1e5)), (SMALL_LAW, Some(1e5))] {
        let mesh = generate::spindle([10, 2]).unwrap();
        let solid = clamped(Space::taylor_hood(&mesh), "fixed", law);
        // A motion of magnitude 1e-4 m has 5 % strain.
        check_energy(&solid, kappa, None, [2e-4, 1e-4]);
    }
}

/// The body has curved and straight elements, three laws (one with fibers, one user-defined), a scaled bulk
/// modulus, and factors that differ between elements.
#[test]
fn force_is_the_derivative_of_the_strain_energy_in_3d() {
    const HEART: Law = Law::Guccione { c: 2e3, b_f: 8.0, b_t: 2.0, b_fs: 4.0 };
    static CUSTOM: MooneyRivlin = MooneyRivlin { c10: 1e4, c01: 2e2 };
    let mesh = generate::block([0.0; 3], [1.5, 1.0, 0.8], [2, 1, 1]).unwrap();
    let curved = mesh.with_midside_nodes(BTreeMap::from([([0, 4], [0.41, 0.53, -0.05])]));
    let mesh = curved.unwrap();
    let n = mesh.n_elements();
    let mut fibers = Fibers::new(&mesh);
    let all: Vec<usize> = (0..n).collect();
    fibers.set_constant(&mesh, &all, [0.6, 0.0, 0.8], Some([0.0, 1.0, 0.0])).unwrap();
    let space = Arc::new(Space::taylor_hood(&mesh));
    assert!((0..n).any(|e| space.is_curved(e)) && !(0..n).all(|e| space.is_curved(e)));
    let dofs = DofMap::clamped(&space, &space.nodes_of("left").unwrap()).unwrap();
    let laws = [HEART, SMALL_LAW, Law::custom("custom", &CUSTOM)];
    let laws: Vec<Law> = (0..n).map(|e| laws[e % 3]).collect();
    let scale = ElementScale { kappa: 2.0, ..ElementScale::ONE };
    let solid = Solid::new(space, dofs, laws, 1e3).unwrap();
    let solid = solid.with_element_scales(&vec![scale; n]).unwrap();
    let solid = solid.with_fibers(fibers);
    let factors = random(4 * n, 0.4, 9);
    let factors: Vec<f64> = factors.iter().map(|change| 1.0 + change).collect();
    for kappa in [None, Some(1e5)] {
        for factors in [None, Some(&factors[..])] {
            check_energy(&solid, kappa, factors, [4e-2, 2e-2]);
        }
    }
}

/// Compares the power of the force along a motion with central differences of the energy. `sizes` holds the
/// magnitudes (m) of the displacement and the motion.
fn check_energy(solid: &Solid, kappa: Option<f64>, factors: Option<&[f64]>, sizes: [f64; 2]) {
    let n = solid.space().n_components();
    let p = random(solid.space().n_pressures(), 3e3, 1);
    let pressure = kappa.map_or(Pressure::Nodal(&p), |kappa| Pressure::Penalty { kappa });
    let (u, direction) = (random(n, sizes[0], 2), random(n, sizes[1], 3));
    let mut force = vec![0.0; n];
    let mut out = Vectors { force: Some(&mut force), ..Vectors::default() };
    let mut fields = Fields::new(&u, pressure);
    fields.factors = factors;
    solid.evaluate(&fields, &mut out).unwrap();
    let power: f64 = force.iter().zip(&direction).map(|(f, d)| f * d).sum();
    let energy = |s: f64| {
        let u: Vec<f64> = u.iter().zip(&direction).map(|(u, d)| u + s * d).collect();
        solid.strain_energy(&Fields { u: &u, ..fields })
    };
    // The error is the square of the step 1e-4 times the change of the slopes over a motion with a few percent
    // strain.
    let slope = (energy(1e-4) - energy(-1e-4)) / 2e-4;
    assert!((slope / power - 1.0).abs() < 1e-6, "{slope} {power}");
}

#[test]
fn penalty_equals_a_constant_pressure_for_affine_maps() {
    // If J is constant, the pressure −κ (J − 1) is in the P1 space, so eq. (20) with (19) equals (16).
    let solid = muscle();
    let kappa = 1e5;
    let u = displacement(&solid, |[x, y]| [1.02 * x + 0.1 * y, 1.01 * y]);
    let p = vec![-kappa * (1.02 * 1.01 - 1.0); solid.space().n_pressures()];
    let (nodal, _) = force_and_volume_residual(&solid, &u, &p);
    let mut penalty = vec![0.0; u.len()];
    let mut out = Vectors { force: Some(&mut penalty), ..Vectors::default() };
    solid.evaluate(&Fields::new(&u, Pressure::Penalty { kappa }), &mut out).unwrap();
    for (a, b) in nodal.iter().zip(&penalty) {
        assert!((a - b).abs() < 1e-12 * largest(&nodal)); // rounding of J − 1 on small elements
    }
}

#[test]
fn inverted_elements_and_nan_are_located() {
    let solid = muscle();
    let p = vec![0.0; solid.space().n_pressures()];
    let mut force = vec![0.0; solid.space().n_components()];
    let mut check = |u: &[f64]| -> Inverted {
        let mut out = Vectors { force: Some(&mut force), ..Vectors::default() };
        let fields = Fields::new(u, Pressure::Nodal(&p));
        let error = solid.evaluate(&fields, &mut out).unwrap_err();
        let mut values = vec![0.0; solid.displacement_pattern().nnz()];
        let mut out = Tangents { stiffness: Some(&mut values), ..Tangents::default() };
        let same = solid.tangents(&fields, &mut out).unwrap_err();
        assert_eq!((error.element, error.barycentric), (same.element, same.barycentric));
        error
    };
    let mirrored = displacement(&solid, |[x, y]| [-x, y]);
    let error = check(&mirrored);
    assert_eq!(error.element, 0);
    assert!((error.jacobian + 1.0).abs() < 1e-13); // rounding of u divided by the element size
    let mut u = vec![0.0; mirrored.len()];
    u[2 * solid.space().element_nodes(200)[4]] = f64::NAN;
    assert!(check(&u).jacobian.is_nan());
}

#[test]
fn vectors_together_equal_each_alone() {
    let solid = muscle();
    let (n, m) = (solid.space().n_components(), solid.space().n_pressures());
    let (u, v, p) = (random(n, 1e-4, 1), random(n, 1e-2, 2), random(m, 10.0, 3));
    let (p_rate, mu) = (random(m, 100.0, 4), random(m, 50.0, 5));
    let fields = Fields {
        u: &u,
        pressure: Pressure::Nodal(&p),
        v: Some(&v),
        p_rate: Some(&p_rate),
        mu: Some(&mu),
        factors: None,
    };
    let mut all = [n, n, n, m, m].map(|n| vec![f64::NAN; n]);
    let [force, force_rate, multiplier_force, volume_residual, volume_residual_rate] = &mut all;
    let mut out = Vectors {
        force: Some(force),
        force_rate: Some(force_rate),
        multiplier_force: Some(multiplier_force),
        volume_residual: Some(volume_residual),
        volume_residual_rate: Some(volume_residual_rate),
    };
    solid.evaluate(&fields, &mut out).unwrap();
    for (k, together) in all.iter().enumerate() {
        let mut alone = vec![f64::NAN; together.len()];
        let slot = Some(alone.as_mut_slice());
        let mut out = match k {
            0 => Vectors { force: slot, ..Vectors::default() },
            1 => Vectors { force_rate: slot, ..Vectors::default() },
            2 => Vectors { multiplier_force: slot, ..Vectors::default() },
            3 => Vectors { volume_residual: slot, ..Vectors::default() },
            _ => Vectors { volume_residual_rate: slot, ..Vectors::default() },
        };
        solid.evaluate(&fields, &mut out).unwrap();
        assert_eq!(&alone, together, "vector {k}");
    }
}

#[test]
fn tangents_together_equal_each_alone() {
    let solid = muscle();
    let (n, m) = (solid.space().n_components(), solid.space().n_pressures());
    let (u, v, p) = (random(n, 1e-4, 1), random(n, 1e-2, 2), random(m, 10.0, 3));
    let (p_rate, mu) = (random(m, 100.0, 4), random(m, 50.0, 5));
    let fields = Fields {
        v: Some(&v),
        p_rate: Some(&p_rate),
        mu: Some(&mu),
        ..Fields::new(&u, Pressure::Nodal(&p))
    };
    let (k, b) = (solid.displacement_pattern().nnz(), solid.divergence_pattern().nnz());
    let mut all = [k, k, k, b, b].map(|n| vec![f64::NAN; n]);
    let [stiffness, rate_stiffness, multiplier_stiffness, divergence, divergence_rate] = &mut all;
    let mut out = Tangents {
        stiffness: Some(stiffness),
        rate_stiffness: Some(rate_stiffness),
        multiplier_stiffness: Some(multiplier_stiffness),
        divergence: Some(divergence),
        divergence_rate: Some(divergence_rate),
        ..Tangents::default()
    };
    solid.tangents(&fields, &mut out).unwrap();
    for (which, together) in all.iter().enumerate() {
        let mut alone = vec![f64::NAN; together.len()];
        let mut out = Tangents::default();
        let slot = match which {
            0 => &mut out.stiffness,
            1 => &mut out.rate_stiffness,
            2 => &mut out.multiplier_stiffness,
            3 => &mut out.divergence,
            _ => &mut out.divergence_rate,
        };
        *slot = Some(&mut alone);
        solid.tangents(&fields, &mut out).unwrap();
        assert_eq!(&alone, together, "tangent {which}");
    }
}

#[test]
fn laws_can_differ_between_triangles() {
    use std::sync::Arc;
    let space = Arc::new(Space::taylor_hood(&muscle_mesh()));
    let dofs = DofMap::clamped(&space, &space.nodes_of("fixed").unwrap()).unwrap();
    let half = |law_a, law_b| {
        let laws = (0..311).map(|e| if e % 2 == 0 { law_a } else { law_b }).collect();
        Solid::new(space.clone(), dofs.clone(), laws, DENSITY).unwrap()
    };
    let stiff = myovib_fem::Law::MooneyRivlin { c10: 3e4, c01: 1e3 };
    let zero = myovib_fem::Law::MooneyRivlin { c10: 0.0, c01: 0.0 };
    let u = random(space.n_components(), 1e-4, 1);
    let p = vec![0.0; space.n_pressures()];
    let (both, _) = force_and_volume_residual(&half(MUSCLE_LAW, stiff), &u, &p);
    let (even, _) = force_and_volume_residual(&half(MUSCLE_LAW, zero), &u, &p);
    let (odd, _) = force_and_volume_residual(&half(zero, stiff), &u, &p);
    for ((both, even), odd) in both.iter().zip(even).zip(odd) {
        assert!((both - even - odd).abs() < 1e-12 * largest(&u) * 1e5);
    }
    let error = Solid::new(space.clone(), dofs, vec![stiff; 3], DENSITY).unwrap_err();
    assert!(matches!(error, FemError::Count { found: 3, needed: 311, .. }));
}
