//! Invalid mesh files are rejected, and the error names the tags of the elements. Correctable defects are
//! corrected and noted.

use myovib_fem::mesh::{DefectKind, ElementName, MeshDefect, MeshNote};
use myovib_fem::{FemError, Mesh, Space, load};

/// Returns a mesh file with the given physical names, nodes (x y 0), load lines and triangles. The tags of nodes
/// and elements start at 101.
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
    Mesh::parse_msh(&text, "m.msh").expect("a valid mesh")
}

fn defect_of(mesh: Result<Mesh, FemError>) -> MeshDefect {
    match mesh {
        Err(FemError::Defect(defect)) => defect,
        other => panic!("{other:?} instead of a defect"),
    }
}

fn defect(nodes: &[[f64; 2]], triangles: &[[usize; 3]]) -> MeshDefect {
    let text = file(NAMES, nodes, &[[0, 1]], triangles);
    defect_of(Mesh::parse_msh(&text, "m.msh"))
}

fn tags<const N: usize>(tags: [u64; N]) -> [ElementName; N] {
    tags.map(ElementName::Tag)
}

/// Regression: repeated edges doubled the load.
#[test]
fn repeated_or_reversed_load_edges_count_once() {
    let load_of = |lines: &[[usize; 2]]| {
        let mesh = read(&SQUARE, lines, &HALVES);
        let load = load::traction(&Space::taylor_hood(&mesh), "load", [0.0, 1.0]).unwrap();
        (load.iter().sum::<f64>(), mesh)
    };
    let (once, mesh) = load_of(&[[2, 3]]);
    assert!(mesh.notes().is_empty());
    for lines in [&[[2, 3], [2, 3]][..], &[[2, 3], [3, 2]], &[[2, 3], [3, 2], [2, 3]]] {
        let (again, mesh) = load_of(lines);
        assert_eq!(again, once);
        let note = MeshNote::Repeated {
            group: "load".to_owned(),
            entries: lines.len() - 1,
            kind: "edges",
        };
        assert_eq!(mesh.notes(), [note]);
        assert_eq!(mesh.refined().unwrap().notes(), mesh.notes());
    }
}

#[test]
fn nonconforming_elements_are_rejected_with_their_tags() {
    let duplicate = defect(&SQUARE, &[[0, 1, 2], [0, 2, 3], [1, 2, 0]]);
    assert_eq!(duplicate.kind, DefectKind::Duplicate);
    assert_eq!(duplicate.elements, tags([102, 104]));

    let inner = [[0.2, 0.1], [0.3, 0.1], [0.2, 0.2]];
    let nodes = [&SQUARE[..], &inner].concat();
    let overlap = defect(&nodes, &[[0, 1, 2], [0, 2, 3], [4, 5, 6]]);
    assert_eq!(overlap.kind, DefectKind::Overlap);
    assert_eq!(overlap.elements, tags([102, 104]));
    assert!((0.2..0.3).contains(&overlap.near[0]), "{overlap}");

    let nodes = [&SQUARE[..], &[[1.0, 0.5], [2.0, 0.5]]].concat();
    let hanging = defect(&nodes, &[[0, 1, 2], [0, 2, 3], [1, 5, 4], [4, 5, 2]]);
    assert_eq!(hanging.kind, DefectKind::HangingNode);

    let nodes = [&SQUARE[..], &[[1.0, 0.0], [1.0, 1.0], [2.0, 0.5]]].concat();
    let crack = defect(&nodes, &[[0, 1, 2], [0, 2, 3], [4, 6, 5]]);
    assert_eq!(crack.kind, DefectKind::Crack);
    assert_eq!(crack.elements, tags([102, 104]));
    assert_eq!(crack.near, [1.0, 0.5]);

    let fan = defect(
        &[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [0.3, 0.5], [0.5, -1.0]],
        &[[0, 1, 2], [0, 1, 3], [0, 4, 1]],
    );
    assert_eq!(fan.kind, DefectKind::NonManifold);
}

