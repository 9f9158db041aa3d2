//! Derivatives of responses with respect to parameters, and fits of frequency data.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use myovib_model::sensitivity::Stencil;
use myovib_scene::Error;
use myovib_scene::fit::{FitOptions, FitResult, Loss, Outcome, compute};
use myovib_scene::run::Existing;
use myovib_scene::sensitivity::{
    Abscissa, Output, Parameterized, Precision, Sample, compute as follow, outputs, respond,
};
use myovib_scene::watch::Watcher;
use rand::{Rng, SeedableRng};

/// A beam on a foundation under tension and pressure, with all kinds of damping, shaken at its fixed end and loaded at
/// its tip.
const BEAM: &str = r#"analysis = "response"
[mesh]
type = "beam"
length = 0.1
height = 0.02
cells = [6, 2]
[solid]
bulk_modulus = 1e5
rayleigh_mass = 2.0
rayleigh_stiffness = 1e-4
[[material]]
law = "mooney-rivlin"
density = 1e3
c10 = 4e3
c01 = 1e3
viscosity = 5.0
prony = [{ relative_modulus = 0.3, relaxation_time = 0.02 }]
springpot = { modulus = 2e3, viscosity = 1.0, exponent = 0.3 }
[[fixed]]
group = "fixed"
components = ["x"]
[[prescribed_displacement]]
group = "fixed"
response = { y = 1e-4 }
[[traction]]
group = "load"
x = 100.0
response = { y = 2.0, phase = 30.0 }
[[elastic_foundation]]
group = "load"
stiffness = 1e4
damping = 10.0
[[probe]]
name = "tip"
type = "point"
at = [0.1, 0.0]
quantities = ["u", "p"]
[[probe]]
name = "clamp"
type = "reaction"
group = "fixed"
[response]
frequencies = "1..60:adaptive"
preload_time = 0.0
"#;

/// A ratio for the beam.
const MOBILITY: &str = r#"[[response.ratio]]
name = "mobility"
numerator = "tip.v_y"
denominator = "clamp.R_y"
"#;

const KEYS: [&str; 15] = [
    "solid.bulk_modulus",
    "solid.rayleigh_mass",
    "solid.rayleigh_stiffness",
    "material[0].density",
    "material[0].c10",
    "material[0].c01",
    "material[0].viscosity",
    "material[0].prony[0].relative_modulus",
    "material[0].prony[0].relaxation_time",
    "material[0].springpot.modulus",
    "material[0].springpot.exponent",
    "prescribed_displacement[0].response.y",
    "traction[0].x",
    "elastic_foundation[0].stiffness",
    "elastic_foundation[0].damping",
];

/// Writes a scene with these parameters and returns its path.
pub(crate) fn written(folder: &Path, text: &str, keys: &[&str]) -> PathBuf {
    let path = folder.join("scene.toml");
    let parameters = keys.iter().map(|key| {
        // This is the scale of 1/κ.
        let scale = match *key {
            "solid.bulk_modulus" => "scale = 1e-5\n",
            _ => "",
        };
        format!("[[parameter]]\nkey = \"{key}\"\n{scale}")
    });
    std::fs::write(&path, text.to_owned() + &parameters.collect::<String>()).unwrap();
    path
}

fn samples(
    scene: &Parameterized,
    values: &[f64],
    outputs: &[Output],
    frequencies: &[f64],
    with: bool,
) -> Vec<Sample> {
    respond(scene, values, outputs, frequencies, with, Watcher::NOBODY).unwrap()
}

