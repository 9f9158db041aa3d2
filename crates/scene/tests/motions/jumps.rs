//! Loads that jump or sweep: impacts, releases, chirps.

use std::path::Path;

use crate::common::{apart, build, rows, run};

/// A block fixed on its left.
const BLOCK: &str = r#"
[time]
end = 0.1
[mesh]
type = "rectangle"
width = 0.1
height = 0.04
cells = [6, 3]
[solid]
bulk_modulus = 1e5
rayleigh_mass = 2.0
rayleigh_stiffness = 1e-4
[[material]]
law = "mooney-rivlin"
density = 1e3
c10 = 1e4
c01 = 1e3
[[fixed]]
group = "left"
[integrator]
rtol = 1e-6
[[probe]]
name = "end"
type = "point"
at = [0.1, 0.04]
quantities = ["u", "v"]
interval = 0.005
[[probe]]
name = "energy"
type = "energy"
interval = 0.005
"#;

const METHODS: [&str; 4] = ["radau13", "radau9", "radau5", "bdf"];
const RTOL: f64 = 1e-6;

fn finish(text: &str, set: &[&str], out: &Path) {
    let result = run(text, set, out);
    assert_eq!(result.document["outcome"], "finished", "{set:?}");
}

/// Checks that a sudden weight acts like the sudden removal of a support: in both cases the body falls from rest. A
/// weight that ends suddenly releases the body from equilibrium. In all cases the energy is balanced, and the tables
/// also contain impacts within the run.
#[test]
fn bodies_are_hit_and_released() {
    let folder = tempfile::tempdir().unwrap();
    let sum = |parts: &str| format!("body_force=[{{ y = {{ type = \"sum\", of = [{parts}] }} }}]");
    let jump = |value: f64, start: f64| {
        format!("{{ type = \"step\", value = {value}, start = {start}, rise = 0 }}")
    };
    let hit = sum(&[jump(-9.81, 0.0), jump(20.0, 0.0325)].join(", "));
    let released = sum(&["-9.81".to_owned(), jump(9.81, 0.0), jump(5.0, 0.05)].join(", "));
    for (name, load, start) in [
        ("hit", &hit, None),
        ("released", &released, Some("initial_state={ type = \"equilibrium\" }")),
    ] {
        let mut first: Option<Vec<Vec<f64>>> = None;
        for method in METHODS {
            let out = folder.path().join(format!("{name}-{method}"));
            let method = format!("integrator.method={method}");
            let set: Vec<&str> = [load, &method[..]].into_iter().chain(start).collect();
            finish(BLOCK, &set, &out);
            let (motion, energy) = (rows(&out, "end"), rows(&out, "energy"));
            assert_eq!(motion.len(), 21);
            let most = energy.iter().fold(0.0, |m: f64, row| m.max(row[1]));
            let imbalance = energy.iter().fold(0.0, |m: f64, row| m.max(row[5].abs()));
            // At the ends of steps, Radau IIA is more accurate than its error estimate: its error is at most the
            // tolerance of one step. BDF accumulates the errors of about a hundred steps: at most ten times the
            // tolerance.
            let allowed = if method.ends_with("bdf") { 10.0 } else { 1.0 };
            assert!(imbalance < allowed * RTOL * most, "{name} {method}: {imbalance:e}");
            if let Some(first) = &first {
                // The error is ten tolerances for each run with Radau IIA; BDF accumulates the errors of about a
                // hundred steps.
                let allowed = if method.ends_with("bdf") { 1000.0 } else { 20.0 };
                let off = apart(first, &motion, 0);
                assert!(off < allowed * RTOL, "{name} {method}: {off:e}");
            }
            first.get_or_insert(motion);
        }
    }
}

/// Regression: powers were integrated by Simpson's rule. Over the large steps of high orders, its
/// error was up to five hundred tolerances. The whole run is one interval of the probe, so that the
/// probe does not shorten steps.
#[test]
fn the_imbalance_is_the_energy_that_the_integrator_loses() {
    let folder = tempfile::tempdir().unwrap();
    let rise = "body_force=[{ y = { type = \"step\", value = -9.81, rise = 0.02 } }]";
    for method in ["radau9", "radau13"] {
        for rtol in [1e-4, 1e-6, 1e-8] {
            let out = folder.path().join(format!("{method} {rtol}"));
            let settings =
                [format!("integrator.method={method}"), format!("integrator.rtol={rtol}")];
            let set = ["time.end=0.3", "probe[1].interval=0.3", rise, &settings[0], &settings[1]];
            finish(BLOCK, &set, &out);
            let energy = rows(&out, "energy");
            let [work, imbalance] = [3, 5].map(|column| energy.last().unwrap()[column]);
            // The bound is the tolerance of one step, as above.
            assert!(imbalance.abs() < rtol * work, "{method} {rtol}: {imbalance:e} {work:e}");
        }
    }
}

