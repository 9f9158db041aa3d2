//! Positions in the body at which chains are driven, and directions of the forcing.

use myovib_fem::{Barycentric, ElementPoint, Group, Mesh, Space, bounds};
use myovib_model::{ModelError, Probe};

use super::Body;
use super::builder::Builder;
use super::materials::GIVE_FIBER;
use super::places::written;
use crate::InputError;
use crate::scene_file::SceneFile;
use crate::scene_file::chain::{Chain, Component, ComponentName, Place};

/// Maximum total number of oscillators at all positions of a chain. Also the maximum number of grid points.
pub(super) const MAX_OSCILLATORS: usize = 1_000_000;

/// Position in the body at which a chain is driven.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DrivenPlace {
    /// Position in the mesh.
    pub at: ElementPoint,
    /// Unit vector d of the forcing γ d·u. In 2D, its third component is zero.
    pub direction: [f64; 3],
}

impl DrivenPlace {
    /// Returns the coordinates at rest (m). In 2D, the third coordinate is zero.
    pub(crate) fn point(&self, space: &Space) -> [f64; 3] {
        let probe = Probe::located_at(space, self.at);
        [0, 1, 2].map(|axis| probe.point().get(axis).copied().unwrap_or_default())
    }
}

#[derive(Default)]
pub(super) struct Found {
    pub(super) places: Vec<DrivenPlace>,
    /// Number of grid points outside the body.
    pub(super) outside: usize,
}