/// Returns the derivatives of the outputs with respect to parameter `j` at each frequency, by difference quotients of
/// order 4 with a relative step. They are one-sided if the parameter is 0.
fn differences(
    scene: &Parameterized,
    j: usize,
    relative_step: f64,
    outputs: &[Output],
    frequencies: &[f64],
) -> Vec<Vec<f64>> {
    let values = scene.values();
    let step = relative_step * scene.parameters[j].scale;
    let stencil = match values[j] {
        0.0 => Stencil::Ahead,
        _ => Stencil::Central,
    };
    let mut sums = vec![vec![0.0; outputs.len()]; frequencies.len()];
    for (distance, weight) in stencil.points() {
        let mut values = values.clone();
        values[j] += distance * step;
        let near = samples(scene, &values, outputs, frequencies, false);
        for (sums, sample) in sums.iter_mut().zip(near) {
            for (sum, value) in sums.iter_mut().zip(sample.values) {
                *sum += weight / step * value;
            }
        }
    }
    sums
}

/// Compares derivatives, which are computed with the factorization of the response, with difference quotients of
/// complete responses, each about its own preload. Near resonances, density and stiffness shift the peaks by a fifth of
/// their width per 1 %: differences converge only with small steps.
#[test]
fn derivatives_are_limits_of_differences_of_order_four() {
    let folder = tempfile::tempdir().unwrap();
    let beam = format!("{BEAM}{MOBILITY}");
    for (set, text) in [
        (None, beam.clone()),
        (None, beam.replace("bulk_modulus = 1e5", "bulk_modulus = inf")),
        (Some("response.preload_time="), beam),
    ] {
        let path = written(folder.path(), &text, &KEYS);
        let set: Vec<String> = set.iter().map(|set| (*set).to_owned()).collect();
        let scene = Parameterized::load(&path, &set).unwrap();
        let mut outputs = outputs(&scene.scene).unwrap();
        // Amplitudes and phases follow from the real and imaginary parts.
        outputs.retain(|output| ["_re", "_im"].iter().any(|part| output.name.ends_with(part)));
        assert_eq!(outputs.len(), 12);
        let frequencies = [1.5, 9.0, 22.0, 60.0];
        let found = samples(&scene, &scene.values(), &outputs, &frequencies, true);
        for (j, parameter) in scene.parameters.iter().enumerate() {
            let by_step =
                [5e-3, 2.5e-3].map(|step| differences(&scene, j, step, &outputs, &frequencies));
            for k in 0..outputs.len() {
                let largest = |values: &mut dyn Iterator<Item = f64>| {
                    values.fold(0.0, |largest: f64, x| largest.max(x.abs()))
                };
                let size = largest(&mut by_step[1].iter().map(|row| row[k]));
                let value = largest(&mut found.iter().map(|sample| sample.values[k]));
                let [whole, half] = by_step.each_ref().map(|rows| {
                    let pairs = rows.iter().zip(&found);
                    largest(&mut pairs.map(|(row, sample)| row[k] - sample.derivatives[j][k]))
                });
                // Probe values have errors of 1e-9 of the value. u_x is a thousandth of u_y, but its errors are as
                // large as the errors of u_y.
                let rounding = 2e-6 * size + 1e-9 * value / parameter.scale;
                assert!(
                    half <= (whole / 10.0).max(rounding) && half <= 1e-5 * size + rounding,
                    "{set:?} {} {}: {whole:e} {half:e} of {size:e}",
                    parameter.key,
                    outputs[k].name,
                );
            }
        }
    }
}

/// A rheometer: a block of 1 m in simple shear without inertia. Its face is displaced by 1 m, so that the force on the
/// face is G* per meter of depth.
pub(crate) const RHEOMETER: &str = r#"analysis = "response"
[mesh]
type = "rectangle"
width = 1.0
height = 1.0
cells = [1, 1]
[solid]
bulk_modulus = inf
[[material]]
law = "neo-hooke"
density = 1e-9
shear_modulus = 1e3
springpot = { modulus = 3e3, viscosity = 1.0, exponent = 0.3 }
[[fixed]]
group = "bottom"
[[prescribed_displacement]]
group = "top"
response = { x = 1.0, y = 0.0 }
[[fixed]]
group = "left"
components = ["y"]
[[fixed]]
group = "right"
components = ["y"]
[[probe]]
name = "face"
type = "reaction"
group = "top"
[[output]]
name = "storage"
probe = "face"
column = "R_x_re"
[[output]]
name = "loss"
probe = "face"
column = "R_x_im"
[response]
frequencies = "1..100:adaptive"
"#;

