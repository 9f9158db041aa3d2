//! Tests of volumetric energies other than the default.

use myovib_fem::material::{Law, VolumeFunction};
use myovib_fem::output::StressContext;
use myovib_fem::solid::{Fields, Pressure, Vectors};
use myovib_fem::{Barycentric, ElementPoint, Mesh, Space, generate};

use crate::common::{MUSCLE_LAW, clamped, random};
use crate::differences::{HEART, STEP, check_with, with_oblique_fibers};

fn meshes() -> [Mesh; 2] {
    let plane = generate::rectangle([0.0, 0.0], [1.5, 1.0], [3, 3]).unwrap();
    [plane, generate::block([0.0; 3], [1.5, 1.0, 0.8], [2, 1, 1]).unwrap()]
}

/// Checks the energy κ/2 (ln J)² with and without a pressure field. Without a pressure field, the force is the
/// derivative of the energy.
#[test]
fn logarithmic_volumes() {
    let function = VolumeFunction::Logarithmic;
    let [plane, spatial] = meshes();
    for (mesh, law) in [(&plane, MUSCLE_LAW), (&plane, HEART), (&spatial, MUSCLE_LAW)] {
        for kappa in [None, Some(1e5)] {
            check_with(law, Space::taylor_hood(mesh), kappa, None, function);
        }
        let solid = with_oblique_fibers(clamped(Space::taylor_hood(mesh), "left", law));
        let solid = solid.with_volume_function(function).unwrap();
        let mut u = random(solid.space().n_components(), 0.02, 1);
        let pressure = Pressure::Penalty { kappa: 1e5 };
        let mut force = vec![0.0; u.len()];
        let mut vectors = Vectors { force: Some(&mut force), ..Vectors::default() };
        solid.evaluate(&Fields::new(&u, pressure), &mut vectors).unwrap();
        let scale = force.iter().fold(0.0_f64, |m, f| m.max(f.abs()));
        for i in (0..u.len()).step_by(7) {
            let [below, above] = [-STEP, STEP].map(|step| {
                u[i] += step;
                let energy = solid.strain_energy(&Fields::new(&u, pressure));
                u[i] -= step;
                energy
            });
            // Differences of energies lose two thirds of the digits.
            let error = force[i] - (above - below) / (2.0 * STEP);
            assert!(error.abs() < 1e-6 * scale, "{i}: {error:e} of {scale:e}");
        }
    }
}

/// The default can be restored.
#[test]
fn the_last_volume_function_counts() {
    let plain = clamped(Space::taylor_hood(&meshes()[0]), "left", MUSCLE_LAW);
    let changed = plain.clone().with_volume_function(VolumeFunction::Logarithmic).unwrap();
    let restored = changed.clone().with_volume_function(VolumeFunction::Quadratic).unwrap();
    let u = random(plain.space().n_components(), 0.02, 1);
    let [plain, changed, restored] = [plain, changed, restored].map(|solid| {
        let mut force = vec![0.0; u.len()];
        let mut vectors = Vectors { force: Some(&mut force), ..Vectors::default() };
        solid.evaluate(&Fields::new(&u, Pressure::Penalty { kappa: 1e5 }), &mut vectors).unwrap();
        force
    });
    assert_ne!(plain, changed);
    assert_eq!(plain, restored);
}

/// Returns each built-in law. Constants without a default value are 10 kPa, or 1.2 if they have no unit.
fn laws() -> impl Iterator<Item = Law> {
    Law::CATALOG.iter().map(|law| {
        let required = law.parameters.iter().filter(|own| own.default.is_none());
        let constants = required.map(|own| (own.name, if own.unit == "Pa" { 1e4 } else { 1.2 }));
        Law::named(law.name, &constants.collect::<Vec<_>>()).unwrap()
    })
}

fn pressure(kappa: Option<f64>, p: &[f64]) -> Pressure<'_> {
    kappa.map_or(Pressure::Nodal(p), |kappa| Pressure::Penalty { kappa })
}

