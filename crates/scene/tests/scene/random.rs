//! Comparison of random scenes with runs of another method at tighter tolerances.
//!
//! A scene is a beam under loads with pulses, ramps and tables. The error of a finished run must not exceed
//! [`MAX_RATIO`] times the error expected from its tolerance.

use std::fmt::Write;
use std::fs;
use std::path::Path;

use myovib_model::IntegratorKind;
use myovib_scene::Scene;
use myovib_scene::csv::Table as Csv;
use myovib_scene::run::{RunOptions, compute};
use rand::prelude::*;
use rand_chacha::ChaCha8Rng;

/// End time (s) of all scenes.
const T_END: f64 = 1.0;

/// Maximum ratio of the error to the error expected from the tolerance.
const MAX_RATIO: f64 = 20.0;

/// Returns the relative error of displacements expected from a tolerance after `periods` of the motion.
///
/// Radau IIA has an error of about its tolerance per period. BDF of order 2 takes steps h with h³ proportional to the
/// tolerance, and its phase error per period is proportional to h².
fn expected_error(method: IntegratorKind, rtol: f64, periods: f64) -> f64 {
    let per_period = match method {
        IntegratorKind::Bdf => rtol.powf(2.0 / 3.0),
        _ => rtol,
    };
    per_period * (1.0 + periods)
}

/// Runs a scene and its reference. Returns the ratio of its error to the expected error, or `None`
/// if a run stopped. `rtol` is the tolerance with which the scene is compared.
fn error_ratio(drawn: &RandomScene, folder: &Path, rtol: f64) -> Option<f64> {
    drawn.write(folder);
    let integrate = |name: &str, set: &[String]| {
        let scene = Scene::load(&folder.join("scene.toml"), set).unwrap();
        let out = folder.join(name);
        let result = compute(&scene, &RunOptions::into_folder(&out)).unwrap();
        let table = Csv::parse(&fs::read_to_string(out.join("tip.csv")).unwrap()).unwrap();
        let rows: Vec<Vec<f64>> = table.rows.iter().filter_map(|row| table.numbers(row)).collect();
        result.document["reason"].is_null().then_some(rows)
    };
    let (rows, exact) = (integrate("run", &[])?, integrate("reference", &drawn.reference())?);
    // The number of periods is half the number of turning points of u_y.
    let differences = exact.windows(2).map(|pair| pair[1][2] - pair[0][2]);
    let moving: Vec<f64> = differences.filter(|d| *d != 0.0).collect();
    let turns = moving.windows(2).filter(|pair| pair[0] * pair[1] < 0.0).count();
    let displacements = |row: &[f64]| [row[1], row[2]];
    let (mut error, mut largest) = (0.0_f64, 0.0_f64);
    for (row, exact) in rows.iter().zip(&exact) {
        for (a, b) in displacements(row).into_iter().zip(displacements(exact)) {
            error = error.max((a - b).abs());
            largest = largest.max(b.abs());
        }
    }
    Some(error / largest / expected_error(drawn.method, rtol, turns as f64 / 2.0))
}

/// Returns an empty folder for this test.
fn folder(name: &str) -> std::path::PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    if folder.exists() {
        fs::remove_dir_all(&folder).unwrap();
    }
    folder
}

#[test]
fn random_scenes_have_the_expected_accuracy() {
    let folder = folder("random");
    for number in [2, 4, 5, 6, 7, 12] {
        let drawn = RandomScene::new(1, number);
        let ratio = error_ratio(&drawn, &folder.join(number.to_string()), drawn.rtol);
        assert!(ratio.unwrap() <= MAX_RATIO, "scene {number}: {ratio:?}");
    }
    // A loose run compared with a tight tolerance must exceed the maximum ratio.
    let drawn = RandomScene::new(1, 2);
    assert!(drawn.rtol > 1e-7, "{}", drawn.rtol);
    let ratio = error_ratio(&drawn, &folder.join("loose"), 1e-7);
    assert!(ratio.unwrap() > MAX_RATIO, "{ratio:?}");
}

