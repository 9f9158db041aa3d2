//! The elastic body of a scene: compressibility, supports, loads.

use myovib_model::Formulation;
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Serialize};

use super::function::Function;
use super::number::Number;

/// Compressibility, damping, and form of the equations.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Solid {
    /// Bulk modulus κ, Pa; `inf` for the incompressible body.
    pub kappa: Kappa,
    /// Mass-proportional damping α, 1/s.
    #[serde(default)]
    #[schemars(range(min = 0))]
    pub alpha: f64,
    /// Stiffness-proportional damping β, s.
    #[serde(default)]
    #[schemars(range(min = 0))]
    pub beta: f64,
    /// The equations [default: position for β = 0 (velocity where κ = inf too), implicit-rate for β
    /// > 0].
    pub formulation: Option<Formulation>,
}

/// A bulk modulus: a number in Pa, or `inf`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(from = "Number", into = "Number")]
pub struct Kappa(pub f64);

impl From<Number> for Kappa {
    fn from(number: Number) -> Self {
        Self(number.0)
    }
}

impl From<Kappa> for Number {
    fn from(kappa: Kappa) -> Self {
        Self(kappa.0)
    }
}

impl JsonSchema for Kappa {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Kappa".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({
            "description": "A bulk modulus: a number in Pa, or `inf`.",
            "anyOf": [
                { "type": "number", "exclusiveMinimum": 0, "description": "Bulk modulus, Pa." },
                { "const": "inf" },
            ],
        })
    }
}

/// A coordinate direction.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Axis {
    /// Along the muscle.
    X,
    /// Across.
    Y,
    /// The third one, in space.
    Z,
}

/// A group that does not move.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Fixed {
    /// Group of points, of the boundary, or of elements.
    pub group: String,
    /// What is held [default: all].
    #[schemars(length(min = 1))]
    pub components: Option<Vec<Axis>>,
}

/// A group that moves as prescribed; a component not given is free. Displacements of the same group
/// add up. Groups that share nodes must move them alike.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Displacement {
    /// Group of points, of the boundary, or of elements.
    pub group: String,
    /// Displacement along x, m.
    pub x: Option<Function>,
    /// Along y, m.
    pub y: Option<Function>,
    /// Along z, m; in space.
    pub z: Option<Function>,
    /// A factor of the components along the group, taken at its nodes [default: 1].
    pub distribution: Option<Distribution>,
}

/// A force of fixed direction (dead load) per undeformed length (in space: area) of a boundary.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Traction {
    /// Group of edges, in space of faces.
    pub group: String,
    /// Component along x, Pa.
    pub x: Option<Function>,
    /// Along y, Pa.
    pub y: Option<Function>,
    /// Along z, Pa; in space.
    pub z: Option<Function>,
    /// A factor of the components along the group, integrated exactly up to degree 3 [default: 1].
    pub distribution: Option<Distribution>,
}

/// An expression of the undeformed coordinates `x`, `y`, `z` in m, as `"1 - (y/0.02)^2"`, or nodal
/// data of the mesh file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum Distribution {
    /// An expression of the coordinates.
    Expression(String),
    /// Nodal data.
    Nodal(NodalFactor),
}

/// Nodal data of the mesh file, linear between the vertices.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct NodalFactor {
    /// Name of the field (`$NodeData`): at each node one value for all components, or one for each.
    /// With components of 1 it is the traction in Pa, the acceleration, or the displacement.
    pub field: String,
}

/// A pressure that stays normal to the deforming boundary (follower load), per deformed length (in
/// space: area).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Pressure {
    /// Group of edges, in space of faces.
    pub group: String,
    /// The pressure, Pa; positive towards the body.
    pub value: Function,
}

/// An elastic and viscous support of a boundary: `P N + k u + c u̇ = 0` (Robin's condition).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Bed {
    /// Group of edges, in space of faces.
    pub group: String,
    /// Stiffness k per undeformed area, Pa/m.
    #[serde(default)]
    #[schemars(range(min = 0))]
    pub stiffness: f64,
    /// Damping c, Pa·s/m.
    #[serde(default)]
    #[schemars(range(min = 0))]
    pub damping: f64,
    /// Its directions.
    #[serde(default)]
    pub along: Direction,
}

/// The directions in which a bed acts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Direction {
    /// All.
    #[default]
    All,
    /// Along the undeformed boundary's normal: the body slides freely.
    Normal,
}

/// A force per mass, such as gravity.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct BodyForce {
    /// Group of elements [default: all].
    pub group: Option<String>,
    /// Acceleration along x, m/s².
    pub x: Option<Function>,
    /// Along y, m/s²; gravity is -9.81 along the axis that points up.
    pub y: Option<Function>,
    /// Along z, m/s²; in space.
    pub z: Option<Function>,
    /// A factor of the components in the group, integrated exactly up to degree 4 [default: 1].
    pub distribution: Option<Distribution>,
}
