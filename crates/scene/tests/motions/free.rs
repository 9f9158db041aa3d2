//! Bodies without supports.

use myovib_scene::Scene;
use myovib_scene::modes::Modes;
use myovib_scene::watch::Watcher;

use crate::common::{rows, run};

const BEAM: &str = r#"
[mesh]
type = "rectangle"
width = 1.0
height = 0.1
cells = [12, 2]
[solid]
bulk_modulus = 1e6
[[material]]
law = "neo-hooke"
density = 1e3
shear_modulus = 1e4
"#;

/// Checks that a body in translation stays undeformed.
#[test]
fn a_free_body_keeps_its_velocity() {
    let motion = "[time]\nend = 0.5\n[initial_state]\ntype = \"velocity\"\nvalue = [0.3, -0.2]\n\
                  [[probe]]\nname = \"end\"\ntype = \"point\"\nat = [1.0, 0.1]\nquantities = [\"u\", \"v\"]\ninterval = 0.1\n";
    for bulk_modulus in ["solid.bulk_modulus=1e6", "solid.bulk_modulus=inf"] {
        let folder = tempfile::tempdir().unwrap();
        let out = folder.path().join("out");
        run(&format!("{motion}{BEAM}"), &[bulk_modulus], &out);
        for row in rows(&out, "end") {
            let exact = [0.3 * row[0], -0.2 * row[0], 0.3, -0.2];
            for (value, exact) in row[1..].iter().zip(exact) {
                // Without strain, only rounding errors remain.
                assert!((value - exact).abs() < 1e-12, "{row:?}");
            }
        }
    }
}

/// Checks that a 2D body has three modes at 0 Hz, and that a foundation raises the fourth frequency by its stiffness.
#[test]
fn a_free_body_has_rigid_modes() {
    let frequencies = |more: &str| {
        let text = format!("analysis = \"modes\"\n{BEAM}{more}");
        let scene = Scene::build("scene.toml", &text, &[], std::path::Path::new("")).unwrap();
        let modes = Modes::of_scene(&scene, Some(4), Watcher::NOBODY).unwrap();
        let modes = &modes.muscles[0].modes;
        modes.iter().map(|mode| mode.omega_squared).collect::<Vec<f64>>()
    };
    let free = frequencies("");
    let bedded = frequencies("[[elastic_foundation]]\ngroup = \"bottom\"\nstiffness = 1.0\n");
    assert_eq!(free[..3], [0.0; 3]);
    // For a shape constant across the beam, the foundation adds k/(ρ h) to ω². The rotation θ of the cross-sections moves the
    // edges by h θ/2. For the first mode of Euler–Bernoulli, cosh b cos b = 1; relative to the deflection, the mean square of
    // h θ is s (s + 6) (h/L)² with s = b (cosh b − cos b)/(sinh b − sin b).
    let added = (bedded[3] - free[3]) * 1e3 * 0.1;
    let mut b = 4.7_f64;
    for _ in 0..10 {
        b -= (b.cosh() * b.cos() - 1.0) / (b.sinh() * b.cos() - b.cosh() * b.sin());
    }
    let s = b * (b.cosh() - b.cos()) / (b.sinh() - b.sin());
    let rotation = s * (s + 6.0) * 0.1_f64.powi(2);
    assert!((added - 1.0).abs() < 0.25 * rotation, "{free:?} {bedded:?}");
}
