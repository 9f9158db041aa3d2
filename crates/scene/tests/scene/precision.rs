//! Factors in single precision compared with double precision.

use std::path::Path;

use myovib_scene::csv::Table;
use myovib_scene::run::{RunOptions, compute};
use myovib_scene::{InputError, Scene};
use serde_json::Value;

/// A 3D block under a shear load that rises within the run.
const BLOCK: &str = r#"
[time]
end = 0.1
[mesh]
type = "box"
size = [0.1, 0.02, 0.02]
cells = [5, 1, 1]
[solid]
bulk_modulus = 1e5
rayleigh_mass = 1.0
[[material]]
law = "mooney-rivlin"
density = 1.1e3
c10 = 1e4
c01 = 2e2
[[fixed]]
group = "left"
[[traction]]
group = "right"
y = { type = "step", value = 20.0, rise = 0.05 }
[[probe]]
name = "end"
type = "point"
at = [0.1, 0.0, 0.0]
quantities = ["u"]
interval = 0.01
"#;

/// A beam that is a thousand times as long as high. With long steps, the condition number of its matrices exceeds the
/// digits of single precision.
const SLENDER: &str = r#"
[time]
end = 10.0
[mesh]
type = "beam"
length = 1.0
height = 1e-3
cells = [200, 1]
[solid]
bulk_modulus = 1e5
rayleigh_mass = 1.0
[[material]]
law = "mooney-rivlin"
density = 1.0
c10 = 1e4
c01 = 2e2
[[fixed]]
group = "fixed"
[[traction]]
group = "load"
y = { type = "step", value = -1e-7, rise = 5.0 }
[[probe]]
name = "end"
type = "point"
at = [1.0, 0.0]
quantities = ["u"]
"#;

/// Relative tolerance of the runs.
const RTOL: f64 = 1e-4;

fn build(text: &str, set: &[&str]) -> Result<Scene, InputError> {
    let set: Vec<String> = set.iter().map(|set| (*set).to_owned()).collect();
    Scene::build("scene.toml", text, &set, Path::new(""))
}

/// Runs a scene. Returns its JSON document and the rows of its probe.
fn run(text: &str, set: &[&str], precision: &str) -> (Value, Vec<Vec<f64>>) {
    let folder = tempfile::tempdir().unwrap();
    let (precision, rtol) =
        (format!("integrator.precision={precision}"), format!("integrator.rtol={RTOL:e}"));
    let scene = build(text, &[set, &[&precision, &rtol]].concat()).unwrap();
    let document = compute(&scene, &RunOptions::into_folder(folder.path())).unwrap().document;
    assert_eq!(document["outcome"], "finished", "{set:?}");
    let table = std::fs::read_to_string(folder.path().join("end.csv")).unwrap();
    let table = Table::parse(&table).unwrap();
    (document, table.rows.iter().filter_map(|row| table.numbers(row)).collect())
}

fn factorizations(document: &Value) -> [u64; 2] {
    let linear = &document["work"]["linear"];
    ["factorizations", "in_single_precision"].map(|key| linear[key].as_u64().unwrap())
}

/// Compares both precisions; returns the numbers of factorizations in total and in single precision.
fn expect_equal(text: &str, set: &[&str]) -> [u64; 2] {
    let [(double, exact), (mixed, found)] = ["double", "mixed"].map(|own| run(text, set, own));
    let steps = |of: &Value| of["steps"].as_f64().unwrap();
    let ratio = steps(&mixed) / steps(&double);
    assert!((ratio - 1.0).abs() <= 0.02, "{set:?}: {ratio}");
    let values = |rows: &[Vec<f64>]| rows.iter().flat_map(|row| row[1..].to_vec()).collect();
    let [exact, found]: [Vec<f64>; 2] = [&exact, &found].map(|rows| values(rows));
    let largest = exact.iter().fold(0.0, |max, u| f64::max(max, u.abs()));
    let off = exact.iter().zip(&found).fold(0.0, |max, (a, b)| f64::max(max, (a - b).abs()));
    assert!(largest > 0.0 && off <= RTOL * largest, "{set:?}: {off:e} of {largest:e}");
    factorizations(&mixed)
}

#[test]
fn single_precision_changes_no_results_of_bodies_in_space() {
    let prony = "material[0].prony=[{ relative_modulus = 0.5, relaxation_time = 0.02 }]";
    let follower =
        "pressure=[{ group = \"top\", value = { type = \"step\", value = 10.0, rise = 0.05 } }]";
    for set in [
        &["solid.bulk_modulus=1e3"][..],
        &["solid.bulk_modulus=1e8"],
        &["solid.bulk_modulus=1e12"],
        &["solid.bulk_modulus=inf"],
        &["solid.bulk_modulus=inf", "solid.rayleigh_stiffness=1e-4"],
        &["material[0].viscosity=5.0"],
        &[prony],
        &[follower],
    ] {
        let [all, single] = expect_equal(BLOCK, &[set, &["integrator.method=radau5"]].concat());
        assert!(single == all && all > 0, "{set:?}: {single} of {all}");
    }
}

#[test]
fn ill_conditioned_bodies_return_to_double_precision() {
    let [all, single] = expect_equal(SLENDER, &["integrator.method=radau5"]);
    assert!(0 < single && single < all / 2, "{single} of {all}");
}

#[test]
fn an_unknown_precision_is_refused() {
    let error = build(BLOCK, &["integrator.precision=single"]).unwrap_err().to_string();
    for part in ["precision", "single", "auto", "double", "mixed"] {
        assert!(error.contains(part), "{part}: {error}");
    }
}