impl Builder<'_> {
    /// Returns the positions at which the body drives a chain, in the order in which the frequencies of the oscillators
    /// are drawn.
    pub(super) fn places_of(
        &self,
        body: &Body,
        chain: &Chain,
        path: &str,
    ) -> Result<Found, InputError> {
        let space = body.muscle.solid.space();
        let here = format!("{path}.at");
        let (places, outside) = match &chain.at {
            Some(Place::Point(at)) => (vec![self.located(space, at, &here)?], 0),
            Some(Place::Points(list)) => {
                let points = list.iter().enumerate();
                let found = points.map(|(i, at)| self.located(space, at, &format!("{here}[{i}]")));
                (found.collect::<Result<_, _>>()?, 0)
            }
            Some(Place::Elements { elements }) => {
                let members = self.elements(Some(elements), space.mesh(), &here)?;
                (members.into_iter().map(|e| middle(space, e)).collect(), 0)
            }
            Some(Place::Vertices { vertices }) => {
                let wanted = |element: usize| match chain.component {
                    Component::Named(ComponentName::Fiber) => has_fiber(self.file, body, element),
                    _ => true,
                };
                (self.vertices(space, vertices, wanted, &here)?, 0)
            }
            Some(Place::Grid { from, to, points }) => {
                self.grid(space, [from, to], points, &here)?
            }
            Some(Place::Position(_)) | None => (Vec::new(), 0),
        };
        let path = format!("{path}.component");
        let drive = |at: ElementPoint| {
            Ok(DrivenPlace { direction: self.direction(body, &chain.component, at, &path)?, at })
        };
        Ok(Found { places: places.into_iter().map(drive).collect::<Result<_, _>>()?, outside })
    }

    fn located(&self, space: &Space, at: &[f64], path: &str) -> Result<ElementPoint, InputError> {
        Ok(self.at(path, Probe::at(space, at))?.located())
    }

    /// Returns the vertices of a group. Each vertex is located in the first selected element that contains it.
    fn vertices(
        &self,
        space: &Space,
        group: &str,
        wanted: impl Fn(usize) -> bool,
        path: &str,
    ) -> Result<Vec<ElementPoint>, InputError> {
        let mesh = space.mesh();
        let path = format!("{path}.vertices");
        let members = self.at(&path, mesh.group(group))?;
        let vertices = vertices_of(mesh, members);
        if vertices.is_empty() {
            let error = InputError::new(format!("the group `{group}` has no vertices"));
            return Err(self.wrong(&path, error.next("name a group with members")));
        }
        let mut owners: Vec<Option<ElementPoint>> = vec![None; mesh.n_points()];
        let elements = match members {
            Group::Elements(members) => members.clone(),
            _ => (0..mesh.n_elements()).collect(),
        };
        for element in elements.into_iter().filter(|&element| wanted(element)) {
            for (corner, &vertex) in mesh.element(element).iter().enumerate() {
                let mut lambda = vec![0.0; mesh.element(element).len()];
                lambda[corner] = 1.0;
                owners[vertex].get_or_insert(ElementPoint {
                    element,
                    barycentric: Barycentric::new(&lambda),
                });
            }
        }
        let located: Option<Vec<ElementPoint>> = vertices.iter().map(|&v| owners[v]).collect();
        located.ok_or_else(|| {
            let without = vertices.iter().filter(|&&v| owners[v].is_none()).count();
            let error = InputError::new(format!(
                "the body has no fibers at {without} of the {} vertices of `{group}`",
                vertices.len()
            ));
            self.wrong(&path, error.next(GIVE_FIBER))
        })
    }

    /// Returns the grid points inside the body and the number of grid points outside. The x coordinate varies fastest.
    fn grid(
        &self,
        space: &Space,
        corners: [&Vec<f64>; 2],
        points: &[usize],
        path: &str,
    ) -> Result<(Vec<ElementPoint>, usize), InputError> {
        let dimension = space.dimension();
        let [from, to] = corners;
        for (key, found) in [("from", from.len()), ("to", to.len()), ("points", points.len())] {
            if found != dimension {
                let error = InputError::new("a grid requires one number for each axis of the body")
                    .found(format!("{found} numbers"))
                    .allowed(format!("{dimension}"));
                return Err(self.wrong(&format!("{path}.{key}"), error));
            }
        }
        let n = points.iter().fold(1_usize, |n, one| n.saturating_mul(*one));
        if n > MAX_OSCILLATORS {
            let error = InputError::new("too many points").found(n);
            let error = error.allowed(format!("{MAX_OSCILLATORS} at most"));
            return Err(self.wrong(&format!("{path}.points"), error));
        }
        let coordinate = |axis: usize, i: usize| {
            let s = match points[axis] {
                1 => 0.5,
                n => i as f64 / (n - 1) as f64,
            };
            (1.0 - s) * from[axis] + s * to[axis]
        };
        let mut found = Vec::new();
        for number in 0..n {
            let mut rest = number;
            let point: Vec<f64> = (0..dimension)
                .map(|axis| {
                    let i = rest % points[axis];
                    rest /= points[axis];
                    coordinate(axis, i)
                })
                .collect();
            match Probe::at(space, &point) {
                Ok(probe) => found.push(probe.located()),
                Err(ModelError::OutsideMesh { .. }) => {}
                Err(error) => return self.at(path, Err(error)),
            }
        }
        if found.is_empty() {
            let [low, high] = bounds(space.coordinates(), space.dimension());
            let error = InputError::new("no grid point is in the body")
                .found(format!("{n} points from {from:?} to {to:?}"))
                .allowed(format!("points of the body, which extends from {low:?} to {high:?} m"));
            return Err(self.wrong(path, error));
        }
        let outside = n - found.len();
        Ok((found, outside))
    }

    /// Returns the unit vector d for which the displacement d·u drives the chain at a position.
    fn direction(
        &self,
        body: &Body,
        component: &Component,
        at: ElementPoint,
        path: &str,
    ) -> Result<[f64; 3], InputError> {
        let solid = &body.muscle.solid;
        let unit = |axis: usize| {
            self.component(axis, solid.space().dimension(), path)?;
            Ok([0, 1, 2].map(|i| f64::from(u8::from(i == axis))))
        };
        match component {
            Component::Named(ComponentName::X) => unit(0),
            Component::Named(ComponentName::Y) => unit(1),
            Component::Named(ComponentName::Z) => unit(2),
            Component::Named(ComponentName::Fiber) => {
                match has_fiber(self.file, body, at.element) {
                    true => Ok(solid.axes_at(&at).fiber),
                    false => {
                        let probe = Probe::located_at(solid.space(), at);
                        let error = InputError::new(format!(
                            "the material at the chain's position ({}) has no fibers",
                            written(probe.point())
                        ));
                        Err(self.wrong(path, error.next(GIVE_FIBER)))
                    }
                }
            }
            Component::Along(vector) => {
                let vector = self.vector(vector, solid.space().mesh(), path)?;
                let length = vector.iter().map(|x| x * x).sum::<f64>().sqrt();
                match length > 0.0 && length.is_finite() {
                    true => Ok(vector.map(|x| x / length)),
                    false => {
                        let error = InputError::new("the direction is too long or too short");
                        Err(self.wrong(path, error.found(format!("{vector:?}"))))
                    }
                }
            }
        }
    }
}

fn middle(space: &Space, element: usize) -> ElementPoint {
    Probe::in_element(space, element).located()
}

/// Returns whether the material of an element defines fiber directions.
fn has_fiber(file: &SceneFile, body: &Body, element: usize) -> bool {
    file.material[body.regions[element]].fiber.is_some()
}

/// Returns the vertices of a group in ascending order.
fn vertices_of(mesh: &Mesh, group: &Group) -> Vec<usize> {
    let mut vertices: Vec<usize> = match group {
        Group::Points(points) => points.clone(),
        Group::Edges(edges) => edges.concat(),
        Group::Faces(faces) => faces.concat(),
        Group::Elements(members) => {
            members.iter().flat_map(|&element| mesh.element(element)).copied().collect()
        }
    };
    vertices.sort_unstable();
    vertices.dedup();
    vertices
}
