//! Tests of errors that runs report, and of error estimates.
#![allow(clippy::unwrap_used)] // a test may panic

use std::fs;
use std::path::Path;

use serde_json::Value;

use crate::harness::myovib_in;
use crate::results::{read_json, read_table};

/// Writes the scene of `init` with probes at points at which no component is zero by symmetry.
fn scene(folder: &Path) {
    let init = myovib_in(folder, &["init", "-"]).with_code(0);
    // The bound on the errors was derived for this formulation.
    let rate = "[solid]\nformulation = \"rate\"";
    let init = init.stdout.replacen("[solid]", rate, 1);
    let probe = "\n[[probe]]\nname = \"off\"\ntype = \"point\"\nat = [0.03, 0.004]\n\
                 quantities = [\"u\", \"p\", \"stress\"]\ninterval = 0.01\n";
    fs::write(folder.join("scene.toml"), init + probe).unwrap();
}

/// Runs the first second of the scene. Returns the printed text and the document.
fn run(folder: &Path, out: &str, sets: &[&str], more: &[&str]) -> (String, Value) {
    let mut arguments = vec!["run", "scene.toml", "--out", out, "--quiet"];
    for set in [&["time.end=1", "fields.interval=1"], sets].concat() {
        arguments.extend(["--set", set]);
    }
    arguments.extend(more);
    let run = myovib_in(folder, &arguments).with_code(0);
    (run.stdout, read_json(&folder.join(out).join("run.json")))
}

/// Undamped, incompressible beam whose tip is set in motion abruptly.
const VIBRATION: &str = r#"
[time]
end = 0.4
[mesh]
type = "rectangle"
width = 0.08
height = 0.02
cells = [6, 2]
[solid]
bulk_modulus = "inf"
formulation = "stabilized"
[[material]]
law = "mooney-rivlin"
c10 = 1.4e4
c01 = 1.4e3
density = 1.1e3
[[fixed]]
group = "left"
[[traction]]
group = "right"
y = { type = "sine", amplitude = 60.0, frequency = 5.0 }
[[probe]]
name = "end"
type = "point"
at = [0.07, 0.012]
interval = 0.0037
quantities = ["u", "v", "p"]
"#;

const TIGHT: [&str; 2] = ["integrator.method=radau13", "integrator.rtol=1e-9"];

/// Returns the columns of the table of a probe, with their names.
fn columns(folder: &Path, out: &str, probe: &str) -> Vec<(String, Vec<f64>)> {
    let (names, rows) = read_table(&folder.join(out).join(format!("{probe}.csv")));
    let column = |(j, name)| (name, rows.iter().map(|row| row[j]).collect());
    names.into_iter().enumerate().map(column).collect()
}

/// Returns, for each column, the name, the maximum magnitude, and the maximum difference from a run with tight
/// tolerances.
fn errors(folder: &Path, probe: &str, [out, tight]: [&str; 2]) -> Vec<(String, f64, f64)> {
    let found = columns(folder, out, probe).into_iter().skip(1);
    let exact = columns(folder, tight, probe).into_iter().skip(1);
    let compare = |((name, a), (_, b)): ((String, Vec<f64>), (String, Vec<f64>))| {
        let largest = b.iter().fold(0.0, |m: f64, b| m.max(b.abs()));
        let pairs = a.iter().zip(&b);
        let error = pairs.fold(0.0, |m: f64, (a, b)| m.max((a - b).abs()));
        (name, largest, error)
    };
    found.zip(exact).map(compare).collect()
}

/// Issue 15, E1: checks that a scene without integrator settings has three correct digits in both directions and in
/// stresses, and that the estimate of `--verify` bounds the error.
#[test]
fn the_defaults_give_three_digits_and_an_error_estimate() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    scene(folder);
    let (_, document) = run(folder, "default", &[], &["--verify"]);
    run(folder, "tight", &TIGHT, &[]);
    for (probe, wanted) in [
        ("origin", &["u_y", "p"][..]),
        ("off", &["u_x", "u_y", "stress_xx", "stress_yy", "stress_xy"]),
    ] {
        let errors = errors(folder, probe, ["default", "tight"]);
        for (name, largest, error) in errors.iter().filter(|e| wanted.contains(&&*e.0)) {
            assert!(*error < 5e-4 * largest, "{name}: {error:e} of {largest:e}");
            let estimate = &document["error_estimate"]["probes"][probe][name]["error"];
            let estimate = estimate.as_f64().unwrap();
            assert!(*error < estimate, "{name}: {error:e}, estimated {estimate:e}");
        }
        let compared = errors.iter().filter(|e| wanted.contains(&&*e.0)).count();
        assert_eq!(compared, wanted.len());
    }
}

