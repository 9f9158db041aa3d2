//! Evaluates a residual or a Jacobian repeatedly, so that `scripts/instructions` can count the instructions.
//!
//! Usage: `instructions SCENE residual|jacobian REPEATS`. Without arguments, lists the scenes.

use std::env;

use anyhow::{Context as _, bail};
use myovib_dae::Problem;
use myovib_fem::{Law, Mesh};
use myovib_model::paper::{BETA, KAPPA, LAW, SMALL_STRAIN};
use myovib_model::{Formulation, MuscleDae, Signal, paper};

/// Scenes, each with one more feature than the previous one.
const SCENES: [(&str, Formulation, Law, f64, f64); 6] = [
    ("small-strain", Formulation::Displacement, SMALL_STRAIN, KAPPA, 0.0),
    ("pressure-incompressible", Formulation::Position, SMALL_STRAIN, f64::INFINITY, 0.0),
    ("kappa-finite", Formulation::Position, SMALL_STRAIN, KAPPA, 0.0),
    ("mooney-rivlin", Formulation::Position, LAW, KAPPA, 0.0),
    ("damping-implicit", Formulation::ImplicitRate, LAW, KAPPA, BETA),
    ("damping-unknown", Formulation::Rate, LAW, KAPPA, BETA),
];

fn main() -> anyhow::Result<()> {
    let arguments: Vec<String> = env::args().skip(1).collect();
    let [name, what, repeats] = arguments.as_slice() else {
        for (name, ..) in SCENES {
            println!("{name}");
        }
        return Ok(());
    };
    let known = SCENES.into_iter().find(|(scene, ..)| scene == name);
    let (_, formulation, law, kappa, beta) = known.context("unknown scene")?;
    let mesh = Mesh::parse_msh(include_str!("../../../../data/meshes/muscle.msh"), "muscle.msh")?;
    let load = Signal::paper(paper::LOAD_AMPLITUDE);
    let muscle = paper::muscle_with_load(&mesh, law, kappa, beta, load)?;
    let mut dae = MuscleDae::new(muscle, formulation)?;
    let n = dae.n_unknowns();
    let state = |size: f64| -> Vec<f64> { (0..n).map(|i| size * (i as f64).sin()).collect() };
    let (y, y_dot, mut out) = (state(1e-6), state(1e-5), vec![0.0; n]);
    let mut values = vec![0.0; dae.jacobian_pattern().nnz()];
    for _ in 0..repeats.parse::<u32>()? {
        match what.as_str() {
            "residual" => dae.residual(0.5, &y, &y_dot, &mut out)?,
            "jacobian" => dae.jacobian(0.5, &y, &y_dot, 1.0, 1e3, &mut values)?,
            other => bail!("`{other}` is neither `residual` nor `jacobian`"),
        }
    }
    Ok(())
}
