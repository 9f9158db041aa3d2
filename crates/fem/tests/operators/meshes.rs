//! Tests of reading and refining meshes and of locating points, with the mesh of the muscle and with invalid
//! files.

use std::collections::BTreeMap;
use std::sync::Arc;

use myovib_fem::element::TRIANGLE;
use myovib_fem::{DofMap, FemError, Group, Mesh, MshProblem, Solid, Space, generate};

use crate::common::{MUSCLE_LAW, muscle_mesh};

/// A unit square of two triangles with groups of all kinds, and a node that does not belong to a triangle.
const SQUARE: &str = "$MeshFormat
4.1 0 8
$EndMeshFormat
$PhysicalNames
3
0 7 \"corner\"
1 3 \"left side\"
2 5 \"body\"
$EndPhysicalNames
$Entities
1 1 1 0
1 0 0 0 1 7
4 0 0 0 0 1 0 1 -3 2 1 -4
1 0 0 0 1 1 0 1 5 1 4
$EndEntities
$Comments
anything may stand here
$EndComments
$Nodes
1 5 10 50
2 1 0 5
10
20
30
40
50
0 0 0
1 0 0
9 9 0
1 1 0
0 1 0
$EndNodes
$Elements
3 4 1 4
0 1 15 1
1 10
1 4 1 1
2 50 10
2 1 2 2
3 10 20 40
4 10 40 50
$EndElements
";

/// Returns the problem of an invalid file and the line of the problem.
fn problem(text: &str) -> (usize, MshProblem) {
    match Mesh::parse_msh(text, "square.msh") {
        Err(FemError::Msh { file, line, problem }) => {
            assert_eq!(file, "square.msh");
            (line, problem)
        }
        other => panic!("{other:?} instead of an invalid file"),
    }
}

/// Returns the problem, and its line, of the square with one part of the file replaced.
fn changed(from: &str, to: &str) -> (usize, MshProblem) {
    assert!(SQUARE.contains(from), "{from}");
    problem(&SQUARE.replacen(from, to, 1))
}

#[test]
fn a_square_is_read_with_its_groups() {
    let mesh = Mesh::parse_msh(SQUARE, "square.msh").unwrap();
    assert_eq!(mesh.points::<2>(), [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]);
    assert_eq!(*mesh.connectivity(), [[0, 1, 2], [0, 2, 3]]);
    assert_eq!(mesh.group("corner").unwrap(), &Group::Points(vec![0]));
    assert_eq!(mesh.group("left side").unwrap(), &Group::Edges(vec![[3, 0]]));
    assert_eq!(mesh.group("body").unwrap(), &Group::Elements(vec![0, 1]));
    let Err(FemError::UnknownGroup { name, known, .. }) = mesh.group("right") else {
        panic!("the group does not exist")
    };
    assert_eq!((&name[..], known.len()), ("right", 3));
    assert_eq!(known, ["body", "corner", "left side"]);
    assert_eq!(mesh, Mesh::parse_msh(SQUARE.replace('\n', "\r\n"), "dos").unwrap());
}

#[test]
fn unsupported_formats_are_rejected() {
    let old = MshProblem::Version("4.0".to_owned());
    assert_eq!(changed("4.1 0 8", "4.0 0 8"), (2, old));
    // The four bytes of the next line are not the number 1.
    assert_eq!(changed("4.1 0 8", "4.1 1 8"), (1, MshProblem::ByteOrder));
    assert_eq!(problem("solid cube"), (1, MshProblem::NotMsh));
    assert_eq!(problem(""), (0, MshProblem::NotMsh));
}

