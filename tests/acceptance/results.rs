//! Functions that run scenes and read their results.

use std::fs;
use std::path::Path;

use serde_json::Value;

use crate::harness::myovib_in;

/// Runs a scene, which must succeed, with an option `--set` for each of `sets`. Returns the document of the run.
#[track_caller]
pub(crate) fn run_scene(folder: &Path, scene: &str, out: &str, sets: &[&str]) -> Value {
    let mut arguments = vec!["run", scene, "--out", out, "--quiet"];
    arguments.extend(sets.iter().flat_map(|set| ["--set", set]));
    myovib_in(folder, &arguments).with_code(0);
    read_json(&folder.join(out).join("run.json"))
}

/// Reads a JSON file.
pub(crate) fn read_json(path: &Path) -> Value {
    let text = fs::read_to_string(path).expect("a document");
    serde_json::from_str(&text).expect("valid JSON")
}

/// Reads a CSV file of numbers. Returns the names of its columns and its rows.
pub(crate) fn read_table(path: &Path) -> (Vec<String>, Vec<Vec<f64>>) {
    parse_table(&fs::read_to_string(path).expect("a table"))
}

/// Returns the names of the columns and the rows of a table in CSV format.
pub(crate) fn parse_table(text: &str) -> (Vec<String>, Vec<Vec<f64>>) {
    let mut lines = text.lines();
    let names = lines.next().expect("a header").split(',').map(String::from).collect();
    let numbers =
        |line: &str| line.split(',').map(|word| word.parse().expect("a number")).collect();
    (names, lines.map(numbers).collect())
}

/// Returns the column `name` of a CSV file.
pub(crate) fn read_column(path: &Path, name: &str) -> Vec<f64> {
    let (names, rows) = read_table(path);
    let index = names.iter().position(|other| other == name).expect(name);
    rows.iter().map(|row| row[index]).collect()
}
