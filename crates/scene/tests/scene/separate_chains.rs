//! Separate steps of chains beside a body.

use std::fs;
use std::path::Path;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};

use myovib_scene::csv::Table;
use myovib_scene::run::{Existing, RunOptions, compute};
use myovib_scene::watch::ProgressSink;
use myovib_scene::{InputError, Scene};
use serde_json::Value;

const MUSCLE: &str = r#"
[time]
end = 0.4
[mesh]
type = "muscle"
[solid]
bulk_modulus = 1e5
rayleigh_mass = 1.0
rayleigh_stiffness = 1e-4
[[material]]
law = "mooney-rivlin"
density = 1.1e3
c10 = 1e4
c01 = 2e2
[[fixed]]
group = "fixed"
[[traction]]
group = "load"
y = { type = "step", value = 100.0, start = 0.02, rise = 0.03 }
[[probe]]
name = "drive"
type = "point"
at = [0.0, 0.0]
quantities = ["u"]
interval = 0.01
"#;

/// The paper's rod, whose load starts at 8 s unless shifted.
const ROD: &str = r#"
[time]
end = 2.0
[rod]
load = { type = "ramped-sine", amplitude = 1.0, frequency = 8.0, steepness = 10.0, shift = 0.3 }
[[probe]]
name = "drive"
type = "rod"
at = 0.07
interval = 0.01
"#;

/// `body` with a chain with this gain, driven by the point of its probe.
fn with_chain(body: &str, oscillators: usize, gain: f64) -> String {
    let at = if body == ROD { "0.07" } else { "[0.0, 0.0]" };
    format!(
        "{body}[[chain]]\nname = \"chain\"\noscillators = {oscillators}\nfrequency_spread = 0.1\n\
         at = {at}\ngain = {gain:?}\n\
         [[probe]]\nname = \"states\"\ntype = \"oscillators\"\nchain = \"chain\"\ninterval = 0.01\n\
         [[probe]]\nname = \"order\"\ntype = \"coherence\"\nchain = \"chain\"\ninterval = 0.01\n"
    )
}

fn build(text: &str, set: &[&str]) -> Result<Scene, InputError> {
    let set: Vec<String> = set.iter().map(|set| (*set).to_owned()).collect();
    Scene::build("scene.toml", text, &set, Path::new(""))
}

/// Runs a scene into a folder.
fn run(text: &str, set: &[&str], folder: &Path) -> Value {
    let scene = build(text, set).unwrap();
    compute(&scene, &RunOptions::into_folder(folder))
        .unwrap()
        .document
}

fn text(folder: &Path, name: &str) -> String {
    fs::read_to_string(folder.join(format!("{name}.csv"))).unwrap()
}

fn rows(folder: &Path, name: &str) -> Vec<Vec<f64>> {
    let table = Table::parse(&text(folder, name)).unwrap();
    table
        .rows
        .iter()
        .filter_map(|row| table.numbers(row))
        .collect()
}

const SEPARATE: &str = "integrator.chains=separate";
/// Counts of the body's integrator.
const COUNTS: [&str; 7] = [
    "steps",
    "error_test_failures",
    "step_solve_failures",
    "newton_iterations",
    "residual_evaluations",
    "linear_setups",
    "last_step",
];

#[test]
fn the_body_moves_as_without_chains() {
    let folder = tempfile::tempdir().unwrap();
    for (name, body, gain) in [
        ("muscle", MUSCLE, 1.0),
        ("muscle", MUSCLE, 1e4),
        ("rod", ROD, 1e3),
    ] {
        for method in ["radau5", "radau9", "bdf"] {
            let method = format!("integrator.method={method}");
            let out = |run: &str| folder.path().join(format!("{run} {name} {method} {gain}"));
            let alone = run(body, &[&method], &out("alone"));
            let with = with_chain(body, 3, gain);
            let beside = run(&with, &[&method, SEPARATE], &out("beside"));
            assert_eq!(alone["outcome"], "finished");
            assert_eq!(text(&out("alone"), "drive"), text(&out("beside"), "drive"));
            for count in COUNTS {
                assert_eq!(alone[count], beside[count], "{name} {method}: {count}");
            }
            assert!(alone["chains"].is_null());
            assert!(beside["chains"]["steps"].as_u64() >= alone["steps"].as_u64());
        }
    }
}

/// Largest magnitude of the columns of a table, and the largest difference between two tables.
fn compare(one: &[Vec<f64>], other: &[Vec<f64>], columns: &[usize]) -> [f64; 2] {
    assert_eq!(one.len(), other.len());
    let mut found = [0.0_f64; 2];
    for (one, other) in one.iter().zip(other) {
        for &k in columns {
            found[0] = found[0].max(other[k].abs());
            found[1] = found[1].max((one[k] - other[k]).abs());
        }
    }
    found
}

