//! Integration of chains with separate steps.

mod agreement;

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

const BLOCK: &str = r#"
[time]
end = 0.4
[mesh]
type = "box"
size = [0.1, 0.02, 0.02]
cells = [5, 1, 1]
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
group = "left"
[[traction]]
group = "right"
y = 0.0
[[probe]]
name = "drive"
type = "point"
at = [0.1, 0.0, 0.0]
quantities = ["u"]
interval = 0.01
"#;

/// The paper's rod. With `shift`, its load starts within the short run; otherwise it would start at 8 s.
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

/// Returns `body` with a chain of the given gain, driven at the position of the body's probe.
fn with_chain(body: &str, oscillators: usize, gain: f64) -> String {
    let at = match body {
        ROD => "0.07",
        BLOCK => "[0.1, 0.0, 0.0]",
        _ => "[0.0, 0.0]",
    };
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
    compute(&scene, &RunOptions::into_folder(folder)).unwrap().document
}

fn text(folder: &Path, name: &str) -> String {
    fs::read_to_string(folder.join(format!("{name}.csv"))).unwrap()
}

fn rows(folder: &Path, name: &str) -> Vec<Vec<f64>> {
    let table = Table::parse(&text(folder, name)).unwrap();
    table.rows.iter().filter_map(|row| table.numbers(row)).collect()
}

const SEPARATE: &str = "integrator.chains=separate";
const TOGETHER: &str = "integrator.chains=together";
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
    for (name, body, gain) in [("muscle", MUSCLE, 1.0), ("muscle", MUSCLE, 1e4), ("rod", ROD, 1e3)]
    {
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

/// Returns the largest magnitude in some columns of a table, and the largest difference between two tables.
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

/// Progress sink that sets a flag after a number of steps.
pub(crate) struct Interrupt(pub(crate) AtomicU32, pub(crate) &'static AtomicBool);

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
    for (name, body, method) in
        [("muscle", MUSCLE, "radau5"), ("muscle", MUSCLE, "radau9"), ("rod", ROD, "radau9")]
    {
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
        let resume = RunOptions { existing: Existing::Resume, ..RunOptions::into_folder(&parts) };
        let resumed = compute(&scene, &resume).unwrap().document;
        for name in ["drive", "states", "order"] {
            assert_eq!(text(&whole, name), text(&parts, name), "{name}");
        }
        assert_eq!(document["chains"], resumed["chains"]);
        assert_eq!(document["driving_error"], resumed["driving_error"]);
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

/// Checks oscillators that perform several steps within one step of the body, so that |Ψ| has several peaks in that
/// step.
#[test]
fn the_amplitude_of_a_chain_ends_a_run_within_a_step_of_the_body() {
    let folder = tempfile::tempdir().unwrap();
    let fast = with_chain(MUSCLE, 3, 1e5).replace("[[chain]]", "[[chain]]\nfrequency = 80.0");
    let [above, out] = ["above", "out"].map(|name| folder.path().join(name));
    let whole = run(&fast, &[SEPARATE], &above);
    let steps = |document: &Value| document["steps"].as_u64().unwrap();
    assert!(whole["chains"]["steps"].as_u64().unwrap() > 2 * steps(&whole));
    let rows = rows(&above, "order");
    let largest = rows.iter().fold(0.0_f64, |max, row| max.max(row[1]));
    let stop =
        format!("[[stop]]\ntype = \"coherence\"\nchain = \"chain\"\nabove = {:?}\n", 0.6 * largest);
    let fast = fast + &stop;
    let mut times = ["separate", "together"].map(|chains| {
        let set = [&*format!("integrator.chains={chains}"), "integrator.rtol=1e-8"];
        let document = run(&fast, &set, &out.join(chains));
        assert_eq!(document["reason"], "event");
        document["t_reached"].as_f64().unwrap()
    });
    // |Ψ| takes at least 0.1 s to change by its own size, and has relative errors of 1e-7.
    assert!((times[0] - times[1]).abs() < 1e-8, "{times:?}");
    times.sort_by(f64::total_cmp);
    let before = rows.iter().take_while(|row| row[0] < times[0]);
    assert!(before.into_iter().all(|row| row[1] <= 0.6 * largest));
    let unknown = fast.replace(
        "\"coherence\"\nchain = \"chain\"\nabove",
        "\"coherence\"\nchain = \"other\"\nabove",
    );
    let error = build(&unknown, &[]).unwrap_err().to_string();
    assert!(error.contains("`other`"), "{error}");
}

#[test]
fn the_error_of_the_driving_displacement_is_reported() {
    let folder = tempfile::tempdir().unwrap();
    let with = with_chain(MUSCLE, 3, 1e4);
    let reference = folder.path().join("reference");
    let tight = "integrator.oscillators={ rtol = 1e-9, atol = 1e-12 }";
    run(&with, &["integrator.rtol=1e-8", tight], &reference);
    for (method, rtol) in [("bdf", 1e-4), ("bdf", 1e-5), ("radau9", 1e-4), ("radau9", 1e-8)] {
        let set = [
            &*format!("integrator.method={method}"),
            &*format!("integrator.rtol={rtol:e}"),
            SEPARATE,
        ];
        let out = folder.path().join(format!("{method} {rtol:e}"));
        let result = compute(&build(&with, &set).unwrap(), &RunOptions::into_folder(&out)).unwrap();
        let found = &result.document["driving_error"][0];
        let number = |key: &str| found[key].as_f64().unwrap();
        let tables = [&out, &reference].map(|out| rows(out, "states"));
        let [size, off] = compare(&tables[0], &tables[1], &[1, 2, 3]);
        // The errors of the oscillators' steps accumulate.
        let own = 20.0 * (1e-7 * size + 1e-10);
        assert!(off < number("position") + own, "{method} {rtol}: {off:e} {found}");
        // The largest position refers to the ends of steps, whereas the size refers to the rows of the table.
        let ratio = number("relative") * size / number("position");
        assert!((0.9..1.1).contains(&ratio), "{ratio}");
        let is_noted = result.notes.iter().any(|note| note.contains("chain `chain`"));
        assert_eq!(is_noted, number("relative") > 10.0 * rtol);
        // The error of BDF is many times its tolerance.
        assert_eq!(is_noted, method == "bdf", "{method} {rtol}: {found}");
        if method == "bdf" {
            let indicator = &result.document["error_indicator"]["states"];
            let found = indicator.as_object().unwrap().values();
            let largest = found.map(|column| column["error"].as_f64().unwrap());
            let largest = largest.fold(0.0, f64::max);
            assert!(off < largest, "{off:e} {largest:e}");
        }
    }
    let together = run(&with, &[TOGETHER], &folder.path().join("together"));
    assert!(together["driving_error"].is_null());
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
