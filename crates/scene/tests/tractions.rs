//! Tractions that vary along their group: their resultants, and what is refused.
#![allow(clippy::unwrap_used)] // a test may panic

use std::fs;
use std::path::Path;

use myovib_scene::Scene;

/// A body held at its left end, its traction to be said.
fn text(mesh: &str, held: &str, traction: &str) -> String {
    format!(
        "analysis = \"static\"\n[mesh]\n{mesh}\n[solid]\nkappa = 1e5\n[[material]]\n\
         law = \"mooney-rivlin\"\ndensity = 1e3\nc10 = 1e4\nc01 = 2e2\n\
         [[fixed]]\ngroup = \"{held}\"\n[[traction]]\n{traction}\n"
    )
}

const BLOCK: &str = "type = \"box\"\nsize = [2.0, 1.0, 1.0]\ncells = [2, 1, 1]";
const SHEET: &str = "type = \"rectangle\"\nwidth = 2.0\nheight = 1.0\ncells = [4, 2]";

fn on_the_right(mesh: &str, traction: &str) -> String {
    let traction = format!("group = \"right\"\n{traction}");
    text(mesh, "left", &traction)
}

fn scene(text: &str, folder: &Path) -> Scene {
    Scene::build("scene.toml", text, &[], folder).unwrap()
}

/// The nodal forces at time t.
fn forces(scene: &Scene, t: f64) -> Vec<f64> {
    let muscle = &scene.body.as_ref().unwrap().muscle;
    let mut total = vec![0.0; muscle.solid.space().n_components()];
    for load in &muscle.loads {
        load.add_at(t, &mut total);
    }
    total
}

/// Σ x_i F_j of the nodal forces, and their sum: moments of all axes.
fn moments(scene: &Scene, t: f64) -> (Vec<Vec<f64>>, Vec<f64>) {
    let (forces, space) = (forces(scene, t), scene.body.as_ref().unwrap());
    let space = space.muscle.solid.space();
    let dimension = space.dimension();
    let mut moments = vec![vec![0.0; dimension]; dimension];
    let mut resultant = vec![0.0; dimension];
    for (node, force) in forces.chunks_exact(dimension).enumerate() {
        for (j, force) in force.iter().enumerate() {
            resultant[j] += force;
            for (i, x) in space.node_point(node).iter().enumerate() {
                moments[i][j] += x * force;
            }
        }
    }
    (moments, resultant)
}

/// Rounding of a hundred numbers of the size of the largest.
fn assert_close(found: f64, expected: f64, size: f64) {
    assert!(
        (found - expected).abs() <= 1e-13 * size,
        "{found} {expected}"
    );
}

/// On x = 2: t_z = 100 (1 + 3 y) Pa, half of it at half of the ramp.
#[test]
fn a_linear_traction_in_space_has_the_resultant_and_moments_of_its_integral() {
    let text = on_the_right(
        BLOCK,
        "z = { type = \"ramp\", value = 100.0, end = 2.0 }\ndistribution = \"1 + 3*y\"",
    );
    let scene = scene(&text, Path::new(""));
    for (t, part) in [(1.0, 0.5), (2.0, 1.0)] {
        let (moments, resultant) = moments(&scene, t);
        assert_eq!(resultant[..2], [0.0, 0.0]);
        assert_close(resultant[2], part * 250.0, 500.0);
        // ∫ x t_z, ∫ y t_z and ∫ z t_z over the unit square.
        for (i, expected) in [500.0, 150.0, 125.0].into_iter().enumerate() {
            assert_close(moments[i][2], part * expected, 500.0);
        }
    }
}

/// On x = 2: t = 10 y (1, x) Pa.
#[test]
fn a_linear_traction_in_the_plane_has_the_resultant_and_moment_of_its_integral() {
    let linear = "[[traction]]\ngroup = \"right\"\ny = 10.0\ndistribution = \"x*y\"";
    let text = on_the_right(SHEET, &format!("x = 10.0\ndistribution = \"y\"\n{linear}"));
    let (moments, resultant) = moments(&scene(&text, Path::new("")), 0.0);
    assert_close(resultant[0], 5.0, 20.0);
    assert_close(resultant[1], 10.0, 20.0);
    // x F_y - y F_x: 2 ∫ 20 y - ∫ 10 y².
    assert_close(moments[0][1] - moments[1][0], 20.0 - 10.0 / 3.0, 20.0);
}

/// The nodes of a mesh file: tags and places.
fn nodes(mesh: &str) -> Vec<(usize, [f64; 3])> {
    let lines = mesh.lines().skip_while(|line| *line != "$Nodes").skip(2);
    let mut lines = lines.take_while(|line| *line != "$EndNodes");
    let mut nodes = Vec::new();
    while let Some(block) = lines.next() {
        let count = block.split_whitespace().nth(3).unwrap().parse().unwrap();
        let tags = lines.by_ref().take(count);
        let tags: Vec<usize> = tags.map(|line| line.trim().parse().unwrap()).collect();
        for tag in tags {
            let words = lines.next().unwrap().split_whitespace();
            let place: Vec<f64> = words.map(|word| word.parse().unwrap()).collect();
            nodes.push((tag, [place[0], place[1], place[2]]));
        }
    }
    nodes
}

