//! Accelerations at points.

use crate::common::{rows, run};

/// A strip whose left end is shaken by a sine that starts smoothly.
const SHAKEN: &str = "[time]\nend = 0.4\n[mesh]\ntype = \"rectangle\"\nwidth = 0.1\nheight = 0.02\ncells = [4, 1]\n\
     [solid]\nbulk_modulus = 1e6\n[[material]]\nlaw = \"neo-hooke\"\ndensity = 1060.0\nshear_modulus = 1e4\n\
     [[prescribed_displacement]]\ngroup = \"left\"\nx = { type = \"product\", of = [\
     { type = \"step\", value = 1.0, rise = 0.2 }, { type = \"sine\", amplitude = 1e-3, frequency = 5.0 }] }\n\
     y = 0.0\n\
     [integrator]\nrtol = 1e-6\n\
     [[probe]]\nname = \"end\"\ntype = \"point\"\nat = [0.1, 0.01]\ninterval = 1e-3\nquantities = [\"v\", \"a\"]\n\
     [[probe]]\nname = \"base\"\ntype = \"point\"\nat = [0.0, 0.01]\ninterval = 1e-3\nquantities = [\"v\", \"a\"]\n";

/// Checks that the acceleration is the derivative of the velocity, including at supports.
#[test]
fn accelerations_are_rates_of_velocities() {
    let out = tempfile::tempdir().unwrap();
    run(SHAKEN, &[], &out.path().join("run"));
    for probe in ["end", "base"] {
        // t, v_x, v_y, a_x, a_y
        let rows = rows(&out.path().join("run"), probe);
        let largest = rows.iter().fold(0.0, |m: f64, row| m.max(row[3].abs()));
        assert!(largest > 0.1, "{probe}: {largest}");
        for three in rows.windows(3).skip(10) {
            let slope = (three[2][1] - three[0][1]) / (three[2][0] - three[0][0]);
            // For a motion below 20 Hz, central differences with an interval of 2 ms have the error (ω h)²/6 = 3e-3.
            let error = (three[1][3] - slope).abs();
            assert!(error < 1e-2 * largest, "{probe} at {}: {error:e}", three[1][0]);
        }
    }
}
