//! Elastic body of a scene: compressibility, supports, loads.

use myovib_model::Formulation;
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Serialize};

use super::function::Function;
use super::number::Number;
use super::response::{Amplitude, Amplitudes};

/// Compressibility, damping and formulation, common to all materials.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Solid {
    /// Bulk modulus κ, Pa; `inf` for an incompressible body.
    pub bulk_modulus: BulkModulus,
    /// Mass-proportional damping α, 1/s.
    #[serde(default)]
    #[schemars(range(min = 0))]
    pub rayleigh_mass: f64,
    /// Stiffness-proportional damping β, s.
    #[serde(default)]
    #[schemars(range(min = 0))]
    pub rayleigh_stiffness: f64,
    /// Form of the equations of motion [default: implicit-rate if rayleigh_stiffness > 0; otherwise position, or
    /// velocity if bulk_modulus = inf].
    pub formulation: Option<Formulation>,
}

/// A bulk modulus: a number in Pa, or `inf`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(from = "Number", into = "Number")]
pub struct BulkModulus(pub f64);

impl From<Number> for BulkModulus {
    fn from(number: Number) -> Self {
        Self(number.0)
    }
}

impl From<BulkModulus> for Number {
    fn from(modulus: BulkModulus) -> Self {
        Self(modulus.0)
    }
}

impl JsonSchema for BulkModulus {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "BulkModulus".into()
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
    /// First coordinate.
    X,
    /// Second coordinate.
    Y,
    /// Third coordinate, in space.
    Z,
}

/// A group whose nodes do not move.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Fixed {
    /// Group of points, of the boundary, or of elements.
    pub group: String,
    /// Fixed components [default: all].
    #[schemars(length(min = 1))]
    pub components: Option<Vec<Axis>>,
}

/// A prescribed displacement of a group. Other components are free. Several
/// displacements of one group add up. Groups that share nodes must prescribe equal values there.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PrescribedDisplacement {
    /// Group of points, of the boundary, or of elements.
    pub group: String,
    /// Displacement along x, m.
    pub x: Option<Function>,
    /// Displacement along y, m.
    pub y: Option<Function>,
    /// Displacement along z, m; in space.
    pub z: Option<Function>,
    /// Amplitudes of the harmonic motion in a response, m. A component without a function is held in other
    /// analyses.
    pub response: Option<Amplitudes>,
    /// Spatial factor of the components, evaluated at the nodes [default: 1].
    pub spatial_factor: Option<SpatialFactor>,
}

/// A force with a fixed direction (dead load) per undeformed area of a boundary.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Traction {
    /// Group of edges, in space of faces.
    pub group: String,
    /// Component along x, Pa.
    pub x: Option<Function>,
    /// Component along y, Pa.
    pub y: Option<Function>,
    /// Component along z, Pa; in space.
    pub z: Option<Function>,
    /// Amplitudes of the harmonic part in a response, Pa.
    pub response: Option<Amplitudes>,
    /// Spatial factor of the components, integrated exactly up to degree 3 [default: 1].
    pub spatial_factor: Option<SpatialFactor>,
}

/// Spatial factor: an expression of the undeformed coordinates `x`, `y`, `z` in m, for example
/// `"1 - (y/0.02)^2"`, or nodal data of the mesh file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum SpatialFactor {
    /// An expression of the coordinates.
    Expression(String),
    /// Nodal data.
    Nodal(NodalFactor),
}

/// Nodal data of the mesh file, interpolated linearly between vertices.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct NodalFactor {
    /// Name of the field (`$NodeData`), with one value per node or one value per component. If all
    /// components are 1, the field itself is the load in its unit.
    pub field: String,
}

/// A pressure normal to the deformed boundary (follower load), per deformed area.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Pressure {
    /// Group of edges, in space of faces.
    pub group: String,
    /// Pressure, Pa; positive values push against the body.
    pub value: Function,
    /// Amplitude of the harmonic part in a response, Pa.
    pub response: Option<Amplitude>,
}

/// An elastic foundation of a boundary with springs and dampers (Robin condition):
/// `P N + k u + c u̇ = 0`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ElasticFoundation {
    /// Group of edges, in space of faces.
    pub group: String,
    /// Stiffness k per undeformed area, Pa/m.
    #[serde(default)]
    #[schemars(range(min = 0))]
    pub stiffness: f64,
    /// Damping c per undeformed area, Pa·s/m.
    #[serde(default)]
    #[schemars(range(min = 0))]
    pub damping: f64,
    /// Directions in which the foundation acts.
    #[serde(default)]
    pub along: Direction,
}

/// Directions in which a foundation acts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Direction {
    /// All directions.
    #[default]
    All,
    /// Along the normal of the undeformed boundary; the body can slide.
    Normal,
}

/// A force per mass, such as gravity. Gravity is -9.81 m/s² along the upward axis.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct BodyForce {
    /// Group of elements [default: all].
    pub group: Option<String>,
    /// Acceleration along x, m/s².
    pub x: Option<Function>,
    /// Acceleration along y, m/s².
    pub y: Option<Function>,
    /// Acceleration along z, m/s²; in space.
    pub z: Option<Function>,
    /// Amplitudes of the harmonic part in a response, m/s².
    pub response: Option<Amplitudes>,
    /// Spatial factor of the components, integrated exactly up to degree 4 [default: 1].
    pub spatial_factor: Option<SpatialFactor>,
}
