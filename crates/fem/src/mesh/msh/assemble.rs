//! Builds a mesh from a parsed file.
//!
//! If the file has tetrahedra, the mesh is 3D, and lines and triangles are the curves and faces of groups.
//! Otherwise, the triangles are the elements. Nodes that do not belong to an element, for example centers of arcs,
//! are dropped.

use std::collections::{BTreeMap, BTreeSet};

use super::{Cell, MshFile, kind_of};
use crate::element::Shape;
use crate::error::{FemError, MshProblem};
use crate::mesh::{Group, Mesh, MeshNote, NodalField, is_degenerate, measure, sorted};

/// Largest distance of the vertices of a plane mesh from their plane, as a fraction of the largest coordinate.
/// Such distances are due to rounding.
const OFF_PLANE: f64 = 1e-10;

/// Line number and the problem found there.
type ProblemAt = (usize, MshProblem);

struct Parts<const D: usize, const V: usize> {
    points: Vec<[f64; D]>,
    elements: Vec<[usize; V]>,
    /// Tags of the elements in the file.
    tags: Vec<u64>,
    /// Vertex index of each node of the file, or `None` for a node outside the body.
    vertices: Vec<Option<usize>>,
}

impl MshFile {
    /// Moves triangles parallel to a plane of two axes into the plane z = 0. Returns these axes unless they are x
    /// and y.
    pub(super) fn flatten(&mut self) -> Option<[char; 2]> {
        // Surfaces of volumes without tetrahedra are rejected later.
        if self.has_volumes || self.cells.iter().any(|cell| cell.dimension == 3) {
            return None;
        }
        let triangles = self.cells.iter().filter(|cell| cell.dimension == 2);
        let vertices: Vec<_> = triangles.flat_map(|cell| &cell.vertices).collect();
        let size = self.nodes.iter().flat_map(|node| node.position);
        let size = size.fold(0.0_f64, |size, x| size.max(x.abs()));
        let normal = [2, 1, 0].into_iter().find(|&axis| {
            let along = |&vertex: &&usize| self.nodes[*vertex].position[axis];
            let (low, high) = (vertices.iter().map(along), vertices.iter().map(along));
            high.fold(f64::NEG_INFINITY, f64::max) - low.fold(f64::INFINITY, f64::min)
                <= OFF_PLANE * size
        })?;
        let axes = [[1, 2], [0, 2], [0, 1]][normal];
        for node in &mut self.nodes {
            let [x, y] = axes.map(|axis| node.position[axis]);
            node.position = [x, y, 0.0];
        }
        for data in self.data.values_mut().filter(|data| data.components == 3) {
            for value in data.values.values_mut() {
                *value = [axes[0], axes[1], normal].map(|axis| value[axis]).to_vec();
            }
        }
        (normal != 2).then(|| axes.map(|axis| ['x', 'y', 'z'][axis]))
    }

    /// Builds the mesh. Messages refer to the file as `name`.
    pub(super) fn assemble(&self, name: &str) -> Result<Mesh, FemError> {
        if self.cells.iter().any(|cell| cell.dimension == 3) {
            self.assemble_in::<3, 4>(name)
        } else {
            self.assemble_in::<2, 3>(name)
        }
    }

    fn assemble_in<const D: usize, const V: usize>(&self, name: &str) -> Result<Mesh, FemError> {
        let error_at = |(line, problem)| FemError::Msh { file: name.to_owned(), line, problem };
        let parts = self.parts::<D, V>().map_err(error_at)?;
        if parts.elements.is_empty() && !self.cells.is_empty() {
            let problem = match (self.has_volumes, self.not_meshed()) {
                (false, MshProblem::NotMeshed { meshed, .. }) => MshProblem::NoElements { meshed },
                (_, problem) => problem,
            };
            return Err(error_at((1, problem)));
        }
        let groups = self.groups(&parts).map_err(error_at)?;
        let fields = self.fields(&parts);
        let notes = self.off_vertex_notes(&parts);
        let midside = self.midside_nodes(&parts);
        let mesh = Mesh::new(parts.points, parts.elements, groups);
        let mesh = mesh.and_then(|mesh| mesh.with_fields(fields)?.with_midside_nodes(midside));
        let mesh = mesh.map_err(|error| error.with_tags(&parts.tags))?;
        Ok(mesh.with_earlier_notes(notes))
    }

