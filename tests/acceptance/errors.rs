//! Errors of runs, and the reported error estimates.
#![allow(clippy::unwrap_used)] // a test may panic

use std::fs;
use std::path::Path;

use serde_json::Value;

use crate::harness::myovib_in;

/// Writes the scene of `init` with probes at points without zero components by symmetry.
fn scene(folder: &Path) {
    let init = myovib_in(folder, &["init", "-"]);
    assert_eq!(init.code, 0, "{}", init.stderr);
    // The bound of the errors was derived for this formulation.
    let rate = "[solid]\nformulation = \"rate\"";
    let init = init.stdout.replacen("[solid]", rate, 1);
    let probe = "\n[[probe]]\nname = \"off\"\ntype = \"point\"\nat = [0.03, 0.004]\n\
                 quantities = [\"u\", \"p\", \"stress\"]\ninterval = 0.01\n";
    fs::write(folder.join("scene.toml"), init + probe).unwrap();
}

/// Runs the scene over its first second; returns printed text and document.
fn run(folder: &Path, out: &str, sets: &[&str], more: &[&str]) -> (String, Value) {
    let mut arguments = vec!["run", "scene.toml", "--out", out, "--quiet"];
    for set in [&["time.end=1", "fields.interval=1"], sets].concat() {
        arguments.extend(["--set", set]);
    }
    arguments.extend(more);
    let run = myovib_in(folder, &arguments);
    assert_eq!(run.code, 0, "{}", run.stderr);
    let text = fs::read_to_string(folder.join(out).join("run.json")).unwrap();
    (run.stdout, serde_json::from_str(&text).unwrap())
}

const TIGHT: [&str; 2] = ["integrator.method=radau13", "integrator.rtol=1e-9"];

/// Returns names and columns of a probe's table.
fn columns(folder: &Path, out: &str, probe: &str) -> Vec<(String, Vec<f64>)> {
    let text = fs::read_to_string(folder.join(out).join(format!("{probe}.csv"))).unwrap();
    let mut lines = text.lines();
    let names = lines.next().unwrap().split(',');
    let rows: Vec<Vec<f64>> = lines
        .map(|line| line.split(',').map(|word| word.parse().unwrap()).collect())
        .collect();
    let column = |(j, name): (usize, &str)| (name.to_owned(), rows.iter().map(|r| r[j]).collect());
    names.enumerate().map(column).collect()
}

/// Returns name, maximum magnitude, and maximum difference to a run with tight tolerances, for each
/// column.
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

/// Issue 15, E1: a scene without integrator settings has three correct digits in both directions
/// and in stresses, and the estimate of `--verify` bounds its error.
#[test]
fn a_scene_without_settings_has_three_digits_and_says_how_far_it_is_off() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    scene(folder);
    let (_, document) = run(folder, "default", &[], &["--verify"]);
    run(folder, "tight", &TIGHT, &[]);
    for (probe, wanted) in [
        ("origin", &["u_y", "p"][..]),
        (
            "off",
            &["u_x", "u_y", "stress_xx", "stress_yy", "stress_xy"],
        ),
    ] {
        let errors = errors(folder, probe, ["default", "tight"]);
        for (name, largest, error) in errors.iter().filter(|e| wanted.contains(&&*e.0)) {
            assert!(*error < 5e-4 * largest, "{name}: {error:e} of {largest:e}");
            let estimate = &document["error_estimate"]["probes"][probe][name]["error"];
            let estimate = estimate.as_f64().unwrap();
            assert!(
                *error < estimate,
                "{name}: {error:e}, estimated {estimate:e}"
            );
        }
        let compared = errors.iter().filter(|e| wanted.contains(&&*e.0)).count();
        assert_eq!(compared, wanted.len());
    }
}

/// Issue 15, E1: every run reports the error of its probes to an order of magnitude: for damped
/// motion and for undamped, incompressible motion, by Radau IIA and by BDF.
#[test]
fn every_run_says_of_its_probes_about_how_far_off_they_are() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    scene(folder);
    let undamped = [
        "solid.bulk_modulus=inf",
        "solid.rayleigh_mass=0",
        "solid.rayleigh_stiffness=0",
        "solid.formulation=position",
    ];
    let cases: [(&[&str], &[&[&str]]); 2] = [
        (
            &[],
            &[
                &[],
                &["integrator.method=radau5"],
                &["integrator.method=bdf"],
                &["integrator.rtol=1e-6"],
            ],
        ),
        (&undamped, &[&[], &["integrator.method=radau5"]]),
    ];
    for (sets, methods) in cases {
        run(
            folder,
            "tight",
            &[sets, &TIGHT[..]].concat(),
            &["--overwrite"],
        );
        for method in methods {
            let (reported, document) =
                run(folder, "run", &[sets, method].concat(), &["--overwrite"]);
            assert!(
                reported.contains("Errors in time, by the estimates of the steps"),
                "{reported}"
            );
            let indicated = &document["error_indicator"]["off"];
            let report = fs::read_to_string(folder.join("run/report.html")).unwrap();
            let of_u_y = indicated["u_y"]["error"].as_f64().unwrap();
            assert!(report.contains(&format!("<td class=\"n\">{of_u_y:.1e}</td>")));
            let errors = errors(folder, "off", ["run", "tight"]);
            // Takes the worst component of each kind, as the printed line does.
            for kind in ["u_", "p", "stress_"] {
                let of_kind = || errors.iter().filter(|e| e.0.starts_with(kind));
                let off = of_kind().fold(0.0, |m: f64, e| m.max(e.2));
                let indicator = of_kind().fold(0.0, |m: f64, (name, _, _)| {
                    m.max(indicated[name]["error"].as_f64().unwrap())
                });
                let ratio = indicator / off;
                assert!(
                    (0.1..10.0).contains(&ratio),
                    "{sets:?} {method:?}, {kind}: {indicator:e} for {off:e}"
                );
            }
        }
    }
}

/// The estimate costs no residual evaluation; a probe that would need one has no estimate.
#[test]
fn what_a_run_says_of_its_errors_costs_no_residual() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    scene(folder);
    let (_, with) = run(folder, "with", &["time.end=0.2"], &[]);
    let (reported, without) = run(folder, "without", &["time.end=0.2", "probe=[]"], &[]);
    for counter in ["residual_evaluations", "steps"] {
        assert_eq!(with[counter], without[counter], "{counter}");
    }
    for counter in ["residual_passes", "tangent_passes", "linear"] {
        assert_eq!(with["work"][counter], without["work"][counter], "{counter}");
    }
    assert_eq!(without["error_indicator"], serde_json::json!({}));
    assert!(!reported.contains("Errors in time"), "{reported}");
    let text = fs::read_to_string(folder.join("scene.toml")).unwrap();
    let (before, _) = text.rsplit_once("type = \"point\"").unwrap();
    let reaction = format!("{before}type = \"reaction\"\ngroup = \"fixed\"\ninterval = 0.01\n");
    fs::write(folder.join("scene.toml"), reaction).unwrap();
    let (_, document) = run(folder, "reaction", &["time.end=0.05"], &[]);
    let probes = document["error_indicator"].as_object().unwrap();
    assert_eq!(probes.keys().collect::<Vec<_>>(), ["origin"]);
}
