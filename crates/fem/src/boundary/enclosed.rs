//! Volume enclosed by a boundary group, for example the cavity of a ventricle or the lumen of a
//! vessel.

use std::collections::HashSet;

use crate::boundary::deformed::DeformedFacets;
use crate::boundary::facet::{area_vector, facet_points, outward_facets};
use crate::element::TRIANGLE;
use crate::error::FemError;
use crate::mesh::{Group, bounds};
use crate::solid::Solid;
use crate::space::Space;

/// Volume (area in 2D) on the outer side of a deformed boundary group.
///
/// Each opening is closed by a cone over its rim. The apex c of the cone is the mean of the rim vertices, so the
/// cone is flat if the rim is flat. With the outward normal n of the body and the area vector A of each opening,
/// the divergence theorem yields
///
/// ```text
/// V = (−∫ n·x ds + Σ c·A) / D,   A = 1/2 ∮ x × dx in 3D, (b − a) rotated by −90° in 2D.
/// ```
///
/// The group must be connected through its vertices. The volume enclosed by several pieces would be ambiguous:
/// each piece could have its own cavity, or there could be one cavity between the pieces, as between two opposite
/// walls.
///
/// A model of a part of a symmetric body has openings at its planes of symmetry. With
/// [`with_symmetry`](Self::with_symmetry), positions are measured from a point on all these planes, so that the
/// planes do not contribute to the volume. The remaining part of a rim is closed by a cone. The apex of the cone
/// is the mean of the vertices of this part, moved onto the planes at which the part ends.
///
/// # Units
/// m³ (m² in 2D).
#[derive(Debug, Clone)]
pub struct EnclosedVolume {
    walls: DeformedFacets,
    /// Edges of each rim as lists of nodes, oriented like the facets. In 2D: the ends of the line, starting with
    /// its first end.
    rims: Vec<Vec<Vec<usize>>>,
    /// Weights, shape functions and derivatives of shape functions at the quadrature points of an edge.
    points: Vec<(f64, Vec<f64>, Vec<f64>)>,
    /// Planes of symmetry, each given by its normal axis and a node on it.
    planes: Vec<(usize, usize)>,
    /// Sides of the rims that may be on a plane of symmetry, given by their sorted vertices and the axis normal to
    /// this plane.
    cuts: HashSet<(Vec<usize>, usize)>,
}

/// Maximum distance of the vertices of a flat rim from its plane, as a fraction of the rim's size.
const FLAT: f64 = 1e-2;
/// Maximum distance of nodes from the plane of symmetry, as a fraction of the size of the rims.
const ON_PLANE: f64 = 1e-6;

impl EnclosedVolume {
    /// Creates the operator for a boundary group.
    ///
    /// # Errors
    /// Returns [`FemError::UnknownGroup`] if the group does not exist, [`FemError::WrongGroup`] if its members are
    /// of another kind, [`FemError::InteriorFacet`] if a member has elements on both sides, or
    /// [`FemError::DisconnectedBoundary`] if the group is not connected.
    pub fn new(solid: &Solid, group: &str) -> Result<Self, FemError> {
        let space = solid.space();
        let facets = outward_facets(space, group)?;
        let disconnected =
            |found| FemError::DisconnectedBoundary { group: group.to_owned(), found };
        let found = connected_pieces(facets.clone()).len();
        if found > 1 {
            return Err(disconnected(found));
        }
        let rims = match space.dimension() {
            2 => ends(&facets).map_err(disconnected)?,
            _ => rims(space, &facets),
        };
        let edges = facet_points(&TRIANGLE, space.degree()).into_iter();
        let mut volume = Self {
            walls: DeformedFacets::new(space, &facets),
            rims,
            points: edges.map(|q| (q.weight, q.values, q.slopes[0].clone())).collect(),
            planes: Vec::new(),
            cuts: HashSet::new(),
        };
        volume.cuts = cuts(solid, &facets, ON_PLANE * volume.rim_size());
        Ok(volume)
    }

