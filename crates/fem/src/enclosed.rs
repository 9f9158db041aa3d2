//! The volume that a part of the boundary encloses: a ventricle's cavity, a vessel's lumen.

use std::collections::HashSet;

use crate::element::TRIANGLE;
use crate::error::FemError;
use crate::facet::{cross, facet_points, outward};
use crate::follower::{FollowerPressure, turned};
use crate::solid::Solid;
use crate::space::Space;

/// The volume on the outer side of a deformed group of the boundary; in the plane the area.
///
/// An opening is closed by a cone over its rim, from the mean c of the rim's vertices: flat where
/// the rim is. By the divergence theorem, with the loads f_a of a unit [`FollowerPressure`] at the
/// nodes x_a and the vector A of each opening,
///
/// ```text
/// V = (Σ f_a·x_a + Σ c·A) / D,   A = 1/2 ∮ x × dx in space, (b − a) turned by −90° in the plane.
/// ```
///
/// # Units
/// m³; in the plane m².
#[derive(Debug, Clone)]
pub struct EnclosedVolume {
    pressure: FollowerPressure,
    /// The edges of each opening's rim, along its facets, by their nodes. In the plane: the line's
    /// ends, from its first.
    rims: Vec<Vec<Vec<usize>>>,
    dimension: usize,
    coordinates: Vec<f64>,
    /// Weight, shape functions and their slopes at the quadrature points of an edge.
    points: Vec<(f64, Vec<f64>, Vec<f64>)>,
}

impl EnclosedVolume {
    /// The operator for a group of the boundary.
    ///
    /// # Errors
    /// Those of [`FollowerPressure::new`]; [`FemError::Pieces`] for a group of several lines.
    pub fn new(solid: &Solid, group: &str) -> Result<Self, FemError> {
        let space = solid.space();
        let facets = outward(space, group)?;
        let rims = match space.dimension() {
            2 => ends(&facets).map_err(|n| FemError::Pieces {
                group: group.to_owned(),
                found: n,
            })?,
            _ => rims(space, &facets),
        };
        let edges = facet_points(&TRIANGLE, space.degree()).into_iter();
        Ok(Self {
            pressure: FollowerPressure::new(solid, group)?,
            rims,
            dimension: space.dimension(),
            coordinates: space.coordinates().to_vec(),
            points: edges
                .map(|q| (q.weight, q.values, q.slopes[0].clone()))
                .collect(),
        })
    }

    /// The volume at the displacement `u` (`n_components`): positive where the body lies around it,
    /// negative where the group lies around the body.
    ///
    /// # Panics
    /// If `u` is too short.
    pub fn at(&self, u: &[f64]) -> f64 {
        let mut load = vec![0.0; self.coordinates.len()];
        self.pressure.add_force(1.0, u, &mut load);
        let terms = load.iter().zip(&self.coordinates).zip(u);
        let walls: f64 = terms.map(|((f, x), u)| f * (x + u)).sum();
        let lids: f64 = self.rims.iter().map(|rim| self.lid(rim, u)).sum();
        (walls + lids) / self.dimension as f64
    }

    /// c·A.
    fn lid(&self, rim: &[Vec<usize>], u: &[f64]) -> f64 {
        let place = |node: usize| -> [f64; 3] {
            std::array::from_fn(|m| match m < self.dimension {
                true => {
                    let i = self.dimension * node + m;
                    self.coordinates[i] + u[i]
                }
                false => 0.0,
            })
        };
        let (mut centre, mut vector) = ([0.0; 3], [0.0; 3]);
        for edge in rim {
            let places: Vec<[f64; 3]> = edge.iter().map(|&node| place(node)).collect();
            for m in 0..3 {
                centre[m] += 0.5 * (places[0][m] + places[1][m]) / rim.len() as f64;
            }
            if self.dimension == 2 {
                let [a, b] = [places[0], places[1]];
                let [x, y] = turned([b[0] - a[0], b[1] - a[1]]);
                vector = [x, y, 0.0];
                continue;
            }
            for (weight, values, slopes) in &self.points {
                let sum = |factors: &[f64]| -> [f64; 3] {
                    let terms = || factors.iter().zip(&places);
                    std::array::from_fn(|m| terms().map(|(factor, x)| factor * x[m]).sum())
                };
                let product = cross(sum(values), sum(slopes));
                for (vector, product) in vector.iter_mut().zip(product) {
                    *vector += 0.5 * weight * product;
                }
            }
        }
        centre.iter().zip(vector).map(|(c, a)| c * a).sum()
    }
}

/// The ends of the line that edges in the plane make, or the number of lines they make.
fn ends(edges: &[Vec<usize>]) -> Result<Vec<Vec<Vec<usize>>>, usize> {
    let alone = |end: usize| {
        let others: HashSet<usize> = edges.iter().map(|edge| edge[1 - end]).collect();
        let found = edges.iter().map(move |edge| edge[end]);
        found
            .filter(move |vertex| !others.contains(vertex))
            .collect::<Vec<_>>()
    };
    match (&alone(0)[..], &alone(1)[..]) {
        ([], []) => Ok(Vec::new()),
        (&[first], &[last]) => Ok(vec![vec![vec![first, last]]]),
        (firsts, _) => Err(firsts.len()),
    }
}

/// The edges that belong to one face only, by openings.
fn rims(space: &Space, faces: &[Vec<usize>]) -> Vec<Vec<Vec<usize>>> {
    let edges = faces
        .iter()
        .flat_map(|face| [0, 1, 2].map(|i| [face[i], face[(i + 1) % 3]]));
    let all: HashSet<[usize; 2]> = edges.clone().collect();
    let mut left: Vec<[usize; 2]> = edges.filter(|&[a, b]| !all.contains(&[b, a])).collect();
    let mut rims = Vec::new();
    while let Some(first) = left.pop() {
        let (mut rim, mut reached) = (vec![first], HashSet::from(first));
        loop {
            let (on, off): (Vec<_>, Vec<_>) = left
                .into_iter()
                .partition(|edge| edge.iter().any(|vertex| reached.contains(vertex)));
            left = off;
            if on.is_empty() {
                break;
            }
            reached.extend(on.iter().flatten());
            rim.extend(on);
        }
        rims.push(rim.iter().map(|edge| space.facet_nodes(edge)).collect());
    }
    rims
}
