//! A slab in harmonic shear: closed form for Rayleigh, Kelvin–Voigt, Prony and springpot damping.

use std::ops::Range;

use num_complex::Complex64;
use serde_json::Value;

use crate::{column, error, number, reference, response};

/// Returns the lines of [solid] and of the material.
fn material(name: &str) -> [&'static str; 2] {
    match name {
        "rayleigh" => [
            "rayleigh_mass = 1.0\nrayleigh_stiffness = 1e-4",
            "shear_modulus = 20400.0",
        ],
        "kelvin_voigt" => ["", "shear_modulus = 20400.0\nviscosity = 10.0"],
        "prony2" => [
            "",
            "shear_modulus = 20400.0\nprony = [{ relative_modulus = 0.3, relaxation_time = 0.05 }, { relative_modulus = 0.2, relaxation_time = 0.002 }]",
        ],
        // A plain springpot: the modulus of the law is below rounding errors.
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

/// Frequencies of the case up to 70 Hz, and the others, whose waves are up to five times shorter.
const LONG_WAVES: Range<usize> = 0..4;
const SHORT_WAVES: Range<usize> = 4..6;

/// Returns the errors of the slab with `n` cells across, relative to the largest value of the row.
fn errors(
    case: &Value,
    name: &str,
    [drive, kappa]: [&str; 2],
    rows: Range<usize>,
    n: usize,
) -> Vec<f64> {
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
    let mut errors = Vec::new();
    for (k, row) in rows.iter().enumerate() {
        for (probe, place) in [
            ("p25", "H/4"),
            ("p50", "H/2"),
            ("p75", "3H/4"),
            ("p100", "H"),
        ] {
            let expected = exact(&row[drive][place]);
            errors.push(error(column(&found, probe, "u_x")[k], expected));
        }
        if drive == "displacement_driven" {
            let force = column(&found, "face", "R_x")[k] / width;
            errors.push(error(force, exact(&row[drive]["face_traction"])));
        }
    }
    errors
}

const MATERIALS: [&str; 5] = [
    "rayleigh",
    "kelvin_voigt",
    "prony2",
    "springpot",
    "fractional_kelvin_voigt",
];

/// Checks that the largest error with `cells[1]` cells, twice as many as `cells[0]`, is below `limit`,
/// and that it falls by a factor in `ratios`.
fn expect_convergence(rows: &Range<usize>, cells: [usize; 2], limit: f64, ratios: &Range<f64>) {
    let case = reference("s13_01_shear_slab.json");
    for name in MATERIALS {
        for drive in ["traction_driven", "displacement_driven"] {
            for kappa in ["1e5", "inf"] {
                let [coarse, fine] = cells.map(|n| {
                    let errors = errors(&case, name, [drive, kappa], rows.clone(), n).into_iter();
                    errors.fold(0.0, f64::max)
                });
                assert!(fine < limit, "{name} {drive} {kappa}: {fine:e}");
                let ratio = coarse / fine;
                assert!(ratios.contains(&ratio), "{name} {drive} {kappa}: {ratio}");
            }
        }
    }
}

#[test]
fn slab_in_shear_converges_to_the_closed_form() {
    // Twice the largest error found; a factor of 8 = 2³ in the limit.
    expect_convergence(&LONG_WAVES, [16, 32], 2.5e-4, &(7.5..10.0));
}

#[test]
fn short_waves_converge_to_the_closed_form() {
    // Twice the largest error found; the largest error changes its place, so the observed order is
    // between 2.5 and 4.
    expect_convergence(&SHORT_WAVES, [64, 128], 2.5e-4, &(5.6..16.0));
}
