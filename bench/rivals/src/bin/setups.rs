//! Frequency of IDAS' matrix setups: rows of Table 2 for several windows of c_j.

use myovib_fem::Mesh;
use myovib_model::{Field, Formulation, MuscleDae, Settings, paper, run, start_at_rest};

/// IDAS repeats the setup when c_j leaves [(1 − δ)/(1 + δ), (1 + δ)/(1 − δ)] times its value at the last setup.
const WINDOWS: [f64; 5] = [0.1, 0.25, 0.4, 0.6, 0.8];
const REPEATS: usize = 3;

fn main() -> anyhow::Result<()> {
    let multipliers: &[Field] = &[Field::Pressure, Field::PressureRate];
    let pressure = &multipliers[..1];
    let rows = [
        ("1", Formulation::Position, 1e5, 0.0, pressure),
        ("2m", Formulation::Rate, 1e5, 1e-4, multipliers),
        ("3m", Formulation::Rate, f64::INFINITY, 1e-4, multipliers),
        ("31", Formulation::Velocity, f64::INFINITY, 0.0, pressure),
    ];
    let mesh = Mesh::parse_msh(include_str!("../../../../data/meshes/muscle.msh"), "muscle.msh")?;
    println!("| row | δ | CPU s | steps | Newton it. | Newton fail. | setups |");
    println!("|---|---|---|---|---|---|---|");
    for (row, formulation, kappa, beta, suppressed) in rows {
        for delta_cj in WINDOWS {
            let settings = Settings {
                delta_cj,
                suppressed: suppressed.to_vec(),
                ..Settings::paper(formulation)
            };
            let mut best = None;
            for _ in 0..REPEATS {
                let dae = MuscleDae::new(paper::muscle(&mesh, kappa, beta)?, formulation)?;
                let mut integrator = start_at_rest(dae, &settings)?;
                let next = run(integrator.as_mut(), &mut [])?;
                best = match best {
                    Some((seconds, known)) if seconds <= next.cpu_seconds => Some((seconds, known)),
                    _ => Some((next.cpu_seconds, next)),
                };
            }
            let Some((seconds, run)) = best else { continue };
            let s = run.counts;
            println!(
                "| {row} | {delta_cj} | {seconds:.2} | {} | {} | {} | {} |",
                s.steps, s.newton_iterations, s.newton_failures, s.linear_setups
            );
        }
    }
    Ok(())
}
