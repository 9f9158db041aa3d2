//! Tests of the volume enclosed by a boundary group.

use std::sync::Arc;

use myovib_fem::{
    DofMap, EnclosedVolume, FemError, Fields, Group, Mesh, Pressure, Solid, Space, Vectors,
    generate,
};

use crate::common::{DENSITY, MUSCLE_LAW, random};

/// Returns a free body with a group `some` that contains the facets of the given groups.
fn solid(mesh: &Mesh, groups: &[&str]) -> Solid {
    let facets = groups.iter().flat_map(|name| mesh.facets(name).unwrap());
    let some = match mesh.dimension() {
        2 => Group::Edges(facets.map(|f| [f[0], f[1]]).collect()),
        _ => Group::Faces(facets.map(|f| [f[0], f[1], f[2]]).collect()),
    };
    let mut all = mesh.groups().clone();
    all.insert("some".to_owned(), some);
    let mesh = mesh.with_groups(all).unwrap();
    let space = Arc::new(Space::taylor_hood(&mesh));
    let dofs = DofMap::new(&space, &[]).unwrap();
    Solid::uniform(space, dofs, MUSCLE_LAW, DENSITY).unwrap()
}

/// Returns ∫ det F over the body at displacement `u`.
fn volume_of_body(solid: &Solid, u: &[f64]) -> f64 {
    let mut volume_residual = vec![0.0; solid.pressure_weights().len()];
    let fields = Fields::new(u, Pressure::Penalty { kappa: 1.0 });
    let vectors =
        &mut Vectors { volume_residual: Some(&mut volume_residual), ..Vectors::default() };
    solid.evaluate(&fields, vectors).unwrap();
    solid.volume() + volume_residual.iter().sum::<f64>()
}

fn at(solid: &Solid, u: &[f64]) -> f64 {
    EnclosedVolume::new(solid, "some").unwrap().at(u)
}

/// Returns random displacements for which the lower and upper sides remain in their planes.
fn between_planes(solid: &Solid) -> Vec<f64> {
    let d = solid.space().dimension();
    let mut u = random(solid.dofs().n_full(), 0.05, 3);
    let coordinates = solid.space().coordinates();
    for (u, x) in u.chunks_mut(d).zip(coordinates.chunks(d)) {
        if x[d - 1] == 0.0 || x[d - 1] == 1.0 {
            u[d - 1] = 0.0;
        }
    }
    u
}

/// All sides together enclose the body. A side that remains flat may be omitted, because the cone that closes the
/// opening coincides with it.
#[test]
fn sides_of_a_body_enclose_its_volume() {
    let plane = generate::rectangle([0.0; 2], [2.0, 1.0], [3, 2]).unwrap();
    let space = generate::block([0.0; 3], [2.0, 1.0, 1.0], [2, 2, 1]).unwrap();
    let around = ["left", "right", "front", "back"];
    let cases: [(&Mesh, &[&str]); 5] = [
        (&plane, &["left", "right", "bottom", "top"]),
        (&plane, &["left", "right", "bottom"]),
        (&space, &[&around[..], &["bottom", "top"]].concat()),
        (&space, &[&around[..], &["bottom"]].concat()),
        (&space, &around),
    ];
    for (mesh, groups) in cases {
        let solid = solid(mesh, groups);
        let u = between_planes(&solid);
        let expected = volume_of_body(&solid, &u);
        assert!((expected - 2.0).abs() > 1e-3, "the volume must change");
        // All integrands are polynomials within the degrees of the rules, so the error is the rounding of a few
        // hundred terms below 1.
        let error = at(&solid, &u) + expected;
        assert!(error.abs() < 1e-13, "{groups:?}: {error:e}");
    }
}

/// Rigid motions preserve the volume, and homogeneous deformations scale it by det F.
#[test]
fn enclosed_volume_scales_with_homogeneous_deformations() {
    let mesh = generate::block([0.0; 3], [2.0, 1.0, 1.0], [2, 2, 1]).unwrap();
    let solid = solid(&mesh, &["left", "right", "front", "back"]);
    let f = [[0.9, 0.3, 0.1], [-0.2, 1.2, 0.0], [0.1, 0.4, 1.1]];
    let moved = [3.0, -4.0, 5.0];
    let coordinates = solid.space().coordinates().chunks(3);
    let u: Vec<f64> = coordinates
        .flat_map(|x| {
            let position =
                |i: usize| f[i].iter().zip(x).map(|(f, x)| f * x).sum::<f64>() + moved[i];
            [0, 1, 2].map(|i| position(i) - x[i])
        })
        .collect();
    let determinant = 0.9 * 1.2 * 1.1 - 0.3 * (-0.2 * 1.1) + 0.1 * (-0.2 * 0.4 - 1.2 * 0.1);
    // The error is the rounding of a few hundred terms of order 5 · 5.
    assert!((at(&solid, &u) + 2.0 * determinant).abs() < 1e-12);
}

