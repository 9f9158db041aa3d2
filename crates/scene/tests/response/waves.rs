//! Fits of speeds and attenuations of shear waves.

use std::fmt::Write;
use std::path::Path;

use myovib_scene::fit::Outcome;
use serde_json::Value;

use crate::fits::{CONSTANTS, RHEOMETER, TRUE, attempt, attempt_to, fit, written};
use crate::{number, reference};

/// Returns the rheometer scene whose outputs are computed from a wave in a tissue of this density.
fn elastography(density: f64) -> String {
    let outputs = RHEOMETER.find("[[output]]").unwrap();
    let response = RHEOMETER.find("[response]").unwrap();
    let output = |quantity: &str| {
        format!(
            "[[output]]\nname = \"{quantity}\"\nprobe = \"face\"\ncolumn = \"R_x\"\n\
             shear_wave = {{ quantity = \"{quantity}\", density = {density:?} }}\n"
        )
    };
    let (speed, attenuation) = (output("speed"), output("attenuation"));
    format!("{}{speed}{attenuation}{}", &RHEOMETER[..outputs], &RHEOMETER[response..])
}

/// Writes speed and attenuation of plane waves in the springpot, from the closed form with |G*|.
fn waves([shear, modulus, exponent]: [f64; 3], density: f64, file: &Path) {
    let mut text = String::from("f,speed,attenuation\n");
    for i in 0..8 {
        let f = 10.0 + 10.0 * f64::from(i);
        let s = num_complex::Complex64::new(0.0, std::f64::consts::TAU * f);
        let g = shear + modulus.powf(1.0 - exponent) * s.powf(exponent);
        let size = g.norm();
        let speed = (2.0 * size.powi(2) / (density * (g.re + size))).sqrt();
        let attenuation = s.im * (density * (size - g.re) / 2.0).sqrt() / size;
        writeln!(text, "{f:e},{speed:e},{attenuation:e}").unwrap();
    }
    std::fs::write(file, text).unwrap();
}

#[test]
fn speeds_and_attenuations_of_waves_give_their_springpot() {
    let folder = tempfile::tempdir().unwrap();
    let path = written(folder.path(), &elastography(1060.0), &CONSTANTS);
    let data = folder.path().join("measured.csv");
    waves(TRUE, 1060.0, &data);
    let found = fit(&path, &data);
    assert_eq!(found.outcome(), Outcome::Converged);
    for (value, exact) in found.fit.values.iter().zip(TRUE) {
        // The tolerance is ten times the tolerance of the fit.
        assert!((value / exact - 1.0).abs() < 1e-4, "{value} {exact}");
    }
}

/// Writes the table of a model of the references, with these relative standard deviations if any.
fn table(model: &Value, noise: Option<f64>, file: &Path) {
    let mut text = String::from("f,speed,attenuation,speed.noise,attenuation.noise\n");
    for row in model["rows"].as_array().unwrap() {
        let [f, speed, attenuation] =
            ["f_hz", "speed_m_s", "attenuation_1_m"].map(|key| number(&row[key]));
        let noise = [speed, attenuation]
            .map(|x| noise.map_or(String::new(), |noise| (noise * x).to_string()));
        writeln!(text, "{f:e},{speed:e},{attenuation:e},{},{}", noise[0], noise[1]).unwrap();
    }
    std::fs::write(file, text).unwrap();
}

/// Returns the scene of a material whose inertia is negligible to ten digits at 1 kHz.
fn of_material(lines: &str) -> String {
    let text = elastography(1100.0)
        .replace("density = 1e-9", "density = 1e-20")
        .replace("1..100:", "10..1000:");
    let own = text.find("shear_modulus").unwrap();
    let end = text.find("[[fixed]]").unwrap();
    format!("{}{lines}\n{}", &text[..own], &text[end..])
}