    /// Returns the elements of the body and their vertices, in the order of the file.
    fn parts<const D: usize, const V: usize>(&self) -> Result<Parts<D, V>, ProblemAt> {
        let body = || self.cells.iter().filter(|cell| cell.dimension == D as u64);
        let mut vertices = vec![None; self.nodes.len()];
        for &node in body().flat_map(|cell| &cell.vertices) {
            vertices[node] = Some(0);
        }
        let size = self.nodes.iter().fold(0.0_f64, |size, node| {
            size.max(node.position[0].abs()).max(node.position[1].abs())
        });
        let mut points = Vec::new();
        for (vertex, node) in vertices.iter_mut().zip(&self.nodes) {
            let [x, y, z] = node.position;
            if vertex.is_some() {
                if D == 2 && z.abs() > OFF_PLANE * size {
                    let problem = match self.has_volumes {
                        true => self.not_meshed(),
                        false => MshProblem::NotPlane { tag: node.tag, z },
                    };
                    return Err((node.line, problem));
                }
                *vertex = Some(points.len());
                points.push(std::array::from_fn(|m| [x, y, z][m]));
            }
        }
        let shape = Shape::of_dimension(D);
        let (mut elements, mut tags) = (Vec::new(), Vec::new());
        for cell in body() {
            let element: [usize; V] = std::array::from_fn(|i| {
                vertices[cell.vertices[i]].expect("vertices of the body were numbered above")
            });
            let corners = element.map(|v| points[v]);
            if is_degenerate(&corners) {
                let (tag, measure) = (cell.tag, measure(&corners));
                return Err((cell.line, MshProblem::DegenerateElement { tag, measure, shape }));
            }
            elements.push(element);
            tags.push(cell.tag);
        }
        if D == 3 {
            self.check_triangles(&elements, &vertices)?;
        }
        Ok(Parts { points, elements, tags, vertices })
    }

    /// Returns the [`MshProblem`] for a file that contains volumes but no tetrahedra.
    fn not_meshed(&self) -> MshProblem {
        let dimension = self.cells.iter().map(|cell| cell.dimension).max();
        let dimension = dimension.unwrap_or(0);
        let meshed = ["points", "curves", "surfaces"][dimension.min(2) as usize];
        MshProblem::NotMeshed { dimension, meshed }
    }

    /// Checks that the triangles of a tetrahedral mesh are faces of tetrahedra.
    fn check_triangles<const V: usize>(
        &self,
        elements: &[[usize; V]],
        vertices: &[Option<usize>],
    ) -> Result<(), ProblemAt> {
        let sides = Shape::of_dimension(3).sides;
        let face =
            |element: &[usize; V], side: &[usize]| sorted([0, 1, 2].map(|i| element[side[i]]));
        let faces: BTreeSet<[usize; 3]> = elements
            .iter()
            .flat_map(|element| sides.iter().map(move |side| face(element, side)))
            .collect();
        let is_face = |cell: &Cell| {
            let vertices: Option<Vec<usize>> = cell.vertices.iter().map(|&n| vertices[n]).collect();
            vertices.is_some_and(|v| faces.contains(&sorted([v[0], v[1], v[2]])))
        };
        let mut triangles = self.cells.iter().filter(|cell| cell.dimension == 2);
        match triangles.find(|cell| !is_face(cell)) {
            Some(cell) => Err((cell.line, MshProblem::MixedDimensions { tag: cell.tag })),
            None => Ok(()),
        }
    }

