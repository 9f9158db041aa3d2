//! The files for ParaView: XML by a parser, the structure that VTK's format demands.

use std::fs;
use std::path::Path;

use roxmltree::{Document, Node};
use serde_json::Value;

use crate::harness::myovib_in;

/// VTK's number for the triangle with six nodes: corners, then the middles of 01, 12, 20.
const QUADRATIC_TRIANGLE: f64 = 22.0;

fn child<'a, 'x>(node: Node<'a, 'x>, name: &str) -> Node<'a, 'x> {
    let mut found = node.children().filter(|child| child.has_tag_name(name));
    let first = found.next().unwrap_or_else(|| panic!("no <{name}>"));
    assert!(found.next().is_none(), "<{name}> twice");
    first
}

/// The numbers of the array called `name`, in rows of as many as it says.
fn array(parent: Node<'_, '_>, name: &str) -> Vec<Vec<f64>> {
    let mut arrays = parent.children().filter(Node::is_element);
    let array = arrays
        .find(|array| array.attribute("Name") == Some(name))
        .unwrap_or_else(|| panic!("no array `{name}`"));
    assert!(array.has_tag_name("DataArray"));
    assert_eq!(array.attribute("format"), Some("ascii"));
    let width = array.attribute("NumberOfComponents").unwrap_or("1");
    let words = array.text().unwrap_or_default().split_whitespace();
    let numbers: Vec<f64> = words.map(|word| word.parse().expect("a number")).collect();
    assert!(numbers.iter().all(|value| value.is_finite()), "{name}");
    let rows = numbers.chunks(width.parse().expect("a width"));
    rows.map(<[f64]>::to_vec).collect()
}

fn whole_numbers(parent: Node<'_, '_>, name: &str) -> Vec<usize> {
    let numbers = array(parent, name).concat();
    assert!(numbers.iter().all(|n| n.fract() == 0.0 && *n >= 0.0));
    numbers.into_iter().map(|n| n as usize).collect()
}

/// Checks one file against the size of the mesh in `run.json`.
fn check(path: &Path, mesh: &Value) {
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
    assert_eq!(mesh["triangles"], n_cells);

    let points = array(child(piece, "Points"), "points");
    assert_eq!(points.len(), n_points);
    assert!(
        points
            .iter()
            .all(|point| point.len() == 3 && point[2] == 0.0)
    );
    let cells = child(piece, "Cells");
    let connectivity = whole_numbers(cells, "connectivity");
    assert_eq!(connectivity.len(), 6 * n_cells);
    let ends: Vec<usize> = (1..=n_cells).map(|cell| 6 * cell).collect();
    assert_eq!(whole_numbers(cells, "offsets"), ends);
    let types = array(cells, "types").concat();
    assert_eq!(types, vec![QUADRATIC_TRIANGLE; n_cells]);
    let mut used = vec![false; n_points];
    for nodes in connectivity.chunks(6) {
        let [a, b, c, ab, bc, ca] = [0, 1, 2, 3, 4, 5].map(|i| &points[nodes[i]]);
        let area = (b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1]);
        assert!(area > 0.0, "counter-clockwise");
        for (from, to, middle) in [(a, b, ab), (b, c, bc), (c, a, ca)] {
            for axis in [0, 1] {
                // Ten digits are written, of lengths up to 0.1.
                assert!((0.5 * (from[axis] + to[axis]) - middle[axis]).abs() < 1e-10);
            }
        }
        nodes.iter().for_each(|&node| used[node] = true);
    }
    assert!(used.iter().all(|used| *used), "a point without a triangle");

    let data = child(piece, "PointData");
    for (name, width) in [
        ("displacement", 3),
        ("velocity", 3),
        ("pressure", 1),
        ("J", 1),
        ("von_mises", 1),
    ] {
        let rows = array(data, name);
        assert_eq!(rows.len(), n_points, "{name}");
        assert!(rows.iter().all(|row| row.len() == width), "{name}");
    }
    let plane = array(data, "displacement").iter().all(|u| u[2] == 0.0);
    assert!(plane, "plane strain");
    assert!(
        array(data, "J").iter().all(|j| (j[0] - 1.0).abs() < 0.1),
        "volume ratios"
    );
}

#[test]
fn fields_are_the_grids_that_paraview_reads() {
    let folder = tempfile::tempdir().unwrap();
    let sets = [
        "time.end=0.5",
        "fields.every=0.25",
        "fields.quantities=[\"u\", \"v\", \"p\", \"J\", \"von-mises\"]",
    ];
    let mut arguments = vec!["run", "init", "--out", "out", "--quiet"];
    arguments.extend(sets.iter().flat_map(|set| ["--set", set]));
    let run = myovib_in(folder.path(), &arguments);
    assert_eq!(run.code, 0, "{}", run.stderr);
    let out = folder.path().join("out");
    let read = |name: &str| fs::read_to_string(out.join(name)).unwrap();
    let summary: Value = serde_json::from_str(&read("run.json")).unwrap();

    let text = read("fields.pvd");
    let document = Document::parse(&text).expect("XML");
    let root = document.root_element();
    assert_eq!(root.attribute("type"), Some("Collection"));
    let sets = child(root, "Collection");
    let sets: Vec<Node<'_, '_>> = sets.children().filter(Node::is_element).collect();
    let times: Vec<&str> = sets
        .iter()
        .map(|set| set.attribute("timestep").unwrap())
        .collect();
    assert_eq!(times, ["0", "0.25", "0.5"]);
    for set in sets {
        check(&out.join(set.attribute("file").unwrap()), &summary["mesh"]);
    }
}
