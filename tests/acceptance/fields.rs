//! Tests of files for ParaView: they are valid XML and have the structure that the VTK format requires.

use std::fs;
use std::path::Path;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use roxmltree::{Document, Node};
use serde_json::Value;

use crate::results::run_scene;

/// Cell type of the VTK format.
struct Cells {
    /// Name of the cells in `run.json`.
    word: &'static str,
    /// Number of the cell type in VTK.
    number: f64,
    /// Ends of the edges, in the order in which the mid-edge nodes are numbered.
    edges: &'static [[usize; 2]],
}

const QUADRATIC_TRIANGLES: Cells =
    Cells { word: "triangles", number: 22.0, edges: &[[0, 1], [1, 2], [2, 0]] };
const QUADRATIC_TETRAHEDRA: Cells = Cells {
    word: "tetrahedra",
    number: 24.0,
    edges: &[[0, 1], [1, 2], [2, 0], [0, 3], [1, 3], [2, 3]],
};

fn child<'a, 'x>(node: Node<'a, 'x>, name: &str) -> Node<'a, 'x> {
    let mut found = node.children().filter(|child| child.has_tag_name(name));
    let first = found.next().unwrap_or_else(|| panic!("no <{name}>"));
    assert!(found.next().is_none(), "<{name}> twice");
    first
}

/// Returns the values of the array `name`. The length of a row is the number of components.
fn array(parent: Node<'_, '_>, name: &str) -> Vec<Vec<f64>> {
    let mut arrays = parent.children().filter(Node::is_element);
    let array = arrays
        .find(|array| array.attribute("Name") == Some(name))
        .unwrap_or_else(|| panic!("no array `{name}`"));
    assert!(array.has_tag_name("DataArray"));
    assert_eq!(array.attribute("format"), Some("binary"));
    let width = array.attribute("NumberOfComponents").unwrap_or("1");
    let text = array.text().unwrap_or_default().trim();
    let bytes = STANDARD.decode(text).expect("base64");
    let (length, content) = bytes.split_at(8);
    let length = u64::from_le_bytes(length.try_into().expect("eight bytes"));
    assert_eq!(length, content.len() as u64, "{name}");
    let number = |bytes: &[u8; 8]| match array.attribute("type") {
        Some("Float64") => f64::from_le_bytes(*bytes),
        Some("Int64") => i64::from_le_bytes(*bytes) as f64,
        kind => panic!("{name} of type {kind:?}"),
    };
    let numbers: Vec<f64> = content.as_chunks().0.iter().map(number).collect();
    assert!(numbers.iter().all(|value| value.is_finite()), "{name}");
    let rows = numbers.chunks(width.parse().expect("a width"));
    rows.map(<[f64]>::to_vec).collect()
}

fn whole_numbers(parent: Node<'_, '_>, name: &str) -> Vec<usize> {
    let numbers = array(parent, name).concat();
    assert!(numbers.iter().all(|n| n.fract() == 0.0 && *n >= 0.0));
    numbers.into_iter().map(|n| n as usize).collect()
}