pub(crate) const CONSTANTS: [&str; 3] = [
    "material[0].shear_modulus",
    "material[0].springpot.modulus",
    "material[0].springpot.exponent",
];

pub(crate) fn fit(path: &Path, data: &Path) -> FitResult {
    fit_all(path, vec![(data.to_owned(), Vec::new())])
}

fn fit_all(path: &Path, experiments: Vec<(PathBuf, Vec<String>)>) -> FitResult {
    attempt(path, experiments).unwrap()
}

pub(crate) fn attempt(
    path: &Path,
    experiments: Vec<(PathBuf, Vec<String>)>,
) -> Result<FitResult, Error> {
    attempt_to(1e-5, path, experiments)
}

pub(crate) fn attempt_to(
    tolerance: f64,
    path: &Path,
    experiments: Vec<(PathBuf, Vec<String>)>,
) -> Result<FitResult, Error> {
    compute(&FitOptions {
        scene: path.to_owned(),
        set: Vec::new(),
        experiments,
        out: path.with_file_name("fit"),
        existing: Existing::Overwrite,
        tolerance,
        max_iterations: 30,
        starts: 1,
        seed: 0,
        loss: Loss::Squares,
        profile: false,
        interrupt: None,
        progress: &(),
    })
}

/// Writes G' and G'' of a springpot at 12 frequencies, from the closed form. The stated standard deviation is 2 % of
/// |G*|; the added errors are `noise` times as large.
fn rheometry([shear, modulus, exponent]: [f64; 3], noise: f64, seed: u64, file: &Path) {
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
    // The sum of twelve uniform random numbers has variance 1 and is nearly normally distributed.
    let mut normal = || (0..12).map(|_| rng.random_range(-0.5..0.5)).sum::<f64>();
    let mut text = String::from("f,storage,loss,storage.noise,loss.noise\n");
    for i in 0..12 {
        let f = 100_f64.powf(f64::from(i) / 11.0).min(100.0);
        let s = num_complex::Complex64::new(0.0, std::f64::consts::TAU * f);
        let g = shear + modulus.powf(1.0 - exponent) * s.powf(exponent);
        let deviation = 0.02 * g.norm();
        let [re, im] = [g.re, g.im].map(|part| part + noise * deviation * normal());
        writeln!(text, "{f:e},{re:e},{im:e},{deviation:e},{deviation:e}").unwrap();
    }
    std::fs::write(file, text).unwrap();
}

pub(crate) const TRUE: [f64; 3] = [1.2e3, 2.5e3, 0.25];

#[test]
fn rheometry_without_noise_gives_its_springpot() {
    let folder = tempfile::tempdir().unwrap();
    let path = written(folder.path(), RHEOMETER, &CONSTANTS);
    let data = folder.path().join("measured.csv");
    rheometry(TRUE, 0.0, 0, &data);
    let found = fit(&path, &data);
    assert_eq!(found.outcome(), Outcome::Converged);
    assert_eq!(found.abscissas(), [Abscissa::Frequency]);
    for (value, exact) in found.fit.values.iter().zip(TRUE) {
        // The tolerance is ten times the tolerance of the fit.
        assert!((value / exact - 1.0).abs() < 1e-4, "{value} {exact}");
    }
}

/// Checks the 95 % intervals for 200 synthetic data sets. The interval of each parameter must contain the true value
/// for 89 to 99 % of the data sets: 0.95 ± 4 standard deviations of a proportion of 200.
#[test]
#[ignore = "slow: 200 fits"]
fn intervals_of_two_hundred_twins_cover_as_often_as_they_say() {
    let folder = tempfile::tempdir().unwrap();
    let path = written(folder.path(), RHEOMETER, &CONSTANTS);
    let data = folder.path().join("measured.csv");
    let mut covered = [0; 3];
    for seed in 0..200 {
        rheometry(TRUE, 1.0, seed, &data);
        let found = fit(&path, &data);
        assert_eq!(found.outcome(), Outcome::Converged, "{seed}");
        for (j, [low, high]) in found.uncertainty.intervals(0.95).into_iter().enumerate() {
            covered[j] += u32::from(low < TRUE[j] && TRUE[j] < high);
        }
    }
    println!("covered of 200: {covered:?}");
    assert!(covered.iter().all(|n| (178..=198).contains(n)), "{covered:?}");
}