#[test]
fn invalid_entries_are_reported_with_their_line() {
    let expected =
        |expected, found: &str| MshProblem::Expected { expected, found: found.to_owned() };
    let duplicate = |what, tag: &str| MshProblem::Duplicate { what, tag: tag.to_owned() };
    let degenerate = MshProblem::DegenerateElement { tag: 3, measure: 0.0, shape: &TRIANGLE };
    for (from, to, line, problem) in [
        ("9 9 0", "9 nine 0", 29, expected("a coordinate", "nine")),
        ("9 9 0", "9 inf 0", 29, expected("a finite coordinate", "inf")),
        ("9 9 0", "9 9", 29, expected("a coordinate", "end of line")),
        ("1 1 0\n0 1 0", "1 1 1\n0 1 0", 30, MshProblem::NotPlane { tag: 40, z: 1.0 }),
        ("20\n30", "20\n20", 29, duplicate("node", "20")),
        ("1 10\n", "1 30\n", 36, MshProblem::UnusedNode(30)),
        ("3 10 20 40", "3 10 20 99", 40, MshProblem::UnknownNode(99)),
        ("3 10 20 40", "3 10 20 20", 40, degenerate),
        ("2 1 2 2\n", "2 1 3 2\n", 39, MshProblem::ElementType(3)),
        (
            "2 1 2 2\n",
            "1 1 2 2\n",
            39,
            expected(
                "an element type of the entity's dimension",
                "elements of dimension 2 in an entity of dimension 1",
            ),
        ),
        ("2 5 \"body\"", "2 5 body", 8, expected("a name in double quotes", "2 5 body")),
    ] {
        assert_eq!(changed(from, to), (line, problem));
    }
}

/// Regression: for a file without a physical surface, the error reported a node outside the body.
#[test]
fn a_file_without_elements_of_a_body_names_the_missing_group() {
    let file = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n1\n1 1 \"left\"\n$EndPhysicalNames\n\
                $Nodes\n2\n1 0 0 0\n2 0 1 0\n$EndNodes\n$Elements\n1\n1 1 2 1 1 1 2\n$EndElements\n";
    match Mesh::parse_msh(file, "line.msh").unwrap_err() {
        FemError::Msh { problem, .. } => {
            assert_eq!(problem, MshProblem::NoElements { meshed: "curves" });
        }
        other => panic!("{other}"),
    }
}

/// Regression: meshes with rounding errors in z, or with unused nodes off the plane, were rejected because they
/// were not plane.
#[test]
fn a_plane_mesh_may_have_rounded_and_unused_nodes_off_its_plane() {
    let plane = Mesh::parse_msh(SQUARE, "square.msh").unwrap();
    for (from, to) in [("9 9 0", "9 9 1"), ("1 1 0\n0 1 0", "1 1 -1e-17\n0 1 0")] {
        let mesh = Mesh::parse_msh(SQUARE.replacen(from, to, 1), "square.msh").unwrap();
        assert_eq!(mesh.points::<2>(), plane.points::<2>());
    }
}

/// Returns the square with one partition for each triangle, so that other entities contain the elements. If
/// `ghost` is true, the file also has a copy of the second triangle, like the file of a single partition.
fn partitioned(ghost: bool) -> String {
    let entities = "$PartitionedEntities
2
1
9 1
1 1 2 0
11 0 1 1 1 0 0 0 1 7
14 1 4 1 2 0 0 0 0 1 0 1 -3 2 1 -4
21 2 1 1 1 0 0 0 1 1 0 1 5 1 4
22 2 1 1 2 0 0 0 1 1 0 1 5 1 4
$EndPartitionedEntities
$Comments";
    let copy = if ghost { "2 9 2 1\n4 10 40 50\n" } else { "" };
    let n_blocks = if ghost { 5 } else { 4 };
    let elements = format!(
        "$Elements
{n_blocks} 4 1 4
0 11 15 1
1 10
1 14 1 1
2 50 10
2 21 2 1
3 10 20 40
{copy}2 22 2 1
4 10 40 50
$EndElements
$GhostElements
1
4 2 1 1
$EndGhostElements
"
    );
    let (before, _) = SQUARE.split_once("$Elements").expect("a section");
    before.replacen("$Comments", entities, 1) + &elements
}

