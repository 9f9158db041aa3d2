//! Coefficients and exponents of Ogden's law as parameters.

use std::fmt::Write;
use std::fs;

use myovib_scene::fit::{FitOptions, compute};
use myovib_scene::sensitivity::{Parameterized, Precision, compute as follow};
use myovib_scene::watch::Watcher;

use crate::options;

/// A strip in plane strain, stretched to twice its length.
const STRIP: &str = "[time]\nend = 1.0\n[mesh]\ntype = \"rectangle\"\nwidth = 0.1\nheight = 0.01\ncells = [2, 1]\n\
    [solid]\nbulk_modulus = inf\n[[material]]\ndensity = 1060.0\nlaw = \"ogden\"\n\
    mu_1 = 8e3\nalpha_1 = 4.0\nmu_2 = -1.5e3\nalpha_2 = -3.0\n\
    [[fixed]]\ngroup = \"left\"\ncomponents = [\"x\"]\n[[fixed]]\ngroup = \"bottom\"\ncomponents = [\"y\"]\n\
    [[prescribed_displacement]]\ngroup = \"right\"\nx = { type = \"step\", rise = 1.0, value = 0.1 }\n\
    [[probe]]\nname = \"force\"\ntype = \"reaction\"\ngroup = \"right\"\ninterval = 0.05\n\
    [[output]]\nname = \"force\"\nprobe = \"force\"\ncolumn = \"R_x\"\nnoise = 0.01\n";

/// Checks that a fit to a computed force finds the coefficient and the exponent of each term.
#[test]
fn constants_of_each_term_are_found() {
    for names in [["mu_1", "alpha_1"], ["mu_2", "alpha_2"]] {
        let folder = tempfile::tempdir().unwrap();
        let scene = folder.path().join("scene.toml");
        let keys = names.map(|name| format!("[[parameter]]\nkey = \"material[0].{name}\"\n"));
        fs::write(&scene, format!("{STRIP}{}", keys.concat())).unwrap();
        let accurate = ["integrator.method=radau9", "integrator.rtol=1e-7"].map(str::to_owned);
        let twin = Parameterized::load(&scene, &accurate).unwrap();
        let truth = twin.values();
        let curves = follow(&twin, Precision::default(), Watcher::NOBODY).unwrap();
        let mut rows = String::from("t,force\n");
        for sample in &curves.samples[1..] {
            writeln!(rows, "{},{:e}", sample.t, sample.values[0]).unwrap();
        }
        let data = folder.path().join("force.csv");
        fs::write(&data, rows).unwrap();
        let guesses = names.iter().zip(&truth);
        let guesses = guesses.map(|(name, value)| format!("material[0].{name}={:e}", 0.8 * value));
        let result = compute(&FitOptions {
            set: accurate.into_iter().chain(guesses).collect(),
            ..options(scene, vec![(data, Vec::new())])
        })
        .unwrap();
        assert!(result.fit.is_converged(), "{}", result.ending());
        for ((name, value), found) in names.into_iter().zip(truth).zip(&result.fit.values) {
            // Both runs have errors of 1e-7 from different time steps, which are amplified at most a hundredfold.
            assert!((found / value - 1.0).abs() < 1e-5, "{name}: {found}");
        }
    }
}
