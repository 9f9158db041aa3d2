//! Derivatives and fits of loading paths and of quasi-static motions.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use myovib_model::ModelError;
use myovib_model::sensitivity::{Dependences, Stencil};
use myovib_scene::fit::{Outcome, compute};
use myovib_scene::sensitivity::{
    Output, Parameterized, Precision, Sample, Unsupported, equilibria, follow, outputs, unsupported,
};
use myovib_scene::watch::Watcher;
use myovib_scene::{Error, Scene};
use rand::{Rng, SeedableRng};

use crate::options;

/// A block between rough plates, whose distance is reduced by a fifth. `MATERIAL` is replaced by additional keys of the
/// material.
const BLOCK: &str = r#"
[time]
end = 1.0
[mesh]
type = "rectangle"
width = 0.02
height = 0.02
cells = [4, 4]
[solid]
bulk_modulus = 2e4
[[material]]
law = "mooney-rivlin"
density = 1e3
c10 = 1e3
c01 = 300.0
MATERIAL
[[fixed]]
group = "bottom"
[[prescribed_displacement]]
group = "top"
y = { type = "step", value = -0.004, rise = 0.5 }
[[prescribed_displacement]]
group = "top"
x = 0.0
[[probe]]
name = "plate"
type = "reaction"
group = "top"
interval = 0.25
[[probe]]
name = "side"
type = "point"
at = [0.02, 0.015]
quantities = ["u", "p"]
interval = 0.25
"#;

/// A layer under a rigid cylinder, with the default contact stiffness, which is proportional to c10.
const LAYER: &str = r#"
analysis = "static"
[time]
end = 1.0
[mesh]
type = "rectangle"
width = 0.04
height = 0.02
cells = [8, 4]
[solid]
bulk_modulus = 1e5
[[material]]
law = "mooney-rivlin"
density = 1e3
c10 = 5e3
c01 = 0.0
[[fixed]]
group = "bottom"
[[fixed]]
group = "left"
components = ["x"]
[[contact]]
group = "top"
type = "sphere"
center = [0.0, 0.03]
radius = 0.01
y = -0.002
[static]
steps = 4
[[probe]]
name = "indenter"
type = "contact"
group = "top"
[[probe]]
name = "bone"
type = "reaction"
group = "bottom"
"#;

/// Writes a scene with these parameters and returns its path.
fn written(folder: &Path, text: &str, keys: &[&str]) -> PathBuf {
    let path = folder.join("scene.toml");
    let parameters = keys.iter().map(|key| format!("[[parameter]]\nkey = \"{key}\"\n"));
    std::fs::write(&path, text.to_owned() + &parameters.collect::<String>()).unwrap();
    path
}

/// Compares the derivatives of `run` with difference quotients of order 4, whose steps decrease until both agree to
/// `tolerance`, relative to the largest value of the output divided by its parameter. Returns the number of nonzero
/// derivatives.
fn derivatives_are_limits(
    scene: &Parameterized,
    tolerance: f64,
    run: impl Fn(&[f64], bool) -> Vec<Sample>,
) -> usize {
    let values = scene.values();
    let exact = run(&values, true);
    let size = |k: usize| exact.iter().map(|s| s.values[k].abs()).fold(0.0, f64::max);
    let sizes: Vec<f64> = (0..exact[0].values.len()).map(size).collect();
    let mut nonzero = 0;
    for (j, parameter) in scene.parameters.iter().enumerate() {
        let error = |relative_step: f64| {
            let step = relative_step * values[j];
            let points = Stencil::Central.points().iter();
            let runs = points.map(|(k, weight)| {
                let mut moved = values.clone();
                moved[j] += k * step;
                (weight / step, run(&moved, false))
            });
            let runs: Vec<_> = runs.collect();
            let mut largest = 0.0_f64;
            for (k, size) in sizes.iter().enumerate() {
                for (i, sample) in exact.iter().enumerate() {
                    let terms = runs.iter().map(|(weight, run)| weight * run[i].values[k]);
                    let distance = sample.derivatives[j][k] - terms.sum::<f64>();
                    largest = largest.max((values[j] * distance).abs() / size);
                }
            }
            largest
        };
        let errors = [0.04, 0.01, 2.5e-3, 6e-4].map(error);
        println!("{}: {errors:?}", parameter.key);
        assert!(errors.iter().any(|error| *error < tolerance), "{}: {errors:?}", parameter.key);
        for sample in &exact {
            let slopes = sample.derivatives[j].iter().zip(&sizes);
            nonzero +=
                slopes.filter(|(slope, size)| (values[j] * **slope).abs() > 1e-6 * **size).count();
        }
    }
    nonzero
}

/// Excludes the shear force of the plates, which is zero by symmetry.
fn without_zero(mut outputs: Vec<Output>) -> Vec<Output> {
    outputs.retain(|output| output.name != "plate.R_x");
    outputs
}

