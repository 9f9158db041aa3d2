//! The undamped muscle of the paper, (28) with κ = 1e5, by diffsol's integrators and by ours.
//!
//! diffsol integrates M ẏ = f(t, y). (28) is of this form: M = ∂F/∂ẏ is constant, f = −F(t, y, 0).
//! Both sides have the same residual and Jacobian, the same tolerances, all components in the error
//! test, and are compared with the stored reference; diffsol factorises the whole matrix with faer's
//! sparse LU, ours is condensed.
//!
//! `cargo run --release --bin rival -- [FILE]` prints a table and writes diffsol's points as JSON for
//! `myovib bench work --rival FILE`.

mod equations;
mod ways;

use std::{env, fs};

use anyhow::Context as _;
use myovib_fem::Mesh;
use myovib_model::{Formulation, MuscleDae, paper};
use serde::{Deserialize, Serialize};

use ways::{TOLERANCES, WAYS};

/// What is read of a reference.
#[derive(Deserialize)]
struct Reference {
    times: Vec<f64>,
    u_y: Vec<f64>,
    p: Vec<f64>,
}

/// u_y and p at the origin at the reference's times, and what they took.
#[derive(Default)]
struct Run {
    u_y: Vec<f64>,
    p: Vec<f64>,
    cpu_seconds: f64,
    steps: u64,
    residual_evaluations: u64,
    linear_setups: u64,
}

/// One point of the diagram of work and precision.
#[derive(Serialize)]
struct Point {
    case: &'static str,
    formulation: &'static str,
    way: &'static str,
    rtol: f64,
    /// Why there are no errors, if there are none.
    stopped: Option<String>,
    u_y: Option<f64>,
    p: Option<f64>,
    cpu_seconds: f64,
    steps: u64,
    residual_evaluations: u64,
    linear_setups: u64,
}

fn main() -> anyhow::Result<()> {
    let mesh = include_str!("../../../../../data/meshes/muscle.msh");
    let mesh = Mesh::parse_msh(mesh, "muscle.msh")?;
    let reference = include_str!("../../../../../data/references/muscle_undamped.json");
    let reference: Reference = serde_json::from_str(reference)?;
    let dae = || -> anyhow::Result<MuscleDae> {
        let muscle = paper::muscle(&mesh, 1e5, 0.0)?;
        Ok(MuscleDae::new(muscle, Formulation::Position)?)
    };

    println!(
        "{:<20}{:>8}{:>11}{:>11}{:>9}{:>8}{:>11}{:>9}",
        "way", "rtol", "error u_y", "p", "CPU s", "steps", "residuals", "set-ups"
    );
    let mut points = Vec::new();
    for way in WAYS {
        for rtol in TOLERANCES {
            let result = way.run(dae()?, rtol, &reference.times);
            let (run, stopped) = match result {
                Ok(run) => (run, None),
                Err(error) => (Run::default(), Some(error.to_string())),
            };
            let point = Point {
                case: "undamped",
                formulation: "position",
                way: way.name(),
                rtol,
                u_y: largest_difference(&run.u_y, &reference.u_y),
                p: largest_difference(&run.p, &reference.p),
                stopped,
                cpu_seconds: run.cpu_seconds,
                steps: run.steps,
                residual_evaluations: run.residual_evaluations,
                linear_setups: run.linear_setups,
            };
            print(&point);
            // Ours are in the diagram already.
            if way.is_rival() {
                points.push(point);
            }
        }
    }
    if let Some(path) = env::args().nth(1) {
        let json = serde_json::to_string_pretty(&points)?;
        fs::write(&path, json + "\n").with_context(|| format!("cannot write `{path}`"))?;
    }
    Ok(())
}

/// max |a − b| / max |b|; none if a is not complete.
fn largest_difference(a: &[f64], b: &[f64]) -> Option<f64> {
    let max = |values: &mut dyn Iterator<Item = f64>| values.map(f64::abs).fold(0.0, f64::max);
    let difference = max(&mut a.iter().zip(b).map(|(a, b)| a - b));
    (a.len() == b.len()).then(|| difference / max(&mut b.iter().copied()))
}

fn print(point: &Point) {
    let number = |x: Option<f64>| x.map_or("–".to_owned(), |x| format!("{x:.1e}"));
    println!(
        "{:<20}{:>8.0e}{:>11}{:>11}{:>9.2}{:>8}{:>11}{:>9} {}",
        point.way,
        point.rtol,
        number(point.u_y),
        number(point.p),
        point.cpu_seconds,
        point.steps,
        point.residual_evaluations,
        point.linear_setups,
        point.stopped.as_deref().unwrap_or("")
    );
}
