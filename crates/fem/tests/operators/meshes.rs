//! Reading, refining and locating: the muscle's mesh, and files that must be refused.

use std::collections::BTreeMap;
use std::sync::Arc;

use myovib_fem::{DofMap, FemError, Group, Mesh, Solid, Space, generate};

use crate::common::{MUSCLE_LAW, muscle_mesh};

/// A unit square of two triangles with all kinds of groups, and a node of no triangle.
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

fn message(text: &str) -> String {
    Mesh::parse_msh(text, "square.msh").unwrap_err().to_string()
}

/// The message for the square's text with one part replaced.
fn changed(from: &str, to: &str) -> String {
    assert!(SQUARE.contains(from), "{from}");
    message(&SQUARE.replacen(from, to, 1))
}

#[test]
fn a_square_is_read_with_its_groups() {
    let mesh = Mesh::parse_msh(SQUARE, "square.msh").unwrap();
    assert_eq!(
        mesh.points::<2>(),
        [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]
    );
    assert_eq!(*mesh.connectivity(), [[0, 1, 2], [0, 2, 3]]);
    assert_eq!(mesh.group("corner").unwrap(), &Group::Points(vec![0]));
    assert_eq!(
        mesh.group("left side").unwrap(),
        &Group::Edges(vec![[3, 0]])
    );
    assert_eq!(mesh.group("body").unwrap(), &Group::Elements(vec![0, 1]));
    assert_eq!(
        mesh.group("right").unwrap_err().to_string(),
        "the mesh has no group \"right\"; its groups are: body, corner, left side"
    );
    assert_eq!(
        mesh,
        Mesh::parse_msh(&SQUARE.replace('\n', "\r\n"), "dos").unwrap()
    );
}

#[test]
fn other_formats_are_refused_with_the_export_option() {
    let old = changed("4.1 0 8", "2.2 0 8");
    assert!(
        old.starts_with("square.msh, line 2: MSH version 2.2 is not read, only 4.1"),
        "{old}"
    );
    assert!(old.contains("Version 4 ASCII"));
    let binary = changed("4.1 0 8", "4.1 1 8");
    assert!(
        binary.starts_with("square.msh, line 2: binary MSH"),
        "{binary}"
    );
    assert!(binary.contains("Mesh.Binary = 0"));
    assert!(message("solid cube").contains("not a Gmsh mesh"));
    assert!(message("").contains("not a Gmsh mesh"));
}

#[test]
fn bad_numbers_are_reported_with_their_line() {
    for (from, to, expected) in [
        (
            "9 9 0",
            "9 nine 0",
            "line 29: expected a coordinate, found \"nine\"",
        ),
        (
            "9 9 0",
            "9 inf 0",
            "line 29: expected a finite coordinate, found \"inf\"",
        ),
        (
            "9 9 0",
            "9 9",
            "line 29: expected a coordinate, found \"end of line\"",
        ),
        (
            "9 9 0",
            "9 9 1",
            "line 29: node 30 has z = 1: without tetrahedra the mesh is plane and needs z = 0",
        ),
        ("20\n30", "20\n20", "line 29: node 20 is defined twice"),
        (
            "1 10\n",
            "1 30\n",
            "line 36: node 30 of a physical group is not a node of any element of the body",
        ),
        (
            "3 10 20 40",
            "3 10 20 99",
            "line 40: node 99 is not defined",
        ),
        (
            "3 10 20 40",
            "3 10 20 20",
            "line 40: element 3 has area 0e0",
        ),
        (
            "2 1 2 2\n",
            "2 1 3 2\n",
            "line 39: element type 3 is not read",
        ),
        (
            "2 1 2 2\n",
            "1 1 2 2\n",
            "line 39: expected an element type of the entity's dimension",
        ),
        (
            "2 5 \"body\"",
            "2 5 body",
            "line 8: expected a name in double quotes",
        ),
        (
            "\"body\"",
            "\"corner\"",
            "line 8: physical name corner is defined twice",
        ),
    ] {
        let found = changed(from, to);
        assert!(found.contains(expected), "{found}\n  instead of {expected}");
    }
}

#[test]
fn counts_too_large_end_in_an_error_not_in_an_allocation() {
    let huge = "99999999999999999";
    assert!(changed("2 1 0 5", &format!("2 1 0 {huge}")).contains("expected a node's tag"));
    assert!(changed("3 4 1 4", &format!("{huge} 4 1 4")).contains("line 42"));
    assert!(changed("1 1 1 0", &format!("{huge} 1 1 0")).contains("expected"));
    assert!(changed("1 0 0 0 1 7", &format!("1 0 0 0 {huge} 7")).contains("end of line"));
}

