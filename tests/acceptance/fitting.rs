//! Tests of `myovib fit` on the measurements in the repository, whose true parameters are known.

use std::fs;
use std::path::Path;

use myovib_scene::escape;
use myovib_scene::vtu::read_field;

use crate::harness::{document, myovib_in};

/// True parameters of the measurements, taken from data/fitting/muscle.toml.
const TRUTH: [(&str, f64); 3] =
    [("material[0].c10", 1.3e4), ("solid.rayleigh_mass", 3.0), ("1/solid.bulk_modulus", 2e-5)];

/// Writes the scene of the guide with additional lines, and the first 0.2 s of its measurements.
fn beginning(folder: &Path, more: &str) {
    let scene = include_str!("../../data/fitting/muscle.toml");
    let (body, rest) = scene.split_once("[[parameter]]").expect("parameters");
    let (_, outputs) = rest.split_once("# The columns").expect("outputs");
    let scene = format!("{body}{more}# The columns{outputs}").replace("end = 0.5", "end = 0.2");
    fs::write(folder.join("scene.toml"), scene).expect("a scene");
    let measured = include_str!("../../data/fitting/measured.csv");
    let rows: Vec<&str> = measured.lines().take(21).collect();
    fs::write(folder.join("measured.csv"), rows.join("\n")).expect("data");
}

/// Parameters that a short measurement cannot determine: a damping, and a load that starts later. The stated noise is a
/// thousandth of the true noise.
const DOUBTFUL: &str = "[[parameter]]\nkey = \"solid.rayleigh_mass\"\nlow = 0.0\n\
                        [[parameter]]\nkey = \"traction[1].y.value\"\n\
                        [[traction]]\ngroup = \"load\"\n\
                        y = { type = \"step\", value = 1.0, start = 9.0, rise = 0.1 }\n";

/// Checks that unusable measurements and options result in the exit code for invalid input, and that nothing is
/// written.
#[test]
fn unusable_measurements_are_wrong_input() {
    let folder = tempfile::tempdir().expect("a folder");
    beginning(folder.path(), "[[parameter]]\nkey = \"solid.rayleigh_mass\"\n");
    let data = folder.path().join("my data");
    fs::create_dir(&data).expect("a folder");
    let scaled = "observableId,time,measurement,observableParameters\ntip,0.1,1,1000;0\n";
    fs::write(data.join("scaled 1.csv"), scaled).expect("data");
    fs::write(data.join("bad 1.csv"), "t,nothing\n0.1,1\n").expect("data");
    let mut cases = vec![
        (vec!["my data/scaled 1.csv"], "my data/scaled 1.csv, line 2, column observableParameters"),
        (
            vec!["my data/bad 1.csv solid.rayleigh_stiffness=1e-4"],
            "my data/bad 1.csv, column nothing",
        ),
        (vec!["measured.csv", "--starts", "1000000000000"], "--starts"),
    ];
    if cfg!(unix) {
        cases.push((vec!["/dev/zero"], "/dev/zero"));
    }
    for (arguments, place) in cases {
        let words = [&["fit", "scene.toml", "--data"], &arguments[..]].concat();
        let run = myovib_in(folder.path(), &words);
        assert_eq!(run.code, 2, "{arguments:?}: {}", run.stderr);
        assert!(run.stderr.contains(place), "{place}: {}", run.stderr);
        assert!(!folder.path().join("fit").exists());
    }
}

/// Regression: a file with `=` in its name could not be used as data.
#[test]
fn measurements_have_any_name() {
    let folder = tempfile::tempdir().expect("a folder");
    beginning(folder.path(), DOUBTFUL);
    let measured = folder.path().join("measured.csv");
    for (i, (name, argument)) in [
        ("a=b c.csv", "--data=a=b c.csv"),
        ("-m.csv", "--data=-m.csv"),
        ("-m.csv", "--data=./-m.csv material[0].c10=1.2e4"),
    ]
    .into_iter()
    .enumerate()
    {
        fs::copy(&measured, folder.path().join(name)).expect("a copy");
        let out = format!("fit{i}");
        let words = ["fit", "scene.toml", argument, "--out", &out, "--max-iterations=1"];
        let run = myovib_in(folder.path(), &words);
        // The fit does not converge within one iteration.
        assert_eq!(run.code, 3, "{name}: {}", run.stderr);
    }
}