/// Regression: a partitioned mesh had no groups, and copied elements were read twice.
#[test]
fn partitions_are_joined_without_their_copies() {
    let whole = Mesh::parse_msh(SQUARE, "square.msh").unwrap();
    for ghost in [false, true] {
        let text = partitioned(ghost);
        assert_eq!(Mesh::parse_msh(&text, "parts.msh").unwrap(), whole);
    }
    let text = partitioned(true).replacen("21 2 1 1 1", "21 2 1 one", 1);
    let (line, problem) = problem(&text);
    let is_expected = matches!(problem, MshProblem::Expected { .. });
    assert!(is_expected, "{line}: {problem}");
}

/// Regression: for a mesh of the surfaces of a volume, the message was "not plane"; for a mesh of the curves, it
/// was "no triangles".
#[test]
fn volumes_without_tetrahedra_are_named() {
    let with_volume = SQUARE.replacen("1 1 1 0\n", "1 1 1 1\n", 1).replacen(
        "$EndEntities",
        "1 0 0 0 1 1 1 0 1 1\n$EndEntities",
        1,
    );
    assert!(Mesh::parse_msh(&with_volume, "square.msh").is_ok());
    let not_meshed = |dimension, meshed| MshProblem::NotMeshed { dimension, meshed };
    let surfaces = with_volume.replacen("1 1 0\n0 1 0", "1 1 1\n0 1 0", 1);
    assert_eq!(problem(&surfaces), (31, not_meshed(2, "surfaces")));
    let curves = with_volume.replacen("3 4 1 4", "2 2 1 2", 1).replacen(
        "2 1 2 2\n3 10 20 40\n4 10 40 50\n",
        "",
        1,
    );
    assert_eq!(problem(&curves), (1, not_meshed(1, "curves")));
}

#[test]
fn excessive_counts_are_errors_without_allocation() {
    let huge = "99999999999999999";
    for (from, to, line) in [
        ("2 1 0 5", format!("2 1 0 {huge}"), 32),
        ("3 4 1 4", format!("{huge} 4 1 4"), 42),
        ("1 1 1 0", format!("{huge} 1 1 0"), 15),
        ("1 0 0 0 1 7", format!("1 0 0 0 {huge} 7"), 12),
    ] {
        let (found, problem) = changed(from, &to);
        let is_expected = matches!(problem, MshProblem::Expected { .. });
        assert!(found == line && is_expected, "{found}: {problem}");
    }
}

#[test]
fn every_truncation_is_an_error() {
    for end in 0..SQUARE.trim_end().len() {
        if SQUARE.is_char_boundary(end) {
            problem(&SQUARE[..end]);
        }
    }
}

#[test]
fn corrupt_words_do_not_panic() {
    let words: Vec<&str> = SQUARE.split_inclusive(char::is_whitespace).collect();
    for index in 0..words.len() {
        for junk in ["-1", "0", "1e300", "NaN", "$", "\"", "18446744073709551616", ""] {
            let mut damaged = words.clone();
            let replaced = format!("{junk}{}", &words[index][words[index].trim_end().len()..]);
            damaged[index] = &replaced;
            // Either result is valid; the parser must not panic.
            let _ = Mesh::parse_msh(damaged.concat(), "damaged");
        }
    }
}

/// Returns a file that Gmsh wrote for a block, with two groups on the same face and a nodal field.
fn block(format: &str) -> Vec<u8> {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data");
    std::fs::read(format!("{folder}/block-{format}.msh")).unwrap()
}