    /// Returns the physical groups. A group without a name is identified by its dimension and tag, as in `surface 3`.
    fn groups<const D: usize, const V: usize>(
        &self,
        parts: &Parts<D, V>,
    ) -> Result<BTreeMap<String, Group>, ProblemAt> {
        let mut groups = BTreeMap::new();
        let mut n_elements = 0;
        for cell in &self.cells {
            let is_in_body = cell.dimension == D as u64;
            let index = n_elements;
            n_elements += usize::from(is_in_body);
            let physical = self.physical.get(&(cell.dimension, cell.entity));
            for &tag in physical.into_iter().flatten() {
                let named = self.names.get(&(cell.dimension, tag)).cloned();
                let name = named.unwrap_or_else(|| format!("{} {tag}", kind_of(cell.dimension)));
                let vertex = |&node: &usize| {
                    let unused = || (cell.line, MshProblem::UnusedNode(self.nodes[node].tag));
                    parts.vertices[node].ok_or_else(unused)
                };
                let vertices = cell.vertices.iter().map(vertex);
                let vertices = vertices.collect::<Result<Vec<usize>, _>>()?;
                let group = groups.entry(name).or_insert(match cell.dimension {
                    _ if is_in_body => Group::Elements(Vec::new()),
                    0 => Group::Points(Vec::new()),
                    1 => Group::Edges(Vec::new()),
                    _ => Group::Faces(Vec::new()),
                });
                match (group, vertices.as_slice()) {
                    (Group::Elements(elements), _) if is_in_body => elements.push(index),
                    (Group::Points(points), &[v]) => points.push(v),
                    (Group::Edges(edges), &[a, b]) => edges.push([a, b]),
                    (Group::Faces(faces), &[a, b, c]) => faces.push([a, b, c]),
                    _ => {}
                }
            }
        }
        Ok(groups)
    }

    /// Returns the nodal fields at the vertices.
    fn fields<const D: usize, const V: usize>(
        &self,
        parts: &Parts<D, V>,
    ) -> BTreeMap<String, NodalField> {
        let field = |(name, data): (&String, &super::Data)| {
            let mut values = Vec::new();
            for (node, _) in self.nodes.iter().zip(&parts.vertices).filter(|(_, v)| v.is_some()) {
                match data.values.get(&node.tag) {
                    Some(entries) => values.extend_from_slice(entries),
                    None => values.resize(values.len() + data.components, f64::NAN),
                }
            }
            let components = data.components;
            (name.clone(), NodalField { components, values })
        };
        self.data.iter().map(field).collect()
    }

    /// Returns a note on each field that has values at nodes other than vertices.
    fn off_vertex_notes<const D: usize, const V: usize>(
        &self,
        parts: &Parts<D, V>,
    ) -> Vec<MeshNote> {
        let nodes = || self.nodes.iter().zip(&parts.vertices);
        let note = |(name, data): (&String, &super::Data)| {
            let others = nodes().filter(|(_, vertex)| vertex.is_none());
            let values = others.filter(|(node, _)| data.values.contains_key(&node.tag));
            let values = values.count();
            (values > 0).then(|| MeshNote::OffVertexValues { field: name.clone(), values })
        };
        self.data.iter().filter_map(note).collect()
    }

    /// Returns the positions of the midside nodes, keyed by the vertices of their edges.
    fn midside_nodes<const D: usize, const V: usize>(
        &self,
        parts: &Parts<D, V>,
    ) -> BTreeMap<[usize; 2], [f64; D]> {
        let position = |([a, b], node): (&[usize; 2], &usize)| {
            let ends = sorted([parts.vertices[*a]?, parts.vertices[*b]?]);
            let position = self.nodes[*node].position;
            Some((ends, std::array::from_fn(|m| position[m])))
        };
        self.midpoints.iter().filter_map(position).collect()
    }
}
