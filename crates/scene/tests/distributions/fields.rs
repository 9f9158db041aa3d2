//! Nodal data instead of expressions.

use std::fs;

use myovib_scene::Scene;

use crate::common::{FILE, assert_close, forces, mesh, scene, text, with_data};

const LINEAR: &str = "1 + 20*x - 7*y";

fn linear([x, y, _]: [f64; 3]) -> f64 {
    1.0 + 20.0 * x - 7.0 * y
}

/// Returns the nodal forces and the prescribed displacements.
fn given(scene: &Scene) -> Vec<f64> {
    let mut given = forces(scene, 0.0);
    for prescribed in &scene.body.as_ref().unwrap().muscle.prescribed {
        given[prescribed.component] += prescribed.signal.at(0.0).value;
    }
    given
}

/// Tables and the fixed group.
const TABLES: [(&str, &str); 3] = [
    ("[[traction]]\ngroup = \"load\"", "fixed"),
    ("[[body_force]]", "fixed"),
    ("[[prescribed_displacement]]\ngroup = \"fixed\"", ""),
];

#[test]
fn nodal_data_and_the_expression_of_the_same_distribution_are_the_same() {
    for (name, scale) in
        [("muscle.msh", [3.0, -2.0, 0.0]), ("spindle_coarse.msh", [3.0, -2.0, 5.0])]
    {
        let file = with_data(&mesh(name), "one", |x| Some([linear(x)]));
        let file = with_data(&file, "three", |x| Some(scale.map(|s| s * linear(x))));
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("m.msh"), file).unwrap();
        let axes = match scale[2] == 0.0 {
            true => &["x", "y"][..],
            false => &["x", "y", "z"],
        };
        for (table, held) in TABLES {
            let given_by = |unit: bool, distribution: &str| {
                let component = |(axis, size): (&&str, f64)| {
                    format!("{axis} = {:?}\n", if unit { 1.0 } else { size })
                };
                let components: String = axes.iter().zip(scale).map(component).collect();
                let table = format!("{table}\n{components}spatial_factor = {distribution}");
                given(&scene(&text(FILE, held, &table), folder.path()))
            };
            let expected = given_by(false, &format!("\"{LINEAR}\""));
            let size = expected.iter().fold(0.0, |size: f64, f| size.max(f.abs()));
            assert!(size > 0.0, "{table}");
            for (unit, field) in [(false, "{ field = \"one\" }"), (true, "{ field = \"three\" }")] {
                for (found, expected) in given_by(unit, field).iter().zip(&expected) {
                    assert_close(*found, *expected, size);
                }
            }
        }
    }
}
