//! Regression: mesh files that are no mesh of a body are refused by the tags of their elements, and
//! what can be put right is, with a word.

use myovib_fem::{Mesh, Space, load};

/// A file with these physical names, nodes (x y 0), load lines and triangles; nodes and elements
/// carry tags from 101 on.
fn file(names: &str, nodes: &[[f64; 2]], lines: &[[usize; 2]], triangles: &[[usize; 3]]) -> String {
    let tag = |index: usize| 101 + index;
    let mut text = format!(
        "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n{names}$Entities\n0 1 1 0\n\
         1 0 0 0 1 1 0 1 3 0\n1 0 0 0 1 1 0 1 5 0\n$EndEntities\n$Nodes\n1 {n} 1 {n}\n2 1 0 {n}\n",
        n = nodes.len()
    );
    for i in 0..nodes.len() {
        text += &format!("{}\n", tag(i));
    }
    for [x, y] in nodes {
        text += &format!("{x} {y} 0\n");
    }
    let n = lines.len() + triangles.len();
    text += &format!("$EndNodes\n$Elements\n2 {n} 1 {n}\n1 1 1 {}\n", lines.len());
    for (i, [a, b]) in lines.iter().enumerate() {
        text += &format!("{} {} {}\n", tag(i), tag(*a), tag(*b));
    }
    text += &format!("2 1 2 {}\n", triangles.len());
    for (i, vertices) in triangles.iter().enumerate() {
        let [a, b, c] = vertices.map(tag);
        text += &format!("{} {a} {b} {c}\n", tag(lines.len() + i));
    }
    text + "$EndElements\n"
}

const NAMES: &str = "$PhysicalNames\n2\n1 3 \"load\"\n2 5 \"body\"\n$EndPhysicalNames\n";
const SQUARE: [[f64; 2]; 4] = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
const HALVES: [[usize; 3]; 2] = [[0, 1, 2], [0, 2, 3]];

fn read(nodes: &[[f64; 2]], lines: &[[usize; 2]], triangles: &[[usize; 3]]) -> Mesh {
    let text = file(NAMES, nodes, lines, triangles);
    Mesh::parse_msh(&text, "m.msh").expect("a mesh of a body")
}

fn refusal(nodes: &[[f64; 2]], triangles: &[[usize; 3]]) -> String {
    let text = file(NAMES, nodes, &[[0, 1]], triangles);
    let refused = Mesh::parse_msh(&text, "m.msh");
    refused.expect_err("no mesh of a body").to_string()
}

/// It doubled the load.
#[test]
fn a_load_edge_listed_twice_or_reversed_counts_once() {
    let load_of = |lines: &[[usize; 2]]| {
        let mesh = read(&SQUARE, lines, &HALVES);
        let load = load::traction(&Space::taylor_hood(&mesh), "load", [0.0, 1.0]).unwrap();
        (load.iter().sum::<f64>(), mesh)
    };
    let (once, mesh) = load_of(&[[2, 3]]);
    assert!(mesh.notes().is_empty());
    for lines in [
        &[[2, 3], [2, 3]][..],
        &[[2, 3], [3, 2]],
        &[[2, 3], [3, 2], [2, 3]],
    ] {
        let (again, mesh) = load_of(lines);
        assert_eq!(again, once);
        assert_eq!(
            mesh.notes()[0].to_string(),
            format!(
                "group \"load\" lists edges more than once: {} repeated entries were left out",
                lines.len() - 1
            )
        );
        assert_eq!(mesh.refined().unwrap().notes(), mesh.notes());
    }
}

#[test]
fn elements_that_do_not_fit_are_refused_by_their_tags() {
    let twice = refusal(&SQUARE, &[[0, 1, 2], [0, 2, 3], [1, 2, 0]]);
    assert!(twice.starts_with("elements 102 and 104, near"), "{twice}");
    assert!(twice.ends_with("have the same vertices: delete one of them"));

    let apart = [[0.2, 0.1], [0.3, 0.1], [0.2, 0.2]];
    let nodes = [&SQUARE[..], &apart].concat();
    let over = refusal(&nodes, &[[0, 1, 2], [0, 2, 3], [4, 5, 6]]);
    assert!(
        over.starts_with("elements 102 and 104, near (0.2"),
        "{over}"
    );
    assert!(over.ends_with("overlap"), "{over}");

    let nodes = [&SQUARE[..], &[[1.0, 0.5], [2.0, 0.5]]].concat();
    let hanging = refusal(&nodes, &[[0, 1, 2], [0, 2, 3], [1, 5, 4], [4, 5, 2]]);
    assert!(hanging.contains("where a node hangs"), "{hanging}");

    let nodes = [&SQUARE[..], &[[1.0, 0.0], [1.0, 1.0], [2.0, 0.5]]].concat();
    let crack = refusal(&nodes, &[[0, 1, 2], [0, 2, 3], [4, 6, 5]]);
    assert!(
        crack.starts_with("elements 102 and 104, near (1.000000, 0.500000), touch at an edge"),
        "{crack}"
    );

    let crowded = refusal(
        &[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [0.3, 0.5], [0.5, -1.0]],
        &[[0, 1, 2], [0, 1, 3], [0, 4, 1]],
    );
    assert!(crowded.contains("two elements at most can have an edge in common"));
}

