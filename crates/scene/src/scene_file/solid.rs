//! Elastic body of a scene: compressibility, supports, loads.

use myovib_model::Formulation;
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Serialize};

use super::function::Function;
use super::number::Number;
use super::response::Amplitudes;

/// Compressibility, damping and formulation.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Solid {
    /// Bulk modulus κ, Pa; `inf` for an incompressible body.
    pub bulk_modulus: BulkModulus,
    /// Volumetric energy of laws that do not define their own.
    #[serde(default)]
    pub volumetric_energy: VolumetricEnergy,
    /// Mass-proportional damping α, 1/s.
    #[serde(default)]
    #[schemars(range(min = 0))]
    pub rayleigh_mass: f64,
    /// Stiffness-proportional damping β, s.
    #[serde(default)]
    #[schemars(range(min = 0))]
    pub rayleigh_stiffness: f64,
    /// Form of the equations [default: implicit-rate if β > 0, else position, or velocity if κ = inf].
    pub formulation: Option<Formulation>,
    /// Whether equilibria and motions with inverted elements are accepted.
    #[serde(default)]
    pub allow_inverted: bool,
}

/// Energy of volume changes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum VolumetricEnergy {
    /// `κ/2 (J − 1)²`.
    #[default]
    Quadratic,
    /// `κ/2 (ln J)²`, which resists the collapse of elements; only with a finite `bulk_modulus`.
    Logarithmic,
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
    /// Third coordinate.
    Z,
}

/// Group whose nodes do not move.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Fixed {
    /// Group of points, boundary facets or elements.
    pub group: String,
    /// Fixed components [default: all].
    #[schemars(length(min = 1))]
    pub components: Option<Vec<Axis>>,
}

/// Prescribed displacement of a group. Components that are not given are free. Displacements of the same group add up.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PrescribedDisplacement {
    /// Group of points, boundary facets or elements.
    pub group: String,
    /// Displacement, m.
    pub x: Option<Function>,
    /// Displacement, m.
    pub y: Option<Function>,
    /// Displacement, m.
    pub z: Option<Function>,
    /// Rotation of the group as a rigid body.
    pub rotation: Option<Rotation>,
    /// Harmonic motion in a response, m; in other analyses, its components are fixed.
    pub response: Option<Amplitudes>,
    /// Factor of the displacement, evaluated at the nodes [default: 1].
    pub spatial_factor: Option<SpatialFactor>,
}

/// Rotation about an axis.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Rotation {
    /// Angle, rad, counterclockwise (in 3D, right-hand rule).
    pub angle: Function,
    /// Point of the axis, m.
    #[schemars(length(min = 2, max = 3))]
    pub point: Vec<f64>,
    /// Direction of the axis in 3D, of any length.
    #[schemars(length(min = 3, max = 3))]
    pub axis: Option<Vec<f64>>,
}

/// Force per undeformed area with a fixed direction (dead load).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Traction {
    /// Group of edges or faces.
    pub group: String,
    /// Force per area, Pa.
    pub x: Option<Function>,
    /// Force per area, Pa.
    pub y: Option<Function>,
    /// Force per area, Pa.
    pub z: Option<Function>,
    /// Harmonic part in a response, Pa.
    pub response: Option<Amplitudes>,
    /// Spatial factor, integrated exactly up to degree 3 [default: 1].
    pub spatial_factor: Option<SpatialFactor>,
}

/// Point force with a fixed direction. The displacement of the point itself grows slowly, without limit, as the
/// mesh is refined.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PointForce {
    /// Undeformed position, m.
    pub at: Vec<f64>,
    /// Force, N (in 2D, N/m).
    pub x: Option<Function>,
    /// Force, N (in 2D, N/m).
    pub y: Option<Function>,
    /// Force, N.
    pub z: Option<Function>,
    /// Harmonic part in a response, N.
    pub response: Option<Amplitudes>,
}

/// Factor that varies in space.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum SpatialFactor {
    /// Expression of the undeformed coordinates `x`, `y`, `z`, m, such as `"1 - (y/0.02)^2"`. Besides `+ - * / ^` and
    /// parentheses it may use the constants `pi` and `e`, the functions `abs`, `signum`, `sqrt`, `cbrt`, `exp`, `ln` (or
    /// `log`), `log2`, `log10`, `sin`, `cos`, `tan`, `asin`, `acos`, `atan`, `sinh`, `cosh`, `tanh`, `asinh`, `acosh`,
    /// `atanh`, `floor`, `round`, `ceil`, `trunc` and `fract`, and `min(a, b)`, `max(a, b)` and `atan2(a, b)`.
    Expression(String),
    /// Nodal data.
    Nodal(NodalFactor),
}

/// Nodal data of the mesh file, interpolated linearly.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct NodalFactor {
    /// Name of the field (`$NodeData`), with one value per node or one per component.
    pub field: String,
}

/// Springs and dampers on a boundary (Robin condition): `P N + k u + c u̇ = 0`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ElasticFoundation {
    /// Group of edges or faces.
    pub group: String,
    /// Stiffness k, Pa/m.
    #[serde(default)]
    #[schemars(range(min = 0))]
    pub stiffness: f64,
    /// Damping c, Pa·s/m.
    #[serde(default)]
    #[schemars(range(min = 0))]
    pub damping: f64,
    /// Directions of springs and dampers.
    #[serde(default)]
    pub along: Direction,
}

/// Spring and damper between a point of the body and the ground: force `-k u - c u̇` on the body.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Spring {
    /// Undeformed position, m.
    pub at: Vec<f64>,
    /// Stiffness k, N/m (in 2D, N/m²).
    #[serde(default)]
    #[schemars(range(min = 0))]
    pub stiffness: f64,
    /// Damping c, N·s/m (in 2D, N·s/m²).
    #[serde(default)]
    #[schemars(range(min = 0))]
    pub damping: f64,
    /// Direction, of any length [default: all directions].
    pub direction: Option<Vec<f64>>,
}

/// Directions in which a foundation acts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Direction {
    /// All directions.
    #[default]
    All,
    /// Normal of the undeformed boundary; the body can slide along the boundary.
    Normal,
}

/// Force per mass, such as gravity: -9.81 m/s² along the upward axis.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct BodyForce {
    /// Group of elements [default: all].
    pub group: Option<String>,
    /// Acceleration, m/s².
    pub x: Option<Function>,
    /// Acceleration, m/s².
    pub y: Option<Function>,
    /// Acceleration, m/s².
    pub z: Option<Function>,
    /// Harmonic part in a response, m/s².
    pub response: Option<Amplitudes>,
    /// Spatial factor, integrated exactly up to degree 4 [default: 1].
    pub spatial_factor: Option<SpatialFactor>,
}
