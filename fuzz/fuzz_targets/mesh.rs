//! Any input must result in a mesh or in an error that contains its location.
#![no_main]

use libfuzzer_sys::fuzz_target;
use myovib_fem::{FemError, Mesh};

fuzz_target!(|bytes: &[u8]| {
    match Mesh::parse_msh(bytes, "m.msh") {
        Ok(mesh) => assert!(mesh.measure() > 0.0),
        Err(error @ FemError::Msh { .. }) => assert!(error.to_string().contains("m.msh")),
        Err(error) => assert!(!error.to_string().is_empty()),
    }
});
