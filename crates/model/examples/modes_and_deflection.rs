//! Natural frequencies and static deflection of a cantilever in plane strain, beside an Euler–Bernoulli beam.
//!
//! `cargo run --release -p myovib-model --example modes_and_deflection`

use std::error::Error;
use std::f64::consts::TAU;
use std::sync::Arc;

use myovib_fem::{DofMap, Law, Solid, Space, generate, load};
use myovib_model::statics::{Equilibrium, equilibrium};
use myovib_model::{Formulation, Load, Muscle, Parameters, Probe, Signal, spectrum};

fn main() -> Result<(), Box<dyn Error>> {
    let (length, thickness, density, shear_modulus) = (0.2, 0.01, 1.1e3, 2e4);
    let traction = 0.05;

    let mesh = generate::rectangle([0.0, 0.0], [length, thickness], [40, 2])?;
    let space = Arc::new(Space::taylor_hood(&mesh));
    let dofs = DofMap::clamped(&space, &space.nodes_of("left")?)?;
    let push = load::traction(&space, "right", [0.0, 1.0])?;
    let law = Law::MooneyRivlin { c10: 0.5 * shear_modulus, c01: 0.0 };
    let muscle = Muscle {
        loads: vec![Load::new(&push, Signal::constant(traction))],
        ..Muscle::unloaded(
            Solid::uniform(space, dofs, law, density)?,
            Parameters::new(0.0, 0.0, f64::INFINITY)?,
        )
    };

    let bending = shear_modulus * thickness.powi(3) / 3.0; // 4μ I: incompressible, in plane strain
    let modes = spectrum::lowest(&muscle, &Equilibrium::unloaded(&muscle), 3)?;
    for (mode, root) in modes.iter().zip([1.875104_f64, 4.694091, 7.854757]) {
        let beam = (root / length).powi(2) * (bending / (density * thickness)).sqrt() / TAU;
        println!("{:.4} Hz, beam {beam:.4} Hz", mode.frequency().unwrap_or(f64::NAN));
    }

    let at = equilibrium(&muscle, Formulation::Position, 0.0)?;
    let dofs = muscle.solid.dofs();
    let mut displacement = vec![0.0; dofs.n_full()];
    dofs.expand(&at.displacement, &mut displacement); // from the free components to all nodes
    let tip = Probe::at(muscle.solid.space(), [length, 0.5 * thickness])?.vector(&displacement);
    let beam = traction * thickness * length.powi(3) / (3.0 * bending);
    println!("tip {:.4e} m, beam {beam:.4e} m", tip[1]);
    Ok(())
}
