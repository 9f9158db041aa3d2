//! A slab in harmonic shear: closed form for Rayleigh, Kelvin–Voigt, Prony and springpot damping.

use std::ops::Range;

use num_complex::Complex64;
use serde_json::Value;

use crate::{column, number, reference, response};

/// Returns the lines of [solid] and of the material.
fn material(name: &str) -> [&'static str; 2] {
    match name {
        "rayleigh" => ["rayleigh_mass = 1.0\nrayleigh_stiffness = 1e-4", "shear_modulus = 20400.0"],
        "kelvin_voigt" => ["", "shear_modulus = 20400.0\nviscosity = 10.0"],
        "prony2" => [
            "",
            "shear_modulus = 20400.0\nprony = [{ relative_modulus = 0.3, relaxation_time = 0.05 }, { relative_modulus = 0.2, relaxation_time = 0.002 }]",
        ],
        // A single springpot: the modulus of the law is below rounding errors.
        "springpot" => [
            "",
            "shear_modulus = 1e-13\nspringpot = { modulus = 5000.0, viscosity = 1.0, exponent = 0.25 }",
        ],
        "fractional_kelvin_voigt" => [
            "",
            "shear_modulus = 5000.0\nspringpot = { modulus = 3000.0, viscosity = 3.7, exponent = 0.3 }",
        ],
        other => panic!("{other}"),
    }
}

/// Frequencies of a case up to 70 Hz. The waves of the remaining frequencies are up to five times shorter.
const LONG_WAVES: Range<usize> = 0..4;
const SHORT_WAVES: Range<usize> = 4..6;

/// Returns the relative errors of the slab with `n` cells across its thickness: of displacements at points, and of the
/// traction at the face.
fn errors(
    case: &Value,
    name: &str,
    [drive, kappa]: [&str; 2],
    rows: Range<usize>,
    n: usize,
) -> [Vec<Complex64>; 2] {
    let [solid, own] = material(name);
    let rows = &case["materials"][name]["rows"].as_array().unwrap()[rows];
    let frequencies: Vec<String> = rows.iter().map(|row| row["f_hz"].to_string()).collect();
    let load = match drive {
        "traction_driven" => "[[traction]]\ngroup = \"top\"\nresponse = { x = 100.0 }",
        _ => "[[prescribed_displacement]]\ngroup = \"top\"\nresponse = { x = 1e-3 }",
    };
    let held = ["left", "right", "top"]
        .map(|group| format!("[[fixed]]\ngroup = \"{group}\"\ncomponents = [\"y\"]\n"));
    let places = [0.25, 0.5, 0.75, 1.0];
    let probes = places.map(|y| {
        format!(
            "[[probe]]\nname = \"p{}\"\ntype = \"point\"\nat = [0.0, {:?}]\nquantities = [\"u\"]\n",
            100.0 * y,
            0.03 * y
        )
    });
    let text = format!(
        "analysis = \"response\"\n[mesh]\ntype = \"rectangle\"\nwidth = {width:?}\nheight = 0.03\ncells = [1, {n}]\n\
         [solid]\nbulk_modulus = {kappa}\n{solid}\n[[material]]\nlaw = \"neo-hooke\"\ndensity = 1100.0\n{own}\n\
         [response]\nfrequencies = [{}]\n[[fixed]]\ngroup = \"bottom\"\n{}{load}\n{}\
         [[probe]]\nname = \"face\"\ntype = \"reaction\"\ngroup = \"top\"\n",
        frequencies.join(", "),
        held.concat(),
        probes.concat(),
        width = 0.03 / n as f64,
    );
    let found = response(&text);
    let width = 0.03 / n as f64;
    let exact = |value: &Value| Complex64::new(number(&value["re"]), number(&value["im"]));
    let error = |found: Complex64, expected: Complex64| (found - expected) / expected.norm();
    let [mut points, mut face] = [Vec::new(), Vec::new()];
    for (k, row) in rows.iter().enumerate() {
        for (probe, place) in [("p25", "H/4"), ("p50", "H/2"), ("p75", "3H/4"), ("p100", "H")] {
            let expected = exact(&row[drive][place]);
            points.push(error(column(&found, probe, "u_x")[k], expected));
        }
        if drive == "displacement_driven" {
            let force = column(&found, "face", "R_x")[k] / width;
            face.push(error(force, exact(&row[drive]["face_traction"])));
        }
    }
    [points, face]
}