#[test]
fn clockwise_surfaces_are_turned_with_a_word() {
    let mesh = read(&SQUARE, &[[0, 1]], &[[0, 2, 1], [0, 3, 2]]);
    assert_eq!(mesh.measure(), 1.0);
    assert_eq!(
        mesh.notes()[0].to_string(),
        "elements of the mesh ran clockwise and were turned round: 2"
    );
}

/// A node pulled over the opposite edge turns a triangle inside out: turning it round hides nothing.
#[test]
fn an_inverted_element_is_refused() {
    // The middle node of a square of four triangles, beyond the right side.
    let nodes = [&SQUARE[..], &[[1.5, 0.5]]].concat();
    let inverted = refusal(&nodes, &[[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]]);
    assert!(inverted.contains("is inverted"), "{inverted}");
    assert!(inverted.contains("and 103,"), "{inverted}");
}

#[test]
fn groups_without_names_are_listed_with_what_to_write() {
    let names = "$PhysicalNames\n1\n2 5 \"body\"\n$EndPhysicalNames\n";
    let text = file(names, &SQUARE, &[[0, 1], [1, 2]], &HALVES);
    let mesh = Mesh::parse_msh(&text, "m.msh").unwrap();
    assert_eq!(
        mesh.group("fixed").unwrap_err().to_string(),
        "the mesh has no group \"fixed\"; its groups are: body; without a name it has \
         Physical Curve 3 (2 elements, dimension 1): name the one you mean, in Gmsh \
         Physical Curve(\"fixed\", 3) = {…}"
    );
}

/// Four tetrahedra around a point, which lies within the large one, or beyond a face of it.
fn around(point: [f64; 3]) -> String {
    let [x, y, z] = point;
    format!(
        "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n\
         $PhysicalNames\n1\n3 2 \"body\"\n$EndPhysicalNames\n\
         $Entities\n0 0 0 1\n1 0 0 0 1 1 1 1 2 0\n$EndEntities\n\
         $Nodes\n1 5 1 5\n3 1 0 5\n1\n2\n3\n4\n5\n\
         0 0 0\n1 0 0\n0 1 0\n0 0 1\n{x} {y} {z}\n$EndNodes\n\
         $Elements\n1 4 1 4\n3 1 4 4\n1 1 2 3 5\n2 1 4 2 5\n3 1 3 4 5\n4 2 4 3 5\n$EndElements\n"
    )
}

#[test]
fn an_inverted_tetrahedron_is_refused() {
    let mesh = Mesh::parse_msh(&around([0.2; 3]), "m.msh").expect("a mesh of a body");
    assert_eq!(mesh.n_elements(), 4);
    let refused = Mesh::parse_msh(&around([0.6; 3]), "m.msh");
    let message = refused.expect_err("no mesh of a body").to_string();
    assert!(message.contains("is inverted"), "{message}");
    assert!(message.contains("and 4,"), "{message}");
}

/// A file with one element of second order, number 7: Gmsh's type, its dimension and its nodes.
fn quadratic(kind: usize, dimension: usize, nodes: &[[f64; 3]]) -> String {
    let n = nodes.len();
    let (surfaces, volumes) = (usize::from(dimension == 2), usize::from(dimension == 3));
    let tags = 1..=n;
    let lines: String = tags.clone().map(|tag| format!("{tag}\n")).collect();
    let places = nodes.iter().map(|[x, y, z]| format!("{x} {y} {z}\n"));
    let places: String = places.collect();
    let element: String = tags.map(|tag| format!(" {tag}")).collect();
    format!(
        "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n\
         $PhysicalNames\n1\n{dimension} 2 \"body\"\n$EndPhysicalNames\n\
         $Entities\n0 0 {surfaces} {volumes}\n1 0 0 0 1 1 1 1 2 0\n$EndEntities\n\
         $Nodes\n1 {n} 1 {n}\n{dimension} 1 0 {n}\n{lines}{places}$EndNodes\n\
         $Elements\n1 1 7 7\n{dimension} 1 {kind} 1\n7{element}\n$EndElements\n"
    )
}