    /// Restricts the volume to the modeled part of a symmetric cavity. The planes of symmetry are normal to
    /// `axes`. At a rim, a facet of the remaining boundary is in such a plane, and the nodes of this facet are
    /// fixed along the axis.
    ///
    /// # Errors
    /// Returns [`FemError::NoSymmetryPlane`] if, for an axis, no rim side is in such a plane, or if rim sides are
    /// in several such planes.
    pub fn with_symmetry(mut self, axes: &[usize]) -> Result<Self, FemError> {
        let dimension = self.walls.dimension;
        let size = self.rim_size();
        for &axis in axes {
            let place = |node: usize| self.walls.coordinates[dimension * node + axis];
            let on_plane = self.rim_sides().filter(|side| self.is_cut(side, axis));
            let nodes: Vec<usize> = on_plane.map(|side| side[0]).collect();
            let different =
                |&&node: &&usize| (place(node) - place(nodes[0])).abs() > ON_PLANE * size;
            match nodes.first() {
                Some(&node) if !nodes.iter().any(|node| different(&node)) => {
                    self.planes.push((axis, node))
                }
                _ => return Err(FemError::NoSymmetryPlane { axis }),
            }
        }
        let rims = std::mem::take(&mut self.rims);
        let on_plane = |nodes: &[usize]| {
            self.planes.iter().any(|&(axis, node)| {
                let place = |node: usize| self.walls.coordinates[dimension * node + axis];
                nodes.iter().all(|&other| (place(other) - place(node)).abs() <= ON_PLANE * size)
            })
        };
        let left = rims.into_iter().flatten().filter(|side| match dimension {
            2 => !side.iter().all(|&node| on_plane(&[node])),
            _ => !on_plane(side),
        });
        self.rims = connected_pieces(left.collect());
        Ok(self)
    }

    /// Returns the sides of all rims: edges in 3D, or the ends of the line in 2D.
    fn rim_sides(&self) -> impl Iterator<Item = &[usize]> {
        let n = if self.walls.dimension == 2 { 1 } else { usize::MAX };
        self.rims.iter().flatten().flat_map(move |side| side.chunks(n.min(side.len())))
    }

    /// Returns whether the boundary beyond a side of a rim may be in a plane of symmetry normal to `axis`.
    fn is_cut(&self, side: &[usize], axis: usize) -> bool {
        self.cuts.contains(&(sorted(&side[..self.walls.dimension - 1]), axis))
    }

    /// Returns whether the rim probably ends at a plane of symmetry and is not flat, so that its cone cuts off a
    /// part of the cavity. This is the case if some of its nodes are fixed along some axes and free along others,
    /// or if the boundary beyond it is in a plane.
    pub fn may_end_at_symmetry(&self, solid: &Solid) -> bool {
        let (dimension, is_held) = (self.walls.dimension, held(solid));
        let n_held = |node: usize| (0..dimension).filter(|&axis| is_held(node, axis)).count();
        let mut nodes = self.rims.iter().flatten().flatten();
        let is_partly_held = nodes.any(|&node| (1..dimension).contains(&n_held(node)));
        let mut sides = self.rim_sides();
        let is_cut = sides.any(|side| (0..dimension).any(|axis| self.is_cut(side, axis)));
        (is_partly_held || is_cut) && !self.has_flat_openings(solid)
    }

    /// Returns whether each opening is flat at rest. In 2D, the chord between the two ends is flat if both are
    /// held in one plane and neither end is held at a plane normal to it.
    fn has_flat_openings(&self, solid: &Solid) -> bool {
        if self.walls.dimension == 2 {
            let (is_held, size) = (held(solid), self.rim_size());
            let is_in_plane = |ends: &[usize], axis: usize| {
                let [first, last] = [0, 1].map(|i| self.walls.coordinates[2 * ends[i] + axis]);
                let is_at_plane =
                    |&end: &usize| is_held(end, axis) && !self.is_cut(&[end], 1 - axis);
                (first - last).abs() <= ON_PLANE * size && ends.iter().all(is_at_plane)
            };
            let mut chords = self.rims.iter().flatten();
            return chords.all(|ends| (0..2).any(|axis| is_in_plane(ends, axis)));
        }
        let (none, size) = (vec![0.0; self.walls.coordinates.len()], self.rim_size());
        self.rims.iter().all(|rim| {
            let (center, vector) = self.cone::<3>(rim, &none);
            let length = vector.iter().map(|x| x * x).sum::<f64>().sqrt();
            rim.iter().flatten().all(|&node| {
                let place = &self.walls.coordinates[3 * node..][..3];
                let terms = place.iter().zip(center).zip(vector);
                let distance = terms.map(|((x, c), a)| (x - c) * a).sum::<f64>() / length;
                distance.abs() <= FLAT * size
            })
        })
    }

