//! The volume that a part of the boundary encloses: a ventricle's cavity, a vessel's lumen.

use std::collections::HashSet;

use crate::boundary::deformed::{DeformedFacets, normal};
use crate::boundary::facet::{facet_points, outward};
use crate::element::TRIANGLE;
use crate::error::FemError;
use crate::solid::Solid;
use crate::space::Space;

/// The volume on the outer side of a deformed group of the boundary; in the plane the area.
///
/// An opening is closed by a cone over its rim, from the mean c of the rim's vertices: flat where
/// the rim is. By the divergence theorem, with the body's outward normal n and the vector A of each
/// opening,
///
/// ```text
/// V = (−∫ n·x ds + Σ c·A) / D,   A = 1/2 ∮ x × dx in space, (b − a) turned by −90° in the plane.
/// ```
///
/// The group is one piece, whose members hang together by their vertices. Several pieces do not say what they
/// enclose: a cavity each, or one between them, as two opposite walls do.
///
/// # Units
/// m³; in the plane m².
#[derive(Debug, Clone)]
pub struct EnclosedVolume {
    walls: DeformedFacets,
    /// The edges of each opening's rim, along its facets, by their nodes. In the plane: the line's
    /// ends, from its first.
    rims: Vec<Vec<Vec<usize>>>,
    /// Weight, shape functions and their slopes at the quadrature points of an edge.
    points: Vec<(f64, Vec<f64>, Vec<f64>)>,
}

impl EnclosedVolume {
    /// The operator for a group of the boundary.
    ///
    /// # Errors
    /// [`FemError::UnknownGroup`], [`FemError::WrongGroup`] if the group holds something else,
    /// [`FemError::InnerFacet`] for a member with the body on both sides, [`FemError::Pieces`] for a
    /// group that is not one piece.
    pub fn new(solid: &Solid, group: &str) -> Result<Self, FemError> {
        let space = solid.space();
        let facets = outward(space, group)?;
        let pieces = |found| FemError::Pieces {
            group: group.to_owned(),
            found,
        };
        let found = connected(facets.clone()).len();
        if found > 1 {
            return Err(pieces(found));
        }
        let rims = match space.dimension() {
            2 => ends(&facets).map_err(pieces)?,
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

    /// The volume at the displacement `u` (`n_components`): positive where the body lies around it,
    /// negative where the group lies around the body.
    ///
    /// # Panics
    /// If `u` is too short.
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

    /// ∫ n·x ds.
    fn flux<const D: usize>(&self, u: &[f64]) -> f64 {
        let mut flux = 0.0;
        for nodes in &self.walls.facets {
            for point in &self.walls.points {
                let [s, t] = self.walls.tangents::<D>(nodes, point, u);
                let place = self.walls.sum::<D>(nodes, &point.values, u);
                let terms = normal(s, t).into_iter().zip(place);
                flux += point.weight * terms.map(|(n, x)| n * x).sum::<f64>();
            }
        }
        flux
    }

    /// c·A.
    fn lid<const D: usize>(&self, rim: &[Vec<usize>], u: &[f64]) -> f64 {
        let (mut centre, mut vector) = ([0.0; D], [0.0; D]);
        for edge in rim {
            let sum = |factors: &[f64]| self.walls.sum::<D>(edge, factors, u);
            for (centre, middle) in centre.iter_mut().zip(sum(&[0.5; 2])) {
                *centre += middle / rim.len() as f64;
            }
            if D == 2 {
                vector = normal(sum(&[-1.0, 1.0]), [0.0; D]);
                continue;
            }
            for (weight, values, slopes) in &self.points {
                let product = normal(sum(values), sum(slopes));
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
    let alone = edges.filter(|&[a, b]| !all.contains(&[b, a]));
    let mut rims = connected(alone.map(Vec::from).collect());
    for edge in rims.iter_mut().flatten() {
        *edge = space.facet_nodes(edge);
    }
    rims
}

/// Members by pieces that hang together by their vertices.
fn connected(mut left: Vec<Vec<usize>>) -> Vec<Vec<Vec<usize>>> {
    let mut pieces = Vec::new();
    while let Some(first) = left.pop() {
        let mut reached: HashSet<usize> = first.iter().copied().collect();
        let mut piece = vec![first];
        loop {
            let (on, off): (Vec<_>, Vec<_>) = left
                .into_iter()
                .partition(|member| member.iter().any(|vertex| reached.contains(vertex)));
            left = off;
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