#[test]
fn clockwise_triangles_are_reoriented_and_noted() {
    let mesh = read(&SQUARE, &[[0, 1]], &[[0, 2, 1], [0, 3, 2]]);
    assert_eq!(mesh.measure(), 1.0);
    let note = MeshNote::Reoriented { elements: 2, order: "clockwise" };
    assert_eq!(mesh.notes(), [note]);
}

/// If a node is moved across the opposite edge, a triangle is inverted. Reorienting this triangle would hide the
/// defect.
#[test]
fn inverted_triangles_are_rejected() {
    // The center node of a square of four triangles is moved beyond the right side.
    let nodes = [&SQUARE[..], &[[1.5, 0.5]]].concat();
    let defect = defect(&nodes, &[[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]]);
    assert_eq!(defect.kind, DefectKind::SameSide { inverted: true });
    assert_eq!(defect.elements.last(), Some(&ElementName::Tag(103)));
}

#[test]
fn unnamed_groups_are_called_by_dimension_and_tag() {
    let names = "$PhysicalNames\n1\n2 5 \"body\"\n$EndPhysicalNames\n";
    let text = file(names, &SQUARE, &[[0, 1], [1, 2]], &HALVES);
    let mesh = Mesh::parse_msh(&text, "m.msh").unwrap();
    assert_eq!(mesh.edges("curve 3").unwrap(), [[0, 1], [1, 2]]);
    assert_eq!(mesh.groups().len(), 2);
}

/// Returns a file with four tetrahedra around a point, which may be inside or outside the large
/// tetrahedron.
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
fn inverted_tetrahedra_are_rejected() {
    let mesh = Mesh::parse_msh(around([0.2; 3]), "m.msh").expect("a valid mesh");
    assert_eq!(mesh.n_elements(), 4);
    let defect = defect_of(Mesh::parse_msh(around([0.6; 3]), "m.msh"));
    assert_eq!(defect.kind, DefectKind::SameSide { inverted: true });
    assert_eq!(defect.elements.last(), Some(&ElementName::Tag(4)));
}

/// Returns a file with a single second-order element, which has tag 7. `kind` is the element type in Gmsh.
fn quadratic(kind: usize, dimension: usize, nodes: &[[f64; 3]]) -> String {
    let n = nodes.len();
    let (surfaces, volumes) = (usize::from(dimension == 2), usize::from(dimension == 3));
    let tags = 1..=n;
    let lines: String = tags.clone().map(|tag| format!("{tag}\n")).collect();
    let positions = nodes.iter().map(|[x, y, z]| format!("{x} {y} {z}\n"));
    let positions: String = positions.collect();
    let element: String = tags.map(|tag| format!(" {tag}")).collect();
    format!(
        "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n\
         $PhysicalNames\n1\n{dimension} 2 \"body\"\n$EndPhysicalNames\n\
         $Entities\n0 0 {surfaces} {volumes}\n1 0 0 0 1 1 1 1 2 0\n$EndEntities\n\
         $Nodes\n1 {n} 1 {n}\n{dimension} 1 0 {n}\n{lines}{positions}$EndNodes\n\
         $Elements\n1 1 7 7\n{dimension} 1 {kind} 1\n7{element}\n$EndElements\n"
    )
}

/// Reads a six-node triangle whose first edge has its midside node at `midside`.
fn six_nodes(midside: [f64; 2]) -> Result<Mesh, FemError> {
    let nodes = [
        [0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [midside[0], midside[1], 0.0],
        [0.5, 0.5, 0.0],
        [0.0, 0.5, 0.0],
    ];
    Mesh::parse_msh(quadratic(9, 2, &nodes), "m.msh")
}

/// Nodal data at midside nodes are ignored, and a note reports this.
#[test]
fn field_values_off_the_vertices_are_noted() {
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
        let mesh = Mesh::parse_msh(quadratic(9, 2, &nodes) + &data, "m.msh").unwrap();
        mesh.notes().to_vec()
    };
    assert_eq!(notes(3), []);
    let note = MeshNote::OffVertexValues { field: "f0".to_owned(), values: 3 };
    assert_eq!(notes(6), [note]);
}

