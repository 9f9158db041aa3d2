//! Checks that the response equals the settled amplitude of a motion under a small load, in all formulations.

use std::f64::consts::TAU;
use std::path::Path;

use myovib_scene::Scene;
use myovib_scene::csv::Table;
use myovib_scene::run::{RunOptions, compute};
use num_complex::Complex64;

use crate::{column, damping, error, response};

const FREQUENCY: f64 = 20.0;
/// Number of periods until the transient has decayed to e^{−αt/2} = 2e-9 (α = 50 1/s; no mode is overdamped).
const PERIODS: usize = 16;
/// Number of samples of the following period.
const SAMPLES: usize = 16;

/// Returns a body pulled along y with a strain of about 1e-4. Nonlinear terms are of third order in the strain and
/// change the amplitude by 1e-8.
fn scene(mesh: &str, solid: &str, size: f64) -> String {
    let every = 1.0 / (FREQUENCY * SAMPLES as f64);
    let end = (PERIODS + 1) as f64 / FREQUENCY;
    format!(
        "[time]\nend = {end:?}\n[mesh]\n{mesh}\n[solid]\nrayleigh_mass = 50.0\n{solid}\n\
         [[material]]\nlaw = \"mooney-rivlin\"\ndensity = 1e3\nc10 = 8e3\nc01 = 1e3\nviscosity = 2.0\n\
         prony = [{{ relative_modulus = 0.3, relaxation_time = 0.01 }}]\n\
         [[fixed]]\ngroup = \"left\"\n[[traction]]\ngroup = \"right\"\n\
         y = {{ type = \"sine\", amplitude = {size:?}, frequency = {FREQUENCY:?} }}\n\
         response = {{ y = {size:?} }}\n[response]\nfrequencies = [{FREQUENCY:?}]\n\
         [[probe]]\nname = \"mean\"\ntype = \"average\"\ngroup = \"right\"\nquantities = [\"u\"]\ninterval = {every:?}\n\
         [integrator]\nmethod = \"radau13\"\nrtol = 1e-8\natol = {{ u = 1e-13, v = 1e-11, p = 1e-6 }}\n"
    )
}

/// Returns the amplitude of the last period of a motion under a load sin ωt.
fn settled(text: &str) -> Complex64 {
    let out = tempfile::tempdir().unwrap();
    let scene = Scene::build("scene.toml", text, &[], Path::new("")).unwrap();
    let result = compute(&scene, &RunOptions::into_folder(out.path())).unwrap();
    assert_eq!(result.document["outcome"], "finished");
    let table = std::fs::read_to_string(out.path().join("mean.csv")).unwrap();
    let table = Table::parse(&table).unwrap();
    let rows: Vec<Vec<f64>> = table.rows.iter().map(|row| table.numbers(row).unwrap()).collect();
    let last = &rows[rows.len() - SAMPLES..];
    let y = table.names.iter().position(|name| name == "u_y").unwrap();
    // u = Im(û e^{iωt}), so the mean of u e^{−iωt} is û/(2i).
    let sum: Complex64 =
        last.iter().map(|row| row[y] * Complex64::from_polar(1.0, -TAU * FREQUENCY * row[0])).sum();
    2.0 * Complex64::I * sum / SAMPLES as f64
}

/// All formulations.
const SOLIDS: [&str; 6] = [
    "bulk_modulus = 1e5\nformulation = \"displacement\"",
    "bulk_modulus = 1e5\nformulation = \"position\"",
    "bulk_modulus = inf\nformulation = \"velocity\"",
    "bulk_modulus = inf\nformulation = \"stabilized\"",
    "bulk_modulus = inf\nrayleigh_stiffness = 1e-4\nformulation = \"rate\"",
    "bulk_modulus = 1e5\nrayleigh_stiffness = 1e-4\nformulation = \"implicit-rate\"",
];

fn expect_settled(mesh: &str, size: f64) {
    for solid in SOLIDS {
        let text = scene(mesh, solid, size);
        let motion = settled(&text);
        let found = response(&format!("analysis = \"response\"\n{text}"));
        let expected = column(&found, "mean", "u_y")[0];
        let error = error(motion, expected);
        assert!(error < 1e-6, "{solid}: {motion} {expected}");
    }
}

#[test]
fn plane_motions_settle_to_the_response() {
    let mesh = "type = \"rectangle\"\nwidth = 0.05\nheight = 0.03\ncells = [3, 1]";
    expect_settled(mesh, 3.0);
}

#[test]
fn motions_in_space_settle_to_the_response() {
    let mesh = "type = \"box\"\nsize = [0.06, 0.02, 0.02]\ncells = [2, 1, 1]";
    expect_settled(mesh, 5.0);
}

/// Supports that move at the time of the preload have no velocity in the equilibrium. Regression: the viscous stress of that
/// velocity was linearized, which changed amplitudes by 10 %.
#[test]
fn velocities_of_supports_at_the_preload_time_have_no_effect() {
    let amplitude = |motion: &str, name: &str| {
        let [solid, material] = damping(name);
        let text = format!(
            "analysis = \"response\"\n[mesh]\ntype = \"rectangle\"\nwidth = 0.1\nheight = 0.03\ncells = [4, 2]\n\
             [solid]\nbulk_modulus = inf\n{solid}\n[[material]]\nlaw = \"neo-hooke\"\nshear_modulus = 1e3\ndensity = 1e3\n\
             {material}\n[[fixed]]\ngroup = \"left\"\n[[prescribed_displacement]]\ngroup = \"right\"\nx = {motion}\n\
             [response]\nfrequencies = [3.0]\npreload_time = 1.0\n[[traction]]\ngroup = \"top\"\nresponse = {{ y = 1.0 }}\n\
             [[probe]]\nname = \"middle\"\ntype = \"point\"\nat = [0.05, 0.03]\n"
        );
        column(&response(&text), "middle", "u_y")[0]
    };
    for name in ["beta1e-4", "eta5", "prony", "springpot"] {
        // The displacement is half of the step, in the middle of its rise.
        let moving = amplitude("{ type = \"step\", value = 0.02, rise = 2.0 }", name);
        let still = amplitude("0.01", name);
        // The tolerance is a hundred times the last relative increment of Newton's method, 1e-9, because the stiffness
        // amplifies increments.
        assert!(error(moving, still) < 1e-7, "{name}: {moving} {still}");
    }
}
