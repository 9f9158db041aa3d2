//! Body forces that vary in space: resultants, and a published problem.

use std::path::Path;

use myovib_fem::element::TRIANGLE;
use myovib_fem::quadrature::Rule;
use myovib_fem::{ElementPoint, Space};
use myovib_model::statics::equilibrium;

use crate::common::{BLOCK, SHEET, assert_close, moments, scene, text};

/// Checks the acceleration 2 (1 + 3 y) m/s² along z with a density of 1e3 kg/m³, at half of the ramp.
#[test]
fn a_linear_body_force_in_space_has_the_resultant_and_moments_of_its_integral() {
    let force = "[[body_force]]\nz = { type = \"ramp\", value = 2.0, end = 2.0 }\n\
                 spatial_factor = \"1 + 3*y\"";
    let scene = scene(&text(BLOCK, "left", force), Path::new(""));
    for (t, part) in [(1.0, 0.5), (2.0, 1.0)] {
        let (moments, resultant) = moments(&scene, t);
        assert_eq!(resultant[..2], [0.0, 0.0]);
        assert_close(resultant[2], part * 1e4, 2e4);
        // The expected values are the integrals of x f_z, y f_z and z f_z over a box of 2 m by 1 m by 1 m.
        for (i, expected) in [1e4, 6e3, 5e3].into_iter().enumerate() {
            assert_close(moments[i][2], part * expected, 2e4);
        }
    }
}

/// Checks the acceleration (y, x y) m/s² with a density of 1e3 kg/m³.
#[test]
fn a_body_force_in_the_plane_has_the_resultant_and_moment_of_its_integral() {
    let forces = "[[body_force]]\nx = 1.0\nspatial_factor = \"y\"\n\
                  [[body_force]]\ny = 1.0\nspatial_factor = \"x*y\"";
    let (moments, resultant) = moments(&scene(&text(SHEET, "left", forces), Path::new("")), 0.0);
    assert_close(resultant[0], 1e3, 2e3);
    assert_close(resultant[1], 1e3, 2e3);
    // The expected value is the integral of x F_y - y F_x, which is ∫ x² y - ∫ y² over 2 m by 1 m.
    assert_close(moments[0][1] - moments[1][0], 1e3 * (4.0 - 2.0) / 3.0, 2e3);
}

/// Checks that the distribution may be non-finite outside its group, here for x < 1.
#[test]
fn a_body_force_is_asked_for_in_its_group_only() {
    let two = "[[region]]\nname = \"end\"\ncenter = [2.0, 0.5]\nradii = [1.0, 1e3]\n";
    let materials = ["body", "end"].map(|group| {
        format!(
            "[[material]]\ngroup = \"{group}\"\nlaw = \"neo-hooke\"\ndensity = 1e3\n\
             shear_modulus = 1e4\n"
        )
    });
    let text = format!(
        "analysis = \"static\"\n[mesh]\n{SHEET}\n{two}[solid]\nbulk_modulus = 1e5\n{}[[fixed]]\n\
         group = \"left\"\n[[body_force]]\ngroup = \"end\"\nx = 1.0\n\
         spatial_factor = \"x + 0*sqrt(x - 1)\"",
        materials.concat()
    );
    let (_, resultant) = moments(&scene(&text, Path::new("")), 0.0);
    // The expected value is ∫ x dx from 1 to 2.
    assert_close(resultant[0], 1.5e3, 3e3);
}

/// The problem of Auricchio, Beirão da Veiga, Lovadina, Reali (2005) on (-1, 1)², translated by (1, 1).
const CLAMPED_SQUARE: &str = r#"
analysis = "static"
[mesh]
type = "rectangle"
width = 2.0
height = 2.0
cells = [4, 4]
[solid]
bulk_modulus = inf
[[material]]
law = "small-strain"
density = 1.0
shear_modulus = 40.0
[[fixed]]
group = "left"
[[fixed]]
group = "right"
[[fixed]]
group = "bottom"
[[fixed]]
group = "top"
[[body_force]]
x = 1.0
spatial_factor = "40*Y*(-1.5*X^4 + 6*X^2 - 3*X^2*Y^2 + Y^2 - 2.5) - 15*X^2*(Y - 1)"
[[body_force]]
y = 1.0
spatial_factor = "40*X*(1.5*Y^4 - 6*Y^2 + 3*X^2*Y^2 - X^2 + 2.5) - 3*Y^2 - 5*X^3"
"#;

