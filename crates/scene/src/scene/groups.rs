//! Groups that a scene selects by position or direction, or combines from other groups.

use std::collections::BTreeSet;

use myovib_fem::{self as fem, Mesh};

use super::builder::Builder;
use crate::InputError;
use crate::scene_file::group::{Group, Members, Place};

/// Maximum distance at which a vertex belongs to a box, sphere or plane, relative to the largest extent of the mesh.
/// Vertices of generated meshes are on surfaces only up to rounding errors and solver tolerances.
const TOLERANCE: f64 = 1e-6;

/// Members of a group: indices of points or elements, or sorted vertices of facets.
type MemberSet = BTreeSet<Vec<usize>>;

/// Condition on the coordinates of a vertex.
type Condition<'a> = Box<dyn Fn(&[f64]) -> bool + 'a>;

impl Builder<'_> {
    pub(super) fn with_group(
        &self,
        mesh: &Mesh,
        group: &Group,
        path: &str,
    ) -> Result<Mesh, InputError> {
        if group.name.is_empty() {
            let error =
                InputError::new("a group needs a name, by which loads and supports refer to it");
            return Err(self.wrong(&format!("{path}.name"), error));
        }
        if mesh.groups().contains_key(&group.name) {
            let error = InputError::new(format!("the mesh already has a group `{}`", group.name));
            return Err(self.wrong(&format!("{path}.name"), error));
        }
        let selected = self.select(mesh, group, path)?;
        if selected.is_empty() {
            let error = InputError::new(format!("the group `{}` has no members", group.name));
            let error = match &group.place {
                Place::Union { .. } => error.found("no groups"),
                Place::Intersection { .. } => error.found("groups without common members"),
                Place::Difference { .. } => {
                    error.found("all members of the first group are in the other groups")
                }
                _ => {
                    let [min, max] = fem::bounds(mesh.coordinates(), mesh.dimension());
                    error.found(format!("the mesh extends from {min:?} to {max:?} m")).next(
                        "move or enlarge the region of the group: it must contain all vertices of a member",
                    )
                }
            };
            return Err(self.wrong(path, error));
        }
        let mut groups = mesh.groups().clone();
        groups.insert(group.name.clone(), selected);
        self.at(path, mesh.with_groups(groups))
    }

    fn select(&self, mesh: &Mesh, group: &Group, path: &str) -> Result<fem::Group, InputError> {
        let dimension = mesh.dimension();
        let vector = |key, values| self.coordinates(values, dimension, &format!("{path}.{key}"));
        let direction = |key, values| self.unit_vector(values, dimension, &format!("{path}.{key}"));
        let [lowest, highest] = fem::bounds(mesh.coordinates(), mesh.dimension());
        let sizes = lowest.iter().zip(&highest).map(|(a, b)| b - a);
        let tolerance = TOLERANCE * sizes.fold(0.0, f64::max);
        let is_inside: Condition<'_> = match &group.place {
            Place::Box { min, max } => {
                vector("min", min)?;
                vector("max", max)?;
                Box::new(move |x| {
                    let within = |((x, min), max): ((&f64, &f64), &f64)| {
                        min - tolerance <= *x && *x <= max + tolerance
                    };
                    x.iter().zip(min).zip(max).all(within)
                })
            }
            Place::Sphere { center, radius } => {
                vector("center", center)?;
                Box::new(move |x| {
                    let squares = x.iter().zip(center).map(|(x, c)| (x - c).powi(2));
                    squares.sum::<f64>().sqrt() <= radius + tolerance
                })
            }
            Place::Plane { point, normal } | Place::HalfSpace { point, normal } => {
                vector("point", point)?;
                let normal = direction("normal", normal)?;
                let offset = dot(&normal, point);
                let thickness = match &group.place {
                    Place::Plane { .. } => tolerance,
                    _ => f64::INFINITY,
                };
                Box::new(move |x| (-tolerance..=thickness).contains(&(dot(&normal, x) - offset)))
            }
            Place::Direction { direction: d, angle } => {
                let d = direction("direction", d)?;
                if group.members != Members::Boundary {
                    let error =
                        InputError::new("a direction can only select facets of the boundary")
                            .allowed("members = \"boundary\"");
                    return Err(self.wrong(&format!("{path}.members"), error));
                }
                let least = angle.to_radians().cos();
                return Ok(mesh.boundary_where(|_, normal| dot(normal, &d) >= least));
            }
            Place::Union { groups } => {
                return self.combine(mesh, groups, group.members, path, |a, b| a | b);
            }
            Place::Intersection { groups } => {
                return self.combine(mesh, groups, group.members, path, |a, b| a & b);
            }
            Place::Difference { groups } => {
                return self.combine(mesh, groups, group.members, path, |a, b| a - b);
            }
        };
        Ok(match group.members {
            Members::Boundary => {
                mesh.boundary_where(|points, _| points.iter().all(|x| is_inside(x)))
            }
            Members::Points => mesh.points_where(is_inside),
            Members::Elements => mesh.elements_where(is_inside),
        })
    }

    fn combine(
        &self,
        mesh: &Mesh,
        names: &[String],
        members: Members,
        path: &str,
        operation: fn(&MemberSet, &MemberSet) -> MemberSet,
    ) -> Result<fem::Group, InputError> {
        let dimension = match members {
            Members::Points => 0,
            Members::Boundary => mesh.dimension() - 1,
            Members::Elements => mesh.dimension(),
        };
        let set = |(i, name): (usize, &String)| {
            let path = format!("{path}.groups[{i}]");
            let group = self.at(&path, mesh.group_of_dimension(name, dimension))?;
            set_of(group, dimension, mesh.dimension()).ok_or_else(|| {
                let error =
                    InputError::new(format!("the group `{name}` has members of a different type"));
                let is_allowed = |group| set_of(group, dimension, mesh.dimension()).is_some();
                let allowed = mesh.groups().iter().filter(|(_, group)| is_allowed(group));
                let names: Vec<&str> = allowed.map(|(name, _)| name.as_str()).collect();
                let error = match names.is_empty() {
                    true => error,
                    false => error.allowed(names.join(", ")),
                };
                let next = "set `members` of the new group to the member type of its `groups`";
                self.wrong(&path, error.next(next))
            })
        };
        let sets = names.iter().enumerate().map(set).collect::<Result<Vec<_>, _>>()?;
        let combined = sets.into_iter().reduce(|a, b| operation(&a, &b)).unwrap_or_default();
        let combined = combined.iter();
        Ok(match members {
            Members::Points => fem::Group::Points(combined.map(|v| v[0]).collect()),
            Members::Elements => fem::Group::Elements(combined.map(|v| v[0]).collect()),
            Members::Boundary if dimension == 1 => {
                fem::Group::Edges(combined.map(|v| [v[0], v[1]]).collect())
            }
            Members::Boundary => fem::Group::Faces(combined.map(|v| [v[0], v[1], v[2]]).collect()),
        })
    }
}

/// Returns the members of a group in a mesh of dimension `of_mesh`, or `None` if they do not have the given dimension.
fn set_of(group: &fem::Group, dimension: usize, of_mesh: usize) -> Option<MemberSet> {
    fn sorted(vertices: &[usize]) -> Vec<usize> {
        let mut vertices = vertices.to_vec();
        vertices.sort_unstable();
        vertices
    }
    let (found, members): (_, MemberSet) = match group {
        fem::Group::Points(members) => (0, members.iter().map(|&v| vec![v]).collect()),
        fem::Group::Edges(members) => (1, members.iter().map(|v| sorted(v)).collect()),
        fem::Group::Faces(members) => (2, members.iter().map(|v| sorted(v)).collect()),
        fem::Group::Elements(members) => (of_mesh, members.iter().map(|&e| vec![e]).collect()),
    };
    (found == dimension).then_some(members)
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
