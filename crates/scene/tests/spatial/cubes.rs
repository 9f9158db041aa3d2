//! Homogeneous states of incompressible cubes with closed-form stresses.

use std::path::Path;

use myovib_scene::Scene;

use crate::{BLOCK, results};

const ROLLERS: &str = r#"
[[fixed]]
group = "left"
components = ["x"]
[[fixed]]
group = "front"
components = ["y"]
[[fixed]]
group = "bottom"
components = ["z"]
"#;

/// Returns a unit cube of a law, two cells long, with its supports and dead tractions (group and
/// components).
fn cube(material: &str, supports: &str, tractions: &[(&str, [f64; 3])]) -> Scene {
    let of_group = |(group, [x, y, z]): &(&str, [f64; 3])| {
        format!("[[traction]]\ngroup = \"{group}\"\nx = {x:e}\ny = {y:e}\nz = {z:e}\n")
    };
    let tractions: String = tractions.iter().map(of_group).collect();
    let text = BLOCK
        .replace("size = [2.0, 1.0, 1.0]", "size = [1.0, 1.0, 1.0]")
        .replace("bulk_modulus = 1e5", "bulk_modulus = inf")
        .replace("law = \"mooney-rivlin\"\ndensity = 1e3\nc10 = 1e4\nc01 = 2e2", material)
        .replace("[[fixed]]\ngroup = \"left\"\n", supports)
        .replace("[[traction]]\ngroup = \"right\"\nz = 100.0\n", &tractions)
        .replace("[[probe]]\nname = \"support\"\ntype = \"reaction\"\ngroup = \"left\"\n", "")
        .replace("at = [2.0, 0.5, 0.5]", "at = [1.0, 1.0, 1.0]");
    Scene::build("scene.toml", &text, &[], Path::new("")).unwrap()
}

/// Returns the Mooney–Rivlin law.
fn mooney_rivlin([c10, c01]: [f64; 2]) -> String {
    format!("law = \"mooney-rivlin\"\ndensity = 1e3\nc10 = {c10}\nc01 = {c01}")
}

/// Returns displacement and pressure of the corner farthest from the supports.
fn corner(scene: &Scene) -> [f64; 4] {
    let results = results(scene);
    ["u_x", "u_y", "u_z", "p"].map(|name| results["end"][name].as_f64().unwrap())
}

fn assert_close(found: &[f64], expected: &[f64]) {
    assert_eq!(found.len(), expected.len());
    for (a, b) in found.iter().zip(expected) {
        // The exact state is in the finite element space. The Newton iteration ends at 1e-9 of displacement and
        // pressure, and tangents are below a hundred Pa.
        let error = (a - b).abs();
        assert!(error < 1e-8 * b.abs().max(1.0), "{found:?} {expected:?}");
    }
}

/// Returns the pressure -tr σ/3 of σ = 2 c10 dev B - 2 c01 dev B⁻¹ - p I. Its normal stress is zero
/// along an axis where B has the eigenvalue `b`. `traces` are the traces of B and of its inverse.
fn pressure_of_free_axis([c10, c01]: [f64; 2], b: f64, traces: [f64; 2]) -> f64 {
    2.0 * c10 * (b - traces[0] / 3.0) - 2.0 * c01 * (1.0 / b - traces[1] / 3.0)
}

/// Checks that the nominal stress of 13.125 Pa leads to the stretch 2 and, because the volume is constant, to the
/// transverse stretches 2^(-1/2).
#[test]
fn an_incompressible_cube_is_pulled_to_twice_its_length() {
    let constants = [2.5; 2];
    let load = [("right", [13.125, 0.0, 0.0])];
    let scene = cube(&mooney_rivlin(constants), ROLLERS, &load);
    let across = 0.5_f64.sqrt() - 1.0;
    let pressure = pressure_of_free_axis(constants, 0.5, [5.0, 4.25]);
    assert_close(&corner(&scene), &[1.0, across, across, pressure]);
}

/// Checks two equal stretches λ under equal nominal stresses P = 2 (λ - λ⁻⁵)(c10 + c01 λ²). Beyond λ = 2, dead loads
/// would make the two stretches differ, by c10 (2 + 2 λ⁻⁶) + c01 (6 λ⁻⁴ - 2 λ²) < 0.
#[test]
fn an_incompressible_cube_is_pulled_and_pushed_along_two_axes() {
    let [c10, c01] = [4.0, 1.0];
    let law = mooney_rivlin([c10, c01]);
    for l in [0.8_f64, 1.2, 1.6] {
        let stress = 2.0 * (l - l.powi(-5)) * (c10 + c01 * l * l);
        let loads = [("right", [stress, 0.0, 0.0]), ("back", [0.0, stress, 0.0])];
        let (thinner, square) = (l.powi(-2), l * l);
        let traces = [2.0 * square + thinner.powi(2), 2.0 * thinner + square.powi(2)];
        let pressure = pressure_of_free_axis([c10, c01], thinner.powi(2), traces);
        let found = corner(&cube(&law, ROLLERS, &loads));
        assert_close(&found, &[l - 1.0, l - 1.0, thinner - 1.0, pressure]);
    }
}

