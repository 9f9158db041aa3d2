//! Tests of readers with mutated input. A seeded random generator damages meshes, scenes and tables. Readers must
//! accept them, or reject them with a message that names the location. They must not panic.
//!
//! The tests are deterministic and short by default. `MYOVIB_MUTATE_SECONDS=600` continues for this
//! time with new seeds. A failing input is kept in the temporary folder and named.
#![allow(clippy::unwrap_used)] // a test may panic

mod mutate;

use std::fs;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::time::{Duration, Instant};

use myovib_fem::{FemError, Mesh};
use myovib_scene::Scene;
use myovib_scene::builtin::{SCENES, find};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use tempfile::TempDir;

use mutate::mutate;

/// Number of mutants in a short run.
const CASES: u64 = 200;

/// Reads mutants of `corpus` until the time is over.
fn run(target: &str, corpus: &[&str], read: impl Fn(&str) + std::panic::RefUnwindSafe) {
    let seconds = std::env::var("MYOVIB_MUTATE_SECONDS").ok();
    let until = seconds.map(|text| Instant::now() + Duration::from_secs(text.parse().unwrap()));
    let goes_on = |case| until.map_or(case < CASES, |end| Instant::now() < end);
    let mut case = 0;
    while goes_on(case) {
        let mut random = ChaCha8Rng::seed_from_u64(case);
        let mutant = mutate(corpus, &mut random);
        if catch_unwind(|| read(&mutant)).is_err() {
            let path = std::env::temp_dir().join(format!("myovib-{target}-{case}"));
            fs::write(&path, &mutant).unwrap();
            panic!("{target}: case {case} fails; it is kept in {}", path.display());
        }
        case += 1;
    }
    println!("{target}: {case} mutants");
}

/// Reads a mesh. Any text must be accepted as a mesh or rejected with the location of the error.
fn read_mesh(text: &str) {
    match Mesh::parse_msh(text, "m.msh") {
        Ok(mesh) => assert!(mesh.measure() > 0.0),
        Err(error @ FemError::Msh { .. }) => assert!(error.to_string().contains("m.msh")),
        Err(error) => assert!(!error.to_string().is_empty()),
    }
}

/// Reads a scene. Any text must be accepted as a scene or rejected with the location of the error.
fn read_scene(text: &str) {
    if let Err(error) = Scene::build("s.toml", text, &[], Path::new("")) {
        let message = error.to_string();
        assert!(message.contains("s.toml"), "{message}");
    }
}

/// Scene with a force from a table in the same folder.
struct TableScene(TempDir);

impl TableScene {
    fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    fn build(&self, table: &[u8]) -> Result<(), String> {
        fs::write(self.0.path().join("table.csv"), table).unwrap();
        Scene::build("s.toml", include_str!("table.toml"), &[], self.0.path())
            .map(|_| ())
            .map_err(|error| error.to_string())
    }

    /// Reads a table. Any bytes must be accepted as a table or rejected with the location of the table's name in the
    /// scene.
    fn read(&self, table: &[u8]) {
        if let Err(message) = self.build(table) {
            assert!(message.contains("s.toml"), "{message}");
        }
    }
}

const TABLES: [&str; 2] = ["t,force\n0,0\n0.5,1\n1,2.5\n2,-1e-3\n", "force , t\n1,0\n2,3\n"];

#[test]
fn damaged_meshes_are_refused_with_their_place() {
    let meshes = [
        include_str!("../../../../data/meshes/block.msh"),
        include_str!("../../../../data/meshes/muscle.msh"),
    ];
    run("mesh", &meshes, read_mesh);
}

#[test]
fn damaged_scenes_are_refused_with_their_place() {
    // The coarse ventricle has the same text with a mesh that is faster to read.
    let scenes = SCENES.iter().filter(|scene| scene.name != "ventricle");
    let scenes: Vec<&str> = scenes.map(|scene| scene.text).collect();
    run("scene", &scenes, read_scene);
}

#[test]
fn damaged_tables_are_refused_with_their_place() {
    let scene = TableScene::new();
    for undamaged in TABLES {
        scene.build(undamaged.as_bytes()).unwrap();
    }
    run("table", &TABLES, |text| scene.read(text.as_bytes()));
}

/// Reads the corpus kept by libFuzzer (`make fuzz`): one input for each branch reached in the
/// readers.
#[test]
fn the_fuzzers_corpus_is_read_or_refused_with_its_place() {
    type Reader<'a> = &'a dyn Fn(&[u8]);
    let scene = TableScene::new();
    let readers: [(&str, Reader); 3] = [
        ("mesh", &|bytes| read_mesh(&String::from_utf8_lossy(bytes))),
        ("scene", &|bytes| read_scene(&String::from_utf8_lossy(bytes))),
        ("table", &|bytes| scene.read(bytes)),
    ];
    for (target, read) in readers {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fuzz/corpus");
        let mut files = 0;
        for file in fs::read_dir(folder.join(target)).unwrap() {
            let path = file.unwrap().path();
            let bytes = fs::read(&path).unwrap();
            let ended = catch_unwind(AssertUnwindSafe(|| read(&bytes)));
            assert!(ended.is_ok(), "{}", path.display());
            files += 1;
        }
        assert!(files > 10, "{target}: {files} files");
    }
}

/// Regression: each of these inputs, found by mutation or review, panicked or requested unbounded memory.
#[test]
fn sizes_beyond_reason_are_refused_before_anything_is_allocated() {
    let huge = usize::MAX / 2;
    for (scene, key, value) in [
        ("cook-static", "mesh.cells", format!("[{huge}, {huge}]")),
        ("cook-static", "mesh.cells", "[100000, 100000]".to_owned()),
        ("figure2", "chain[0].oscillators", "100000000000".to_owned()),
        ("figure2", "rod.elements", "100000000000".to_owned()),
        ("cook-static", "static.steps", "1000000000".to_owned()),
        ("cook-static", "modes.count", "1000000000".to_owned()),
        ("figure3", "periodic.multipliers", "1000000000".to_owned()),
        ("figure3", "periodic.settling_periods", "1000000000".to_owned()),
    ] {
        let text = find(scene).unwrap().text;
        let set = [format!("{key}={value}")];
        let error = Scene::build("s.toml", text, &set, Path::new("")).unwrap_err();
        assert!(
            error.to_string().contains("at most") || error.to_string().contains("maximum"),
            "{error}"
        );
    }
}