/// Checks that oscillators coupled to a body in both directions restart together with the body.
#[test]
fn a_body_with_feedback_is_hit() {
    let folder = tempfile::tempdir().unwrap();
    let text = include_str!("../../../../data/scenes/two-way.toml");
    let [jump, steep] = ["0", "1e-6"].map(|rise| {
        let part = |value: f64, start: f64| {
            format!("{{ type = \"step\", value = {value}, start = {start}, rise = {rise} }}")
        };
        let load = format!(
            "traction[0].y={{ type = \"sum\", of = [{}, {}] }}",
            part(100.0, 0.01),
            part(-160.0, 0.05)
        );
        let out = folder.path().join(rise);
        let set = ["time.end=0.1", "integrator.method=radau9", "integrator.max_order=", "integrator.rtol=1e-5"];
        let more = [
            &load[..],
            "probe=[{ name = \"end\", type = \"point\", at = [0.05, 0.0], quantities = [\"u\", \"v\"], interval = 0.01 }]",
        ];
        finish(text, &[&set[..], &more[..]].concat(), &out);
        rows(&out, "end")
    });
    let off = apart(&jump, &steep, 0);
    // On average, the loads act 0.5 µs later. In this time, the phase of the fastest motion, about 1000 rad/s, advances
    // by 5e-4. The second term is ten tolerances.
    assert!(off < 5e-4 + 1e-4, "{off:e}");
}

/// Checks that internal stresses, which are unknowns with BDF and part of the memory of Radau IIA, are continuous at a
/// jump.
#[test]
fn a_body_whose_stress_relaxes_is_hit() {
    let folder = tempfile::tempdir().unwrap();
    let text = BLOCK.replace(
        "c01 = 1e3",
        "c01 = 1e3\nprony = [{ relative_modulus = 0.5, relaxation_time = 0.01 }]",
    );
    let load = |rise: &str| {
        let step = |value: f64, start: f64| {
            format!("{{ type = \"step\", value = {value}, start = {start}, rise = {rise} }}")
        };
        let of = [step(-9.81, 0.0), step(20.0, 0.0325)].join(", ");
        format!("body_force=[{{ y = {{ type = \"sum\", of = [{of}] }} }}]")
    };
    let steep = folder.path().join("steep");
    finish(&text, &[&load("1e-7"), "integrator.method=radau9"], &steep);
    for method in METHODS {
        let out = folder.path().join(method);
        let set = format!("integrator.method={method}");
        finish(&text, &[&load("0"), &set], &out);
        let off = apart(&rows(&steep, "end"), &rows(&out, "end"), 0);
        // The loads act 0.05 µs later on average; with about 1000 rad/s this changes the motion by 5e-5. The tolerance
        // above is added.
        let allowed = if method == "bdf" { 1000.0 } else { 20.0 };
        assert!(off < 5e-5 + allowed * RTOL, "{method}: {off:e}");
    }
}

#[test]
fn jumps_of_smooth_quantities_are_rejected_with_their_location() {
    for (key, value, reported) in [
        (
            "prescribed_displacement",
            "[{ group = \"right\", y = { type = \"step\", value = 0.01, rise = 0 } }]",
            "it jumps; give the step a rise",
        ),
        (
            "prescribed_displacement",
            "[{ group = \"right\", y = { type = \"ramp\", value = 0.01, end = 0.1 } }]",
            "its slope jumps",
        ),
        (
            "traction",
            "[{ group = \"right\", y = { type = \"ramp\", value = 1.0, start = 0.1, end = 0.1 } }]",
            "rise = 0",
        ),
        (
            "traction",
            "[{ group = \"right\", y = { type = \"step\", value = 1.0, rise = -0.1 } }]",
            "rise",
        ),
    ] {
        let refused = build(BLOCK, &[&format!("{key}={value}")], Path::new(""));
        let message = refused.map(|_| ()).unwrap_err();
        assert!(message.contains(reported), "{message}");
    }
}

/// Checks that a sweep from a frequency to itself is a sine, and that the energy of a sweep from 5 to 15 Hz, which ends
/// within the run, is balanced. Errors about invalid sweeps and groups without enclosed volume name the key.
#[test]
fn bodies_are_swept() {
    let folder = tempfile::tempdir().unwrap();
    let sweep = |to: f64, duration: f64| {
        format!(
            "traction=[{{ group = \"right\", y = {{ type = \"chirp\", amplitude = 50.0, frequency = 5.0, \
             end_frequency = {to}, duration = {duration} }} }}]"
        )
    };
    let sine = "traction=[{ group = \"right\", y = { type = \"sine\", amplitude = 50.0, frequency = 5.0 } }]";
    let out = |name: &str| folder.path().join(name);
    finish(BLOCK, &[&sweep(5.0, 1.0)], &out("same"));
    finish(BLOCK, &[sine], &out("sine"));
    // Both runs have the same steps, so the tolerance only covers rounding errors of the load.
    let [same, sine] = ["same", "sine"].map(|name| rows(&out(name), "end"));
    assert!(apart(&same, &sine, 1) < 1e-9);

    finish(BLOCK, &[&sweep(15.0, 0.06)], &out("swept"));
    let energy = rows(&out("swept"), "energy");
    let largest = |column: usize| energy.iter().fold(0.0_f64, |m, row| m.max(row[column].abs()));
    let [work, imbalance] = [3, 5].map(largest);
    assert!(work > 0.0 && imbalance < RTOL * work, "{imbalance:e} {work:e}");

    let volume = "probe=[{ name = \"v\", type = \"volume\", group = \"body\" }]".to_owned();
    for (set, reported) in [(sweep(15.0, 0.0), "duration"), (volume, "group")] {
        let error = build(BLOCK, &[&set], folder.path()).unwrap_err();
        assert!(error.contains(reported), "{error}");
    }
}