/// Returns a square with a square hole.
fn frame() -> Mesh {
    let square = generate::rectangle([0.0; 2], [3.0; 2], [3, 3]).unwrap();
    let points = square.points::<2>().to_vec();
    let in_hole = |vertices: &[usize]| {
        let within = |i: usize| vertices.iter().all(|&k| (1.0..=2.0).contains(&points[k][i]));
        within(0) && within(1)
    };
    let triangles = square.connectivity::<3>().iter();
    let triangles: Vec<_> = triangles.filter(|t| !in_hole(&t[..])).copied().collect();
    let sides = triangles.iter().flat_map(|t| [[t[0], t[1]], [t[1], t[2]], [t[2], t[0]]]);
    let hole: Vec<_> = sides.filter(|side| in_hole(side)).collect();
    let mut groups = square.groups().clone();
    groups.retain(|_, group| matches!(group, Group::Edges(_)));
    groups.insert("hole".to_owned(), Group::Edges(hole));
    Mesh::new(points, triangles, groups).unwrap()
}

/// The volume is ambiguous if a group is disconnected, as for two opposite walls, or for a hole and the outer
/// boundary.
#[test]
fn disconnected_groups_are_rejected() {
    let plane = generate::rectangle([0.0; 2], [2.0, 1.0], [3, 2]).unwrap();
    let space = generate::block([0.0; 3], [2.0, 1.0, 1.0], [2, 2, 1]).unwrap();
    let frame = frame();
    let hole = solid(&frame, &["hole"]);
    // The error is the rounding of a few products of numbers up to 2.
    assert!((at(&hole, &vec![0.0; hole.dofs().n_full()]) - 1.0).abs() < 1e-14);
    let outer = ["left", "right", "bottom", "top"];
    let cases: [(&Mesh, &[&str]); 4] = [
        (&plane, &["left", "right"]),
        (&space, &["left", "right"]),
        (&frame, &["hole", "left"]),
        (&frame, &[&outer[..], &["hole"]].concat()),
    ];
    for (mesh, groups) in cases {
        let error = EnclosedVolume::new(&solid(mesh, groups), "some").unwrap_err();
        let is_expected = matches!(error, FemError::DisconnectedBoundary { found: 2, .. });
        assert!(is_expected, "{groups:?}: {error}");
    }
}

/// Returns a body supported on planes of symmetry through the origin. If the coordinate of a node along an axis in
/// `held` is zero, the node is fixed along this axis.
fn symmetric(mesh: &Mesh, held: &[usize]) -> Solid {
    let space = Arc::new(Space::taylor_hood(mesh));
    let on_plane = |&(node, axis): &(usize, usize)| space.node_point(node)[axis].abs() < 1e-12;
    let all = (0..space.n_nodes()).flat_map(|node| held.iter().map(move |&axis| (node, axis)));
    let dofs = DofMap::new(&space, &all.filter(on_plane).collect::<Vec<_>>()).unwrap();
    Solid::uniform(space, dofs, MUSCLE_LAW, DENSITY).unwrap()
}

/// Regression: a quarter of a lumen was closed by a chord in 2D and by a cone in 3D.
#[test]
fn planes_of_symmetry_close_a_quarter_of_a_tube() {
    const N: usize = 3;
    let turned = |[r, angle]: [f64; 2]| {
        let (sin, cos) = (0.5 * std::f64::consts::PI * angle).sin_cos();
        // The coordinates must be exactly zero on the planes.
        let cos = if angle == 1.0 { 0.0 } else { cos };
        [(2.0 + r) * cos, (2.0 + r) * sin]
    };
    // Area of the triangles between the origin and the sides of the inner polygon.
    let angle = 0.5 * std::f64::consts::PI / N as f64;
    let area = N as f64 * 0.5 * 4.0 * angle.sin();
    let square = generate::rectangle([0.0; 2], [1.0, 1.0], [1, N]).unwrap();
    let points = square.points::<2>().iter().map(|&point| turned(point));
    let ring = Mesh::new::<2, 3>(
        points.collect(),
        square.connectivity::<3>().to_vec(),
        square.groups().clone(),
    );
    let tube = generate::spatial([1, N, 2], |[r, angle, z]| {
        let [x, y] = turned([r, angle]);
        [x, y, 3.0 * z]
    })
    .unwrap();
    for (mesh, axes, expected) in [
        (ring.unwrap(), vec![0, 1], area),
        (tube.clone(), vec![0, 1], 3.0 * area),
        (tube, vec![0, 1, 2], 3.0 * area),
    ] {
        let solid = symmetric(&mesh, &axes);
        let u = vec![0.0; solid.dofs().n_full()];
        let open = EnclosedVolume::new(&solid, "left").unwrap();
        assert!(open.may_end_at_symmetry(&solid));
        assert!((open.at(&u).abs() / expected - 1.0).abs() > 0.1);
        let closed = open.with_symmetry(&axes).unwrap();
        // The error is the rounding of several dozen terms.
        assert!((closed.at(&u) / expected - 1.0).abs() < 1e-13, "{}", closed.at(&u));
        // The displacement doubles the size of the tube in all directions.
        let twice = closed.at(solid.space().coordinates());
        let d = mesh.dimension() as i32;
        assert!((twice / (2f64.powi(d) * expected) - 1.0).abs() < 1e-13);
    }
}

