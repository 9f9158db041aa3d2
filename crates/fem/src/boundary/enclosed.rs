//! Volume enclosed by a boundary group, for example the cavity of a ventricle or the lumen of a
//! vessel.

use std::collections::HashSet;

use crate::boundary::deformed::{DeformedFacets, area_vector};
use crate::boundary::facet::{facet_points, outward_facets};
use crate::element::TRIANGLE;
use crate::error::FemError;
use crate::solid::Solid;
use crate::space::Space;

/// Volume on the outer side of a deformed boundary group; in 2D the area.
///
/// Each opening is closed by a cone over its rim with apex c, the mean of the rim vertices. The
/// cone is flat if the rim is flat. With the outward normal n of the body and the area vector A of
/// each opening, the divergence theorem gives
///
/// ```text
/// V = (−∫ n·x ds + Σ c·A) / D,   A = 1/2 ∮ x × dx in 3D, (b − a) rotated by −90° in 2D.
/// ```
///
/// The group must be connected through its vertices. The volume enclosed by several pieces would be
/// ambiguous: one cavity each, or one cavity between them as for two opposite walls.
///
/// # Units
/// m³; in 2D m².
#[derive(Debug, Clone)]
pub struct EnclosedVolume {
    walls: DeformedFacets,
    /// Edges of each rim, oriented like their facets, by their nodes. In 2D: the ends of the line,
    /// first end first.
    rims: Vec<Vec<Vec<usize>>>,
    /// Weight, shape functions and their derivatives at the quadrature points of an edge.
    points: Vec<(f64, Vec<f64>, Vec<f64>)>,
}

impl EnclosedVolume {
    /// Creates the operator for a boundary group.
    ///
    /// # Errors
    /// [`FemError::UnknownGroup`]; [`FemError::WrongGroup`] if the group has other members;
    /// [`FemError::InteriorFacet`] for a member with elements on both sides;
    /// [`FemError::DisconnectedBoundary`] if the group is not connected.
    pub fn new(solid: &Solid, group: &str) -> Result<Self, FemError> {
        let space = solid.space();
        let facets = outward_facets(space, group)?;
        let disconnected = |found| FemError::DisconnectedBoundary {
            group: group.to_owned(),
            found,
        };
        let found = connected_pieces(facets.clone()).len();
        if found > 1 {
            return Err(disconnected(found));
        }
        let rims = match space.dimension() {
            2 => ends(&facets).map_err(disconnected)?,
            _ => rims(space, &facets),
        };
        let edges = facet_points(&TRIANGLE, space.degree()).into_iter();
        Ok(Self {
            walls: DeformedFacets::new(space, &facets),
            rims,
            points: edges
                .map(|q| (q.weight, q.values, q.slopes[0].clone()))
                .collect(),
        })
    }

    /// Returns the volume at displacement `u` (`n_components`): positive if the body surrounds it,
    /// negative if the group surrounds the body.
    ///
    /// # Panics
    /// Panics if `u` is too short.
    pub fn at(&self, u: &[f64]) -> f64 {
        match self.walls.dimension {
            2 => self.at_in::<2>(u),
            _ => self.at_in::<3>(u),
        }
    }

    fn at_in<const D: usize>(&self, u: &[f64]) -> f64 {
        let lids: f64 = self.rims.iter().map(|rim| self.lid::<D>(rim, u)).sum();
        (lids - self.flux::<D>(u)) / D as f64
    }

    /// Returns ∫ n·x ds.
    fn flux<const D: usize>(&self, u: &[f64]) -> f64 {
        let mut flux = 0.0;
        for nodes in &self.walls.facets {
            for point in &self.walls.points {
                let [s, t] = self.walls.tangents::<D>(nodes, point, u);
                let position = self.walls.sum::<D>(nodes, &point.values, u);
                let terms = area_vector(s, t).into_iter().zip(position);
                flux += point.weight * terms.map(|(n, x)| n * x).sum::<f64>();
            }
        }
        flux
    }

    /// Returns c·A for one opening.
    fn lid<const D: usize>(&self, rim: &[Vec<usize>], u: &[f64]) -> f64 {
        let (mut center, mut vector) = ([0.0; D], [0.0; D]);
        for edge in rim {
            let sum = |factors: &[f64]| self.walls.sum::<D>(edge, factors, u);
            for (center, midpoint) in center.iter_mut().zip(sum(&[0.5; 2])) {
                *center += midpoint / rim.len() as f64;
            }
            if D == 2 {
                vector = area_vector(sum(&[-1.0, 1.0]), [0.0; D]);
                continue;
            }
            for (weight, values, slopes) in &self.points {
                let product = area_vector(sum(values), sum(slopes));
                for (vector, product) in vector.iter_mut().zip(product) {
                    *vector += 0.5 * weight * product;
                }
            }
        }
        center.iter().zip(vector).map(|(c, a)| c * a).sum()
    }
}

/// Returns the ends of the line formed by edges in 2D (none if it is closed), or the number of
/// separate lines as an error.
fn ends(edges: &[Vec<usize>]) -> Result<Vec<Vec<Vec<usize>>>, usize> {
    let unmatched = |end: usize| {
        let others: HashSet<usize> = edges.iter().map(|edge| edge[1 - end]).collect();
        let found = edges.iter().map(move |edge| edge[end]);
        found
            .filter(move |vertex| !others.contains(vertex))
            .collect::<Vec<_>>()
    };
    match (&unmatched(0)[..], &unmatched(1)[..]) {
        ([], []) => Ok(Vec::new()),
        (&[first], &[last]) => Ok(vec![vec![vec![first, last]]]),
        (firsts, _) => Err(firsts.len()),
    }
}

/// Returns the edges that belong to one face only, grouped by opening.
fn rims(space: &Space, faces: &[Vec<usize>]) -> Vec<Vec<Vec<usize>>> {
    let edges = faces
        .iter()
        .flat_map(|face| [0, 1, 2].map(|i| [face[i], face[(i + 1) % 3]]));
    let all: HashSet<[usize; 2]> = edges.clone().collect();
    let unmatched = edges.filter(|&[a, b]| !all.contains(&[b, a]));
    let mut rims = connected_pieces(unmatched.map(Vec::from).collect());
    for edge in rims.iter_mut().flatten() {
        *edge = space.facet_nodes(edge);
    }
    rims
}

/// Groups members into pieces connected through vertices.
fn connected_pieces(mut remaining: Vec<Vec<usize>>) -> Vec<Vec<Vec<usize>>> {
    let mut pieces = Vec::new();
    while let Some(first) = remaining.pop() {
        let mut reached: HashSet<usize> = first.iter().copied().collect();
        let mut piece = vec![first];
        loop {
            let (on, off): (Vec<_>, Vec<_>) = remaining
                .into_iter()
                .partition(|member| member.iter().any(|vertex| reached.contains(vertex)));
            remaining = off;
            if on.is_empty() {
                break;
            }
            reached.extend(on.iter().flatten());
            piece.extend(on);
        }
        pieces.push(piece);
    }
    pieces
}