/// A viscous block in shear, loaded by a smooth step and by harmonic loads. Either experiment alone determines both
/// constants.
const BLOCK: &str = r#"
[mesh]
type = "rectangle"
width = 0.1
height = 0.1
cells = [1, 1]
[solid]
bulk_modulus = 1e5
[[material]]
law = "mooney-rivlin"
density = 1e3
c10 = 1e3
c01 = 0.0
viscosity = 20.0
[[fixed]]
group = "bottom"
[[traction]]
group = "top"
x = { type = "step", value = 10.0, rise = 0.05 }
response = { x = 10.0 }
[[probe]]
name = "corner"
type = "point"
at = [0.1, 0.1]
interval = 0.02
[[output]]
name = "motion"
probe = "corner"
column = "u_x"
noise = 1e-6
[[output]]
name = "real"
probe = "corner"
column = "u_x_re"
noise = 1e-6
[[output]]
name = "phase"
probe = "corner"
column = "u_x_phase"
noise = 0.1
[response]
frequencies = "1..20:3"
[time]
end = 0.2
[integrator]
method = "radau9"
rtol = 1e-7
"#;

#[test]
fn motions_and_responses_are_fitted_together() {
    let folder = tempfile::tempdir().unwrap();
    let keys = ["material[0].c10", "material[0].viscosity"];
    let path = written(folder.path(), BLOCK, &keys);
    let settings = ["analysis=response", "analysis=dynamic"].map(|set| vec![set.to_owned()]);
    let [responses, motions] = settings.each_ref().map(|set| {
        let scene = Parameterized::load(&path, set).unwrap();
        let outputs = outputs(&scene.scene).unwrap();
        match set[0].ends_with("response") {
            true => {
                assert_eq!(outputs.len(), 2);
                samples(&scene, &scene.values(), &outputs, &[1.0, 4.0, 20.0], false)
            }
            false => {
                assert_eq!(outputs.len(), 1);
                let found = follow(&scene, Precision::default(), Watcher::NOBODY);
                found.unwrap().samples
            }
        }
    });
    let table = |header: &str, samples: &[Sample]| {
        let mut text = format!("{header}\n");
        for sample in samples {
            let values = sample.values.iter().map(|value| format!(",{value:e}"));
            writeln!(text, "{}{}", sample.t, values.collect::<String>()).unwrap();
        }
        let file = folder.path().join(format!("{}.csv", &header[..1]));
        std::fs::write(&file, text).unwrap();
        file
    };
    let files = [table("f,real,phase", &responses), table("t,motion", &motions)];
    let rough = BLOCK.replace("c10 = 1e3", "c10 = 1.5e3");
    written(folder.path(), &rough.replace("viscosity = 20.0", "viscosity = 8.0"), &keys);
    let both = files.into_iter().zip(settings).collect();
    let found = fit_all(&path, both);
    assert_eq!(found.outcome(), Outcome::Converged);
    assert_eq!(found.abscissas(), [Abscissa::Time, Abscissa::Frequency]);
    assert_eq!(found.points.len(), 6 + motions.len());
    for (value, exact) in found.fit.values.iter().zip([1e3, 20.0]) {
        // The tolerance is ten times the tolerance of the fit.
        assert!((value / exact - 1.0).abs() < 1e-4, "{value} {exact}");
    }
    // The viscosity is twice the small-strain shear viscosity.
    let shear_viscosities = [0, 1].map(|j| found.shear_viscosity(j));
    assert_eq!(shear_viscosities, [None, Some(found.fit.values[1] / 2.0)]);
}