/// Regression: the difference from a run with ten times the tolerance was smaller than the error, because a method of
/// high order took similar steps in both runs.
#[test]
fn verify_bounds_the_error_of_high_orders() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    fs::write(folder.join("scene.toml"), VIBRATION).unwrap();
    let end = "time.end=0.4";
    run(folder, "tight", &[&TIGHT[..], &[end]].concat(), &[]);
    for method in ["integrator.method=radau9", "integrator.method=radau13"] {
        let sets = [end, method, "integrator.rtol=1e-5"];
        let (_, document) = run(folder, "run", &sets, &["--verify", "--overwrite"]);
        assert_eq!(document["error_indicator"], serde_json::json!({}));
        for (name, _, error) in errors(folder, "end", ["run", "tight"]) {
            let estimate = &document["error_estimate"]["probes"]["end"][&name]["error"];
            let estimate = estimate.as_f64().unwrap();
            assert!(error < estimate, "{method}, {name}: {error:e} {estimate:e}");
        }
    }
}

/// Checks that every run by BDF reports the errors of its probes within a factor of 5, both for damped motion and for
/// undamped, incompressible motion. Radau IIA has no such estimate and reports none.
#[test]
fn runs_by_bdf_report_their_errors() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    scene(folder);
    let undamped = [
        "solid.bulk_modulus=inf",
        "solid.rayleigh_mass=0",
        "solid.rayleigh_stiffness=0",
        "solid.formulation=position",
    ];
    for sets in [&[][..], &undamped] {
        run(folder, "tight", &[sets, &TIGHT[..]].concat(), &["--overwrite"]);
        for rtol in ["integrator.rtol=1e-3", "integrator.rtol=1e-4"] {
            let method = ["integrator.method=bdf", rtol];
            let (reported, document) =
                run(folder, "run", &[sets, &method].concat(), &["--overwrite"]);
            assert!(reported.contains("estimated from the steps"), "{reported}");
            let indicated = &document["error_indicator"]["off"];
            let report = fs::read_to_string(folder.join("run/report.html")).unwrap();
            let of_u_y = indicated["u_y"]["error"].as_f64().unwrap();
            assert!(report.contains(&format!("<td class=\"n\">{of_u_y:.1e}</td>")));
            let errors = errors(folder, "off", ["run", "tight"]);
            // For each kind, the component with the largest error is used, as in the printed line.
            for kind in ["u_", "p", "stress_"] {
                let of_kind = || errors.iter().filter(|e| e.0.starts_with(kind));
                let off = of_kind().fold(0.0, |m: f64, e| m.max(e.2));
                let indicator = of_kind().fold(0.0, |m: f64, (name, _, _)| {
                    m.max(indicated[name]["error"].as_f64().unwrap())
                });
                let ratio = indicator / off;
                assert!(
                    (0.2..5.0).contains(&ratio),
                    "{sets:?} {rtol}, {kind}: {indicator:e} for {off:e}"
                );
            }
        }
    }
    let (reported, document) = run(folder, "radau", &[], &[]);
    assert_eq!(document["error_indicator"], serde_json::json!({}));
    assert!(!reported.contains("estimated from the steps"), "{reported}");
}

