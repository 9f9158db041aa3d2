//! Groups selected by position or direction, or combined from other groups.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Group selected by location, or combined from groups of the mesh and of earlier `[[group]]` sections. A location selects the
/// members of the refined mesh whose vertices are all inside.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Group {
    /// Name of the new group.
    #[schemars(length(min = 1))]
    pub name: String,
    /// Type of the members.
    #[serde(default)]
    pub members: Members,
    /// Location of the members.
    #[serde(flatten)]
    pub place: Place,
}

/// Type of the members of a group.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Members {
    /// Edges or faces on the boundary.
    #[default]
    Boundary,
    /// Vertices.
    Points,
    /// Triangles or tetrahedra.
    Elements,
}

/// Location of the members of a group.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "type", rename_all = "kebab-case")]
pub enum Place {
    /// Box parallel to the axes.
    Box {
        /// Smallest coordinates, m.
        #[schemars(length(min = 2, max = 3))]
        min: Vec<f64>,
        /// Largest coordinates, m.
        #[schemars(length(min = 2, max = 3))]
        max: Vec<f64>,
    },
    /// Circle or sphere.
    Sphere {
        /// Center, m.
        #[schemars(length(min = 2, max = 3))]
        center: Vec<f64>,
        /// Radius, m.
        #[schemars(extend("exclusiveMinimum" = 0))]
        radius: f64,
    },
    /// Line or plane, within 1e-6 of the size of the mesh.
    Plane {
        /// Point of the plane, m.
        #[schemars(length(min = 2, max = 3))]
        point: Vec<f64>,
        /// Normal of the plane, of any length.
        #[schemars(length(min = 2, max = 3))]
        normal: Vec<f64>,
    },
    /// Side of a line or plane to which the normal points, including vertices behind it within 1e-6 of the size of the
    /// mesh.
    HalfSpace {
        /// Point of the plane, m.
        #[schemars(length(min = 2, max = 3))]
        point: Vec<f64>,
        /// Normal of the plane, of any length.
        #[schemars(length(min = 2, max = 3))]
        normal: Vec<f64>,
    },
    /// Boundary facets whose outward normal points in a given direction.
    Direction {
        /// Direction, of any length.
        #[schemars(length(min = 2, max = 3))]
        direction: Vec<f64>,
        /// Largest angle between normal and direction, degrees.
        #[serde(default = "angle")]
        #[schemars(extend("exclusiveMinimum" = 0), range(max = 180))]
        angle: f64,
    },
    /// Members of any of the groups.
    Union {
        /// Groups whose members have the type `members`.
        groups: Vec<String>,
    },
    /// Members that all groups have in common.
    Intersection {
        /// Groups whose members have the type `members`.
        groups: Vec<String>,
    },
    /// Members of the first group that are not in the other groups.
    Difference {
        /// Groups whose members have the type `members`.
        groups: Vec<String>,
    },
}

fn angle() -> f64 {
    30.0
}