/// A triangle of six nodes, the one between the first two at `place`.
fn six_nodes(place: [f64; 2]) -> Result<Mesh, myovib_fem::FemError> {
    let nodes = [
        [0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [place[0], place[1], 0.0],
        [0.5, 0.5, 0.0],
        [0.0, 0.5, 0.0],
    ];
    Mesh::parse_msh(&quadratic(9, 2, &nodes), "m.msh")
}

/// Data at nodes between vertices are left out, and it is said.
#[test]
fn values_of_a_field_beside_the_vertices_are_told_of() {
    let nodes = [
        [0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [0.5, 0.0, 0.0],
        [0.5, 0.5, 0.0],
        [0.0, 0.5, 0.0],
    ];
    let notes = |given: usize| {
        let values: String = (1..=given).map(|tag| format!("{tag} 1 0 0\n")).collect();
        let data = format!("$NodeData\n1\n\"f0\"\n1\n0\n3\n0\n3\n{given}\n{values}$EndNodeData\n");
        let mesh = Mesh::parse_msh(&(quadratic(9, 2, &nodes) + &data), "m.msh").unwrap();
        let notes = mesh.notes().iter().map(ToString::to_string);
        notes.collect::<Vec<_>>()
    };
    assert_eq!(notes(3), [""; 0]);
    let told = notes(6);
    assert!(
        told[0].contains("\"f0\"") && told[0].contains("at 3 other nodes"),
        "{told:?}"
    );
}

/// A tetrahedron of ten nodes, the one between the first and the last vertex at `place`; with its
/// second and third vertex exchanged if `mirrored`.
fn ten_nodes(place: [f64; 3], mirrored: bool) -> Result<Mesh, myovib_fem::FemError> {
    let mut nodes = [
        [0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [0.0, 0.0, 1.0],
        [0.5, 0.0, 0.0],
        [0.5, 0.5, 0.0],
        [0.0, 0.5, 0.0],
        place,
        [0.0, 0.5, 0.5],
        [0.5, 0.0, 0.5],
    ];
    if mirrored {
        for (a, b) in [(1, 2), (4, 6), (8, 9)] {
            nodes.swap(a, b);
        }
    }
    Mesh::parse_msh(&quadratic(11, 3, &nodes), "m.msh")
}

/// A node that slides along its straight edge, s in 0 to 1, makes the map's derivative there
/// 3 - 4 s at the end: it folds from s = 3/4 on.
#[test]
fn curved_elements_turned_inside_out_are_refused() {
    for s in [0.5, 0.26, 0.74] {
        assert_eq!(six_nodes([s, 0.0]).expect("a triangle").n_elements(), 1);
        let mesh = ten_nodes([0.0, 0.0, s], false).expect("a tetrahedron");
        assert!(mesh.notes().is_empty());
    }
    let why = "is turned inside out there by the nodes on its curved edges";
    for s in [0.75, 0.76, 1.4] {
        let flat = six_nodes([s, 0.0]).unwrap_err().to_string();
        let start = "element 7, near (1.000000, 0.000000), ";
        assert!(flat.starts_with(&format!("{start}{why}")), "{flat}");
        let spatial = ten_nodes([0.0, 0.0, s], false).unwrap_err().to_string();
        let start = "element 7, near (0.000000, 0.000000, 1.000000), ";
        assert!(spatial.starts_with(&format!("{start}{why}")), "{spatial}");
    }
    let flat = six_nodes([0.2, 0.9]).unwrap_err().to_string();
    assert!(flat.contains(why), "{flat}");
    let spatial = ten_nodes([9.0; 3], false).unwrap_err().to_string();
    assert!(spatial.contains(why), "{spatial}");
}

/// The sign of a curved element's map counts once it is turned round.
#[test]
fn mirrored_curved_elements_are_turned_with_a_word() {
    let mesh = ten_nodes([-0.1, -0.1, 0.5], true).expect("a tetrahedron");
    assert_eq!(
        mesh.notes()[0].to_string(),
        "elements of the mesh were inside out and were turned round: 1"
    );
    let space = Space::taylor_hood(&mesh);
    let straight = Space::taylor_hood(&ten_nodes([0.0, 0.0, 0.5], true).unwrap());
    assert!(space.is_curved(0) && space.measure() > straight.measure());
    assert!(ten_nodes([9.0; 3], true).is_err());
}
