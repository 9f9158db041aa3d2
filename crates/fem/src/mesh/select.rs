//! Selection of groups by position or direction.

use super::facets::{by_vertices, sorted_facets};
use super::simplices::{Simplices, outward_normal};
use super::{Group, Mesh};

impl Mesh {
    /// Returns the vertices that satisfy `is_inside`, a condition on coordinates (m).
    pub fn points_where(&self, is_inside: impl Fn(&[f64]) -> bool) -> Group {
        let points = self.coordinates().chunks_exact(self.dimension());
        let inside = points.enumerate().filter(|(_, point)| is_inside(point));
        Group::Points(inside.map(|(index, _)| index).collect())
    }

    /// Returns the elements whose vertices all satisfy `is_inside`.
    pub fn elements_where(&self, is_inside: impl Fn(&[f64]) -> bool) -> Group {
        let is_member =
            |element: &usize| self.element(*element).iter().all(|&v| is_inside(self.point(v)));
        Group::Elements((0..self.n_elements()).filter(is_member).collect())
    }

    /// Returns the boundary facets (edges in 2D, faces in 3D) whose vertices and outward unit normal satisfy a
    /// condition.
    pub fn boundary_where(&self, is_member: impl Fn(&[&[f64]], &[f64]) -> bool) -> Group {
        let dimension = self.dimension();
        let simplices = Simplices::new(dimension, &self.coordinates, &self.vertices);
        let facets = sorted_facets(&simplices);
        let mut members = Vec::new();
        for facet in by_vertices(&facets) {
            let &[facet] = facet else { continue };
            let vertices = facet.vertices();
            let mut corners = simplices.corners(facet.element);
            let inner = corners.remove(facet.opposite);
            let normal = outward_normal(&corners, inner);
            let points: Vec<&[f64]> = vertices.iter().map(|&v| self.point(v)).collect();
            if is_member(&points, &normal[..dimension]) {
                members.push(vertices.to_vec());
            }
        }
        match dimension {
            2 => Group::Edges(members.iter().map(|v| [v[0], v[1]]).collect()),
            _ => Group::Faces(members.iter().map(|v| [v[0], v[1], v[2]]).collect()),
        }
    }

    fn point(&self, vertex: usize) -> &[f64] {
        &self.coordinates[self.dimension() * vertex..][..self.dimension()]
    }
}
