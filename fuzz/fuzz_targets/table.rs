//! Any input must result in the table of a force, or in an error that contains the location in the scene at which the
//! table is referenced.
#![no_main]

use std::sync::LazyLock;

use libfuzzer_sys::fuzz_target;
use myovib_scene::Scene;
use tempfile::TempDir;

static FOLDER: LazyLock<TempDir> = LazyLock::new(|| tempfile::tempdir().expect("a folder"));

fuzz_target!(|bytes: &[u8]| {
    std::fs::write(FOLDER.path().join("table.csv"), bytes).expect("the folder is ours");
    let scene = include_str!("../../crates/scene/tests/mutations/table.toml");
    if let Err(error) = Scene::build("s.toml", scene, &[], FOLDER.path()) {
        assert!(error.to_string().contains("s.toml"), "{error}");
    }
});
