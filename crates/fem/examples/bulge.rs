//! Energy, volume change and stress for a prescribed bulge of the muscle.
//!
//! The example meshes the spindle and prescribes u_y = a cos²(π x / 0.2) for several amplitudes a. This
//! displacement and its slope are zero at both ends. The example prints the results of the operators. Run it with
//! `cargo run -p myovib-fem --example bulge`.

use std::f64::consts::PI;
use std::sync::Arc;

use myovib_fem::solid::{Fields, Pressure, Solid, Vectors};
use myovib_fem::{DofMap, Law, Space, generate};

/// Returns the energy, the total volume residual, and the von Mises stress at (0.05, 0) for the amplitude `a`.
fn results(solid: &Solid, a: f64) -> Result<[f64; 3], Box<dyn std::error::Error>> {
    let bulge = |&[x, _]: &[f64; 2]| [0.0, a * (PI * x / 0.2).cos().powi(2)];
    let u: Vec<f64> = solid.space().node_points().iter().flat_map(bulge).collect();
    let fields = Fields::new(&u, Pressure::Penalty { kappa: 1e5 });
    let mut volume_residual = vec![0.0; solid.space().n_pressures()];
    let mut out = Vectors { volume_residual: Some(&mut volume_residual), ..Vectors::default() };
    solid.evaluate(&fields, &mut out)?;
    let quarter = solid.space().locate([0.05, 0.0]).ok_or("the point is outside the mesh")?;
    Ok([
        solid.strain_energy(&fields),
        volume_residual.iter().sum(),
        solid.state_at(&fields, &quarter).von_mises(),
    ])
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let space = Arc::new(Space::taylor_hood(&generate::spindle([20, 6])?));
    let dofs = DofMap::clamped(&space, &space.nodes_of("fixed")?)?;
    let law = Law::MooneyRivlin { c10: 1e4, c01: 2e2 };
    let solid = Solid::uniform(space, dofs, law, 1.1e3)?;
    println!("{} triangles, {} free components", solid.space().n_elements(), solid.dofs().n_free());
    println!("amplitude/m  energy/(J/m)  volume change/m²  von Mises at (0.05, 0)/Pa");
    for a in [1e-3, 2e-3, 4e-3] {
        let [energy, change, mises] = results(&solid, a)?;
        println!("{a:<11}  {energy:<12.5e}  {change:<16.5e}  {mises:.5e}");
    }
    // u_y depends on x alone, so the deformation is a shear along y, which preserves the volume.
    let [small, change, _] = results(&solid, 1e-3)?;
    let [large, ..] = results(&solid, 2e-3)?;
    assert!(change.abs() < 1e-15 && (large / small - 4.0).abs() < 1e-2);
    Ok(())
}