/// The damping stress in the output is β times the rate of the elastic stress.
#[test]
fn damping_stresses_are_rates_of_stresses() {
    let (beta, mut compared) = (0.5, 0);
    let functions = [VolumeFunction::Quadratic, VolumeFunction::Logarithmic];
    let cases = laws().flat_map(|law| functions.map(|function| (law, function)));
    for ((law, function), mesh) in cases.flat_map(|case| meshes().map(|mesh| (case, mesh))) {
        let solid = with_oblique_fibers(clamped(Space::taylor_hood(&mesh), "left", law));
        let Ok(solid) = solid.with_volume_function(function) else {
            continue;
        };
        let (n, m) = (solid.space().n_components(), solid.space().n_pressures());
        let [u, v] = [(0.02, 1), (1.0, 2)].map(|(size, seed)| random(n, size, seed));
        let [p, p_rate] = [(3e3, 3), (2e3, 4)].map(|(size, seed)| random(m, size, seed));
        let coordinates = &[0.4, 0.3, 0.2, 0.1][..=mesh.dimension()];
        let at = ElementPoint { element: 3, barycentric: Barycentric::new(coordinates) };
        for kappa in [None, Some(1e5)] {
            let moved = |x: &[f64], rate: &[f64], t: f64| -> Vec<f64> {
                x.iter().zip(rate).map(|(x, rate)| x + t * rate).collect()
            };
            let stress = |t: f64| {
                let (u, p) = (moved(&u, &v, t), moved(&p, &p_rate, t));
                solid.state_at(&Fields::new(&u, pressure(kappa, &p)), &at).piola
            };
            let [before, elastic, after] = [-STEP, 0.0, STEP].map(stress);
            let (v, p_rate) = (Some(&v[..]), Some(&p_rate[..]));
            let fields = Fields { v, p_rate, ..Fields::new(&u, pressure(kappa, &p)) };
            let context = StressContext { tensions: &[], beta, internal: &[] };
            let damped = solid.dynamic_state_at(&fields, &context, &at).piola;
            let indices = || (0..3).flat_map(|i| (0..3).map(move |j| (i, j)));
            let rates = indices().map(|(i, j)| (damped[i][j] - elastic[i][j]) / beta);
            let rates: Vec<f64> = rates.collect();
            let largest = rates.iter().fold(0.0_f64, |most, rate| most.max(rate.abs()));
            for (rate, (i, j)) in rates.iter().zip(indices()) {
                let quotient = (after[i][j] - before[i][j]) / (2.0 * STEP);
                // Differences lose two thirds of the digits, as in `differences.rs`.
                let error = (rate - quotient).abs();
                assert!(
                    error < 1e-7 * largest,
                    "{law:?} {function:?} {kappa:?}: {error:e} {largest:e}"
                );
            }
            compared += 1;
        }
    }
    assert!(compared > 0);
}

/// Checks a plane body with equal stretches λ in its plane. With J = λ², σ_v = κ ln(J)/J and D = μ (λ² − 1)/(3
/// J^(5/3)), the stress is σ_v + D in the plane and σ_v − 2 D out of the plane.
#[test]
fn a_plane_stretch_has_the_stresses_of_the_closed_form() {
    let (kappa, stretch) = (1e5, 1.1_f64);
    let law = Law::MooneyRivlin { c10: 1e4, c01: 0.0 };
    let solid = clamped(Space::taylor_hood(&meshes()[0]), "left", law);
    let solid = solid.with_volume_function(VolumeFunction::Logarithmic).unwrap();
    let u: Vec<f64> = solid.space().coordinates().iter().map(|x| (stretch - 1.0) * x).collect();
    let fields = Fields::new(&u, Pressure::Penalty { kappa });
    let j = stretch.powi(2);
    let (volumetric, d) = (kappa * j.ln() / j, 2e4 * (j - 1.0) / (3.0 * j.powf(5.0 / 3.0)));
    let at = ElementPoint { element: 3, barycentric: Barycentric::new(&[0.4, 0.3, 0.3]) };
    let found = solid.state_at(&fields, &at).cauchy;
    // The error is the rounding of a few dozen operations.
    for (found, exact) in [
        (found[0][0], volumetric + d),
        (found[1][1], volumetric + d),
        (found[2][2], volumetric - 2.0 * d),
    ] {
        assert!((found / exact - 1.0).abs() < 1e-13, "{found} {exact}");
    }
    // The plane law of the equations has the same stress. It is compared with P on a side of length 1.
    let mut force = vec![0.0; u.len()];
    let mut vectors = Vectors { force: Some(&mut force), ..Vectors::default() };
    solid.evaluate(&fields, &mut vectors).unwrap();
    let right = solid.space().nodes_of("right").unwrap().into_iter();
    let pull: f64 = right.map(|node| force[2 * node]).sum();
    assert!((pull / (stretch * found[0][0]) - 1.0).abs() < 1e-13, "{pull}");
}