#[test]
fn a_fit_reports_doubtful_results() {
    let folder = tempfile::tempdir().expect("a folder");
    beginning(folder.path(), DOUBTFUL);
    let words = [
        "fit",
        "scene.toml",
        "--data",
        "measured.csv",
        "--profile",
        "--set",
        "material[0].c10=1.3e4",
        "--set",
        "solid.bulk_modulus=5e4",
        "--set",
        "output[0].noise=2e-8",
        "--set",
        "output[1].noise=1e-3",
    ];
    let run = myovib_in(folder.path(), &words);
    // The stated noise is a thousandth of the true noise, so the model does not fit the data.
    assert_eq!(run.code, 3, "{}", run.stderr);
    let profile = "profile 1 of 2, about ten fits each: solid.rayleigh_mass";
    assert!(run.stderr.contains(profile), "{}", run.stderr);
    let read = |name: &str| fs::read_to_string(folder.path().join("fit").join(name));
    let page = read("report.html").expect("the page");
    let found = document(&read("fit.json").expect("fit.json"), "fit");
    assert_eq!(found["outcome"], "does_not_fit");
    let [damping, load] = [0, 1].map(|j| &found["parameters"][j]);
    assert_eq!((&damping["acts"], &damping["passes_bound"]), (&true.into(), &true.into()));
    assert!(damping["profile_interval"].is_array(), "{damping}");
    assert_eq!(load["acts"], false);
    assert!(load["profile_interval"].is_null(), "{load}");
    // Both the text and the page list each finding.
    let findings: Vec<&str> =
        run.stdout.lines().skip_while(|line| !line.starts_with("residuals:")).collect();
    assert!(findings.len() >= 5, "{findings:?}");
    for line in findings {
        assert!(page.contains(&escape(line)), "{line}");
    }
    let row = |name: &str| run.stdout.lines().find(|line| line.starts_with(name));
    let damping = row("solid.rayleigh_mass").expect("a row");
    assert!(damping.contains(" *  "), "{damping}");
    let load = row("traction[1].y.value").expect("a row");
    let cells: Vec<&str> = load.split_whitespace().skip(1).collect();
    let unknown = "1.000000e0 – – … – not computed";
    assert_eq!(cells.join(" "), unknown);
    let (page, _) = page.split_once("<script").expect("a script after the text");
    for text in [run.stdout, page.to_owned(), found.to_string()] {
        assert!(!text.contains("NaN"), "{text}");
    }
}

#[test]
fn the_fit_of_the_guide_finds_the_truth_and_shows_it_on_a_page() {
    let folder = tempfile::tempdir().expect("a folder");
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../data/fitting");
    let file = |name: &str| data.join(name).to_str().expect("UTF-8").to_owned();
    let (scene, measured) = (file("muscle.toml"), file("measured.csv"));
    let words = ["fit", &scene, "--data", &measured, "--json", "--quiet"];
    let run = myovib_in(folder.path(), &words);
    assert_eq!((run.code, run.stderr.as_str()), (0, ""));
    // A fit does not replace the report of a run.
    fs::create_dir(folder.path().join("run")).expect("a folder");
    fs::write(folder.path().join("run/report.html"), "").expect("a file");
    let into = [&words[..], &["--out", "run"]].concat();
    let refused = myovib_in(folder.path(), &into).with_code(2);
    assert!(refused.stderr.contains("report.html"), "{}", refused.stderr);

    let found = document(&run.stdout, "fit");
    let read = |name: &str| fs::read_to_string(folder.path().join("fit").join(name));
    let kept = document(&read("fit.json").expect("fit.json"), "fit");
    assert_eq!(kept["parameters"], found["parameters"]);
    let page = read("report.html").expect("the page");
    for (j, (name, value)) in TRUTH.into_iter().enumerate() {
        let parameter = &found["parameters"][j];
        assert_eq!(parameter["name"], name);
        let ends = [0, 1].map(|k| parameter["interval"][k].as_f64().expect("a number"));
        assert!(ends[0] < value && value < ends[1], "{name}: {ends:?}");
        let shown = format!("{:.6e}", parameter["value"].as_f64().expect("a number"));
        assert!(page.contains(&format!("<td>{name}</td><td class=\"n\">{shown}</td>")));
    }
    assert!(!page.contains("does not fit") && !page.contains("exceeds a bound"));
    let path = folder.path().join("fit/report.html");
    if let Some(seen) = crate::browser::seen_in(&path) {
        // The charts show the intervals, both outputs, the residuals, and the iterations.
        assert_eq!(seen["charts"], 5, "{seen}");
    }
    // The pictures show the intervals, the curves with the residuals, and the costs of the iterations.
    assert_eq!(page.matches("<svg xmlns=").count(), 3);
    assert!(page.contains("<h1>A muscle to be identified</h1>"));
    assert!(page.contains("3 parameters"));
}

