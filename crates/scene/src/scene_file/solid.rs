//! The elastic body of a scene: compressibility, supports, loads.

use myovib_model::Formulation;
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Serialize};

use super::function::Function;
use super::number::Number;

/// Compressibility, damping, and the way the equations are written.
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
    /// The DAE to integrate [default: position for β = 0 (velocity where κ = inf too),
    /// implicit-rate for β > 0].
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

/// A group whose nodes do not move.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Fixed {
    /// Physical group: of points, of the boundary, or of elements.
    pub group: String,
    /// The components that are held [default: all].
    #[schemars(length(min = 1))]
    pub components: Option<Vec<Axis>>,
}

/// A group whose nodes move as prescribed; a component not given is free.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Displacement {
    /// Physical group: of points, of the boundary, or of elements.
    pub group: String,
    /// Displacement along x, m.
    pub x: Option<Function>,
    /// Along y, m.
    pub y: Option<Function>,
    /// Along z, m; in space.
    pub z: Option<Function>,
}

/// A force per undeformed length (in space: area) of a boundary, with a fixed direction (dead load).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Traction {
    /// Physical group of the boundary: edges, in space faces.
    pub group: String,
    /// Component along x, Pa.
    pub x: Option<Function>,
    /// Along y, Pa.
    pub y: Option<Function>,
    /// Along z, Pa; in space.
    pub z: Option<Function>,
    /// How it varies along the group: a factor of the components [default: 1].
    pub distribution: Option<Distribution>,
}

/// How a traction varies along its group: an expression of the coordinates `x`, `y` and (in space)
/// `z` of the undeformed body in m, as `"1 - (y/0.02)^2"`, or nodal data of the mesh file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum Distribution {
    /// An expression of the coordinates.
    Expression(String),
    /// Nodal data.
    Nodal(NodalFactor),
}

/// A factor from nodal data of the mesh file, linear between the vertices.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct NodalFactor {
    /// Name of the field (`$NodeData`): of one value at each node, the factor of all components, or
    /// of three, a factor of each. A traction in Pa goes with components of 1.
    pub field: String,
}

/// A pressure on a boundary that stays normal to it as the body deforms (follower load), per
/// deformed length (in space: area).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Pressure {
    /// Physical group of the boundary: edges, in space faces.
    pub group: String,
    /// The pressure, Pa, positive towards the body.
    pub value: Function,
}

/// An elastic and viscous support of a boundary, `P N + k u + c u̇ = 0` there (Robin's condition):
/// what surrounds the body.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Bed {
    /// Physical group of the boundary: edges, in space faces.
    pub group: String,
    /// Stiffness k per undeformed area, Pa/m.
    #[serde(default)]
    #[schemars(range(min = 0))]
    pub stiffness: f64,
    /// Damping c per undeformed area, Pa·s/m.
    #[serde(default)]
    #[schemars(range(min = 0))]
    pub damping: f64,
    /// The directions in which it acts.
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
    /// Along the normal of the undeformed boundary: the body slides freely.
    Normal,
}

/// A force per mass throughout a region, gravity for one.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct BodyForce {
    /// Physical group of elements [default: all].
    pub group: Option<String>,
    /// Acceleration along x, m/s².
    pub x: Option<Function>,
    /// Along y, m/s²; gravity is -9.81 along whatever points up.
    pub y: Option<Function>,
    /// Along z, m/s²; in space.
    pub z: Option<Function>,
}
