//! Integration of index 3: steps and accuracy of the multiplier as functions of the tolerance, as
//! Markdown.
//!
//! ```text
//! cargo run --release -p myovib-model --example index3
//! ```
//! The muscle without damping to t = 10 s, order 2: row 1 of Table 2 (κ = 1e5, index 1) compared
//! with κ = ∞ in index 3 with step-dependent multiplier weights, λ excluded from or included in the
//! error test, and `stabilized` (index 2). Then `rate` with κ = ∞, of index 3, with damping, at the
//! order permitted by the damping and at order 5, compared with `implicit-rate` with κ = 1e5 (index
//! 1). Errors of u_y(0, 0) and p(0, 0) up to 2 s are relative to their largest values, with Radau
//! IIA of order 9 at 1e-7 as the reference.

use std::collections::BTreeSet;

use myovib_dae::Problem;
use myovib_fem::Mesh;
use myovib_model::advice::Advice;
use myovib_model::{
    Formulation, IntegratorKind, ModelError, MultiplierWeights, MuscleDae, Outcome, Probe,
    SampleTimes, Sampler, Settings, paper, run, start_at_rest,
};

const TOLERANCES: [f64; 5] = [1e-2, 1e-3, 1e-4, 1e-5, 1e-6];
const T_END: f64 = 10.0;
/// End of the comparison of motions, s.
const COMPARED: f64 = 2.0;

fn main() -> Result<(), ModelError> {
    let mesh = include_str!("../../../data/meshes/muscle.msh");
    let mesh = Mesh::parse_msh(mesh, "muscle.msh")?;
    undamped(&mesh)?;
    println!();
    damped(&mesh)
}

/// Settings for the integration of index 3.
fn index_3(formulation: Formulation, rtol: f64, tested: bool) -> Settings {
    let mut settings = paper_settings(formulation, rtol);
    settings.multiplier_weights = MultiplierWeights::StepScaled;
    if tested {
        settings.suppressed = Vec::new();
    }
    settings
}

fn undamped(mesh: &Mesh) -> Result<(), ModelError> {
    let undamped = [f64::INFINITY, 0.0];
    let trusted = trusted(mesh, Formulation::Position, undamped)?;
    println!(
        "| rtol | row 1: steps | λ left out: steps | p | RMS | λ tested: steps | p | RMS \
         | `stabilized`: steps | p | RMS | steps / row 1, at most |"
    );
    println!("|{}", "---|".repeat(12));
    for rtol in TOLERANCES {
        let row_1 = paper_settings(Formulation::Position, rtol);
        let row_1 = motion(mesh, Formulation::Position, [paper::KAPPA, 0.0], &row_1)?;
        let mut line = format!("| {rtol:.0e} | {} |", row_1.steps());
        let mut most = 0.0_f64;
        for (formulation, tested) in [
            (Formulation::Position, false),
            (Formulation::Position, true),
            (Formulation::Stabilized, false),
        ] {
            let settings = index_3(formulation, rtol, tested);
            let run = motion(mesh, formulation, undamped, &settings)?;
            let [_, p] = run.errors(&trusted);
            line += &format!(" {} | {:.0e} | {:.0e} |", run.steps(), p.largest, p.rms);
            most = most.max(run.over(&row_1));
        }
        println!("{line} {most:.2} |");
    }
    Ok(())
}

