//! Measures the spatial discretization error. Compares u_y and p at the origin between the paper's mesh and refined
//! meshes. The error of the time integration is negligible.

use anyhow::Context as _;
use myovib_dae::Problem;
use myovib_fem::Mesh;
use myovib_model::{
    Formulation, IntegratorKind, MuscleDae, Outcome, Probe, SampleTimes, Sampler, Settings, paper,
    run, start_at_rest,
};

const FORMULATION: Formulation = Formulation::Position;
const LEVELS: usize = 3;
const RTOL: f64 = 1e-6;
/// End time of the runs, s.
const T_END: f64 = 1.0;
/// Sampling interval (s), with twenty samples per period of the load.
const EVERY: f64 = 1.0 / 160.0;

/// u_y and p at the origin as functions of time.
type Motion = [Vec<f64>; 2];

fn main() -> anyhow::Result<()> {
    for kappa in [paper::KAPPA, f64::INFINITY] {
        let mut mesh =
            Mesh::parse_msh(include_str!("../../../../data/meshes/muscle.msh"), "muscle.msh")?;
        let mut motions = Vec::new();
        for level in 0..LEVELS {
            if level > 0 {
                mesh = mesh.refined()?;
            }
            print!("bulk_modulus = {kappa:e}, level {level}: ");
            motions.push(integrate(&mesh, kappa)?);
        }
        let (finest, coarser) = motions.split_last().context("there is a level 0")?;
        for (level, motion) in coarser.iter().enumerate() {
            let [u_y, p] = [0, 1].map(|k| largest_difference(&motion[k], &finest[k]));
            println!(
                "bulk_modulus = {kappa:e}, level {level} to {}: u_y {u_y:.2e}, p {p:.2e}",
                LEVELS - 1,
            );
        }
    }
    Ok(())
}

/// Integrates the undamped muscle on the given mesh and prints the cost.
fn integrate(mesh: &Mesh, kappa: f64) -> anyhow::Result<Motion> {
    let muscle = paper::muscle(mesh, kappa, 0.0)?;
    let unknowns = muscle.n_unknowns_paper();
    let origin = Probe::at(muscle.solid.space(), [0.0, 0.0])?;
    let dae = MuscleDae::new(muscle, FORMULATION)?;
    let settings = Settings {
        integrator: IntegratorKind::Radau9,
        t_end: T_END,
        suppressed: Vec::new(),
        ..Settings::paper(FORMULATION).with_relative_tolerance(RTOL)
    };
    let (mut u_y, mut p) = (Vec::new(), Vec::new());
    let (times, n) = (SampleTimes::new(EVERY, T_END), dae.n_unknowns());
    let mut sampler = Sampler::new(times, n, |dae: &mut MuscleDae, t, y: &[f64]| {
        let value = dae.read(&origin, t, y);
        u_y.push(value.displacement[1]);
        p.push(value.pressure);
        Ok(())
    });
    let mut integrator = start_at_rest(dae, &settings)?;
    let statistics = run(integrator.as_mut(), &mut [&mut sampler])?;
    drop(sampler);
    if let Outcome::Stopped { message, .. } = statistics.outcome {
        anyhow::bail!("the run stopped: {message}");
    }
    println!(
        "{unknowns} unknowns q and lambda, {} steps, {:.2} s",
        statistics.counts.steps, statistics.cpu_seconds
    );
    Ok([u_y, p])
}

/// Returns max |a − b| / max |b|.
fn largest_difference(a: &[f64], b: &[f64]) -> f64 {
    let max = |values: &mut dyn Iterator<Item = f64>| values.map(f64::abs).fold(0.0, f64::max);
    max(&mut a.iter().zip(b).map(|(a, b)| a - b)) / max(&mut b.iter().copied())
}