#[test]
fn versions_and_encodings_of_gmsh_give_the_same_mesh() {
    let mesh = Mesh::parse_msh(block("4.1-ascii"), "block").unwrap();
    let names: Vec<&String> = mesh.groups().keys().collect();
    assert_eq!(names, ["body", "ends", "left", "right"]);
    // The error is the rounding of a sum of about 100 volumes of a block with the size 2 x 1 x 1.
    assert!((mesh.measure() - 2.0).abs() < 1e-13);
    let heights = &mesh.field("height").unwrap().values;
    let z: Vec<f64> = mesh.points::<3>().iter().map(|point| point[2]).collect();
    assert_eq!(*heights, z);
    for format in ["4.1-binary", "2.2-ascii", "2.2-binary"] {
        let other = Mesh::parse_msh(block(format), "block").unwrap();
        assert_eq!(other.groups().keys().collect::<Vec<_>>(), names, "{format}");
        for (name, group) in mesh.groups() {
            let members = |group: &Group| match group {
                Group::Faces(faces) => faces.len(),
                Group::Elements(elements) => elements.len(),
                _ => 0,
            };
            assert_eq!(members(&other.groups()[name]), members(group), "{format}: {name}");
        }
        assert_eq!(other.connectivity::<4>(), mesh.connectivity::<4>(), "{format}");
        // Gmsh writes 16 digits in text files, and coordinates are at most 2.
        let near = |a: &[f64], b: &[f64]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-15);
        assert!(near(other.coordinates(), mesh.coordinates()), "{format}");
        assert!(near(&other.field("height").unwrap().values, heights), "{format}");
    }
}

/// Truncated and modified files lead to an error or a mesh, but not to a panic or a large allocation.
#[test]
fn damaged_binary_files_are_rejected() {
    for format in ["4.1-binary", "2.2-binary"] {
        let content = block(format);
        for end in (0..content.len()).step_by(97) {
            assert!(Mesh::parse_msh(&content[..end], "block").is_err(), "{format}: {end}");
        }
        for at in (0..content.len()).step_by(7) {
            let mut damaged = content.clone();
            damaged[at] = 255 - damaged[at];
            let _ = Mesh::parse_msh(&damaged, "block");
        }
    }
}

#[test]
fn groups_are_selected_by_place_and_direction() {
    let mesh = Mesh::parse_msh(SQUARE, "square.msh").unwrap();
    assert_eq!(mesh.points_where(|x| x[0] == 0.0), Group::Points(vec![0, 3]));
    assert_eq!(mesh.elements_where(|x| x[0] + x[1] >= 0.0), Group::Elements(vec![0, 1]));
    assert_eq!(mesh.elements_where(|x| x != [1.0, 0.0]), Group::Elements(vec![1]));
    let sides =
        [([-1.0, 0.0], [0, 3]), ([1.0, 0.0], [1, 2]), ([0.0, -1.0], [0, 1]), ([0.0, 1.0], [2, 3])];
    for (direction, edge) in sides {
        let toward = mesh.boundary_where(|_, normal| normal == direction);
        assert_eq!(toward, Group::Edges(vec![edge]));
    }
    let block = Mesh::parse_msh(block("4.1-binary"), "block").unwrap();
    let Group::Faces(faces) = block.boundary_where(|_, normal| normal[0] < -0.99) else {
        panic!("a mesh in space has faces")
    };
    assert_eq!(faces.len(), block.facets("left").unwrap().len());
}

#[test]
fn a_scaled_mesh_has_its_midside_nodes_scaled() {
    let mesh = Mesh::parse_msh(SQUARE, "square.msh").unwrap();
    let scaled = mesh.clone().scaled(0.5);
    assert_eq!(scaled.measure(), 0.25);
    assert_eq!(scaled.groups(), mesh.groups());
}

#[test]
fn missing_files_are_named() {
    let missing = std::path::Path::new("no/such/file.msh");
    let error = Mesh::read_msh(missing).unwrap_err();
    assert!(matches!(error, FemError::Io { path, .. } if path == missing));
}

