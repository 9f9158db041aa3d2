//! Helpers of the tests: scenes, their nodal forces, and mesh files with nodal data.

use std::fs;
use std::path::Path;

use myovib_scene::Scene;

/// Returns the scene of a body fixed at a group (if its name is not empty), with additional tables.
pub(crate) fn text(mesh: &str, held: &str, tables: &str) -> String {
    let fixed = match held {
        "" => String::new(),
        held => format!("[[fixed]]\ngroup = \"{held}\"\n"),
    };
    format!(
        "analysis = \"static\"\n[mesh]\n{mesh}\n[solid]\nbulk_modulus = 1e5\n[[material]]\n\
         law = \"mooney-rivlin\"\ndensity = 1e3\nc10 = 1e4\nc01 = 2e2\n\
         {fixed}{tables}\n"
    )
}

pub(crate) const BLOCK: &str = "type = \"box\"\nsize = [2.0, 1.0, 1.0]\ncells = [2, 1, 1]";
pub(crate) const SHEET: &str = "type = \"rectangle\"\nwidth = 2.0\nheight = 1.0\ncells = [4, 2]";

pub(crate) fn on_the_right(mesh: &str, traction: &str) -> String {
    let traction = format!("[[traction]]\ngroup = \"right\"\n{traction}");
    text(mesh, "left", &traction)
}

pub(crate) fn scene(text: &str, folder: &Path) -> Scene {
    Scene::build("scene.toml", text, &[], folder).unwrap()
}

/// Returns the nodal forces at time t.
pub(crate) fn forces(scene: &Scene, t: f64) -> Vec<f64> {
    let muscle = &scene.body.as_ref().unwrap().muscle;
    let mut total = vec![0.0; muscle.solid.space().n_components()];
    for load in &muscle.loads {
        load.add_at(t, &mut total);
    }
    total
}

/// Returns Σ x_i F_j of the nodal forces (moments of all axes), and their sum.
pub(crate) fn moments(scene: &Scene, t: f64) -> (Vec<Vec<f64>>, Vec<f64>) {
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

/// Asserts equality up to the rounding errors of a hundred numbers of magnitude `size`.
pub(crate) fn assert_close(found: f64, expected: f64, size: f64) {
    assert!((found - expected).abs() <= 1e-13 * size, "{found} {expected}");
}

/// Returns the nodes of a mesh file: tags and positions.
pub(crate) fn nodes(mesh: &str) -> Vec<(usize, [f64; 3])> {
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

/// Returns the mesh file with nodal data of the given name.
pub(crate) fn with_data<const N: usize>(
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

pub(crate) const FILE: &str = "type = \"file\"\npath = \"m.msh\"";
pub(crate) fn mesh(name: &str) -> String {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../data/meshes");
    fs::read_to_string(folder.join(name)).unwrap()
}

pub(crate) fn refusal(text: &str, folder: &Path) -> String {
    match Scene::build("scene.toml", text, &[], folder) {
        Ok(_) => "accepted".to_owned(),
        Err(error) => error.to_string(),
    }
}