/// Returns the integrals of three functions of position, by a quadrature rule of degree 6 on 64 parts of each triangle.
fn integrals(space: &Space, of: impl Fn(&ElementPoint, [f64; 2]) -> [f64; 3]) -> [f64; 3] {
    let mut integrals = [0.0; 3];
    let cells = 8;
    let points = Rule::Degree6.points(&TRIANGLE);
    for element in 0..space.n_elements() {
        let part = space.mesh().measure_of(element) / f64::from(cells * cells);
        for (i, j) in (0..cells).flat_map(|i| (0..cells).map(move |j| (i, j))) {
            // Each part is the subtriangle with the orientation of the triangle, or its mirror image.
            for turned in [false, true] {
                if i + j + i32::from(turned) >= cells {
                    continue;
                }
                for q in &points {
                    let at = |base: i32, l: f64| match turned {
                        false => (f64::from(base) + l) / f64::from(cells),
                        true => (f64::from(base + 1) - l) / f64::from(cells),
                    };
                    let (a, b) = (at(i, q.barycentric[0]), at(j, q.barycentric[1]));
                    let at = ElementPoint { element, barycentric: [a, b, 1.0 - a - b].into() };
                    for (sum, value) in integrals.iter_mut().zip(of(&at, space.position(&at))) {
                        *sum += part * q.weight * value;
                    }
                }
            }
        }
    }
    integrals
}

#[test]
fn the_clamped_square_as_a_scene_has_the_errors_of_another_program() {
    let text = CLAMPED_SQUARE.replace('X', "(x - 1)").replace('Y', "(y - 1)");
    let scene = scene(&text, Path::new(""));
    let body = scene.body.as_ref().unwrap();
    let solid = &body.muscle.solid;
    let found = equilibrium(&body.muscle, body.formulation, 0.0).unwrap();
    let mut displacement = vec![0.0; solid.space().n_components()];
    for (&full, u) in solid.dofs().free_to_full().iter().zip(&found.displacement) {
        displacement[full] = *u;
    }
    let exact = |[x, y]: [f64; 2]| {
        let (x, y) = (x - 1.0, y - 1.0);
        let (a, b) = (x * x - 1.0, y * y - 1.0);
        let pressure = -(5.0 * x * x * x * (y - 1.0) + y * y * y);
        [a * a * b * y / 4.0, -b * b * a * x / 4.0, pressure]
    };
    let space = solid.space();
    let [of_u, of_p, mean] = integrals(space, |at, place| {
        let [x, y] = space.displacement_at::<2>(&displacement, at);
        let (exact, pressure) = (exact(place), space.pressure_at(&found.pressure, at));
        let squared = (x - exact[0]).powi(2) + (y - exact[1]).powi(2);
        let error = pressure - exact[2];
        [squared, error * error, error]
    });
    let reference = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../../data/references/s6_clamped_square_incompressible.json"
    );
    let reference = std::fs::read_to_string(reference).unwrap();
    let reference: serde_json::Value = serde_json::from_str(&reference).unwrap();
    // The mean pressure is arbitrary; the area is 4.
    let of_p = of_p - mean * mean / 4.0;
    for (found, name) in [(of_u.sqrt(), "L2_u"), (of_p.sqrt(), "L2_p")] {
        let stated = reference["deviator"][name][0].as_f64().unwrap();
        // The published values have four digits.
        assert!((found / stated - 1.0).abs() < 2e-4, "{name} {found} {stated}");
    }
}
