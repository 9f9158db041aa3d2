//! Index 3 made to hold: steps and the accuracy of the multiplier against tolerance, as Markdown.
//!
//! ```text
//! cargo run --release -p myovib-model --example index3
//! ```
//! The muscle without damping to t = 10 s, order 2: row 1 of Table 2 (κ = 1e5, index 1) beside κ = ∞
//! in index 3 with multiplier weights that follow the step, λ left out of the error test and in it,
//! and `stabilized` (index 2). Then the same in index 3 with damping, at higher orders. Errors of p(0, 0)
//! up to 2 s beside its largest value, against Radau IIA of order 9 at 1e-7.

use myovib_fem::Mesh;
use myovib_model::{
    Formulation, IntegratorKind, ModelError, MultiplierWeights, MuscleDae, Outcome, Probe,
    SampleTimes, Sampler, Settings, paper, run, start_at_rest,
};
use sundials_wrap::DaeProblem;

const T_END: f64 = 10.0;
/// Up to where the pressure is compared, s.
const COMPARED: f64 = 2.0;

fn main() -> Result<(), ModelError> {
    let mesh = include_str!("../../../data/meshes/muscle.msh");
    let mesh = Mesh::parse_msh(mesh, "muscle.msh")?;
    undamped(&mesh)?;
    println!();
    damped(&mesh)
}

/// A way to integrate index 3.
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
        "| rtol | row 1: steps | λ left out: steps | p | λ tested: steps | p | `stabilized`: steps | p |"
    );
    println!("|---|---|---|---|---|---|---|---|");
    for rtol in [1e-2, 1e-3, 1e-4, 1e-5, 1e-6] {
        let row_1 = paper_settings(Formulation::Position, rtol);
        let row_1 = motion(mesh, Formulation::Position, [paper::KAPPA, 0.0], &row_1)?;
        print!("| {rtol:.0e} | {} |", row_1.steps());
        for (formulation, tested) in [
            (Formulation::Position, false),
            (Formulation::Position, true),
            (Formulation::Stabilized, false),
        ] {
            let settings = index_3(formulation, rtol, tested);
            let run = motion(mesh, formulation, undamped, &settings)?;
            print!(" {} | {} |", run.steps(), run.error(&trusted));
        }
        println!();
    }
    Ok(())
}

fn damped(mesh: &Mesh) -> Result<(), ModelError> {
    println!("| β | rtol | order 2: steps | p | order 3 | p | order 4 | p | order 5 | p |");
    println!("|---|---|---|---|---|---|---|---|---|---|");
    for beta in [1e-5, 1e-4] {
        let damped = [f64::INFINITY, beta];
        let trusted = trusted(mesh, Formulation::Rate, damped)?;
        for rtol in [1e-3, 1e-5] {
            print!("| {beta:.0e} | {rtol:.0e} |");
            for max_order in [2, 3, 4, 5] {
                let settings = Settings {
                    max_order,
                    ..index_3(Formulation::Rate, rtol, true)
                };
                let run = motion(mesh, Formulation::Rate, damped, &settings)?;
                print!(" {} | {} |", run.steps(), run.error(&trusted));
            }
            println!();
        }
    }
    Ok(())
}

fn trusted(mesh: &Mesh, formulation: Formulation, body: [f64; 2]) -> Result<Vec<f64>, ModelError> {
    let settings = Settings {
        integrator: IntegratorKind::Radau9,
        suppressed: Vec::new(),
        t_end: COMPARED,
        ..paper_settings(formulation, 1e-7)
    };
    Ok(motion(mesh, formulation, body, &settings)?.p)
}

/// The paper's settings to the end time, at a relative tolerance.
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
    /// At the origin, twenty to a period of the load, Pa.
    p: Vec<f64>,
}

impl Motion {
    fn steps(&self) -> String {
        if self.finished {
            self.steps.to_string()
        } else {
            format!("{} to t = {:.2}", self.steps, self.t_reached)
        }
    }

    fn error(&self, trusted: &[f64]) -> String {
        let pairs = self.p.iter().zip(trusted);
        let apart = pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        let largest = trusted.iter().fold(0.0_f64, |most, p| most.max(p.abs()));
        format!("{:.0e}", apart / largest)
    }
}

/// From rest with the κ and β given.
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
    let mut p = Vec::new();
    let mut sampler = Sampler::new(
        SampleTimes::new(1.0 / 160.0, COMPARED),
        n,
        |dae: &mut MuscleDae, t, y: &[f64]| {
            p.push(dae.read(&origin, t, y).pressure);
            Ok(())
        },
    );
    let statistics = run(integrator.as_mut(), &mut [&mut sampler])?;
    drop(sampler);
    Ok(Motion {
        steps: statistics.counts.steps,
        t_reached: statistics.t_reached,
        finished: statistics.outcome == Outcome::Finished,
        p,
    })
}