#[test]
#[ignore = "slow"]
fn two_hundred_random_scenes_have_the_expected_accuracy() {
    let folder = folder("random-200");
    let numbers: Vec<u64> = (1..=200).collect();
    let threads = std::thread::available_parallelism().unwrap();
    let ratios = myovib_scene::parallel::map(&numbers, threads, |&number| {
        let drawn = RandomScene::new(1, number);
        error_ratio(&drawn, &folder.join(number.to_string()), drawn.rtol)
    });
    // Stopped runs have no error; at least 190 of the 200 scenes finish.
    assert!(ratios.iter().flatten().count() >= 190, "{ratios:?}");
    for (number, ratio) in numbers.iter().zip(&ratios) {
        assert!(ratio.is_none_or(|ratio| ratio <= MAX_RATIO), "scene {number}: {ratio:?}");
    }
}

#[test]
fn the_seed_determines_the_scene() {
    let (a, b) = (RandomScene::new(1, 7), RandomScene::new(1, 7));
    assert_eq!(a.text, b.text);
    assert_ne!(a.text, RandomScene::new(2, 7).text);
    assert_ne!(a.text, RandomScene::new(1, 8).text);
}

/// A random scene.
struct RandomScene {
    method: IntegratorKind,
    rtol: f64,
    text: String,
    /// CSV files of the loads.
    tables: Vec<String>,
}

impl RandomScene {
    /// Draws scene `number` of a seed.
    fn new(seed: u64, number: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(number);
        let rng = &mut rng;
        let is_incompressible = rng.random_bool(0.4);
        let beta = if rng.random_bool(0.5) { decade(rng, -5.0, -3.0) } else { 0.0 };
        let formulations: &[&str] = match (is_incompressible, beta > 0.0) {
            (false, false) => &["position", "velocity", "displacement"],
            (true, false) => &["velocity", "stabilized", "position"],
            (_, true) => &["implicit-rate", "rate"],
        };
        let formulation = formulations.choose(rng).unwrap();
        let method = *[
            IntegratorKind::Bdf,
            IntegratorKind::Radau5,
            IntegratorKind::Radau9,
            IntegratorKind::Radau13,
        ]
        .choose(rng)
        .unwrap();
        let rtol = 10_f64.powi(-rng.random_range(3..=7));
        let kappa = match is_incompressible {
            true => "inf".to_owned(),
            false => format!("{:e}", decade(rng, 4.5, 6.5)),
        };
        let alpha = rng.random_range(0.0..5.0);
        let mut tables = Vec::new();
        let (x, y) = (load(rng, &mut tables), load(rng, &mut tables));
        let text = format!(
            "title = \"Random scene {number} of seed {seed}\"\n\
             [time]\nend = {T_END}\n\
             [mesh]\ntype = \"beam\"\nlength = 0.1\nheight = 0.02\ncells = [6, 2]\n\
             [solid]\nbulk_modulus = {kappa}\nrayleigh_mass = {alpha}\nrayleigh_stiffness = {beta:e}\n\
             formulation = \"{formulation}\"\n\
             [[material]]\n{law}\ndensity = 1.1e3\n\
             [[fixed]]\ngroup = \"fixed\"\n\
             [[traction]]\ngroup = \"load\"\nx = {x}\ny = {y}\n\
             [integrator]\nmethod = \"{method}\"\nrtol = {rtol:e}\nmax_cpu = 60.0\n\
             [[probe]]\nname = \"tip\"\ntype = \"point\"\nat = [0.1, 0.01]\ninterval = 0.005\n\
             quantities = [{quantities}]\n",
            law = law(rng),
            method = method.name(),
            quantities = match *formulation {
                "displacement" => "\"u\"",
                _ => "\"u\", \"p\"",
            },
        );
        Self { method, rtol, text, tables }
    }