/// Checks derivatives of reactions, displacements and pressures with respect to constants of the material,
/// compressibility and the distance of the plates.
#[test]
fn equilibria_have_the_derivatives_of_their_differences() {
    let folder = tempfile::tempdir().unwrap();
    let keys = [
        "material[0].c10",
        "material[0].c01",
        "solid.bulk_modulus",
        "prescribed_displacement[0].y.value",
    ];
    let path = written(folder.path(), &BLOCK.replace("MATERIAL", ""), &keys);
    let scene = Parameterized::load(&path, &["analysis=static".to_owned()]).unwrap();
    let outputs = without_zero(outputs(&scene.scene).unwrap());
    let run = |values: &[f64], with| {
        let loads = [0.0, 0.5, 1.0];
        equilibria(&scene, values, &outputs, &loads, with, Watcher::NOBODY).unwrap().0
    };
    // The truncation error is a few times (0.01)⁴. Equilibria converge to rounding errors, about 1e-12 of the outputs,
    // which are divided by steps of 1e-2.
    let nonzero = derivatives_are_limits(&scene, 1e-9, run);
    // All outputs depend on all parameters, except at the load factor 0.
    assert_eq!(nonzero, 2 * outputs.len() * keys.len());
}

/// Regression: fits and sensitivities accepted equilibria with inverted elements, which runs reject.
#[test]
fn inverted_elements_end_fits_as_they_end_runs() {
    let folder = tempfile::tempdir().unwrap();
    let sphere = LAYER
        .replace("0.03]\nradius = 0.01\ny = -0.002", "0.025]\nradius = 0.005\ny = -0.014")
        .replace("bulk_modulus = 1e5", "bulk_modulus = inf");
    let path = written(folder.path(), &sphere, &["material[0].c10"]);
    let found = |set: &[String]| {
        let scene = Parameterized::load(&path, set).unwrap();
        let outputs = outputs(&scene.scene).unwrap();
        equilibria(&scene, &scene.values(), &outputs, &[1.0], false, Watcher::NOBODY)
    };
    assert!(matches!(found(&[]), Err(Error::Model(ModelError::Inverted(_)))));
    let allowed = ["solid.allow_inverted=true".to_owned()];
    assert_eq!(found(&allowed).unwrap().0.len(), 1);
}

/// Checks derivatives of the force of an indenter with respect to c10 and the compressibility.
#[test]
fn contact_forces_have_the_derivatives_of_their_differences() {
    let folder = tempfile::tempdir().unwrap();
    let keys = ["material[0].c10", "solid.bulk_modulus"];
    let path = written(folder.path(), LAYER, &keys);
    let scene = Parameterized::load(&path, &[]).unwrap();
    let mut outputs = outputs(&scene.scene).unwrap();
    // The contact area is a sum over points in contact, so it is not differentiable.
    outputs.retain(|output| !output.name.ends_with("area"));
    let run = |values: &[f64], with| {
        let loads = [0.5, 1.0];
        equilibria(&scene, values, &outputs, &loads, with, Watcher::NOBODY).unwrap().0
    };
    derivatives_are_limits(&scene, 1e-7, run);
}

/// Checks derivatives of a reaction and of a displacement with respect to an angle of rotation.
#[test]
fn equilibria_have_derivatives_with_respect_to_an_angle() {
    let folder = tempfile::tempdir().unwrap();
    let text = "analysis = \"static\"\n[mesh]\ntype = \"rectangle\"\nwidth = 0.03\nheight = 0.01\ncells = [3, 1]\n[solid]\n\
         bulk_modulus = 1e5\n[[material]]\nlaw = \"neo-hooke\"\ndensity = 1e3\nshear_modulus = 1e4\n[[fixed]]\n\
         group = \"left\"\n[[prescribed_displacement]]\ngroup = \"right\"\n\
         rotation = { angle = 0.4, point = [0.02, 0.0] }\n[[probe]]\nname = \"clamp\"\ntype = \"reaction\"\ngroup = \"left\"\n\
         [[probe]]\nname = \"middle\"\ntype = \"point\"\nat = [0.015, 0.01]\n";
    let key = "prescribed_displacement[0].rotation.angle";
    let path = written(folder.path(), text, &[key]);
    let scene = Parameterized::load(&path, &[]).unwrap();
    let outputs = outputs(&scene.scene).unwrap();
    let run = |values: &[f64], with| {
        let loads = [0.5, 1.0];
        equilibria(&scene, values, &outputs, &loads, with, Watcher::NOBODY).unwrap().0
    };
    // The tolerance has the same origin as above.
    let nonzero = derivatives_are_limits(&scene, 1e-9, run);
    assert_eq!(nonzero, 2 * outputs.len());
}

const PRONY: &str = "prony = [{ relative_modulus = 0.5, relaxation_time = 0.4 }]";