const MATERIALS: [&str; 5] =
    ["rayleigh", "kelvin_voigt", "prony2", "springpot", "fractional_kelvin_voigt"];

/// All cases of loads and compressibilities.
const CASES: [[&str; 2]; 4] = [
    ["traction_driven", "1e5"],
    ["traction_driven", "inf"],
    ["displacement_driven", "1e5"],
    ["displacement_driven", "inf"],
];

fn largest(errors: &[Complex64]) -> f64 {
    errors.iter().map(|error| error.norm()).fold(0.0, f64::max)
}

#[test]
fn slab_in_shear_converges_to_the_closed_form() {
    let reference = reference("s13_01_shear_slab.json");
    for name in MATERIALS {
        for case in CASES {
            let [coarse, fine] = [16, 32].map(|n| {
                let errors = errors(&reference, name, case, LONG_WAVES, n);
                largest(&errors.concat())
            });
            // The tolerance is twice the largest observed error. In the limit, the errors decrease by a factor of 8 =
            // 2³.
            assert!(fine < 2.5e-4, "{name} {case:?}: {fine:e}");
            let ratio = coarse / fine;
            assert!((7.5..10.0).contains(&ratio), "{name} {case:?}: {ratio}");
        }
    }
}

/// Checks short waves. The error of a displacement at a point is A h³ + B h⁴ with complex A and B: h³ is the order of
/// the interpolation by quadratic elements, and the error of the wavelength, of order h⁴, accumulates over the
/// wavelengths from the face. For short waves B h is as large as A on all of these meshes, so neither order can be
/// observed alone: where both terms cancel, the error may decrease by any factor. Extrapolation from two meshes removes
/// the first term, and the remainder decreases by a factor of 16. The traction at the face follows from the balance of
/// forces of the whole slab, without interpolation errors, so its error also decreases by a factor of 16.
#[test]
fn short_waves_converge_to_the_closed_form() {
    let reference = reference("s13_01_shear_slab.json");
    for name in MATERIALS {
        for case in CASES {
            let [coarse, middle, fine] =
                [64, 128, 256].map(|n| errors(&reference, name, case, SHORT_WAVES, n));
            // The tolerance is twice the largest observed error.
            let error = largest(&fine.concat());
            assert!(error < 3.5e-5, "{name} {case:?}: {error:e}");
            let [points, face] = [0, 1].map(|k| [&coarse[k], &middle[k], &fine[k]]);
            let extrapolated = |coarse: &[Complex64], fine: &[Complex64]| {
                let pairs = coarse.iter().zip(fine);
                pairs.map(|(a, b)| (8.0 * b - a) / 7.0).collect::<Vec<_>>()
            };
            let points = [extrapolated(points[0], points[1]), extrapolated(points[1], points[2])];
            let face = [face[0].clone(), face[1].clone()];
            for [coarse, fine] in [points, face] {
                for (coarse, fine) in coarse.iter().zip(&fine) {
                    // Below 1e-8, B is near zero or the value is prescribed, so that smaller terms and rounding errors
                    // dominate.
                    let ratio = coarse.norm() / fine.norm();
                    let is_of_order_4 = (15.0..17.5).contains(&ratio) || coarse.norm() < 1e-8;
                    assert!(is_of_order_4, "{name} {case:?}: {coarse:e} {ratio}");
                }
            }
        }
    }
}