/// Regression: the children of a curved element were straight. Refinement must preserve the shape of the body.
#[test]
fn refinement_preserves_curved_bodies() {
    let square = generate::rectangle([0.0; 2], [1.5, 1.0], [1, 1]).unwrap();
    let square = square.with_midside_nodes(BTreeMap::from([([0, 1], [0.8, -0.1])])).unwrap();
    let block = generate::block([0.0; 3], [1.5, 1.0, 0.8], [1, 1, 1]).unwrap();
    let block = block.with_midside_nodes(BTreeMap::from([([0, 3], [0.78, 0.53, -0.05])]));
    for coarse in [square, block.unwrap()] {
        let volume = |mesh: &Mesh| {
            let space = Arc::new(Space::taylor_hood(mesh));
            let curved = (0..space.n_elements()).filter(|&e| space.is_curved(e)).count();
            let dofs = DofMap::clamped(&space, &[]).unwrap();
            let solid = Solid::new(space, dofs, vec![MUSCLE_LAW; mesh.n_elements()], 1.0).unwrap();
            (curved, solid.volume())
        };
        let (n_curved, coarse_volume) = volume(&coarse);
        let (n_children, fine_volume) = volume(&coarse.refined().unwrap());
        // The children along a curved edge share this edge. Inner children follow the map of their parent.
        assert!(n_children > 2 * n_curved, "{n_children} of {n_curved}");
        // The error is a few dozen roundings. With straight children, a quarter of the curved part would be
        // missing, which is a few percent.
        assert!((fine_volume / coarse_volume - 1.0).abs() < 1e-14, "{fine_volume} {coarse_volume}");
    }
}

#[test]
fn refinement_preserves_area_groups_and_conformity() {
    let coarse = muscle_mesh();
    let fine = coarse.refined().unwrap();
    assert_eq!(fine.n_elements(), 4 * 311);
    // The fine mesh has one vertex per node of the coarse quadratic space, because shared edges are split once.
    assert_eq!(fine.n_points(), 680);
    assert!((fine.measure() / coarse.measure() - 1.0).abs() < 1e-13);
    for child in 0..fine.n_elements() {
        let ratio = fine.measure_of(child) / coarse.measure_of(child / 4);
        // The error is the rounding of coordinates of 0.1 m, relative to elements of 5 mm.
        assert!((4.0 * ratio - 1.0).abs() < 1e-12, "{child}: {ratio}");
    }
    for name in ["fixed", "load"] {
        assert_eq!(fine.edges(name).unwrap().len(), 2 * coarse.edges(name).unwrap().len());
    }
    let (a, b) = (Space::taylor_hood(&coarse), Space::taylor_hood(&fine));
    assert_eq!(b.nodes_of("fixed").unwrap().len(), 2 * a.nodes_of("fixed").unwrap().len() - 2);
    assert_eq!(fine.group("origin").unwrap(), coarse.group("origin").unwrap());
    assert_eq!(b.nodes_of("muscle").unwrap().len(), b.n_nodes());
}

#[test]
fn located_points_interpolate_quadratics_exactly() {
    let space = Space::taylor_hood(&muscle_mesh());
    let f = |[x, y]: [f64; 2]| [3.0 * x * x - x * y, y * y + 2.0 * x - 1.0];
    let u: Vec<f64> = space.node_points().iter().flat_map(|&x| f(x)).collect();
    for point in [[0.0, 0.0], [0.03, -0.011], [-0.0999, 0.0119], [0.1, 0.012], [-0.05, 0.003]] {
        let at = space.locate(point).expect("inside");
        assert!((at.barycentric.iter().sum::<f64>() - 1.0).abs() < 1e-14);
        let found: [f64; 2] = space.displacement_at(&u, &at);
        for (found, exact) in found.iter().zip(f(point)) {
            assert!((found - exact).abs() < 1e-14);
        }
    }
    assert_eq!(space.locate([0.0, 0.031]), None);
    assert_eq!(space.locate([0.11, 0.0]), None);
    assert_eq!(space.locate([f64::NAN, 0.0]), None);
}
