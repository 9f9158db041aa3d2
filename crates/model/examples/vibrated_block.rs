//! A soft incompressible block under a vibration, as a library user would run it.
//!
//! `cargo run --release -p myovib-model --example vibrated_block`

use std::error::Error;
use std::sync::Arc;

use myovib_dae::Problem;
use myovib_fem::{DofMap, Law, Solid, Space, generate, load};
use myovib_model::{
    Formulation, IdaIntegrator, Load, Muscle, MuscleDae, Parameters, Probe, SampleTimes, Sampler,
    Settings, Signal, run,
};

fn main() -> Result<(), Box<dyn Error>> {
    // The body: 10 cm by 3 cm of soft tissue, clamped on the left.
    let mesh = generate::rectangle([0.0, 0.0], [0.1, 0.03], [10, 3])?;
    let space = Arc::new(Space::taylor_hood(&mesh));
    let dofs = DofMap::clamped(&space, &space.nodes_of("left")?)?;
    let push = load::traction(&space, "right", [0.0, 1.0])?;
    let solid = Solid::uniform(space, dofs, Law::MooneyRivlin { c10: 1e4, c01: 2e2 }, 1.1e3)?;
    let muscle = Muscle {
        loads: vec![Load::new(&push, Signal::paper(20.0))],
        ..Muscle::unloaded(solid, Parameters::new(1.0, 0.0, f64::INFINITY)?)
    };
    let corner = Probe::at(muscle.solid.space(), [0.1, 0.03])?;

    // The equations: Gear–Gupta–Leimkuhler, index 2.
    let dae = MuscleDae::new(muscle, Formulation::Stabilized)?;
    println!("{} unknowns, index {}", dae.n_unknowns(), dae.index());

    // The run, with the corner's displacement every tenth of a second.
    let settings = Settings { t_end: 1.0, ..Settings::paper(Formulation::Stabilized) };
    let n = dae.n_unknowns();
    let mut integrator = IdaIntegrator::from_rest(dae, &settings)?;
    println!("{:>6} {:>12}", "t (s)", "u_y (m)");
    let mut print =
        Sampler::new(SampleTimes::new(0.1, 1.0), n, |dae: &mut MuscleDae, t, y: &[f64]| {
            let (displacement, _) = dae.nodal_motion(t, y);
            println!("{t:6.2} {:12.4e}", corner.vector(displacement)[1]);
            Ok(())
        });
    let statistics = run(&mut integrator, &mut [&mut print])?;
    println!("{} steps, {}", statistics.counts.steps, statistics.outcome.name());
    Ok(())
}