    /// Writes the scene and its tables.
    fn write(&self, folder: &Path) {
        fs::create_dir_all(folder).unwrap();
        fs::write(folder.join("scene.toml"), &self.text).unwrap();
        for (i, table) in self.tables.iter().enumerate() {
            fs::write(folder.join(table_name(i)), table).unwrap();
        }
    }

    /// Returns the settings of the reference: another method and a tolerance a hundred times smaller.
    fn reference(&self) -> [String; 3] {
        let method = match self.method {
            IntegratorKind::Radau13 => IntegratorKind::Radau9,
            _ => IntegratorKind::Radau13,
        };
        let rtol = (self.rtol * 1e-2).min(1e-7);
        [
            format!("integrator.method={}", method.name()),
            format!("integrator.rtol={rtol:e}"),
            "integrator.max_cpu=600".to_owned(),
        ]
    }
}

fn table_name(number: usize) -> String {
    format!("load-{number}.csv")
}

/// Returns a random number between two powers of ten.
fn decade(rng: &mut ChaCha8Rng, low: f64, high: f64) -> f64 {
    10_f64.powf(rng.random_range(low..high))
}

fn law(rng: &mut ChaCha8Rng) -> String {
    let modulus = rng.random_range(1.5e4..3e4);
    match rng.random_range(0..4) {
        0 => format!("law = \"mooney-rivlin\"\nc10 = {:e}\nc01 = 2e2", 0.5 * modulus),
        1 => format!("law = \"neo-hooke\"\nshear_modulus = {modulus:e}"),
        2 => format!("law = \"deviatoric-st-venant-kirchhoff\"\nshear_modulus = {modulus:e}"),
        _ => format!("law = \"small-strain\"\nshear_modulus = {modulus:e}"),
    }
}

/// Returns a sum of one to three signals in Pa.
fn load(rng: &mut ChaCha8Rng, tables: &mut Vec<String>) -> String {
    let n = rng.random_range(1..=3);
    let parts: Vec<String> = (0..n).map(|_| part(rng, tables)).collect();
    format!("{{ type = \"sum\", of = [{}] }}", parts.join(", "))
}

fn part(rng: &mut ChaCha8Rng, tables: &mut Vec<String>) -> String {
    let value = rng.random_range(-20.0..20.0);
    let start = rng.random_range(0.05..0.8);
    match rng.random_range(0..5) {
        // A pulse.
        0 => {
            let (rise, length) = (decade(rng, -3.0, -1.5), decade(rng, -2.0, -0.8));
            let step = |value: f64, start: f64| {
                format!("{{ type = \"step\", value = {value}, start = {start}, rise = {rise} }}")
            };
            format!("{}, {}", step(value, start), step(-value, start + rise + length))
        }
        1 => {
            let end = start + decade(rng, -3.0, -1.0);
            format!("{{ type = \"ramp\", value = {value}, start = {start}, end = {end} }}")
        }
        2 => {
            let frequency = rng.random_range(1.0..12.0);
            format!("{{ type = \"ramped-sine\", amplitude = {value}, frequency = {frequency} }}")
        }
        3 => format!("{{ type = \"step\", value = {value}, start = {start}, rise = 0.05 }}"),
        _ => {
            let file = table_name(tables.len());
            tables.push(table(rng, value, start));
            format!(
                "{{ type = \"table\", file = \"{file}\", column = \"value\", interpolation = \"spline\" }}"
            )
        }
    }
}

/// Returns a table at 1 kHz with a bell-shaped pulse of a few milliseconds.
fn table(rng: &mut ChaCha8Rng, value: f64, at: f64) -> String {
    let width = rng.random_range(2e-3..2e-2);
    let mut text = "t,value\n".to_owned();
    for i in 0..=1000 {
        let t = f64::from(i) * 1e-3;
        let s = (t - at) / width;
        let bell = if s.abs() < 1.0 { (1.0 - s * s).powi(3) } else { 0.0 };
        writeln!(text, "{t},{}", value * bell).unwrap();
    }
    text
}
