//! Error messages for invalid scenes in 3D.

use std::fs;
use std::path::Path;

use myovib_scene::Scene;

use crate::BLOCK;

/// Returns the error for the block with `from` replaced by `to`.
fn refusal(from: &str, to: &str) -> String {
    assert!(BLOCK.contains(from), "{from}");
    let text = BLOCK.replacen(from, to, 1);
    refusal_of(&text, Path::new(""))
}

fn refusal_of(text: &str, folder: &Path) -> String {
    match Scene::build("scene.toml", text, &[], folder) {
        Ok(_) => "accepted".to_owned(),
        Err(error) => error.to_string(),
    }
}

#[test]
fn keys_of_the_other_dimension_are_rejected() {
    for (from, to, message) in [
        ("at = [2.0, 0.5, 0.5]", "at = [2.0, 0.5]", "a point of the body has 3 coordinates, not 2"),
        (
            "at = [2.0, 0.5, 0.5]",
            "at = [2.0, 0.5, 1.5]",
            "the point (2, 0.5, 1.5) is outside the mesh",
        ),
        (
            "type = \"box\"\nsize = [2.0, 1.0, 1.0]\ncells = [2, 1, 1]",
            "type = \"rectangle\"\nwidth = 2.0\nheight = 1.0\ncells = [2, 1]",
            "a plane body has no z component",
        ),
        (
            "group = \"left\"\n[[traction]]",
            "group = \"left\"\n[[region]]\nname = \"disc\"\ncenter = [0.0, 0.0]\nradii = [1.0, 1.0]\n[[traction]]",
            "a region in this mesh needs 3 numbers",
        ),
        (
            "law = \"mooney-rivlin\"",
            "group = \"left\"\nlaw = \"mooney-rivlin\"",
            "the group `left` contains no tetrahedra",
        ),
        (
            "size = [2.0, 1.0, 1.0]",
            "size = [2.0, -1.0, 1.0]",
            "width = -1 must be positive and finite\n   where: scene.toml, line 5, column 8",
        ),
        (
            "c10 = 1e4\nc01 = 2e2",
            "c10 = 0.0",
            "the material has no stiffness: all its moduli are 0\n   where: scene.toml, line 9, column 1",
        ),
        ("z = 100.0", "", "no component is given\n   where: scene.toml, line 16, column 1"),
    ] {
        let found = refusal(from, to);
        assert!(found.contains(message), "{to}: {found}");
    }
}

/// Checks that St. Venant–Kirchhoff's law is rejected with a pressure field, because the pressure of the law differs
/// from −κ (J − 1).
#[test]
fn st_venant_kirchhoff_is_for_displacements_alone() {
    const LAW: &str = "law = \"mooney-rivlin\"\ndensity = 1e3\nc10 = 1e4\nc01 = 2e2";
    const OTHER: &str = "law = \"st-venant-kirchhoff\"\ndensity = 1e3\nfirst_lame_parameter = 1e5\nshear_modulus = 1e4";
    assert!(BLOCK.contains(LAW));
    let text = BLOCK.replace(LAW, OTHER);
    let found = refusal_of(&text, Path::new(""));
    let expected = "the law st-venant-kirchhoff has a volumetric part other than -κ (J-1)";
    assert!(found.starts_with(expected), "{found}");
    let text =
        text.replace("bulk_modulus = 1e5", "bulk_modulus = 1e5\nformulation = \"displacement\"");
    assert_eq!(refusal_of(&text, Path::new("")), "accepted");
}

/// Regression: the scene was rejected with an error about the pattern of a matrix and the number of an unknown.
#[test]
fn an_incompressible_body_that_is_held_everywhere_is_refused() {
    let text = BLOCK
        .replace("bulk_modulus = 1e5", "bulk_modulus = inf")
        .replace("[[fixed]]\ngroup = \"left\"", "[[fixed]]\ngroup = \"body\"");
    let found = refusal_of(&text, Path::new(""));
    let expected =
        "all nodes are fixed: no displacement can balance the pressures\n   where: scene.toml";
    assert!(found.contains(expected), "{found}");
}

/// Checks that both ends of a spindle are rejected, since they do not enclose a volume.
#[test]
fn a_volume_in_separate_pieces_is_refused() {
    let block = "type = \"box\"\nsize = [2.0, 1.0, 1.0]\ncells = [2, 1, 1]";
    let text = BLOCK
        .replace(block, "type = \"muscle3d\"\ncells = [10, 2, 2]")
        .replace("\"left\"", "\"fixed\"")
        .replace("\"right\"", "\"load\"")
        .replace("[2.0, 0.5, 0.5]", "[0.0, 0.0, 0.0]");
    let accepted = refusal_of(&text, Path::new(""));
    assert_eq!(accepted, "accepted");
    let text = text.replace("\"reaction\"", "\"volume\"");
    let found = refusal_of(&text, Path::new(""));
    let expected = "group \"fixed\" has 2 disconnected pieces";
    assert!(found.starts_with(expected), "{found}");
    assert!(found.contains("line 25"), "{found}");
}

