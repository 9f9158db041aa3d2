//! Any input must result in a scene or in an error that contains its location.
#![no_main]

use std::path::Path;

use libfuzzer_sys::fuzz_target;
use myovib_scene::Scene;

fuzz_target!(|bytes: &[u8]| {
    let text = String::from_utf8_lossy(bytes);
    if let Err(error) = Scene::build("s.toml", &text, &[], Path::new("")) {
        assert!(error.to_string().contains("s.toml"), "{error}");
    }
});
