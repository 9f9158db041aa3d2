//! The error of the mesh: u_y and p at the origin on the paper's mesh and on refined ones, with the
//! error of time far below.

use myovib_fem::Mesh;
use myovib_model::{
    AbsoluteTolerances, Formulation, IntegratorKind, MuscleDae, Probe, SampleTimes, Sampler,
    Settings, paper, run, start_at_rest,
};
use sundials_wrap::DaeProblem;

const LEVELS: usize = 3;
const RTOL: f64 = 1e-6;

fn main() -> anyhow::Result<()> {
    for (kappa, formulation) in [
        (1e5, Formulation::Position),
        (f64::INFINITY, Formulation::Position),
    ] {
        let mut mesh = Mesh::parse_msh(
            include_str!("../../../data/meshes/muscle.msh"),
            "muscle.msh",
        )?;
        let mut known: Vec<[Vec<f64>; 2]> = Vec::new();
        for level in 0..LEVELS {
            if level > 0 {
                mesh = mesh.refined();
            }
            let muscle = paper::muscle(&mesh, kappa, 0.0)?;
            let unknowns = muscle.n_unknowns_paper();
            let origin = Probe::at(muscle.solid.space(), [0.0, 0.0])?;
            let dae = MuscleDae::new(muscle, formulation)?;
            let (mut u, mut p) = (Vec::new(), Vec::new());
            let paper = Settings::paper(formulation);
            let factor = RTOL / paper.relative_tolerance;
            let atol = paper.absolute_tolerances;
            let settings = Settings {
                integrator: IntegratorKind::Radau9,
                t_end: 1.0,
                relative_tolerance: RTOL,
                absolute_tolerances: AbsoluteTolerances {
                    displacement: factor * atol.displacement,
                    velocity: factor * atol.velocity,
                    pressure: factor * atol.pressure,
                    multiplier: factor * atol.multiplier,
                },
                suppressed: Vec::new(),
                ..paper
            };
            let times = SampleTimes::new(1.0 / 160.0, 1.0);
            let n = dae.n_unknowns();
            let mut sampler = Sampler::new(times, n, |dae: &mut MuscleDae, t, y: &[f64]| {
                let value = dae.read(&origin, t, y);
                u.push(value.displacement[1]);
                p.push(value.pressure);
                Ok(())
            });
            let mut integrator = start_at_rest(dae, &settings)?;
            let statistics = run(integrator.as_mut(), &mut [&mut sampler])?;
            drop(sampler);
            println!(
                "kappa = {kappa:e}, level {level}: {unknowns} unknowns q and lambda, {} steps, {:.2} s",
                statistics.counts.steps, statistics.cpu_seconds
            );
            known.push([u, p]);
        }
        let finest = known[LEVELS - 1].clone();
        for (level, runs) in known.iter().enumerate().take(LEVELS - 1) {
            let difference = |k: usize| {
                let max = |x: f64, y: f64| f64::max(x, y.abs());
                let pairs = runs[k].iter().zip(&finest[k]);
                let largest = pairs.map(|(a, b)| a - b).fold(0.0, max);
                largest / finest[k].iter().copied().fold(0.0, max)
            };
            println!(
                "kappa = {kappa:e}, level {level} to {}: u_y {:.2e}, p {:.2e}",
                LEVELS - 1,
                difference(0),
                difference(1)
            );
        }
    }
    Ok(())
}
