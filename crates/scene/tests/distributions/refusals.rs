//! Invalid distributions.

use std::fs;
use std::path::Path;

use crate::common::{BLOCK, FILE, SHEET, mesh, refusal, text, with_data};

const TABLES: [&str; 3] = [
    "[[traction]]\ngroup = \"right\"",
    "[[prescribed_displacement]]\ngroup = \"right\"",
    "[[body_force]]",
];

#[test]
fn invalid_spatial_factors_are_rejected_with_their_key() {
    for table in TABLES {
        for (mesh, distribution, message) in [
            (BLOCK, "\"100*\"", "the spatial factor is not an expression"),
            (BLOCK, "\"\"", "the spatial factor is not an expression"),
            (BLOCK, "\"2*r\"", "`r` is not a coordinate"),
            (SHEET, "\"2*z\"", "`z` is not a coordinate"),
            (BLOCK, "\"1/(x - x)\"", "has no finite value at ["),
            (BLOCK, "\"sqrt(y - 5)\"", "has no finite value at ["),
            (BLOCK, "3.0", "has a value of the wrong type"),
            (BLOCK, "{ field = \"t\" }", "the mesh has no nodal field \"t\""),
            (BLOCK, "{ fields = \"t\" }", "did you mean `field`?"),
        ] {
            let table = format!("{table}\ny = 1.0\nspatial_factor = {distribution}");
            let found = refusal(&text(mesh, "left", &table), Path::new(""));
            assert!(found.contains(message), "{table}: {found}");
            assert!(found.contains("spatial_factor"), "{found}");
        }
    }
}

#[test]
fn invalid_nodal_data_are_rejected_as_a_factor() {
    let file = with_data(&mesh("spindle_coarse.msh"), "nine", |_| Some([1.0; 9]));
    let half = |[x, ..]: [f64; 3]| (x < 0.0).then_some([1.0]);
    let file = with_data(&file, "half", half);
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("m.msh"), file).unwrap();
    for (table, held) in [
        ("[[traction]]\ngroup = \"load\"", "fixed"),
        ("[[prescribed_displacement]]\ngroup = \"fixed\"", ""),
        ("[[body_force]]", "fixed"),
    ] {
        for (field, message) in [
            ("nine", "9 values at each node"),
            ("half", "the nodal field `half` has no value at vertex"),
            ("hal", "its fields are: half, nine"),
        ] {
            let table = format!("{table}\ny = 1.0\nspatial_factor = {{ field = \"{field}\" }}");
            let found = refusal(&text(FILE, held, &table), folder.path());
            assert!(found.contains(message), "{table}: {found}");
        }
    }
}