/// Regression: a value beyond the header, such as the decimals after a comma, and a second column of the same name were
/// ignored.
#[test]
fn a_table_is_refused_with_its_line_or_column() {
    let folder = tempfile::tempdir().unwrap();
    let load = "z = { type = \"table\", file = \"load.csv\", column = \"force\" }";
    let text = BLOCK.replace("z = 100.0", load);
    for (table, place) in [
        ("t,force\n0,1\n0.5,nan\n1,2\n", "line 3"),
        ("t,force\n\n0,1\n0.5,2\n0.5,3\n", "line 5"),
        ("t,force\n0,1\n0.5,1,5\n1,2\n", "line 3"),
        ("t,force,force\n0,1,2\n1,2,3\n", "`force`"),
    ] {
        std::fs::write(folder.path().join("load.csv"), table).unwrap();
        let found = refusal_of(&text, folder.path());
        assert!(found.contains("load.csv") && found.contains(place), "{found}");
    }
    std::fs::write(folder.path().join("load.csv"), "t,force\n0,1\n1,2\n").unwrap();
    assert_eq!(refusal_of(&text, folder.path()), "accepted");
}

#[test]
fn missing_and_invalid_fiber_directions_are_rejected() {
    const LAW: &str = "law = \"mooney-rivlin\"\ndensity = 1e3\nc10 = 1e4\nc01 = 2e2";
    let guccione = |directions: &str| {
        let law = "law = \"guccione\"\ndensity = 1e3\nc = 2e3\nb_f = 8.0\nb_t = 2.0\nb_fs = 4.0";
        refusal(LAW, &format!("{law}\n{directions}"))
    };
    assert_eq!(guccione("fiber = [1, 0, 0]"), "accepted");
    for (directions, message) in [
        ("", "the law guccione needs the direction of its fibers"),
        ("fiber = [0, 0, 0]", "a direction cannot be zero"),
        ("fiber = [1, 0]", "a direction in space has three components"),
        ("fiber = \"f0\"", "the mesh has no nodal field `f0`"),
        ("sheet = [0, 1, 0]", "needs the direction of its fibers"),
        ("fiber = [1, 0, 0]\nsheet = [-2, 0, 0]", "the sheets are parallel to the fibers"),
        ("fiber = [1, 0, 0]\nsheet = \"s0\"", "`fiber` and `sheet` are of different kinds"),
    ] {
        let found = guccione(directions);
        assert!(found.contains(message), "{directions}: {found}");
    }
    let heart = "law = \"holzapfel-ogden\"\ndensity = 1e3\na = 59\nb = 8.023\na_f = 18472\n\
                 b_f = 16.026\na_s = 2481\nb_s = 11.12\na_fs = 216\nb_fs = 11.436\nfiber = [1, 0, 0]";
    let without = refusal(LAW, heart);
    assert!(without.contains("sheet"), "{without}");
    let step = format!("{heart}\nsheet = [0, 1, 0]\nk = inf");
    assert_eq!(refusal(LAW, &step), "accepted");
    let text = BLOCK.replace(LAW, &step);
    let scene = Scene::build("scene.toml", &text, &[], Path::new("")).unwrap();
    let echo = serde_json::to_value(scene.file()).unwrap();
    assert_eq!(echo["material"][0]["k"], "inf");
}

/// Returns a mesh file of two tetrahedra on one face, with fibers at their vertices. The `line` of the file is replaced
/// by `to`.
fn mesh_file(line: &str, to: &str) -> String {
    let text = "\
$MeshFormat\n4.1 0 8\n$EndMeshFormat\n\
$PhysicalNames\n2\n2 1 \"left\"\n3 2 \"body\"\n$EndPhysicalNames\n\
$Entities\n0 0 1 1\n1 0 0 0 1 1 1 1 1 0\n1 0 0 0 1 1 1 1 2 0\n$EndEntities\n\
$Nodes\n1 5 1 5\n3 1 0 5\n1\n2\n3\n4\n5\n\
0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 1 1\n$EndNodes\n\
$Elements\n2 3 1 3\n2 1 2 1\n1 1 2 3\n3 1 4 2\n2 1 2 3 4\n3 2 3 4 5\n$EndElements\n\
$NodeData\n1\n\"f0\"\n1\n0\n3\n0\n3\n5\n1 1 0 0\n2 1 0 0\n3 1 0 0\n4 1 0 0\n5 1 0 0\n$EndNodeData\n";
    assert!(text.contains(line), "{line}");
    text.replacen(line, to, 1)
}