/// The mesh file with nodal data of that name.
fn with_data<const N: usize>(
    mesh: &str,
    name: &str,
    values: impl Fn([f64; 3]) -> Option<[f64; N]>,
) -> String {
    let rows: Vec<String> = nodes(mesh)
        .iter()
        .filter_map(|(tag, place)| {
            let words = values(*place)?.map(|value| format!(" {value:e}")).concat();
            Some(format!("{tag}{words}\n"))
        })
        .collect();
    let head = format!("1\n\"{name}\"\n1\n0.0\n3\n0\n{N}\n{}\n", rows.len());
    format!("{mesh}\n$NodeData\n{head}{}$EndNodeData\n", rows.concat())
}

const FILE: &str = "type = \"file\"\npath = \"m.msh\"";
const LINEAR: &str = "1 + 20*x - 7*y";

fn linear([x, y, _]: [f64; 3]) -> f64 {
    1.0 + 20.0 * x - 7.0 * y
}

fn mesh(name: &str) -> String {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../data/meshes");
    fs::read_to_string(folder.join(name)).unwrap()
}

#[test]
fn nodal_data_and_the_expression_of_the_same_traction_give_the_same_forces() {
    for (name, scale) in [
        ("muscle.msh", [3.0, -2.0, 0.0]),
        ("spindle_coarse.msh", [3.0, -2.0, 5.0]),
    ] {
        let file = with_data(&mesh(name), "one", |x| Some([linear(x)]));
        let file = with_data(&file, "three", |x| Some(scale.map(|s| s * linear(x))));
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("m.msh"), file).unwrap();
        let axes = if scale[2] == 0.0 {
            &["x", "y"][..]
        } else {
            &["x", "y", "z"]
        };
        let forces_of = |unit: bool, distribution: &str| {
            let component = |(axis, size): (&&str, f64)| {
                format!("{axis} = {:?}\n", if unit { 1.0 } else { size })
            };
            let components: String = axes.iter().zip(scale).map(component).collect();
            let traction = format!("group = \"load\"\n{components}distribution = {distribution}");
            let scene = scene(&text(FILE, "fixed", &traction), folder.path());
            forces(&scene, 0.0)
        };
        let expected = forces_of(false, &format!("\"{LINEAR}\""));
        let size = expected.iter().fold(0.0, |size: f64, f| size.max(f.abs()));
        assert!(size > 0.0);
        for (unit, field) in [
            (false, "{ field = \"one\" }"),
            (true, "{ field = \"three\" }"),
        ] {
            for (found, expected) in forces_of(unit, field).iter().zip(&expected) {
                assert_close(*found, *expected, size);
            }
        }
    }
}

fn refusal(text: &str, folder: &Path) -> String {
    match Scene::build("scene.toml", text, &[], folder) {
        Ok(_) => "accepted".to_owned(),
        Err(error) => error.to_string(),
    }
}

#[test]
fn what_is_no_distribution_is_refused_with_its_key() {
    for (mesh, distribution, message) in [
        (BLOCK, "\"100*\"", "the distribution is no expression"),
        (BLOCK, "\"\"", "the distribution is no expression"),
        (BLOCK, "\"2*r\"", "`r` is no coordinate"),
        (SHEET, "\"2*z\"", "`z` is no coordinate"),
        (BLOCK, "\"1/(x - 2)\"", "has no finite value at [2.0, "),
        (BLOCK, "\"sqrt(y - 5)\"", "has no finite value at [2.0, "),
        (BLOCK, "3.0", "has a value of the wrong kind"),
        (
            BLOCK,
            "{ field = \"t\" }",
            "the mesh has no nodal field \"t\"",
        ),
        (BLOCK, "{ fields = \"t\" }", "did you mean `field`?"),
    ] {
        let text = on_the_right(mesh, &format!("y = 1.0\ndistribution = {distribution}"));
        let found = refusal(&text, Path::new(""));
        assert!(found.contains(message), "{distribution}: {found}");
        assert!(found.contains("distribution"), "{found}");
    }
}

#[test]
fn nodal_data_that_are_no_factor_are_refused() {
    let file = with_data(&mesh("spindle_coarse.msh"), "nine", |_| Some([1.0; 9]));
    let half = |[x, ..]: [f64; 3]| (x < 0.0).then_some([1.0]);
    let file = with_data(&file, "half", half);
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("m.msh"), file).unwrap();
    for (field, message) in [
        ("nine", "9 values at each node"),
        ("half", "the nodal field `half` has no value at vertex"),
        ("hal", "its fields are: half, nine"),
    ] {
        let traction =
            format!("group = \"load\"\ny = 1.0\ndistribution = {{ field = \"{field}\" }}");
        let found = refusal(&text(FILE, "fixed", &traction), folder.path());
        assert!(found.contains(message), "{field}: {found}");
    }
}