/// Reads a ten-node tetrahedron. The midside node between the first and the last vertex is at `midside`. If
/// `mirrored`, the second and the third vertex are exchanged.
fn ten_nodes(midside: [f64; 3], mirrored: bool) -> Result<Mesh, FemError> {
    let mut nodes = [
        [0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [0.0, 0.0, 1.0],
        [0.5, 0.0, 0.0],
        [0.5, 0.5, 0.0],
        [0.0, 0.5, 0.0],
        midside,
        [0.0, 0.5, 0.5],
        [0.5, 0.0, 0.5],
    ];
    if mirrored {
        for (a, b) in [(1, 2), (4, 6), (8, 9)] {
            nodes.swap(a, b);
        }
    }
    Mesh::parse_msh(quadratic(11, 3, &nodes), "m.msh")
}

/// If the midside node is at the parameter s in [0, 1] of a straight edge, the derivative of the map at the end is
/// 3 − 4 s. The element is inverted for s ≥ 3/4.
#[test]
fn inverted_curved_elements_are_rejected() {
    // The element is nearly degenerate at an end if this derivative is below 0.2. In the straight element, the
    // derivative is 1.
    for (s, end) in [(0.5, None), (0.29, Some(0.0)), (0.31, None), (0.69, None), (0.71, Some(1.0))]
    {
        let plane = six_nodes([s, 0.0]).expect("a triangle");
        let spatial = ten_nodes([0.0, 0.0, s], false).expect("a tetrahedron");
        for (mesh, axis) in [(&plane, 0), (&spatial, 2)] {
            let found = mesh.notes().iter().find_map(|note| match note {
                MeshNote::NearlyDegenerate { elements: 1, ratio, near } => {
                    Some((ratio, near[axis]))
                }
                _ => None,
            });
            assert_eq!(found.map(|(_, near)| near), end, "{s}");
            // The error is the rounding of s.
            assert!(found.is_none_or(|(ratio, _)| (ratio - 0.16).abs() < 1e-14), "{s}: {found:?}");
        }
    }
    for s in [0.75, 0.76, 1.4] {
        let plane = defect_of(six_nodes([s, 0.0]));
        assert_eq!(plane.kind, DefectKind::InvertedCurved);
        assert_eq!(plane.elements, tags([7]));
        assert_eq!(plane.near, [1.0, 0.0]);
        let spatial = defect_of(ten_nodes([0.0, 0.0, s], false));
        assert_eq!(spatial.kind, DefectKind::InvertedCurved);
        assert_eq!(spatial.elements, tags([7]));
        assert_eq!(spatial.near, [0.0, 0.0, 1.0]);
    }
    let plane = defect_of(six_nodes([0.2, 0.9]));
    assert_eq!(plane.kind, DefectKind::InvertedCurved);
    let spatial = defect_of(ten_nodes([9.0; 3], false));
    assert_eq!(spatial.kind, DefectKind::InvertedCurved);
}

/// The orientation of a curved element is checked after the element has been reoriented.
#[test]
fn mirrored_curved_elements_are_reoriented_and_noted() {
    let mesh = ten_nodes([-0.1, -0.1, 0.5], true).expect("a tetrahedron");
    let note = MeshNote::Reoriented { elements: 1, order: "inverted" };
    assert_eq!(mesh.notes(), [note]);
    let space = Space::taylor_hood(&mesh);
    let straight = Space::taylor_hood(&ten_nodes([0.0, 0.0, 0.5], true).unwrap());
    assert!(space.is_curved(0) && space.measure() > straight.measure());
    assert!(ten_nodes([9.0; 3], true).is_err());
}
