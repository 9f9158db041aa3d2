use super::*;

/// Points and elements of a body in 2D or 3D.
#[derive(Clone)]
struct Body {
    dimension: usize,
    points: Vec<f64>,
    elements: Vec<usize>,
}

impl Body {
    fn check(&self) -> Result<(), MeshDefect> {
        conforming(self.dimension, &self.points, &self.elements, &[])
    }

    fn kind(&self) -> DefectKind {
        self.check().unwrap_err().kind
    }

    /// Appends another body, which has separate points.
    fn and(mut self, other: &Self) -> Self {
        let shift = self.points.len() / self.dimension;
        self.points.extend(&other.points);
        self.elements.extend(other.elements.iter().map(|v| v + shift));
        self
    }

    fn moved(mut self, by: &[f64]) -> Self {
        for point in self.points.chunks_exact_mut(self.dimension) {
            for (x, by) in point.iter_mut().zip(by) {
                *x += by;
            }
        }
        self
    }
}

/// Returns the unit square with `n` cells per side, or the unit cube. Each cell is split into d! simplices along
/// one diagonal (Kuhn subdivision). Inner points are displaced by up to a tenth of a cell, which does not invert
/// any element.
fn block(dimension: usize, n: usize) -> Body {
    perturbed_block(dimension, n, 0.1)
}

fn perturbed_block(dimension: usize, n: usize, amplitude: f64) -> Body {
    let per_axis = n + 1;
    let coordinates = |v: usize| (0..dimension).map(move |k| v / per_axis.pow(k as u32) % per_axis);
    let n_points = per_axis.pow(dimension as u32);
    let mut points: Vec<f64> =
        (0..n_points).flat_map(coordinates).map(|i| i as f64 / n as f64).collect();
    for (v, point) in points.chunks_exact_mut(dimension).enumerate() {
        if coordinates(v).all(|i| i > 0 && i < n) {
            for (k, x) in point.iter_mut().enumerate() {
                *x += ((v * v + 7 * k) as f64).sin() * amplitude / n as f64;
            }
        }
    }
    let orders: &[&[usize]] = match dimension {
        2 => &[&[0, 1], &[1, 0]],
        _ => &[&[0, 1, 2], &[1, 2, 0], &[2, 0, 1], &[1, 0, 2], &[0, 2, 1], &[2, 1, 0]],
    };
    let mut elements = Vec::new();
    for corner in (0..n_points).filter(|&v| coordinates(v).all(|i| i < n)) {
        for (which, order) in orders.iter().enumerate() {
            let mut path = vec![corner];
            for &axis in *order {
                path.push(path[path.len() - 1] + per_axis.pow(axis as u32));
            }
            // Odd permutations of the axes invert the vertex order.
            if which >= orders.len() / 2 {
                path.swap(dimension - 1, dimension);
            }
            elements.extend(path);
        }
    }
    Body { dimension, points, elements }
}

fn body<const D: usize, const N: usize>(points: &[[f64; D]], elements: &[[usize; N]]) -> Body {
    Body { dimension: D, points: points.concat(), elements: elements.concat() }
}

#[test]
fn blocks_and_separated_pairs_conform() {
    for dimension in [2, 3] {
        let one = block(dimension, 4);
        assert_eq!(one.check(), Ok(()));
        let other = one.clone().moved(&[1.001, 0.0, 0.0]);
        assert_eq!(one.and(&other).check(), Ok(()));
    }
}

#[test]
fn duplicate_elements_are_found() {
    for dimension in [2, 3] {
        let mut block = block(dimension, 3);
        let mut again = block.elements[5 * (dimension + 1)..][..=dimension].to_vec();
        again.rotate_left(1);
        if dimension == 3 {
            // A cyclic rotation of four vertices is an odd permutation.
            again.swap(0, 1);
        }
        block.elements.extend(again);
        let last = block.elements.len() / (dimension + 1) - 1;
        let found = block.check().unwrap_err();
        assert_eq!(found.kind, DefectKind::Duplicate);
        let names = [5, last].map(ElementName::Index);
        assert_eq!(found.elements, names);
    }
}

#[test]
fn elements_on_the_same_side_of_a_facet_are_found() {
    let folded = body(&[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [0.3, 0.5]], &[[0, 1, 2], [0, 1, 3]]);
    assert_eq!(folded.kind(), DefectKind::SameSide { inverted: false });
    let points =
        [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.5, 0.5, 0.3]];
    let folded = body(&points, &[[0, 1, 2, 3], [0, 1, 2, 4]]);
    assert_eq!(folded.kind(), DefectKind::SameSide { inverted: false });
    let defect = folded.check().unwrap_err();
    assert_eq!(defect.elements, [0, 1].map(ElementName::Index));
    let third = 1.0 / 3.0;
    assert_eq!(defect.near, [third, third, 0.0]);
}