    /// Returns the largest extent of the rims along an axis, m.
    fn rim_size(&self) -> f64 {
        let dimension = self.walls.dimension;
        let nodes = self.rims.iter().flatten().flatten();
        let places = nodes.map(|node| &self.walls.coordinates[dimension * node..][..dimension]);
        let [low, high] = bounds(&places.collect::<Vec<_>>().concat(), dimension);
        high.iter().zip(low).map(|(high, low)| high - low).fold(0.0, f64::max)
    }

    /// Returns the volume at displacement `u`, which has length `n_components`. The volume is positive if the body
    /// surrounds the volume, and negative if the surface of the group surrounds the body.
    ///
    /// # Panics
    /// Panics if `u` is too short.
    pub fn at(&self, u: &[f64]) -> f64 {
        in_dimension!(self.walls.dimension, |D| {
            let origin = self.origin::<D>(u);
            let lids: f64 = self.rims.iter().map(|rim| self.lid::<D>(rim, origin, u)).sum();
            (lids - self.flux::<D>(origin, u)) / D as f64
        })
    }

    /// Returns a point on all planes of symmetry, which are at their positions for the displacement `u`.
    fn origin<const D: usize>(&self, u: &[f64]) -> [f64; D] {
        let mut origin = [0.0; D];
        for &(axis, node) in &self.planes {
            origin[axis] = self.walls.coordinates[D * node + axis] + u[D * node + axis];
        }
        origin
    }

    /// Returns ∫ n·(x − x₀) ds.
    fn flux<const D: usize>(&self, origin: [f64; D], u: &[f64]) -> f64 {
        let mut flux = 0.0;
        for nodes in &self.walls.facets {
            for point in &self.walls.points {
                let [s, t] = self.walls.tangents::<D>(nodes, point, u);
                let place = self.walls.sum::<D>(nodes, &point.values, u);
                let terms = area_vector(s, t).into_iter().zip(place).zip(origin);
                flux += point.weight * terms.map(|((n, x), o)| n * (x - o)).sum::<f64>();
            }
        }
        flux
    }

    /// Returns (c − x₀)·A.
    fn lid<const D: usize>(&self, rim: &[Vec<usize>], origin: [f64; D], u: &[f64]) -> f64 {
        let (center, vector) = self.cone::<D>(rim, u);
        let terms = center.iter().zip(vector).zip(origin);
        terms.map(|((c, a), o)| (c - o) * a).sum()
    }

    /// Returns the apex c of the cone over a rim, and its area vector A.
    fn cone<const D: usize>(&self, rim: &[Vec<usize>], u: &[f64]) -> ([f64; D], [f64; D]) {
        let (mut center, mut vector) = ([0.0; D], [0.0; D]);
        for edge in rim {
            let middle = self.walls.sum::<D>(edge, &[0.5; 2], u);
            for (center, middle) in center.iter_mut().zip(middle) {
                *center += middle / rim.len() as f64;
            }
        }
        if D == 3 {
            // If a rim is not closed, its ends are on planes of symmetry.
            let origin = self.origin::<D>(u);
            for axis in self.planes_of(rim) {
                center[axis] = origin[axis];
            }
        }
        for edge in rim {
            let sum = |factors: &[f64]| self.walls.sum::<D>(edge, factors, u);
            if D == 2 {
                vector = area_vector(sum(&[-1.0, 1.0]), [0.0; D]);
                continue;
            }
            for (weight, values, slopes) in &self.points {
                let mut place = sum(values);
                place.iter_mut().zip(center).for_each(|(x, c)| *x -= c);
                let product = area_vector(place, sum(slopes));
                for (vector, product) in vector.iter_mut().zip(product) {
                    *vector += 0.5 * weight * product;
                }
            }
        }
        (center, vector)
    }