/// Checks that fits of exact tables of plane waves at 10 to 1000 Hz return the constants, starting from twice their
/// values.
#[test]
fn exact_tables_of_waves_give_the_constants_of_their_models() {
    let case = reference("s13_03_plane_wave.json");
    let folder = tempfile::tempdir().unwrap();
    let spring = |shear: f64, modulus: f64, viscosity: f64, exponent: f64| {
        format!(
            "shear_modulus = {shear:e}\nspringpot = {{ modulus = {modulus:e}, viscosity = {viscosity:e}, exponent = {exponent:e} }}"
        )
    };
    let branches = "shear_modulus = 12000.0\nprony = [{ relative_modulus = 1.2, relaxation_time = 0.02 }, \
                    { relative_modulus = 0.8, relaxation_time = 0.002 }]";
    let [shear, viscosity] = ["material[0].shear_modulus", "material[0].viscosity"];
    let [modulus, exponent] = ["material[0].springpot.modulus", "material[0].springpot.exponent"];
    let prony = [
        shear,
        "material[0].prony[0].relative_modulus",
        "material[0].prony[0].relaxation_time",
        "material[0].prony[1].relative_modulus",
        "material[0].prony[1].relaxation_time",
    ];
    for (name, lines, keys, exact) in [
        (
            "springpot_relaxed",
            spring(1e-13, 5360.0, 1.0, 0.506),
            &[modulus, exponent][..],
            &[2680.0, 0.253][..],
        ),
        (
            "springpot_contracted",
            spring(1e-13, 7740.0, 1.0, 0.54),
            &[modulus, exponent][..],
            &[3870.0, 0.27][..],
        ),
        (
            "fractional_kelvin_voigt",
            spring(1e4, 6000.0, 3.7, 0.6),
            &[shear, modulus, exponent][..],
            &[5000.0, 3000.0, 0.3][..],
        ),
        (
            "kelvin_voigt",
            "shear_modulus = 12000.0\nviscosity = 16.0".to_owned(),
            &[shear, viscosity][..],
            &[6000.0, 8.0][..],
        ),
        ("prony2", branches.to_owned(), &prony[..], &[6000.0, 0.6, 0.01, 0.4, 0.001][..]),
    ] {
        let path = written(folder.path(), &of_material(&lines), keys);
        let data = folder.path().join("measured.csv");
        table(&case["at_rest"]["models"][name], None, &data);
        let found = attempt_to(1e-12, &path, vec![(data, Vec::new())]).unwrap();
        assert_eq!(found.outcome(), Outcome::Converged, "{name}");
        for (value, exact) in found.fit.values.iter().zip(exact) {
            // The constants have ten digits, because the fit amplifies rounding errors of 1e-15 in the table.
            assert!((value / exact - 1.0).abs() < 1e-10, "{name}: {value} {exact}");
        }
    }
}

/// Checks that only μ^(1−a) η^a and a of a plain springpot have an effect: along (a, −(1−a), 0), relative changes of μ, η
/// and a cancel.
#[test]
fn waves_do_not_determine_modulus_and_viscosity_of_a_springpot() {
    let case = reference("s13_03_plane_wave.json");
    let folder = tempfile::tempdir().unwrap();
    let keys =
        ["modulus", "viscosity", "exponent"].map(|key| format!("material[0].springpot.{key}"));
    let lines = "shear_modulus = 1e-13\nspringpot = { modulus = 2680.0, viscosity = 1.0, exponent = 0.253 }";
    let path = written(folder.path(), &of_material(lines), &keys.each_ref().map(String::as_str));
    let data = folder.path().join("measured.csv");
    table(&case["at_rest"]["models"]["springpot_relaxed"], Some(0.01), &data);
    let found = attempt(&path, vec![(data, Vec::new())]).unwrap();
    let unknown = found.unknown();
    assert_eq!(unknown.len(), 1, "{:?}", found.identifiability);
    let a: f64 = 0.253;
    let expected = [a, a - 1.0, 0.0].map(|share| share / a.hypot(1.0 - a));
    let sign = expected[0].signum() * unknown[0].shares[0].signum();
    for (own, expected) in unknown[0].shares.iter().zip(expected) {
        // The tolerance covers rounding errors relative to the sensitivities of the other directions.
        assert!((sign * own - expected).abs() < 1e-6, "{:?}", unknown[0]);
    }
}

#[test]
fn wrong_waves_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let refused = |text: &str, rows: &str| {
        let path = written(folder.path(), text, &CONSTANTS);
        let data = folder.path().join("measured.csv");
        std::fs::write(&data, format!("f,speed,attenuation\n{rows}\n")).unwrap();
        let error = attempt(&path, vec![(data, Vec::new())]).unwrap_err();
        assert!(!folder.path().join("fit").exists());
        error.to_string()
    };
    let text = elastography(1060.0);
    for (text, rows, place) in [
        (&text, "10.0,0.0,1.0", "line 2, column speed"),
        (&text, "10.0,1.0,-1.0", "line 2, column attenuation"),
        (&elastography(0.0), "10.0,1.0,1.0", "density"),
        (&text.replace("\"R_x\"", "\"R_x_re\""), "10.0,1.0,1.0", "column"),
        (&text.replace("\"speed\", d", "\"group\", d"), "10.0,1.0,1.0", "quantity"),
        (
            &text.replace("analysis = \"response\"", "analysis = \"static\""),
            "10.0,1.0,1.0",
            "shear_wave",
        ),
    ] {
        let error = refused(text, rows);
        assert!(error.contains(place), "{place}: {error}");
    }
}