#[test]
fn three_elements_sharing_a_facet_are_found() {
    let fan = body(
        &[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [0.3, 0.5], [0.5, -1.0]],
        &[[0, 1, 2], [0, 1, 3], [0, 4, 1]],
    );
    assert_eq!(fan.kind(), DefectKind::NonManifold);
}

#[test]
fn overlaps_of_any_depth_are_found() {
    for dimension in [2, 3] {
        let one = block(dimension, 3);
        for by in [[0.9999, 0.2, 0.1], [0.1, 0.05, 0.02], [1e-4, 0.0, 0.0]] {
            let other = one.clone().moved(&by);
            assert_eq!(one.clone().and(&other).kind(), DefectKind::Overlap, "{by:?}");
        }
        // A small body is inside the large elements of the other body, so no facets touch.
        let mut small = one.clone();
        for x in &mut small.points {
            *x = 0.46 + 0.01 * *x;
        }
        assert_eq!(one.and(&small).kind(), DefectKind::Overlap);
    }
}

/// In a fan that winds around its center more than once, every edge is valid, but regions are covered twice.
#[test]
fn a_fan_that_overlaps_itself_is_found() {
    let n = 9;
    let mut points = vec![[0.0, 0.0]];
    points.extend((0..=n).map(|i| {
        let angle = f64::from(i) * 0.8;
        // The radius increases, so that no two edges coincide.
        let radius = 1.0 + 0.05 * f64::from(i);
        [radius * angle.cos(), radius * angle.sin()]
    }));
    let fan: Vec<[usize; 3]> = (1..=n as usize).map(|i| [0, i, i + 1]).collect();
    assert_eq!(body(&points, &fan).kind(), DefectKind::Overlap);
    assert_eq!(body(&points[..8], &fan[..6]).check(), Ok(()));
}

#[test]
fn cracks_from_duplicate_nodes_are_found() {
    for dimension in [2, 3] {
        let one = block(dimension, 3);
        let other = one.clone().moved(&[1.0, 0.0, 0.0]);
        let found = one.and(&other).check().unwrap_err();
        assert_eq!(found.kind, DefectKind::Crack);
        assert!((found.near[0] - 1.0).abs() < 1e-12, "{found}");
    }
}

#[test]
fn hanging_nodes_are_found() {
    for dimension in [2, 3] {
        let one = block(dimension, 2);
        let other = block(dimension, 3).moved(&[1.0, 0.0, 0.0]);
        assert_eq!(one.and(&other).kind(), DefectKind::HangingNode);
    }
    // A node of the upper triangles is on the edge of the lower triangle.
    let points = [[0.0, 0.0], [2.0, 0.0], [1.0, -1.0], [1.0, 0.0], [1.0, 1.0]];
    let hanging = body(&points, &[[0, 2, 1], [0, 3, 4], [3, 1, 4]]);
    assert_eq!(hanging.kind(), DefectKind::HangingNode);
}

/// If a square face is cut along different diagonals from above and below, the faces are not shared, although the
/// mesh has no hanging node.
#[test]
fn faces_split_along_different_diagonals_are_found() {
    let points = [
        [0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [1.0, 1.0, 0.0],
        [0.0, 1.0, 0.0],
        [0.5, 0.5, 1.0],
        [0.5, 0.5, -1.0],
    ];
    let above = [[0, 1, 2, 4], [0, 2, 3, 4]];
    let below = [[1, 0, 3, 5], [2, 1, 3, 5]];
    let both = [above[0], above[1], below[0], below[1]];
    assert_eq!(body(&points, &both).kind(), DefectKind::HangingNode);
    let matching = [above[0], above[1], [1, 0, 2, 5], [0, 3, 2, 5]];
    assert_eq!(body(&points, &matching).check(), Ok(()));
}

/// Positions far from the origin and cell sizes from 1e-6 to 1 are accepted.
#[test]
fn large_coordinates_and_graded_sizes_are_accepted() {
    for dimension in [2, 3] {
        let mut scaled_matrices = perturbed_block(dimension, 6, 0.0);
        for x in &mut scaled_matrices.points {
            *x = 10f64.powf(6.0 * (*x - 1.0));
        }
        assert_eq!(scaled_matrices.check(), Ok(()));
        let far = block(dimension, 6).moved(&[1e3, -2e3, 5e2]);
        assert_eq!(far.check(), Ok(()));
    }
}

/// The mesh is large enough that a comparison of all 4e8 pairs would take too long.
#[test]
fn large_meshes_are_checked() {
    // There are 17³ cells with six tetrahedra each.
    let block = block(3, 17);
    assert_eq!(block.elements.len() / 4, 29_478);
    assert_eq!(block.check(), Ok(()));
}
