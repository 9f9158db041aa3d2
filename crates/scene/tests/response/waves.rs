//! Fits of speeds and attenuations of shear waves.

use std::fmt::Write;
use std::path::Path;

use myovib_scene::fit::Outcome;

use crate::fits::{CONSTANTS, RHEOMETER, TRUE, attempt, fit, written};

/// Returns the rheometer with a wave of this density as its outputs.
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
        // Ten times the tolerance of the fit.
        assert!((value / exact - 1.0).abs() < 1e-4, "{value} {exact}");
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