#[test]
fn separate_steps_agree_with_one_system_at_tighter_tolerances() {
    let folder = tempfile::tempdir().unwrap();
    for (n, gain) in [(1, 1.0), (5, 1e5)] {
        let with = with_chain(MUSCLE, n, gain);
        let together = folder.path().join(format!("together {gain}"));
        let tight = "integrator.oscillators={ rtol = 1e-7, atol = 1e-10 }";
        let set = ["integrator.method=radau9", tight, "integrator.rtol=1e-8"];
        run(&with, &set, &together);
        for method in ["radau5", "radau9", "bdf"] {
            let method = format!("integrator.method={method}");
            let out = |name: &str| folder.path().join(format!("{name} {method} {gain}"));
            let tolerances = "integrator.oscillators={ rtol = 1e-5, atol = 1e-8 }";
            let set = [&method, SEPARATE, tolerances, "integrator.rtol=1e-6"];
            run(&with, &set, &out("separate"));
            let tables = |name| [&out("separate"), &together].map(|out| rows(out, name));
            let [one, other] = tables("drive");
            let columns: Vec<usize> = (1..one[0].len()).collect();
            let [_, of_u] = compare(&one, &other, &columns);
            let [one, other] = tables("states");
            let positions: Vec<usize> = (1..=n).collect();
            let [size, off] = compare(&one, &other, &positions);
            let [one, other] = tables("order");
            let [largest, of_order] = compare(&one, &other, &[1, 3]);
            // A sum of errors of many steps: 20 tolerances of the chain. The body's tolerance of 1e-6
            // keeps the gain times its error of u below them.
            let allowed = |size: f64| 20.0 * (1e-5 * size + 1e-8);
            assert!(off < allowed(size), "{method} {gain}: {off:e} of {size:e}");
            let at = format!("{method} {gain}: |u| {of_u:e}, order {of_order:e}");
            assert!(of_order < allowed(largest), "{at}");
        }
    }
}

/// Sets a flag after a number of steps.
struct Interrupt(AtomicU32, &'static AtomicBool);

impl ProgressSink for Interrupt {
    fn on_progress(&self, _: &dyn Fn() -> String) {
        if self.0.fetch_sub(1, Ordering::Relaxed) == 1 {
            self.1.store(true, Ordering::Relaxed);
        }
    }
}

#[test]
fn a_resumed_run_of_radau_iia_is_the_uninterrupted_run() {
    static FLAG: AtomicBool = AtomicBool::new(false);
    let folder = tempfile::tempdir().unwrap();
    for (name, body, method) in [
        ("muscle", MUSCLE, "radau5"),
        ("muscle", MUSCLE, "radau9"),
        ("rod", ROD, "radau9"),
    ] {
        let method = format!("integrator.method={method}");
        let set = [&*method, SEPARATE];
        let with = with_chain(body, 3, 1e4);
        let [whole, parts] =
            ["whole", "parts"].map(|run| folder.path().join(format!("{run} {name} {method}")));
        let document = run(&with, &set, &whole);
        let scene = build(&with, &set).unwrap();
        let interrupt = Interrupt(AtomicU32::new(12), &FLAG);
        FLAG.store(false, Ordering::Relaxed);
        let first = RunOptions {
            interrupt: Some(&FLAG),
            progress: &interrupt,
            ..RunOptions::into_folder(&parts)
        };
        let stopped = compute(&scene, &first).unwrap().document;
        assert_eq!(stopped["reason"], "interrupted");
        let resume = RunOptions {
            existing: Existing::Resume,
            ..RunOptions::into_folder(&parts)
        };
        let resumed = compute(&scene, &resume).unwrap().document;
        for name in ["drive", "states", "order"] {
            assert_eq!(text(&whole, name), text(&parts, name), "{name}");
        }
        assert_eq!(document["chains"], resumed["chains"]);
        assert_eq!(document["steps"], resumed["steps"]);
    }
}

#[test]
fn a_stop_within_a_step_of_the_body_ends_the_chains_there() {
    let folder = tempfile::tempdir().unwrap();
    let with = with_chain(MUSCLE, 3, 1e4);
    let stop = "[[stop]]\ntype = \"displacement\"\nat = [0.0, 0.0]\nabove = 1e-4\n";
    let [whole, part] = ["whole", "part"].map(|name| folder.path().join(name));
    run(&with, &[SEPARATE], &whole);
    let document = run(&format!("{with}{stop}"), &[SEPARATE], &part);
    assert_eq!(document["reason"], "event");
    let t = document["t_reached"].as_f64().unwrap();
    assert!(t < 0.4);
    for name in ["states", "order"] {
        let (all, some) = (text(&whole, name), text(&part, name));
        assert!(all.starts_with(&some), "{name}");
        let last = rows(&part, name).last().unwrap()[0];
        assert!(last <= t && t < last + 0.01, "{last} of {t}");
    }
}

#[test]
fn separate_steps_where_they_are_impossible_are_refused() {
    let with = with_chain(MUSCLE, 3, 1e4);
    let free = with.split_once("[[chain]]").map(|(_, chain)| {
        let chain = chain.replace("at = [0.0, 0.0]\n", "");
        format!("[time]\nend = 1.0\n[[chain]]{chain}")
    });
    let free = free.unwrap();
    let feedback = format!("{with}[[feedback]]\nchain = \"chain\"\nat_zero_coherence = 1.5\n");
    let untested = "integrator.oscillators={ in_error_test = false }";
    assert!(build(&with, &[SEPARATE]).is_ok());
    assert!(build(&with_chain(ROD, 3, 1.0), &[SEPARATE]).is_ok());
    assert!(build(&feedback, &[]).is_ok());
    assert!(build(&free, &[]).is_ok());
    assert!(build(&with, &[untested]).is_ok());
    for (text, set) in [
        (&*feedback, &[SEPARATE][..]),
        (&*with, &[SEPARATE, untested]),
        (MUSCLE, &[SEPARATE]),
        (&*free, &[SEPARATE]),
    ] {
        let error = build(text, set).unwrap_err().to_string();
        assert!(error.contains("integrator.chains"), "{error}");
    }
}
