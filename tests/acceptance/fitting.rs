//! `myovib fit` on the measurements that are shipped with their true values.

use std::fs;
use std::path::Path;

use myovib_scene::vtu::field_of;

use crate::harness::{document, myovib_in};

/// What the measurements were computed with, as data/fitting/muscle.toml says.
const TRUTH: [(&str, f64); 3] = [
    ("material[0].c10", 1.3e4),
    ("solid.alpha", 3.0),
    ("1/solid.kappa", 2e-5),
];

#[test]
fn the_fit_of_the_guide_finds_the_truth_and_shows_it_on_a_page() {
    let folder = tempfile::tempdir().expect("a folder");
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../data/fitting");
    let file = |name: &str| data.join(name).to_str().expect("UTF-8").to_owned();
    let (scene, measured) = (file("muscle.toml"), file("measured.csv"));
    let words = ["fit", &scene, "--data", &measured, "--json", "--quiet"];
    let run = myovib_in(folder.path(), &words);
    assert_eq!((run.code, run.stderr.as_str()), (0, ""));
    // Nor does it replace the report of a run.
    fs::create_dir(folder.path().join("run")).expect("a folder");
    fs::write(folder.path().join("run/run.json"), "{}").expect("a file");
    let into = [&words[..], &["--out", "run"]].concat();
    let refused = myovib_in(folder.path(), &into);
    assert_eq!(refused.code, 2, "{}", refused.stderr);
    assert!(refused.stderr.contains("holds a run"), "{}", refused.stderr);

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
    // The curves with the residuals, and the costs of the iterations.
    assert_eq!(page.matches("<svg xmlns=").count(), 2);
    assert!(page.contains("<h1>A muscle to be identified</h1>"));
    assert!(page.contains("3 parameters from "));
}

/// The elements of a map add up to the derivative by the stiffness of all, which forward sensitivities give; the file for
/// ParaView has their densities, whose mean is that sum.
#[test]
fn a_map_says_where_an_output_sees_the_stiffness() {
    let folder = tempfile::tempdir().expect("a folder");
    let short = ["init", "--set", "time.end=0.5", "--quiet"];
    let words = [&["sensitivity"], &short[..], &["--map", "--out", "map"]].concat();
    let run = myovib_in(folder.path(), &words);
    assert_eq!((run.code, run.stderr.as_str()), (0, ""));
    assert!(
        run.stdout
            .contains("no displacements or velocities: origin.p")
    );
    let read = |name: &str| fs::read_to_string(folder.path().join("map").join(name));
    let document = document(
        &read("stiffness.json").expect("stiffness.json"),
        "stiffness map",
    );
    let outputs = document["outputs"].as_array().expect("a list");
    let text = read("stiffness.vtu").expect("stiffness.vtu");
    for (k, name) in ["origin.u_x", "origin.u_y"].into_iter().enumerate() {
        let output = &outputs[k];
        assert_eq!(output["name"], name);
        let elements = output["elements"].as_array().expect("a list").iter();
        let elements: Vec<f64> = elements.map(|e| e.as_f64().expect("a number")).collect();
        let total = output["total"].as_f64().expect("a number");
        let sum: f64 = elements.iter().sum();
        // Digits of the document.
        assert!(
            total.abs() > 1e-3 && (total - sum).abs() < 1e-12,
            "{name}: {total} {sum}"
        );
        let densities = field_of(&text, name).expect("a field of the cells");
        let area_over_whole = elements.iter().zip(&densities).map(|(e, d)| e / d);
        // Rounding of as many fractions as there are elements, 311.
        assert!((area_over_whole.sum::<f64>() - 1.0).abs() < 1e-12);
    }
    let drawn = read("stiffness.svg").expect("stiffness.svg");
    assert!(drawn.contains("origin.u_x") && drawn.contains("origin.u_y"));
}