    /// Returns the axes of the planes of symmetry at which a rim ends.
    fn planes_of(&self, rim: &[Vec<usize>]) -> Vec<usize> {
        let dimension = self.walls.dimension;
        let count = |vertex: usize| {
            let ends = rim.iter().flat_map(|edge| &edge[..2]);
            ends.filter(|&&end| end == vertex).count()
        };
        let place = |node: usize, axis: usize| self.walls.coordinates[dimension * node + axis];
        let ends = rim.iter().flat_map(|edge| &edge[..2]);
        let ends: Vec<usize> = ends.copied().filter(|&vertex| count(vertex) == 1).collect();
        let size = self.rim_size();
        let near = |axis: usize, node: usize| {
            let distances = ends.iter().map(|&end| (place(end, axis) - place(node, axis)).abs());
            distances.fold(f64::INFINITY, f64::min) <= ON_PLANE * size
        };
        let planes = self.planes.iter().filter(|&&(axis, node)| near(axis, node));
        planes.map(|&(axis, _)| axis).collect()
    }
}

/// Returns the ends of the line that the edges form in 2D. The result is empty if the line is closed. If there are
/// several separate lines, returns the number of lines as an error.
fn ends(edges: &[Vec<usize>]) -> Result<Vec<Vec<Vec<usize>>>, usize> {
    let unmatched = |end: usize| {
        let others: HashSet<usize> = edges.iter().map(|edge| edge[1 - end]).collect();
        let found = edges.iter().map(move |edge| edge[end]);
        found.filter(move |vertex| !others.contains(vertex)).collect::<Vec<_>>()
    };
    match (&unmatched(0)[..], &unmatched(1)[..]) {
        ([], []) => Ok(Vec::new()),
        (&[first], &[last]) => Ok(vec![vec![vec![first, last]]]),
        (firsts, _) => Err(firsts.len()),
    }
}

fn sorted(vertices: &[usize]) -> Vec<usize> {
    let mut sorted = vertices.to_vec();
    sorted.sort_unstable();
    sorted
}

/// Returns those sides of facets outside a group that may be in a plane of symmetry, each with the axis normal to
/// the plane. All nodes of such a facet are fixed along this axis, and their coordinates along it differ by at
/// most `tolerance`. Facets of the group are excluded, because a support may move them.
fn cuts(solid: &Solid, facets: &[Vec<usize>], tolerance: f64) -> HashSet<(Vec<usize>, usize)> {
    let (space, is_held) = (solid.space(), held(solid));
    let dimension = space.dimension();
    let members: HashSet<Vec<usize>> = facets.iter().map(|facet| sorted(facet)).collect();
    let boundary: Vec<Vec<usize>> = match space.mesh().boundary_where(|_, _| true) {
        Group::Edges(edges) => edges.into_iter().map(Vec::from).collect(),
        Group::Faces(faces) => faces.into_iter().map(Vec::from).collect(),
        Group::Points(_) | Group::Elements(_) => Vec::new(),
    };
    let mut cuts = HashSet::new();
    for facet in boundary.iter().filter(|facet| !members.contains(&sorted(facet))) {
        let nodes = space.facet_nodes(facet);
        let place = |node: usize, axis: usize| space.node_point(node)[axis];
        for axis in 0..dimension {
            let is_in_plane = |&node: &usize| {
                is_held(node, axis)
                    && (place(node, axis) - place(nodes[0], axis)).abs() <= tolerance
            };
            if nodes.iter().all(is_in_plane) {
                let sides = (0..dimension).map(|i| {
                    let others = (0..dimension).filter(|&j| j != i);
                    sorted(&others.map(|j| facet[j]).collect::<Vec<_>>())
                });
                cuts.extend(sides.map(|side| (side, axis)));
            }
        }
    }
    cuts
}

/// Returns a function that determines whether a node is fixed or moved by a support along an axis.
fn held(solid: &Solid) -> impl Fn(usize, usize) -> bool {
    let (dimension, free) = (solid.space().dimension(), solid.dofs().free_to_full());
    move |node, axis| free.binary_search(&(dimension * node + axis)).is_err()
}

/// Returns the edges that belong to a single face, grouped by opening.
fn rims(space: &Space, faces: &[Vec<usize>]) -> Vec<Vec<Vec<usize>>> {
    let edges = faces.iter().flat_map(|face| [0, 1, 2].map(|i| [face[i], face[(i + 1) % 3]]));
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