/// Checks that the sum of a map over the elements is equal to the derivative with respect to a common stiffness, which
/// is computed with forward sensitivities. The file for ParaView contains the densities.
#[test]
fn a_map_shows_the_influence_of_the_stiffness() {
    let folder = tempfile::tempdir().expect("a folder");
    let short = ["init", "--set", "time.end=0.5", "--quiet"];
    let words = [&["sensitivity"], &short[..], &["--map", "--out", "map"]].concat();
    let run = myovib_in(folder.path(), &words);
    assert_eq!((run.code, run.stderr.as_str()), (0, ""));
    assert!(run.stdout.contains("origin.p"));
    let read = |name: &str| fs::read_to_string(folder.path().join("map").join(name));
    let document = document(&read("stiffness.json").expect("stiffness.json"), "stiffness-map");
    let words = [&["sensitivity"], &short[..], &["--set", STIFFNESS, "--json"]].concat();
    let forward = myovib_in(folder.path(), &words);
    let rows = crate::harness::document(&forward.stdout, "sensitivity")["rows"].take();
    let rows: Vec<Vec<f64>> = serde_json::from_value(rows).expect("numbers");
    let outputs = document["outputs"].as_array().expect("a list");
    let text = read("stiffness.vtu").expect("stiffness.vtu");
    for (k, name) in ["origin.u_x", "origin.u_y"].into_iter().enumerate() {
        let output = &outputs[k];
        assert_eq!(output["name"], name);
        let elements = output["elements"].as_array().expect("a list").iter();
        let elements: Vec<f64> = elements.map(|e| e.as_f64().expect("a number")).collect();
        // The columns are the time, two displacements and a pressure, followed by their derivatives.
        let sum = |of: fn(f64, f64) -> f64| -> f64 {
            rows.iter().map(|row| of(row[1 + k], row[4 + k])).sum()
        };
        let expected = sum(|u, by_stiffness| u * by_stiffness) / sum(|u, _| u * u);
        let total: f64 = elements.iter().sum();
        // The tolerance of forward sensitivities is a third of the given tolerance, 1e-4.
        assert!((total - expected).abs() < 1e-3 * expected.abs(), "{name}: {total} {expected}");
        let densities = read_field(&text, name).expect("a field of the cells");
        let shares: Vec<f64> = elements.iter().zip(&densities).map(|(e, d)| e / d).collect();
        // The bounds are the shares of the smallest and the largest element in the area of the mesh.
        assert!(shares.iter().all(|share| (3e-4..2e-2).contains(share)), "{shares:?}");
    }
    let drawn = read("stiffness.svg").expect("stiffness.svg");
    assert!(drawn.contains("origin.u_x") && drawn.contains("origin.u_y"));
}

/// The stress scale of all elements, used as a parameter.
const STIFFNESS: &str = "parameter=[{ key = \"material[0].stress_scale\" }]";