/// Checks relaxation without inertia: loading within half a second, followed by a hold. The slope of the ramp jumps at t
/// = 0 and 0.5 s.
#[test]
fn quasi_static_motions_have_the_derivatives_of_their_differences() {
    let keys = [
        "material[0].c10",
        "material[0].prony[0].relative_modulus",
        "material[0].prony[0].relaxation_time",
        "solid.bulk_modulus",
        "prescribed_displacement[0].y.value",
    ];
    let text = BLOCK.replace("MATERIAL", PRONY);
    let ramp = text.replace("\"step\"", "\"ramp\"").replace("rise", "end");
    assert_ne!(text, ramp);
    for text in [text, ramp] {
        check_quasi_static_derivatives(&text, &keys);
    }
}

fn check_quasi_static_derivatives(text: &str, keys: &[&str]) {
    let folder = tempfile::tempdir().unwrap();
    let path = written(folder.path(), text, keys);
    let set = ["analysis=quasi-static", "integrator.rtol=1e-9"].map(str::to_owned);
    let scene = Parameterized::load(&path, &set).unwrap();
    let outputs = without_zero(outputs(&scene.scene).unwrap());
    let run = |values: &[f64], with| {
        let dependences = match with {
            true => scene.dependences(values).unwrap(),
            false => Dependences::default(),
        };
        let (at, times) = (scene.at(values).unwrap(), [0.25, 0.5, 0.6, 1.0]);
        let requested = (dependences, Precision::default());
        follow(&at, &outputs, &times, requested, Watcher::NOBODY).unwrap().0
    };
    let nonzero = derivatives_are_limits(&scene, 1e-6, run);
    assert_eq!(nonzero, 4 * outputs.len() * keys.len());
}

/// Writes the outputs of a scene at its own parameter values, at the times at which its run samples them, with noise of
/// the given standard deviation.
fn measure(path: &Path, set: &[&str], deviation: f64, file: &Path) {
    let set: Vec<String> = set.iter().map(|text| (*text).to_owned()).collect();
    let scene = Parameterized::load(path, &set).unwrap();
    let curves =
        myovib_scene::sensitivity::compute(&scene, Precision::default(), Watcher::NOBODY).unwrap();
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(5);
    let mut text = format!("{},{}\n", curves.abscissa.name(), curves.outputs.join(","));
    for sample in &curves.samples {
        write!(text, "{}", sample.t).unwrap();
        for value in &sample.values {
            // The sum of twelve uniform random numbers has variance 1 and is nearly normally distributed.
            let normal: f64 = (0..12).map(|_| rng.random_range(-0.5..0.5)).sum();
            write!(text, ",{:e}", value + deviation * normal).unwrap();
        }
        text.push('\n');
    }
    std::fs::write(file, text).unwrap();
}

/// Fits compression and relaxation of one material together; both are computed at the true values and have normally
/// distributed noise.
#[test]
fn paths_and_relaxation_are_fitted_together_within_their_intervals() {
    let folder = tempfile::tempdir().unwrap();
    let output = "[static]\nsteps = 10\n[[output]]\nname = \"force\"\nprobe = \"plate\"\ncolumn = \"R_y\"\nnoise = 0.05\n";
    let text =
        BLOCK.replace("MATERIAL", PRONY).replace("interval = 0.25", "interval = 0.05") + output;
    let keys = [
        "material[0].c10",
        "material[0].prony[0].relative_modulus",
        "material[0].prony[0].relaxation_time",
    ];
    let path = written(folder.path(), &text, &keys);
    let analyses = ["analysis=static", "analysis=quasi-static"];
    let experiments = analyses.map(|analysis| {
        let file = folder.path().join(format!("{analysis}.csv"));
        measure(&path, &[analysis], 0.05, &file);
        (file, vec![analysis.to_owned()])
    });
    let rough = text.replace("c10 = 1e3", "c10 = 3e3").replace(
        "relative_modulus = 0.5, relaxation_time = 0.4",
        "relative_modulus = 0.2, relaxation_time = 0.1",
    );
    written(folder.path(), &rough, &keys);
    let found = compute(&options(path, experiments.into())).unwrap();
    assert_eq!(found.outcome(), Outcome::Converged);
    // With this seed, the 95 % intervals of all parameters contain the true values.
    for ([low, high], exact) in found.uncertainty.intervals(0.95).into_iter().zip([1e3, 0.5, 0.4]) {
        assert!(low < exact && exact < high, "{low} {exact} {high}");
        assert!(high - low < 0.2 * exact, "{low} {high}");
    }
}

#[test]
fn paths_by_arc_length_are_rejected() {
    let set = ["static.method=arc-length".to_owned()];
    let scene = Scene::build("scene.toml", LAYER, &set, Path::new("")).unwrap();
    let found = unsupported(&scene);
    assert_eq!(found, Some((Unsupported::ArcLength, "static.method".to_owned())));
}