#[test]
fn mesh_files_that_are_wrong_in_space_are_refused_with_their_place() {
    let text = BLOCK
        .replace("type = \"box\"", "type = \"file\"\npath = \"own.msh\"")
        .replace("size = [2.0, 1.0, 1.0]\ncells = [2, 1, 1]", "")
        .replace("law = \"mooney", "fiber = \"f0\"\nlaw = \"mooney")
        .replace("group = \"right\"", "group = \"left\"")
        .replace("at = [2.0, 0.5, 0.5]", "at = [0.1, 0.1, 0.1]");
    let folder = tempfile::tempdir().unwrap();
    let found = |line: &str, to: &str| {
        fs::write(folder.path().join("own.msh"), mesh_file(line, to)).unwrap();
        refusal_of(&text, folder.path())
    };
    assert_eq!(found("", ""), "accepted");
    for (line, to, message) in [
        // The field lacks a node, is zero at a node, or has another number of components.
        (
            "3\n5\n1 1 0 0\n",
            "3\n4\n",
            "`f0` is missing or not a number at the vertex [0.0, 0.0, 0.0]",
        ),
        ("4 1 0 0\n", "4 0 0 0\n", "`f0` is zero at the vertex [0.0, 0.0, 1.0]"),
        ("4 1 0 0\n", "4 nan 0 0\n", "not a number at the vertex [0.0, 0.0, 1.0]"),
        ("\"f0\"", "\"f1\"", "the mesh has no nodal field `f0`"),
        // The triangle is not a face of a tetrahedron.
        ("1 1 2 3\n", "1 1 2 5\n", "is not a face of any tetrahedron"),
        // Four vertices are coplanar, or two tetrahedra are on the same side of a common face.
        ("1 1 1\n$EndNodes", "0 0.5 0.5\n$EndNodes", "is degenerate"),
        (
            "1 1 1\n$EndNodes",
            "0.1 0.1 0.1\n$EndNodes",
            "lie on the same side of the face they share",
        ),
    ] {
        let message_found = found(line, to);
        assert!(message_found.contains(message), "{to}: {message_found}");
    }
}

/// Checks the note on fibers that turn by more than 120° within an element.
#[test]
fn unresolved_fibers_are_reported() {
    let folder = tempfile::tempdir().unwrap();
    let text = BLOCK
        .replace("type = \"box\"", "type = \"file\"\npath = \"own.msh\"")
        .replace("size = [2.0, 1.0, 1.0]\ncells = [2, 1, 1]", "")
        .replace("law = \"mooney", "fiber = \"f0\"\nlaw = \"mooney")
        .replace("group = \"right\"", "group = \"left\"")
        .replace("at = [2.0, 0.5, 0.5]", "at = [0.1, 0.1, 0.1]");
    let notes = |fiber: &str| {
        let file = mesh_file("1 1 0 0\n2 1", &format!("1 {fiber}\n2 1"));
        fs::write(folder.path().join("own.msh"), file).unwrap();
        let scene = Scene::build("scene.toml", &text, &[], folder.path()).unwrap();
        scene.notes().join("; ")
    };
    assert!(!notes("-0.4 1 0").contains("120°"));
    let reported = notes("-1.8 1 0");
    assert!(reported.contains("in 1 of 2 elements"), "{reported}");
}

/// Checks that mirrored tetrahedra are reoriented with a note.
#[test]
fn inverted_tetrahedra_are_turned_with_a_note() {
    let folder = tempfile::tempdir().unwrap();
    let text = BLOCK
        .replace("type = \"box\"", "type = \"file\"\npath = \"own.msh\"")
        .replace("size = [2.0, 1.0, 1.0]\ncells = [2, 1, 1]", "")
        .replace("group = \"right\"", "group = \"left\"")
        .replace("at = [2.0, 0.5, 0.5]", "at = [0.1, 0.1, 0.1]");
    fs::write(folder.path().join("own.msh"), mesh_file("2 1 2 3 4\n", "2 2 1 3 4\n")).unwrap();
    let scene = Scene::build("scene.toml", &text, &[], folder.path()).unwrap();
    let notes = scene.notes();
    assert!(notes.iter().any(|note| note.contains("reoriented")), "{notes:?}");
}
