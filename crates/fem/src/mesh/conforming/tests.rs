use super::*;

/// Points and elements of any dimension.
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

    /// Another body beside this one, with points of its own.
    fn and(mut self, other: &Self) -> Self {
        let shift = self.points.len() / self.dimension;
        self.points.extend(&other.points);
        self.elements
            .extend(other.elements.iter().map(|v| v + shift));
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

/// The unit square in `n` × `n` cells, or the unit cube, each cell cut into d! simplices along one
/// diagonal (Kuhn's), inner points pushed about by a tenth of a cell: none is turned inside out.
fn block(dimension: usize, n: usize) -> Body {
    block_with_pushes(dimension, n, 0.1)
}

fn block_with_pushes(dimension: usize, n: usize, push: f64) -> Body {
    let per_axis = n + 1;
    let coordinates = |v: usize| (0..dimension).map(move |k| v / per_axis.pow(k as u32) % per_axis);
    let n_points = per_axis.pow(dimension as u32);
    let mut points: Vec<f64> = (0..n_points)
        .flat_map(coordinates)
        .map(|i| i as f64 / n as f64)
        .collect();
    for (v, point) in points.chunks_exact_mut(dimension).enumerate() {
        if coordinates(v).all(|i| i > 0 && i < n) {
            for (k, x) in point.iter_mut().enumerate() {
                *x += ((v * v + 7 * k) as f64).sin() * push / n as f64;
            }
        }
    }
    let orders: &[&[usize]] = match dimension {
        2 => &[&[0, 1], &[1, 0]],
        _ => &[
            &[0, 1, 2],
            &[1, 2, 0],
            &[2, 0, 1],
            &[1, 0, 2],
            &[0, 2, 1],
            &[2, 1, 0],
        ],
    };
    let mut elements = Vec::new();
    for corner in (0..n_points).filter(|&v| coordinates(v).all(|i| i < n)) {
        for (which, order) in orders.iter().enumerate() {
            let mut path = vec![corner];
            for &axis in *order {
                path.push(path[path.len() - 1] + per_axis.pow(axis as u32));
            }
            // Odd permutations of the axes run the other way round.
            if which >= orders.len() / 2 {
                path.swap(dimension - 1, dimension);
            }
            elements.extend(path);
        }
    }
    Body {
        dimension,
        points,
        elements,
    }
}

fn body<const D: usize, const N: usize>(points: &[[f64; D]], elements: &[[usize; N]]) -> Body {
    Body {
        dimension: D,
        points: points.concat(),
        elements: elements.concat(),
    }
}

#[test]
fn blocks_are_bodies_and_so_are_two_with_a_gap() {
    for dimension in [2, 3] {
        let one = block(dimension, 4);
        assert_eq!(one.check(), Ok(()));
        let other = one.clone().moved(&[1.001, 0.0, 0.0]);
        assert_eq!(one.and(&other).check(), Ok(()));
    }
}

#[test]
fn an_element_twice_is_found() {
    for dimension in [2, 3] {
        let mut block = block(dimension, 3);
        let mut again = block.elements[5 * (dimension + 1)..][..=dimension].to_vec();
        again.rotate_left(1);
        if dimension == 3 {
            // A rotation of four is odd.
            again.swap(0, 1);
        }
        block.elements.extend(again);
        let last = block.elements.len() / (dimension + 1) - 1;
        let found = block.check().unwrap_err();
        assert_eq!(found.kind, DefectKind::Twice);
        let names = [5, last].map(ElementName::Index);
        assert_eq!(found.elements, names);
    }
}

#[test]
fn two_elements_on_one_side_of_their_facet_are_found() {
    let folded = body(
        &[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [0.3, 0.5]],
        &[[0, 1, 2], [0, 1, 3]],
    );
    assert_eq!(folded.kind(), DefectKind::SameSide { inverted: false });
    let points = [
        [0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [0.0, 0.0, 1.0],
        [0.5, 0.5, 0.3],
    ];
    let folded = body(&points, &[[0, 1, 2, 3], [0, 1, 2, 4]]);
    assert_eq!(folded.kind(), DefectKind::SameSide { inverted: false });
    let message = folded.check().unwrap_err().to_string();
    assert_eq!(
        message,
        "elements number 0 and number 1, near (0.333333, 0.333333, 0.000000), \
         overlap: they lie on the same side of the face they share"
    );
}

#[test]
fn three_elements_at_a_facet_are_found() {
    let crowd = body(
        &[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [0.3, 0.5], [0.5, -1.0]],
        &[[0, 1, 2], [0, 1, 3], [0, 4, 1]],
    );
    assert_eq!(crowd.kind(), DefectKind::Crowded);
}

#[test]
fn bodies_over_each_other_are_found_however_deep() {
    for dimension in [2, 3] {
        let one = block(dimension, 3);
        for by in [[0.9999, 0.2, 0.1], [0.1, 0.05, 0.02], [1e-4, 0.0, 0.0]] {
            let other = one.clone().moved(&by);
            assert_eq!(
                one.clone().and(&other).kind(),
                DefectKind::Overlap,
                "{by:?}"
            );
        }
        // A small one within the large elements of another: no facets meet.
        let mut small = one.clone();
        for x in &mut small.points {
            *x = 0.46 + 0.01 * *x;
        }
        assert_eq!(one.and(&small).kind(), DefectKind::Overlap);
    }
}

/// A ring that closes on itself twice: every edge is right, and yet places are covered twice.
#[test]
fn a_fan_of_more_than_a_turn_is_found() {
    let n = 9;
    let mut points = vec![[0.0, 0.0]];
    points.extend((0..=n).map(|i| {
        let angle = f64::from(i) * 0.8;
        // Growing, so that no two edges lie on each other.
        let radius = 1.0 + 0.05 * f64::from(i);
        [radius * angle.cos(), radius * angle.sin()]
    }));
    let fan: Vec<[usize; 3]> = (1..=n as usize).map(|i| [0, i, i + 1]).collect();
    assert_eq!(body(&points, &fan).kind(), DefectKind::Overlap);
    assert_eq!(body(&points[..8], &fan[..6]).check(), Ok(()));
}

#[test]
fn cracks_by_duplicate_nodes_are_found() {
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
        assert_eq!(one.and(&other).kind(), DefectKind::Hanging);
    }
    // A node of the upper triangles on the edge of the lower one.
    let points = [[0.0, 0.0], [2.0, 0.0], [1.0, -1.0], [1.0, 0.0], [1.0, 1.0]];
    let hanging = body(&points, &[[0, 2, 1], [0, 3, 4], [3, 1, 4]]);
    assert_eq!(hanging.kind(), DefectKind::Hanging);
}

/// A square face cut along either diagonal: no node hangs, and yet no face is shared.
#[test]
fn faces_cut_differently_are_found() {
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
    assert_eq!(body(&points, &both).kind(), DefectKind::Hanging);
    let matching = [above[0], above[1], [1, 0, 2, 5], [0, 3, 2, 5]];
    assert_eq!(body(&points, &matching).check(), Ok(()));
}

/// Places far from the origin and cells from 1e-6 to 1 change nothing.
#[test]
fn large_coordinates_and_graded_sizes_are_no_defects() {
    for dimension in [2, 3] {
        let mut graded = block_with_pushes(dimension, 6, 0.0);
        for x in &mut graded.points {
            *x = 10f64.powf(6.0 * (*x - 1.0));
        }
        assert_eq!(graded.check(), Ok(()));
        let far = block(dimension, 6).moved(&[1e3, -2e3, 5e2]);
        assert_eq!(far.check(), Ok(()));
    }
}

/// Far more pairs than there is time for, were all compared: 4e8.
#[test]
fn large_meshes_are_checked() {
    // 17³ cells of six.
    let block = block(3, 17);
    assert_eq!(block.elements.len() / 4, 29_478);
    assert_eq!(block.check(), Ok(()));
}
