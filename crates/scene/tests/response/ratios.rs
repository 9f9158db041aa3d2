//! Transmissibility, impedance and apparent mass of a shaken slab against closed forms.

use myovib_scene::fit::Outcome;
use num_complex::Complex64;

use crate::fits::{fit, written};
use crate::refusals::refusal_of;
use crate::{column, response};

/// Frequencies, Hz.
const FREQUENCIES: [f64; 3] = [10.0, 40.0, 70.0];

const RATIOS: [&str; 3] = ["transmissibility", "impedance", "apparent-mass"];

/// Returns a viscous slab on a rigid base, shaken at its upper face, with `n` cells across its thickness.
pub(crate) fn slab(n: usize) -> String {
    let width = 0.03 / n as f64;
    let held = ["left", "right", "top"]
        .map(|group| format!("[[fixed]]\ngroup = \"{group}\"\ncomponents = [\"y\"]\n"));
    format!(
        r#"analysis = "response"
[mesh]
type = "rectangle"
width = {width:?}
height = 0.03
cells = [1, {n}]
[solid]
bulk_modulus = inf
[[material]]
law = "neo-hooke"
density = 1100.0
shear_modulus = 20400.0
viscosity = 10.0
[[fixed]]
group = "bottom"
{held}
[[prescribed_displacement]]
group = "top"
response = {{ x = 1e-3, phase = 30.0 }}
[[probe]]
name = "top"
type = "point"
at = [0.0, 0.03]
quantities = ["u"]
[[probe]]
name = "middle"
type = "point"
at = [0.0, 0.015]
quantities = ["u", "v"]
[[probe]]
name = "face"
type = "reaction"
group = "top"
[response]
frequencies = {FREQUENCIES:?}
[[response.ratio]]
name = "transmissibility"
numerator = "middle.v_x"
denominator = "top.v_x"
[[response.ratio]]
name = "impedance"
numerator = "face.R_x"
denominator = "top.v_x"
[[response.ratio]]
name = "apparent-mass"
numerator = "face.R_x"
denominator = "top.a_x"
"#,
        held = held.concat()
    )
}

/// Returns the ratios at a frequency, from the closed form for a slab with this shear modulus and viscosity.
fn exact([shear_modulus, viscosity]: [f64; 2], width: f64, f: f64) -> [Complex64; 3] {
    let s = Complex64::new(0.0, std::f64::consts::TAU * f);
    let modulus = shear_modulus + s * viscosity / 2.0;
    let wavenumber = s / Complex64::I * (1100.0 / modulus).sqrt();
    let phase = wavenumber * 0.03;
    let stiffness = width * modulus * wavenumber * phase.cos() / phase.sin();
    [(0.5 * phase).sin() / phase.sin(), stiffness / s, stiffness / (s * s)]
}

/// Returns the largest relative error of each ratio.
fn errors(n: usize) -> [f64; 3] {
    let found = response(&slab(n));
    let mut errors = [0.0_f64; 3];
    for (i, f) in FREQUENCIES.into_iter().enumerate() {
        let exact = exact([20400.0, 10.0], 0.03 / n as f64, f);
        for ((error, exact), name) in errors.iter_mut().zip(exact).zip(RATIOS) {
            let relative = (column(&found, name, name)[i] / exact - 1.0).norm();
            *error = error.max(relative);
        }
    }
    errors
}

#[test]
fn ratios_of_a_slab_converge_to_the_closed_form() {
    let [coarse, fine] = [16, 32].map(errors);
    for ((coarse, fine), name) in coarse.into_iter().zip(fine).zip(RATIOS) {
        // With quadratic elements, displacements at points converge with order 3 and the force with order 4.
        assert!(fine < 1e-4 && fine < coarse / 7.0, "{name}: {coarse:e} {fine:e}");
    }
}

/// Fits shear modulus and viscosity to the transmissibility of the closed form.
#[test]
fn a_fitted_transmissibility_gives_modulus_and_viscosity() {
    let folder = tempfile::tempdir().unwrap();
    let outputs = ["amplitude", "phase"].map(|part| {
        format!(
            "[[output]]\nname = \"{part}\"\nprobe = \"transmissibility\"\n\
             column = \"transmissibility_{part}\"\nnoise = 1e-3\n"
        )
    });
    let text = slab(16) + &outputs.concat();
    let path = written(
        folder.path(),
        &text.replace("shear_modulus = 20400.0", "shear_modulus = 15e3"),
        &["material[0].shear_modulus", "material[0].viscosity"],
    );
    let constants = [24e3, 16.0];
    let rows = FREQUENCIES.map(|f| {
        let [gain, ..] = exact(constants, 0.03 / 16.0, f);
        format!("{f},{:e},{:e}\n", gain.norm(), gain.arg().to_degrees())
    });
    let data = folder.path().join("measured.csv");
    std::fs::write(&data, format!("f,amplitude,phase\n{}", rows.concat())).unwrap();
    let found = fit(&path, &data);
    assert_eq!(found.outcome(), Outcome::Converged);
    for (value, exact) in found.fit.values.iter().zip(constants) {
        // The elements have errors of up to 1e-3 on this mesh.
        assert!((value / exact - 1.0).abs() < 1e-3, "{value} {exact}");
    }
}

#[test]
fn invalid_ratios_are_refused_at_their_key() {
    for (from, to, place) in [
        ("\"middle.v_x\"", "\"middle.v_z\"", "numerator"),
        ("\"middle.v_x\"", "\"middle.p\"", "numerator"),
        ("\"top.a_x\"", "\"face.v_x\"", "denominator"),
        ("\"impedance\"", "\"face\"", "name"),
        ("\"impedance\"", "\"a/b\"", "name"),
        // The bottom does not move.
        ("at = [0.0, 0.03]", "at = [0.0, 0.0]", "denominator"),
        ("[10.0, 40.0, 70.0]", "[0.0]", "denominator"),
    ] {
        let text = slab(2);
        assert!(text.contains(from));
        let error = refusal_of(&text.replacen(from, to, 1), &[]).unwrap();
        assert!(error.contains(place), "{to}: {error}");
    }
}

/// Regression: rounding errors of the constant amplitude gave thousands of peaks.
#[test]
fn a_shaken_support_has_no_peaks() {
    for frequencies in ["5..150:60", "5..150:adaptive"] {
        let given = format!("frequencies = {FREQUENCIES:?}");
        let text = slab(8).replace(&given, &format!("frequencies = \"{frequencies}\""));
        let peaks = response(&text).peaks;
        assert!(peaks.iter().any(|peak| peak.probe == "middle"), "{frequencies}");
        assert!(peaks.iter().all(|peak| peak.probe != "top"), "{frequencies}");
    }
}
