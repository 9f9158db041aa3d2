//! Tests of `myovib figure` and `myovib figures`.

use std::fs;
use std::path::Path;

use crate::harness::{code_of_interrupted, document, myovib, myovib_in};
use crate::results::read_column;

fn read(folder: &Path, name: &str) -> String {
    fs::read_to_string(folder.join(name)).expect(name)
}

#[test]
fn figure_4_shows_the_papers_mesh_from_any_folder() {
    let folder = tempfile::tempdir().expect("a folder");
    myovib_in(folder.path(), &["figure", "4", "--out", "f", "--json=f4.json"]).with_code(0);
    let found = document(&read(folder.path(), "f4.json"), "figure");
    let figure = &found["figures"][0];
    // The paper states this number of unknowns.
    assert_eq!(figure["unknowns_paper"], 1545);
    let csv = folder.path().join("f/figure4.csv");
    // Euler's formula for a simply connected mesh gives edges = vertices + triangles - 1.
    assert_eq!(read_column(&csv, "x_1").len(), 185 + 311 - 1);
    // Only the two ends of the spindle are fixed. Each end is 2 × 0.012 m high.
    let (x, fixed) = (read_column(&csv, "x_1"), read_column(&csv, "fixed"));
    assert!(x.iter().zip(&fixed).all(|(x, f)| *f == 0.0 || (x.abs() - 0.1).abs() < 1e-12));
    let svg = read(folder.path(), "f/figure4.svg");
    assert!(svg.starts_with("<svg ") && svg.contains("fixed"));
}

#[test]
fn figures_5_and_6_show_one_run() {
    let folder = tempfile::tempdir().expect("a folder");
    let run = myovib_in(folder.path(), &["figures", "--t-end", "1", "--json=f.json", "--quiet"]);
    assert_eq!((run.code, run.stderr.as_str()), (0, ""));
    let csv = folder.path().join("figures/figure6.csv");
    let t = read_column(&csv, "t");
    // There are 50 samples per period of 1/8 s, including both ends of the run.
    assert_eq!((t.len(), t[0], t[t.len() - 1]), (401, 0.0, 1.0));

    let found = document(&read(folder.path(), "f.json"), "figures");
    let all = found["figures"].as_array().expect("a list").iter();
    let [snapshots, series] = [5, 6].map(|number| {
        let mut all = all.clone();
        all.find(|figure| figure["number"] == number).expect("Figures 5 and 6")
    });
    assert_eq!(snapshots["steps"], series["steps"], "one run");
    assert_eq!(series["outcome"], "finished");
    // The snapshots are in the last period, at the extrema of the displacement of the origin.
    let u_y = read_column(&csv, "u_y");
    let at = |name: &str| {
        let time = snapshots[name].as_f64().expect(name);
        let i = t.iter().position(|&t| t == time).expect("a sample");
        (time, u_y[i])
    };
    let last_period = || t.iter().zip(&u_y).filter(|(t, _)| **t > 1.0 - 0.125).map(|(_, u)| *u);
    assert_eq!(at("t_highest").1, last_period().fold(f64::MIN, f64::max));
    assert_eq!(at("t_lowest").1, last_period().fold(f64::MAX, f64::min));
}

#[test]
fn an_interrupted_run_is_code_130_and_drawn_as_far_as_it_got() {
    let folder = tempfile::tempdir().expect("a folder");
    let arguments = ["figures", "--quiet", "--json=f.json"];
    assert_eq!(code_of_interrupted(folder.path(), &arguments), Some(130));
    let found = document(&read(folder.path(), "f.json"), "figures");
    assert_eq!(found["figures"][4]["reason"], "interrupted");
    assert!(read_column(&folder.path().join("figures/figure6.csv"), "t").len() > 1);
}

/// Checks that a command that is interrupted before its first result does not report an input error.
#[test]
fn an_interruption_before_the_first_result_is_code_130() {
    let folder = tempfile::tempdir().expect("a folder");
    for arguments in [
        &["synchronization", "--t-end", "1e5"][..],
        &["movie", "chain", "--from", "9e4", "--to", "1e5"],
    ] {
        let code = code_of_interrupted(folder.path(), arguments);
        assert_eq!(code, Some(130), "{arguments:?}");
    }
}

#[test]
fn wrong_options_are_code_2_and_write_nothing() {
    let folder = tempfile::tempdir().expect("a folder");
    for arguments in [
        &["figure", "1"][..],
        &["figure", "six"],
        &["figure", "6", "--t-end", "-1"],
        &["figure", "6", "--t-end", "NaN"],
        &["figure", "4", "--mesh", "no-such.msh"],
    ] {
        let run = myovib_in(folder.path(), arguments);
        assert_eq!((run.code, run.stdout.as_str()), (2, ""), "{arguments:?}");
        assert!(run.stderr.starts_with("error: "), "{}", run.stderr);
    }
    assert_eq!(fs::read_dir(folder.path()).expect("the folder").count(), 0);
    assert_eq!(myovib(&["figure", "--help"]).code, 0);
}
