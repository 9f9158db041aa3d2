//! Checks the remedies that messages about meshes recommend, by applying them with Gmsh.

use std::path::Path;
use std::process::{Command, Stdio};

use super::*;

const BLOCK: &str = "SetFactory(\"OpenCASCADE\");\nBox(1) = {0, 0, 0, 0.1, 0.02, 0.02};\nMesh.MeshSizeMax = 0.01;\n";
const HALVES: &str = "SetFactory(\"OpenCASCADE\");\nBox(1) = {0, 0, 0, 0.05, 0.02, 0.02};\n\
                      Box(2) = {0.05, 0, 0, 0.05, 0.02, 0.02};\nMesh.MeshSizeMax = 0.01;\n";

const GRID: &str = "Transfinite Surface {:};\nTransfinite Volume {:};\n";
/// Tolerance for rounding errors, because the coordinates and the order of sums differ.
const ROUNDING: f64 = 1e-8;
/// Tolerance for coarse meshes. Results with elements of half the thickness differ by up to 2.1 % from the result with
/// elements of a fifth.
const COARSE: f64 = 0.025;

/// Returns whether the tests can run Gmsh.
fn has_gmsh() -> bool {
    let found = Command::new("gmsh").arg("-version").stderr(Stdio::null()).status().is_ok();
    if !found {
        eprintln!("skipped: Gmsh is not installed");
    }
    found
}

/// Returns the mesh of Gmsh for a geometry.
fn mesh(folder: &Path, geometry: &str) -> Vec<u8> {
    gmsh(folder, geometry, "-3 -format msh41 -o block.msh")
}

/// Returns the file that Gmsh writes with these arguments, the last of which is the name of the file.
fn gmsh(folder: &Path, geometry: &str, arguments: &str) -> Vec<u8> {
    fs::write(folder.join("block.geo"), geometry).unwrap();
    let words: Vec<&str> =
        ["-v", "0", "block.geo"].into_iter().chain(arguments.split(' ')).collect();
    let mut command = Command::new("gmsh");
    command.args(&words).current_dir(folder).stdout(Stdio::null());
    let status = command.status().unwrap();
    assert!(status.success(), "{arguments}");
    fs::read(folder.join(words[words.len() - 1])).unwrap()
}

/// Returns the deflection of a block, clamped at facets with the normal −x.
fn tip(content: &[u8]) -> f64 {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("block.msh"), content).unwrap();
    let end = "[[group]]\nname = \"end\"\ntype = \"direction\"\ndirection = [-1.0, 0.0, 0.0]\n";
    let text = scene("end", 1.0) + end;
    let scene = Scene::build("scene.toml", &text, &[], folder.path()).unwrap();
    let out = tempfile::tempdir().unwrap();
    let run = compute(&scene, &RunOptions::into_folder(out.path())).unwrap();
    run.document["results"]["tip"]["u_z"].as_f64().unwrap()
}

fn problem(content: &[u8]) -> MshProblem {
    match Mesh::parse_msh(content, "block.msh").unwrap_err() {
        FemError::Msh { problem, .. } => problem,
        error => panic!("{error}"),
    }
}

#[test]
fn remedies_of_options_lead_to_the_same_deflection() {
    if !has_gmsh() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let run = |arguments: &str| gmsh(folder.path(), BLOCK, arguments);
    let exact = tip(&run("-3 -format msh41 -o block.msh"));
    let version = problem(&run("-3 -format msh40 -o block.msh"));
    assert!(matches!(version, MshProblem::Version(_)), "{version}");
    let surfaces = problem(&run("-2 -format msh41 -o block.msh"));
    assert!(matches!(surfaces, MshProblem::NotMeshed { .. }), "{surfaces}");
    let cubic = BLOCK.to_owned() + "Mesh.ElementOrder = 3;\n";
    let problem_of = |geometry: &str| problem(&mesh(folder.path(), geometry));
    assert!(matches!(problem_of(&cubic), MshProblem::ElementType(_)));
    let linear = mesh(folder.path(), &(cubic + "Mesh.ElementOrder = 1;\n"));
    assert!((tip(&linear) / exact - 1.0).abs() < ROUNDING);
    let grid = BLOCK.to_owned() + GRID;
    let bricks = problem_of(&(grid.clone() + "Recombine Surface {:};\n"));
    assert!(matches!(bricks, MshProblem::ElementType(_)), "{bricks}");
    assert!((tip(&mesh(folder.path(), &grid)) / exact - 1.0).abs() < COARSE);
}

#[test]
fn remedies_of_separate_volumes_join_them() {
    if !has_gmsh() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let exact = tip(&mesh(folder.path(), BLOCK));
    let defect = |content: &[u8]| match Mesh::parse_msh(content, "block.msh").unwrap_err() {
        FemError::Defect(defect) => defect.kind,
        error => panic!("{error}"),
    };
    // Gmsh 4.15 meshes some common faces alike, and Gmsh 4.8 meshes none alike. The recommended remedy is the same.
    let halves = mesh(folder.path(), HALVES);
    assert!(matches!(defect(&halves), DefectKind::HangingNode | DefectKind::Crack));
    let joined = HALVES.to_owned() + "BooleanFragments{ Volume{1, 2}; Delete; }{}\n";
    assert!((tip(&mesh(folder.path(), &joined)) / exact - 1.0).abs() < COARSE);
    let alike = mesh(folder.path(), &(HALVES.to_owned() + GRID));
    assert_eq!(defect(&alike), DefectKind::Crack);
    fs::write(folder.path().join("alike.msh"), alike).unwrap();
    let merged = "Merge \"alike.msh\";\nCoherence Mesh;\n";
    let merged = gmsh(folder.path(), merged, "-save -format msh41 -o block.msh");
    assert!((tip(&merged) / exact - 1.0).abs() < COARSE);
}

#[test]
fn files_of_other_programs_are_converted_by_the_remedy() {
    if !has_gmsh() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let exact = tip(&mesh(folder.path(), BLOCK));
    let cases = [
        ("-3 -o file.unv", "-save -format msh41 -o block.msh", "", ROUNDING),
        ("-0 -o file.step", "-3 -format msh41 -o block.msh", "Mesh.MeshSizeMax = 0.01;\n", COARSE),
        (
            "-2 -o file.stl",
            "-3 -format msh41 -o block.msh",
            "Surface Loop(1) = {1}; Volume(1) = {1};\n",
            COARSE,
        ),
    ];
    for (writes, remedy, rest, tolerance) in cases {
        assert_eq!(problem(&gmsh(folder.path(), BLOCK, writes)), MshProblem::NotMsh);
        let name = writes.rsplit(' ').next().unwrap();
        let read = gmsh(folder.path(), &format!("Merge \"{name}\";\n{rest}"), remedy);
        let error = (tip(&read) / exact - 1.0).abs();
        assert!(error < tolerance, "{name}: {error:e}");
    }
}