/// Regression: if a support moves a rim along all axes, the ends of the rim were not recognized, and the planes of
/// the moved facets were taken for planes of symmetry.
#[test]
fn planes_of_symmetry_close_a_quarter_whose_skin_is_moved() {
    let square = generate::rectangle([0.0; 2], [1.0, 1.0], [2, 2]).unwrap();
    let cube = generate::block([0.0; 3], [1.0; 3], [2, 2, 2]).unwrap();
    for (mesh, names, axes) in [
        (square, &["right", "top"][..], vec![0, 1]),
        (cube, &["right", "top", "back"][..], vec![0, 1, 2]),
    ] {
        let plain = solid(&mesh, names);
        let space = Space::clone(plain.space());
        let d = space.dimension();
        let is_outer = |&x: &f64| x == 1.0;
        let is_held = |&(node, axis): &(usize, usize)| {
            let point = space.node_point(node);
            point[axis] == 0.0 || point.iter().any(is_outer)
        };
        let all = (0..space.n_nodes()).flat_map(|node| (0..d).map(move |axis| (node, axis)));
        let dofs = DofMap::new(&space, &all.filter(is_held).collect::<Vec<_>>()).unwrap();
        let solid = Solid::uniform(Arc::new(space), dofs, MUSCLE_LAW, DENSITY).unwrap();
        let open = EnclosedVolume::new(&solid, "some").unwrap();
        assert!(open.may_end_at_symmetry(&solid));
        let closed = open.with_symmetry(&axes).unwrap();
        let u: Vec<f64> = solid.space().coordinates().iter().map(|x| 0.1 * x).collect();
        // The error is the rounding of several dozen terms.
        assert!((closed.at(&u).abs() / 1.1f64.powi(d as i32) - 1.0).abs() < 1e-13);
    }
}

/// Regression: the ends of half a ring, which are on the same plane, were taken for the ends of a quarter. The
/// chord between these ends is in their plane, so specifying the plane of symmetry does not change the volume. If
/// a straight skin is between two planes, its ends are at the same height, but the chord between them is not in a
/// plane of symmetry.
#[test]
fn half_a_ring_on_one_plane_has_the_volume_above_the_plane() {
    let half = |solid: &dyn Fn(&Mesh) -> Solid| {
        let square = generate::rectangle([0.0; 2], [1.0, 1.0], [1, 4]).unwrap();
        let points = square.points::<2>().iter().map(|&[r, angle]| {
            let (sin, cos) = (std::f64::consts::PI * angle).sin_cos();
            // The coordinate must be exactly zero on the plane.
            [(2.0 + r) * cos, if angle == 1.0 { 0.0 } else { (2.0 + r) * sin }]
        });
        let (triangles, groups) = (square.connectivity::<3>().to_vec(), square.groups().clone());
        solid(&Mesh::new::<2, 3>(points.collect(), triangles, groups).unwrap())
    };
    let area = 4.0 * 0.5 * 4.0 * std::f64::consts::FRAC_PI_4.sin();
    let clamped = |mesh: &Mesh| {
        let space = Arc::new(Space::taylor_hood(mesh));
        let ends = ["bottom", "top"].iter().flat_map(|name| space.nodes_of(name).unwrap());
        let dofs = DofMap::clamped(&space, &ends.collect::<Vec<_>>()).unwrap();
        Solid::uniform(space, dofs, MUSCLE_LAW, DENSITY).unwrap()
    };
    for solid in [half(&clamped), half(&|mesh| symmetric(mesh, &[1]))] {
        let open = EnclosedVolume::new(&solid, "left").unwrap();
        assert!(!open.may_end_at_symmetry(&solid));
        let u = vec![0.0; solid.dofs().n_full()];
        let closed = open.clone().with_symmetry(&[1]).unwrap();
        // The error is the rounding of several dozen terms.
        assert!((open.at(&u) / area - 1.0).abs() < 1e-13, "{}", open.at(&u));
        assert!((closed.at(&u) / area - 1.0).abs() < 1e-13, "{}", closed.at(&u));
    }
    let block = generate::rectangle([0.0; 2], [1.0, 1.0], [2, 2]).unwrap();
    let solid = symmetric(&block, &[0]);
    assert!(EnclosedVolume::new(&solid, "top").unwrap().may_end_at_symmetry(&solid));
}

#[test]
fn an_axis_without_a_plane_of_symmetry_is_rejected() {
    let tube = generate::spatial([1, 2, 2], |[r, angle, z]| {
        let (sin, cos) = (0.5 * std::f64::consts::PI * angle).sin_cos();
        [(2.0 + r) * cos, (2.0 + r) * sin, 3.0 * z]
    })
    .unwrap();
    let solid = symmetric(&tube, &[1]);
    let error = EnclosedVolume::new(&solid, "left").unwrap().with_symmetry(&[0]);
    assert!(matches!(error, Err(FemError::NoSymmetryPlane { axis: 0 })));
    let whole = symmetric(&tube, &[]);
    assert!(!EnclosedVolume::new(&whole, "left").unwrap().may_end_at_symmetry(&whole));
}