/// Checks that the estimate requires no residual evaluation. A probe that would require one has no estimate.
#[test]
fn error_indicators_cost_no_residual() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    scene(folder);
    let short = ["time.end=0.2", "integrator.method=bdf"];
    let (_, with) = run(folder, "with", &short, &[]);
    let (reported, without) = run(folder, "without", &[&short[..], &["probe=[]"]].concat(), &[]);
    for counter in ["residual_evaluations", "steps"] {
        assert_eq!(with[counter], without[counter], "{counter}");
    }
    for counter in ["residual_passes", "tangent_passes", "linear"] {
        assert_eq!(with["work"][counter], without["work"][counter], "{counter}");
    }
    assert_eq!(without["error_indicator"], serde_json::json!({}));
    assert!(!reported.contains("estimated from the steps"), "{reported}");
    let text = fs::read_to_string(folder.join("scene.toml")).unwrap();
    let (before, _) = text.rsplit_once("type = \"point\"").unwrap();
    let reaction = format!("{before}type = \"reaction\"\ngroup = \"fixed\"\ninterval = 0.01\n");
    fs::write(folder.join("scene.toml"), reaction).unwrap();
    let (_, document) = run(folder, "reaction", &short, &[]);
    let probes = document["error_indicator"].as_object().unwrap();
    assert_eq!(probes.keys().collect::<Vec<_>>(), ["origin"]);
}

/// Strip of which one half is moved as a whole and has its own material.
const BONE: &str = r#"
[time]
end = 0.01
[mesh]
type = "rectangle"
width = 0.1
height = 0.02
cells = [8, 2]
[[group]]
name = "bone"
members = "elements"
type = "box"
min = [0.045, -1.0]
max = [0.2, 1.0]
[solid]
bulk_modulus = inf
[[material]]
law = "neo-hooke"
density = 1.1e3
shear_modulus = 1e4
[[material]]
group = "bone"
law = "neo-hooke"
density = 1.1e3
shear_modulus = 1e6
[[fixed]]
group = "left"
[[prescribed_displacement]]
group = "bone" # moved
x = { type = "step", value = 1e-3, rise = 0.1 }
y = 0.0
"#;

/// Strip without inertia under a sudden load.
const SUDDEN: &str = r#"
analysis = "quasi-static"
[time]
end = 1.0
[mesh]
type = "rectangle"
width = 0.1
height = 0.02
cells = [4, 2]
[solid]
bulk_modulus = 1e5
[[material]]
law = "neo-hooke"
density = 1.1e3
shear_modulus = 1e4
[[fixed]]
group = "left"
[[traction]]
group = "top"
x = { type = "step", value = 20.0, rise = 0.1 }
y = { type = "step", value = 20.0, rise = 0 } # jumps
[integrator]
method = "radau5"
"#;

/// Regression: the errors referred to `[[fixed]]` and to `analysis`.
#[test]
fn errors_point_at_the_line_to_change() {
    let folder = tempfile::tempdir().unwrap();
    for (scene, mark) in [(BONE, "# moved"), (SUDDEN, "# jumps")] {
        fs::write(folder.path().join("scene.toml"), scene).unwrap();
        let run = myovib_in(folder.path(), &["run", "scene.toml"]).with_code(2);
        assert!(run.stderr.contains(mark), "{}", run.stderr);
        assert!(!folder.path().join("out").exists());
    }
}

/// Regression: a varied name that contained U+202E reversed the subsequent text on a terminal.
#[test]
fn names_on_standard_output_do_not_hide_text() {
    let folder = tempfile::tempdir().unwrap();
    let sweep = ["sweep", "init", "--quiet", "--set", "time.end=0.01"];
    let vary = ["--vary", "title=a\u{202e}b,c\u{2066}d"];
    for more in [&[][..], &["--json"]] {
        let run = myovib_in(folder.path(), &[&sweep[..], &vary, more].concat()).with_code(0);
        for hidden in ['\u{202e}', '\u{2066}'] {
            assert!(!run.stdout.contains(hidden), "{more:?}: {}", run.stdout);
        }
    }
}

/// Regression: the message for a scene in Latin-1 did not state the line.
#[test]
fn a_scene_in_latin_1_is_refused_with_its_line() {
    let folder = tempfile::tempdir().unwrap();
    let latin = [VIBRATION.as_bytes(), b"[solid.x]\n# Fa\xe7on\n"].concat();
    let line = VIBRATION.lines().count() + 2;
    fs::write(folder.path().join("scene.toml"), latin).unwrap();
    for command in ["run", "check"] {
        let run = myovib_in(folder.path(), &[command, "scene.toml"]).with_code(2);
        assert!(run.stderr.contains(&format!("line {line}")), "{}", run.stderr);
        assert!(!folder.path().join("out").exists());
    }
}