#[test]
fn every_truncation_is_an_error_and_none_panics() {
    for end in 0..SQUARE.trim_end().len() {
        if SQUARE.is_char_boundary(end) {
            message(&SQUARE[..end]);
        }
    }
}

#[test]
fn every_damaged_word_is_an_error_or_a_valid_mesh() {
    let words: Vec<&str> = SQUARE.split_inclusive(char::is_whitespace).collect();
    for place in 0..words.len() {
        for junk in [
            "-1",
            "0",
            "1e300",
            "NaN",
            "$",
            "\"",
            "18446744073709551616",
            "",
        ] {
            let mut damaged = words.clone();
            let replaced = format!("{junk}{}", &words[place][words[place].trim_end().len()..]);
            damaged[place] = &replaced;
            // What matters is that it returns.
            let _ = Mesh::parse_msh(&damaged.concat(), "damaged");
        }
    }
}

#[test]
fn a_missing_file_is_named() {
    let error = Mesh::read_msh("no/such/file.msh").unwrap_err();
    assert!(matches!(error, FemError::Io { .. }));
    assert!(error.to_string().contains("no/such/file.msh"));
}

/// The parts of a curved element are as curved as it is: they fill the same body. Regression: they were straight.
#[test]
fn refinement_keeps_curved_bodies() {
    let square = generate::rectangle([0.0; 2], [1.5, 1.0], [1, 1]).unwrap();
    let square = square
        .bent(BTreeMap::from([([0, 1], [0.8, -0.1])]))
        .unwrap();
    let block = generate::block([0.0; 3], [1.5, 1.0, 0.8], [1, 1, 1]).unwrap();
    let block = block.bent(BTreeMap::from([([0, 3], [0.78, 0.53, -0.05])]));
    for coarse in [square, block.unwrap()] {
        let volume = |mesh: &Mesh| {
            let space = Arc::new(Space::taylor_hood(mesh));
            let curved = (0..space.n_elements())
                .filter(|&e| space.is_curved(e))
                .count();
            let dofs = DofMap::clamped(&space, &[]).unwrap();
            let solid = Solid::new(space, dofs, vec![MUSCLE_LAW; mesh.n_elements()], 1.0).unwrap();
            (curved, solid.volume())
        };
        let (n_curved, of_coarse) = volume(&coarse);
        let (n_parts, of_fine) = volume(&coarse.refined().unwrap());
        // Those along the curved edge have one of their own; those inside follow the map.
        assert!(n_parts > 2 * n_curved, "{n_parts} of {n_curved}");
        // A few dozen roundings; straight parts miss a quarter of the bulge, per cents.
        assert!(
            (of_fine / of_coarse - 1.0).abs() < 1e-14,
            "{of_fine} {of_coarse}"
        );
    }
}

#[test]
fn refinement_keeps_area_groups_and_conformity() {
    let coarse = muscle_mesh();
    let fine = coarse.refined().unwrap();
    assert_eq!(fine.n_elements(), 4 * 311);
    // A vertex per old node of the quadratic space: the edges met from two sides are one.
    assert_eq!(fine.n_points(), 680);
    assert!((fine.measure() / coarse.measure() - 1.0).abs() < 1e-13);
    assert!((fine.h_max() / coarse.h_max() - 0.5).abs() < 1e-13);
    for name in ["fixed", "load"] {
        assert_eq!(
            fine.edges(name).unwrap().len(),
            2 * coarse.edges(name).unwrap().len()
        );
    }
    let (a, b) = (Space::taylor_hood(&coarse), Space::taylor_hood(&fine));
    assert_eq!(
        b.nodes_of("fixed").unwrap().len(),
        2 * a.nodes_of("fixed").unwrap().len() - 2
    );
    assert_eq!(
        fine.group("origin").unwrap(),
        coarse.group("origin").unwrap()
    );
    assert_eq!(b.nodes_of("muscle").unwrap().len(), b.n_nodes());
}

#[test]
fn points_are_located_and_quadratics_interpolated_exactly() {
    let space = Space::taylor_hood(&muscle_mesh());
    let f = |[x, y]: [f64; 2]| [3.0 * x * x - x * y, y * y + 2.0 * x - 1.0];
    let u: Vec<f64> = space.node_points().iter().flat_map(|&x| f(x)).collect();
    for point in [
        [0.0, 0.0],
        [0.03, -0.011],
        [-0.0999, 0.0119],
        [0.1, 0.012],
        [-0.05, 0.003],
    ] {
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
