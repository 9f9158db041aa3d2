//! Convergence of the muscle's motion to the incompressible motion as κ → ∞.
//!
//! ```text
//! cargo run --release -p myovib-model --example kappa_limit
//! ```
//! For each κ, the largest difference in u_y(0, 0) over [0, 0.6] s from the motion with κ = ∞,
//! relative to the largest u_y of the latter; by Radau IIA at a relative tolerance of 1e-8.
//! `displacement` is included, whose limit locks, and `position` with P1–P1 elements, which violate
//! the inf–sup condition.

use std::sync::Arc;

use myovib_dae::Problem;
use myovib_fem::{DofMap, Mesh, Solid, Space, load};
use myovib_model::{
    Formulation, IntegratorKind, Load, ModelError, Muscle, MuscleDae, Outcome, Parameters, Probe,
    SampleTimes, Sampler, Settings, Signal, paper, run, start_at_rest,
};

const T_END: f64 = 0.6;

fn main() -> Result<(), ModelError> {
    let mesh = include_str!("../../../data/meshes/muscle.msh");
    let mesh = Mesh::parse_msh(mesh, "muscle.msh")?;
    let stable = Space::taylor_hood(&mesh);
    let unstable = Space::equal_order(&mesh);
    let columns = [
        (&stable, Formulation::Position, 0.0),
        (&stable, Formulation::Rate, paper::BETA),
        (&stable, Formulation::Displacement, 0.0),
        (&unstable, Formulation::Position, 0.0),
    ];
    println!("| κ | `position`, β = 0 | `rate`, β = 1e-4 | `displacement`, β = 0 | P1–P1, β = 0 |");
    println!("|---|---|---|---|---|");
    let undamped = motion(&stable, Formulation::Position, f64::INFINITY, 0.0)?;
    let damped = motion(&stable, Formulation::Rate, f64::INFINITY, paper::BETA)?;
    for kappa in (5..=12).map(|k| 10_f64.powi(k)) {
        let mut row = format!("| {kappa:.0e} |");
        for (space, formulation, beta) in columns {
            let limit = if beta > 0.0 { &damped } else { &undamped };
            let cell = match motion(space, formulation, kappa, beta)? {
                Some(u_y) => limit.as_ref().map(|limit| distance(&u_y, limit)),
                None => None,
            };
            row += &cell.map_or(" stopped |".to_owned(), |gap| format!(" {gap:.2e} |"));
        }
        println!("{row}");
    }
    Ok(())
}

/// Returns u_y at the origin, if the run finishes.
fn motion(
    space: &Space,
    formulation: Formulation,
    kappa: f64,
    beta: f64,
) -> Result<Option<Vec<f64>>, ModelError> {
    let space = Arc::new(space.clone());
    let dofs = DofMap::clamped(&space, &space.nodes_of(paper::FIXED_GROUP)?)?;
    let load = load::traction(&space, paper::LOAD_GROUP, [0.0, 1.0])?;
    let solid = Solid::uniform(space, dofs, paper::LAW, paper::DENSITY)?;
    let muscle = Muscle {
        loads: vec![Load::new(&load, Signal::paper(paper::LOAD_AMPLITUDE))],
        ..Muscle::unloaded(solid, Parameters::new(paper::ALPHA, beta, kappa)?)
    };
    let origin = Probe::at(muscle.solid.space(), [0.0, 0.0])?;
    let settings = Settings {
        t_end: T_END,
        ..Settings::paper(formulation)
            .with_integrator(IntegratorKind::Radau5)
            .with_relative_tolerance(1e-8)
    };
    let dae = MuscleDae::new(muscle, formulation)?;
    let n = dae.n_unknowns();
    let mut integrator = start_at_rest(dae, &settings)?;
    let mut u_y = Vec::new();
    let mut sampler = Sampler::new(
        SampleTimes::new(1.0 / 160.0, T_END),
        n,
        |dae: &mut MuscleDae, t, y: &[f64]| {
            let (displacement, _) = dae.nodal_motion(t, y);
            u_y.push(origin.vector(displacement)[1]);
            Ok(())
        },
    );
    let statistics = run(integrator.as_mut(), &mut [&mut sampler])?;
    drop(sampler);
    Ok((statistics.outcome == Outcome::Finished).then_some(u_y))
}

fn distance(ours: &[f64], limit: &[f64]) -> f64 {
    let gaps = ours.iter().zip(limit).map(|(a, b)| (a - b).abs());
    let largest = limit.iter().map(|b| b.abs()).fold(0.0, f64::max);
    gaps.fold(0.0, f64::max) / largest
}
