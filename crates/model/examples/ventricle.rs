//! Contraction of an ellipsoidal ventricle with inertia (Aróstica et al. 2025, case A).
//!
//! ```text
//! cargo run --release -p myovib-model --example ventricle -- MESH [RTOL] [T_END] [ORDER]
//! ```
//!
//! Holzapfel–Ogden's law, Kelvin–Voigt damping, fibers of the mesh file, tension by Bestel's
//! equation, elastic and viscous foundations on the outside and at the base. Prints the
//! displacements of two points in mm, then steps and CPU time.

use std::sync::Arc;

use myovib_dae::Problem;
use myovib_fem::material::{ActiveStress, Bestel};
use myovib_fem::{AddedStress, DofMap, Fibers, Group, Law, Mesh, Solid, Space, SupportDirection};
use myovib_model::{
    Activation, Formulation, IntegratorKind, ModelError, Muscle, MuscleDae, Parameters, Probe,
    RobinSupport, SampleTimes, Sampler, Settings, run, start_at_rest,
};

/// Creates the probe at a point, or at a nearby interior point if the straight-sided mesh does not
/// reach it.
fn probe(space: &Space, [x, y, z]: [f64; 3]) -> Result<Probe, ModelError> {
    let inside = |k: i32| 1.0 - 1e-4 * f64::from(k);
    let tried = (0..100).map(|k| Probe::at(space, [x, inside(k) * y, inside(k) * z]));
    tried.reduce(Result::or).expect("a hundred trials")
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let path = arguments.next().ok_or("name the mesh file")?;
    let number =
        |text: Option<String>, default: f64| text.map_or(Ok(default), |t| t.parse::<f64>());
    let rtol = number(arguments.next(), 1e-3)?;
    let t_end = number(arguments.next(), 1.0)?;
    let order = number(arguments.next(), 5.0)?;

    let mesh = Mesh::read_msh(&path)?;
    let Group::Elements(members) = mesh.group("myocardium")?.clone() else {
        return Err("the group of the myocardium has no elements".into());
    };
    let space = Arc::new(Space::taylor_hood(&mesh));
    let dofs = DofMap::new(&space, &[])?;
    let law = Law::HolzapfelOgden {
        a: 59.0,
        b: 8.023,
        a_f: 18472.0,
        b_f: 16.026,
        a_s: 2481.0,
        b_s: 11.12,
        a_fs: 216.0,
        b_fs: 11.436,
        k: 100.0,
        dispersion_f: 0.0,
        dispersion_s: 0.0,
    };
    let mut fibers = Fibers::new(&mesh);
    fibers.set_nodal(&mesh, &members, "f0", Some("s0"))?;
    let stress = AddedStress {
        active: Some(ActiveStress::PLAIN),
        viscosity: 100.0,
    };
    let solid = Solid::uniform(space.clone(), dofs, law, 1e3)?
        .with_fibers(fibers)
        .with_added_stresses(&[(members, stress)])?;
    let muscle = Muscle {
        foundations: vec![
            RobinSupport::new(&solid, "epi", SupportDirection::Normal, [1e8, 5e3])?,
            RobinSupport::new(&solid, "base", SupportDirection::All, [1e5, 5e3])?,
        ],
        activations: vec![(0, Activation::Bestel(Bestel::ventricle(1.5e5)))],
        ..Muscle::unloaded(solid, Parameters::new(0.0, 0.0, 1e6)?)
    };

    let formulation = Formulation::Position;
    let mut settings = Settings::paper(formulation);
    settings.t_end = t_end;
    let of_order = |kind: &IntegratorKind| kind.order().map(f64::from) == Some(order);
    let kind = IntegratorKind::ALL.into_iter().find(of_order);
    settings = settings.with_integrator(kind.unwrap_or(IntegratorKind::Bdf));
    settings.relative_tolerance = rtol;
    settings.absolute_tolerances.displacement = 1e-2 * rtol;
    settings.absolute_tolerances.velocity = rtol;
    settings.absolute_tolerances.pressure = 1e5 * rtol;

    let points = [[0.025, 0.03, 0.0], [0.0, 0.03, 0.0]];
    let probes = [probe(&space, points[0])?, probe(&space, points[1])?];
    let dae = MuscleDae::new(muscle, formulation)?;
    let n = dae.n_unknowns();
    println!("# {n} unknowns; t in s, points in mm");
    println!("t,p0_x,p0_y,p0_z,p1_x,p1_y,p1_z,T");
    let mut integrator = start_at_rest(dae, &settings)?;
    let mut sampler = Sampler::new(
        SampleTimes::new(0.01, t_end),
        n,
        |dae: &mut MuscleDae, t, y: &[f64]| {
            let (u, _) = dae.nodal_motion(t, y);
            let places = probes.iter().flat_map(|probe| probe.vector(u));
            let places: Vec<String> = places.map(|x| format!("{:.4}", 1e3 * x)).collect();
            println!("{t:.2},{},{:.1}", places.join(","), y[n - 1]);
            Ok(())
        },
    );
    let statistics = run(&mut *integrator, &mut [&mut sampler])?;
    println!("# {statistics:?}");
    println!("# {:?}", integrator.problem().counters());
    Ok(())
}