/// Returns the signed measure of the simplex with these corners, multiplied by 2 in 2D and by 6 in 3D.
fn determinant(corners: &[&Vec<f64>]) -> f64 {
    let edge = |i: usize| [0, 1, 2].map(|axis| corners[i][axis] - corners[0][axis]);
    let (a, b) = (edge(1), edge(2));
    let c = if corners.len() == 4 { edge(3) } else { [0.0, 0.0, 1.0] };
    let cross = [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
    (0..3).map(|axis| cross[axis] * c[axis]).sum()
}

/// Checks a file against the mesh size in `run.json`. `arrays` lists the point arrays and their numbers of components.
fn check(path: &Path, mesh: &Value, kind: &Cells, arrays: &[(&str, usize)]) {
    let text = fs::read_to_string(path).expect("the file is there");
    let document = Document::parse(&text).expect("XML");
    let root = document.root_element();
    assert!(root.has_tag_name("VTKFile"));
    assert_eq!(root.attribute("type"), Some("UnstructuredGrid"));
    let piece = child(child(root, "UnstructuredGrid"), "Piece");
    let count = |name| -> usize {
        let count = piece.attribute(name).expect("a count");
        count.parse().expect("a whole number")
    };
    let (n_points, n_cells) = (count("NumberOfPoints"), count("NumberOfCells"));
    assert_eq!(mesh["nodes"], n_points);
    assert_eq!(mesh[kind.word], n_cells);

    let points = array(child(piece, "Points"), "points");
    assert_eq!(points.len(), n_points);
    let plane = kind.edges.len() == 3;
    assert!(points.iter().all(|point| point.len() == 3));
    assert!(!plane || points.iter().all(|point| point[2] == 0.0));
    let cells = child(piece, "Cells");
    let connectivity = whole_numbers(cells, "connectivity");
    let n_corners = if plane { 3 } else { 4 };
    let n_nodes = n_corners + kind.edges.len();
    assert_eq!(connectivity.len(), n_nodes * n_cells);
    let ends: Vec<usize> = (1..=n_cells).map(|cell| n_nodes * cell).collect();
    assert_eq!(whole_numbers(cells, "offsets"), ends);
    let types = array(cells, "types").concat();
    assert_eq!(types, vec![kind.number; n_cells]);
    let mut used = vec![false; n_points];
    for nodes in connectivity.chunks(n_nodes) {
        let corners: Vec<&Vec<f64>> = nodes[..n_corners].iter().map(|&n| &points[n]).collect();
        assert!(determinant(&corners) > 0.0, "counter-clockwise");
        for ([from, to], &middle) in kind.edges.iter().zip(&nodes[n_corners..]) {
            for (axis, middle) in points[middle].iter().enumerate() {
                let mean = 0.5 * (corners[*from][axis] + corners[*to][axis]);
                // The tolerance is the rounding error of lengths up to 0.1.
                assert!((mean - middle).abs() < 1e-16, "{mean} {middle}");
            }
        }
        nodes.iter().for_each(|&node| used[node] = true);
    }
    assert!(used.iter().all(|used| *used), "a point without a triangle");

    let data = child(piece, "PointData");
    for &(name, width) in arrays {
        let rows = array(data, name);
        assert_eq!(rows.len(), n_points, "{name}");
        assert!(rows.iter().all(|row| row.len() == width), "{name}");
    }
    let flat = array(data, "u").iter().all(|u| u[2] == 0.0);
    assert_eq!(flat, plane, "plane strain");
    assert!(array(data, "J").iter().all(|j| (j[0] - 1.0).abs() < 0.1), "volume ratios");
    let regions = whole_numbers(child(piece, "CellData"), "region");
    assert_eq!(regions, vec![0; n_cells]);
}

#[test]
fn fields_are_the_grids_that_paraview_reads() {
    let folder = tempfile::tempdir().unwrap();
    let sets = [
        "time.end=0.5",
        "fields.interval=0.25",
        "fields.quantities=[\"u\", \"v\", \"p\", \"J\", \"von-mises\"]",
    ];
    let summary = run_scene(folder.path(), "init", "out", &sets);
    let out = folder.path().join("out");
    let text = fs::read_to_string(out.join("fields.pvd")).unwrap();
    let document = Document::parse(&text).expect("XML");
    let root = document.root_element();
    assert_eq!(root.attribute("type"), Some("Collection"));
    let sets = child(root, "Collection");
    let sets: Vec<Node<'_, '_>> = sets.children().filter(Node::is_element).collect();
    let times: Vec<&str> = sets.iter().map(|set| set.attribute("timestep").unwrap()).collect();
    assert_eq!(times, ["0", "0.25", "0.5"]);
    for set in sets {
        let arrays = [("u", 3), ("v", 3), ("p", 1), ("J", 1), ("von_mises", 1)];
        let file = out.join(set.attribute("file").unwrap());
        check(&file, &summary["mesh"], &QUADRATIC_TRIANGLES, &arrays);
    }
}

/// Regression: the report labeled the states on a loading path with times, although their labels may be load factors.
#[test]
fn the_states_of_a_path_are_shown_by_their_load_factors() {
    let folder = tempfile::tempdir().unwrap();
    let sets = ["static.loads=[0.5, 1.0, 0.75]", "fields.interval=1"];
    run_scene(folder.path(), "cook-static", "out", &sets);
    let report = fs::read_to_string(folder.path().join("out/report.html")).unwrap();
    for load in ["0", "0.5", "1", "0.75"] {
        assert!(report.contains(&format!("\"load factor {load}\"")), "{load}");
    }
}

#[test]
fn fields_of_a_body_in_space_are_quadratic_tetrahedra_with_stress_and_fibers() {
    let folder = tempfile::tempdir().unwrap();
    let sets = [
        "mesh.cells=[4,1,1]",
        "pressure[0].value=1.0",
        "fields.quantities=[\"u\", \"p\", \"J\", \"strain\", \"stress\", \"principal-stress\"]",
    ];
    let summary = run_scene(folder.path(), "land1", "out", &sets);
    let arrays =
        [("u", 3), ("p", 1), ("J", 1), ("strain", 6), ("stress", 6), ("principal_stress", 3)];
    let file = folder.path().join("out/fields_00000.vtu");
    check(&file, &summary["mesh"], &QUADRATIC_TETRAHEDRA, &arrays);

    let text = fs::read_to_string(file).unwrap();
    let document = Document::parse(&text).unwrap();
    let piece = child(child(document.root_element(), "UnstructuredGrid"), "Piece");
    let fibers = array(child(piece, "CellData"), "fiber");
    assert!(fibers.iter().all(|fiber| fiber[..] == [1.0, 0.0, 0.0]));
    let data = child(piece, "PointData");
    let names = ["xx", "yy", "zz", "xy", "yz", "xz"].iter().enumerate();
    let names: String = names.map(|(i, name)| format!(" ComponentName{i}=\"{name}\"")).collect();
    for array in ["stress", "strain"] {
        let of_points = data.children().filter(|child| child.attribute("Name") == Some(array));
        let range = of_points.map(|child| child.range()).next().unwrap();
        assert!(text[range].contains(&names), "the components of {array} have names");
    }
    let (stress, principal) = (array(data, "stress"), array(data, "principal_stress"));
    for (stress, principal) in stress.iter().zip(&principal) {
        assert!(principal[0] >= principal[1] && principal[1] >= principal[2]);
        // The average over the elements at a point preserves the traces of both tensors.
        let trace = stress[0] + stress[1] + stress[2];
        let scale: f64 = stress.iter().map(|s| s.abs()).sum();
        assert!((trace - principal.iter().sum::<f64>()).abs() <= 1e-12 * scale);
    }
}

/// Checks the moving spindle. The files contain its velocity and a fiber direction that varies in space.
#[test]
fn fields_of_a_moving_body_in_space_have_its_velocity_and_its_own_fibers() {
    let folder = tempfile::tempdir().unwrap();
    let sets = [
        "mesh.cells=[10,2,2]",
        "time.end=0.5",
        "fields={interval=0.25, quantities=[\"u\", \"v\"]}",
    ];
    run_scene(folder.path(), "muscle3d", "out", &sets);
    let text = fs::read_to_string(folder.path().join("out/fields_00002.vtu")).unwrap();
    let document = Document::parse(&text).unwrap();
    let piece = child(child(document.root_element(), "UnstructuredGrid"), "Piece");
    let velocity = array(child(piece, "PointData"), "v");
    assert!(velocity.iter().flatten().any(|v| v.abs() > 1e-4));
    let fibers = array(child(piece, "CellData"), "fiber");
    let length = |fiber: &Vec<f64>| fiber.iter().map(|x| x * x).sum::<f64>().sqrt();
    let fibers: Vec<_> = fibers.iter().filter(|fiber| length(fiber) > 0.0).collect();
    // The tolerance is the rounding error of a normalized vector.
    assert!(fibers.iter().all(|fiber| (length(fiber) - 1.0).abs() < 1e-15));
    assert!(fibers.iter().any(|fiber| fiber[..] != fibers[0][..]));
}

/// Checks two layers under homogeneous stretch. All constants of the upper layer are twice the constants of the lower
/// layer. The homogeneous strain is exact, so each stress component above the interface is twice the component below
/// it.
#[test]
fn stress_at_the_interface_of_materials_is_that_of_each_and_not_their_mean() {
    let folder = tempfile::tempdir().unwrap();
    let material = |group: &str, factor: f64| {
        let [c10, c01, kappa] = [1e4, 2e2, 5e4].map(|constant| factor * constant);
        format!(
            "[[material]]\ngroup = \"{group}\"\nlaw = \"mooney-rivlin\"\ndensity = 1e3\n\
             c10 = {c10}\nc01 = {c01}\nbulk_modulus = {kappa}\n"
        )
    };
    // The upper half is described as the region above a very flat ellipse.
    let scene = format!(
        "analysis = \"static\"\n\
         [mesh]\ntype = \"rectangle\"\nwidth = 2.0\nheight = 2.0\ncells = [2, 4]\n\
         [[region]]\nname = \"upper\"\ncenter = [1.0, 101.0]\nradii = [1e4, 100.0]\n\
         [solid]\nbulk_modulus = 5e4\nformulation = \"displacement\"\n{}{}\
         [[fixed]]\ngroup = \"left\"\ncomponents = [\"x\"]\n\
         [[fixed]]\ngroup = \"bottom\"\ncomponents = [\"y\"]\n\
         [[prescribed_displacement]]\ngroup = \"right\"\nx = 0.2\n\
         [fields]\ninterval = 1.0\nquantities = [\"stress\", \"strain\", \"principal-strain\"]\n",
        material("body", 1.0),
        material("upper", 2.0)
    );
    fs::write(folder.path().join("layers.toml"), scene).unwrap();
    run_scene(folder.path(), "layers.toml", "out", &[]);
    let text = fs::read_to_string(folder.path().join("out/fields_00000.vtu")).unwrap();
    let document = Document::parse(&text).unwrap();
    let piece = child(child(document.root_element(), "UnstructuredGrid"), "Piece");
    let data = child(piece, "PointData");
    let (stress, strain) = (array(data, "stress"), array(data, "strain"));
    let principal = array(data, "principal_strain");
    let points = array(child(piece, "Points"), "points");
    let cells = whole_numbers(child(piece, "Cells"), "connectivity");
    let regions = whole_numbers(child(piece, "CellData"), "region");

    let mut at_interface = [0; 2];
    let soft = stress[0].clone();
    assert!(soft[0] > 1e3, "{soft:?}");
    for (nodes, region) in cells.chunks(6).zip(regions) {
        for &node in nodes {
            at_interface[region] += usize::from(points[node][1] == 1.0);
            for (found, expected) in stress[node].iter().zip(&soft) {
                let expected = (1 + region) as f64 * expected;
                // The bound is Newton's tolerance for stresses of about 1e4 Pa.
                assert!((found - expected).abs() < 1e-4, "{found} {expected}");
            }
        }
    }
    // There are two cells along the interface. In each cell, one triangle has three nodes on the interface, and the
    // other triangle has one.
    assert_eq!(at_interface, [8, 8], "both sides have points on the line");
    for (strain, principal) in strain.iter().zip(&principal) {
        // The axial stretch is 1.1, and the axes are principal axes. The other principal strain is the transverse
        // contraction.
        let [xx, yy] = [strain[0], strain[1]];
        assert!((xx - 0.105).abs() < 1e-9 && yy < 0.0, "{strain:?}");
        for (found, expected) in principal.iter().zip([xx, 0.0, yy]) {
            assert!((found - expected).abs() < 1e-9, "{principal:?} {strain:?}");
        }
    }
}