/// Checks simple shear x + k y between two plates, with free faces along z. The nominal stress is P e_x = (-2 c01 k², 2
/// k (c10 + c01 + c01 k²)) on the sides, P e_y = (2 k (c10 + c01), -2 c01 k²) on the plates. The normal stress pushes
/// the plates apart (Poynting effect).
#[test]
fn an_incompressible_cube_is_sheared() {
    let [c10, c01] = [4.0, 1.0];
    let law = mooney_rivlin([c10, c01]);
    for k in [0.2, 0.8] {
        let plates = format!(
            "[[fixed]]\ngroup = \"front\"\n[[prescribed_displacement]]\ngroup = \"back\"\nx = {k}\ny = 0.0\nz = 0.0\n\
             [[probe]]\nname = \"plate\"\ntype = \"reaction\"\ngroup = \"front\"\n\
             [[probe]]\nname = \"side\"\ntype = \"point\"\nat = [1.0, 0.5, 1.0]\n"
        );
        let on_side = [-2.0 * c01 * k * k, 2.0 * k * (c10 + c01 + c01 * k * k), 0.0];
        let loads = [("left", on_side.map(|t| -t)), ("right", on_side)];
        let results = results(&cube(&law, &plates, &loads));
        let found = |probe: &str, names: &[&str]| -> Vec<f64> {
            let of = |name: &&str| results[probe][name].as_f64().unwrap();
            names.iter().map(of).collect()
        };
        let pressure = pressure_of_free_axis([c10, c01], 1.0, [3.0 + k * k; 2]);
        assert_close(&found("side", &["u_x", "u_y", "u_z", "p"]), &[0.5 * k, 0.0, 0.0, pressure]);
        // The force acts on 1 m² with the outward normal -e_y.
        assert_close(
            &found("plate", &["R_x", "R_y", "R_z"]),
            &[-2.0 * k * (c10 + c01), 2.0 * c01 * k * k, 0.0],
        );
    }
}

/// Checks a cube of the transverse law between rollers, stretched along and across its fibers. The nominal
/// stresses for a stretch λ are known in closed form. Along: P = 2 (λ - λ⁻²)(c10 + c01/λ) + T(λ)/λ. Across: the stretch
/// of the fiber is μ and the stretch of the other side is 1/(λ μ). Both sides are free.
#[test]
fn an_incompressible_cube_is_pulled_along_and_across_its_fibers() {
    let (c10, c01, c3, c4, c5, straight) = (1e4, 2e2, 500.0, 8.0, 1.2e4, 1.1);
    let law = format!(
        "law = \"transverse-mooney-rivlin\"\ndensity = 1e3\nc10 = {c10}\nc01 = {c01}\nc3 = {c3}\nc4 = {c4}\n\
         c5 = {c5}\nstretch_max = {straight}"
    );
    let crimped = |l: f64| c3 * ((c4 * (l - 1.0)).exp() - 1.0);
    let tension = |l: f64| match l {
        l if l < 1.0 => 0.0,
        l if l < straight => crimped(l),
        l => c5 * (l - straight) + crimped(straight),
    };
    // This is the difference between the Cauchy stresses along two axes, given the third stretch.
    let matrix = |a: f64, b: f64, c: f64| 2.0 * (a * a - b * b) * (c10 + c01 * c * c);
    let along = |l: f64| (matrix(l, l.powf(-0.5), l.powf(-0.5)) + tension(l)) / l;
    // Bisection finds the stretch μ of the free fibers for the stretch λ across them.
    let fiber = |l: f64| {
        let free = |m: f64| matrix(m, 1.0 / (l * m), l) + tension(m);
        let (mut low, mut high) = (0.5, 2.0);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            *(if free(middle) < 0.0 { &mut low } else { &mut high }) = middle;
        }
        0.5 * (low + high)
    };
    let across = |l: f64| {
        let m = fiber(l);
        (matrix(l, m, 1.0 / (l * m)) - tension(m)) / l
    };
    let pulled = |direction: &str, stress: f64| {
        let material = format!("{law}\nfiber = {direction}");
        let [x, y, z, _] = corner(&cube(&material, ROLLERS, &[("right", [stress, 0.0, 0.0])]));
        [1.0 + x, 1.0 + y, 1.0 + z]
    };
    // The cases include shortened, crimped and straight fibers.
    assert!(fiber(1.2) < 1.0 && (1.0..straight).contains(&fiber(0.9)) && fiber(0.75) > straight);
    for l in [0.75_f64, 0.9, 1.05, 1.2] {
        let (side, m) = (l.powf(-0.5), fiber(l));
        for (found, expected) in [
            (pulled("[1, 0, 0]", along(l)), [l, side, side]),
            (pulled("[0, 1, 0]", across(l)), [l, m, 1.0 / (l * m)]),
        ] {
            for (found, expected) in found.iter().zip(expected) {
                // The exact state is in the finite element space. The Newton iteration ends at 1e-9 of the
                // displacement.
                assert!((found - expected).abs() < 1e-8, "{l}: {found} {expected}");
            }
        }
    }
}