fn damped(mesh: &Mesh) -> Result<(), ModelError> {
    println!(
        "| β | rtol | order | `implicit-rate`, κ = 1e5: steps | λ, μ left out: steps | u_y | p \
         | λ, μ tested: steps | u_y | p | steps / `implicit-rate`, at most |"
    );
    println!("|{}", "---|".repeat(11));
    for beta in [1e-5, 1e-4, 1e-3, 1e-2] {
        let damped = [f64::INFINITY, beta];
        let trusted = trusted(mesh, Formulation::ImplicitRate, damped)?;
        let muscle = paper::muscle(mesh, f64::INFINITY, beta)?;
        for rtol in TOLERANCES {
            let settings = index_3(Formulation::Rate, rtol, true);
            let advised = Advice::new(&muscle, Formulation::Rate, &settings).max_order();
            for max_order in BTreeSet::from([advised, 5]) {
                let of_order = |settings| Settings {
                    max_order,
                    ..settings
                };
                let index_1 = of_order(paper_settings(Formulation::ImplicitRate, rtol));
                let index_1 = motion(
                    mesh,
                    Formulation::ImplicitRate,
                    [paper::KAPPA, beta],
                    &index_1,
                )?;
                let mut line = format!(
                    "| {beta:.0e} | {rtol:.0e} | {max_order} | {} |",
                    index_1.steps()
                );
                let mut most = 0.0_f64;
                for tested in [false, true] {
                    let settings = of_order(index_3(Formulation::Rate, rtol, tested));
                    let run = motion(mesh, Formulation::Rate, damped, &settings)?;
                    let [u_y, p] = run.errors(&trusted).map(|error| error.largest);
                    line += &format!(" {} | {u_y:.0e} | {p:.0e} |", run.steps());
                    most = most.max(run.over(&index_1));
                }
                println!("{line} {most:.2} |");
            }
        }
    }
    Ok(())
}

fn trusted(
    mesh: &Mesh,
    formulation: Formulation,
    body: [f64; 2],
) -> Result<[Vec<f64>; 2], ModelError> {
    let settings = Settings {
        t_end: COMPARED,
        ..paper_settings(formulation, 1e-7).with_integrator(IntegratorKind::Radau9)
    };
    Ok(motion(mesh, formulation, body, &settings)?.origin)
}

/// The paper's settings to the end time, with a given relative tolerance.
fn paper_settings(formulation: Formulation, rtol: f64) -> Settings {
    Settings {
        t_end: T_END,
        ..Settings::paper(formulation).with_relative_tolerance(rtol)
    }
}

struct Motion {
    steps: u64,
    t_reached: f64,
    finished: bool,
    /// u_y (m) and p (Pa) at the origin, twenty to a period of the load.
    origin: [Vec<f64>; 2],
}

/// Beside the largest value.
struct Error {
    largest: f64,
    /// The root mean square in time.
    rms: f64,
}

impl Motion {
    fn steps(&self) -> String {
        if self.finished {
            self.steps.to_string()
        } else {
            format!("{} to t = {:.2}", self.steps, self.t_reached)
        }
    }

    /// Ratio of the steps to the steps of another run.
    fn over(&self, other: &Self) -> f64 {
        self.steps as f64 / other.steps as f64
    }

    fn errors(&self, trusted: &[Vec<f64>; 2]) -> [Error; 2] {
        [0, 1].map(|k| {
            let pairs = || self.origin[k].iter().zip(&trusted[k]);
            let largest = trusted[k].iter().fold(0.0_f64, |most, x| most.max(x.abs()));
            let gaps = || pairs().map(|(ours, theirs)| (ours - theirs).abs() / largest);
            Error {
                largest: gaps().fold(0.0, f64::max),
                rms: (gaps().map(|gap| gap * gap).sum::<f64>() / pairs().count() as f64).sqrt(),
            }
        })
    }
}

/// Runs from rest with the given κ and β.
fn motion(
    mesh: &Mesh,
    formulation: Formulation,
    [kappa, beta]: [f64; 2],
    settings: &Settings,
) -> Result<Motion, ModelError> {
    let muscle = paper::muscle(mesh, kappa, beta)?;
    let origin = Probe::at(muscle.solid.space(), [0.0, 0.0])?;
    let dae = MuscleDae::new(muscle, formulation)?;
    let n = dae.n_unknowns();
    let mut integrator = start_at_rest(dae, settings)?;
    let mut origin_motion = [Vec::new(), Vec::new()];
    let mut sampler = Sampler::new(
        SampleTimes::new(1.0 / 160.0, COMPARED),
        n,
        |dae: &mut MuscleDae, t, y: &[f64]| {
            let value = dae.read(&origin, t, y);
            origin_motion[0].push(value.displacement[1]);
            origin_motion[1].push(value.pressure);
            Ok(())
        },
    );
    let statistics = run(integrator.as_mut(), &mut [&mut sampler])?;
    drop(sampler);
    Ok(Motion {
        steps: statistics.counts.steps,
        t_reached: statistics.t_reached,
        finished: statistics.outcome == Outcome::Finished,
        origin: origin_motion,
    })
}
