//! `myovib fit` on the measurements that are shipped with their true values.

use std::fs;
use std::path::Path;

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
