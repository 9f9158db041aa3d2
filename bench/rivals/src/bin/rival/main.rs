//! Integrates the undamped muscle of the paper, (28) with κ = 1e5, with diffsol and with this project.
//!
//! diffsol integrates M ẏ = f(t, y). Equation (28) has this form, because M = ∂F/∂ẏ is constant and f = −F(t, y, 0).
//! Both programs use the same residual, Jacobian and tolerances, and include all components in the error test. Both
//! results are compared with the stored reference. diffsol factorizes the full matrix with faer's sparse LU, whereas
//! this project factorizes the condensed matrix.
//!
//! `cargo run --release --bin rival -- [FILE]` prints a table and writes diffsol's results as JSON.

mod equations;
mod integrators;

use std::{env, fs};

use anyhow::Context as _;
use myovib_fem::Mesh;
use myovib_model::{Formulation, MuscleDae, paper};
use serde::{Deserialize, Serialize};

use integrators::{INTEGRATORS, TOLERANCES};

/// Columns of a reference file.
#[derive(Deserialize)]
struct Reference {
    times: Vec<f64>,
    u_y: Vec<f64>,
    p: Vec<f64>,
}

/// Result of one run: u_y and p at the origin at the times of the reference, and the cost.
#[derive(Default)]
struct Run {
    u_y: Vec<f64>,
    p: Vec<f64>,
    cpu_seconds: f64,
    steps: u64,
    residual_evaluations: u64,
    linear_setups: u64,
}

/// Error and cost of one run.
#[derive(Serialize)]
struct Point {
    case: &'static str,
    formulation: &'static str,
    integrator: &'static str,
    rtol: f64,
    /// Reason why the run stopped without a result.
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
        "way", "rtol", "error u_y", "p", "CPU s", "steps", "residuals", "setups"
    );
    let mut points = Vec::new();
    for integrator in INTEGRATORS {
        for rtol in TOLERANCES {
            let result = integrator.run(dae()?, rtol, &reference.times);
            let (run, stopped) = match result {
                Ok(run) => (run, None),
                Err(error) => (Run::default(), Some(error.to_string())),
            };
            let point = Point {
                case: "undamped",
                formulation: "position",
                integrator: integrator.name(),
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
            // Only the results of diffsol are written to the file.
            if integrator.is_rival() {
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

/// Returns max |a − b| / max |b|, or `None` if `a` is incomplete.
fn largest_difference(a: &[f64], b: &[f64]) -> Option<f64> {
    let max = |values: &mut dyn Iterator<Item = f64>| values.map(f64::abs).fold(0.0, f64::max);
    let difference = max(&mut a.iter().zip(b).map(|(a, b)| a - b));
    (a.len() == b.len()).then(|| difference / max(&mut b.iter().copied()))
}

fn print(point: &Point) {
    let number = |x: Option<f64>| x.map_or("–".to_owned(), |x| format!("{x:.1e}"));
    println!(
        "{:<20}{:>8.0e}{:>11}{:>11}{:>9.2}{:>8}{:>11}{:>9} {}",
        point.integrator,
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
