//! The elastic body of a scene: materials, supports, loads.

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::function::Function;

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
    /// The DAE to integrate (default: what suits κ and β: `position` for β = 0 and finite κ,
    /// `velocity` for β = 0 and κ = inf, `implicit-rate` for β > 0).
    pub formulation: Option<FormulationName>,
}

/// A bulk modulus: a number in Pa, or `inf`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Kappa(pub f64);

impl Serialize for Kappa {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        if self.0.is_infinite() {
            serializer.serialize_str("inf")
        } else {
            serializer.serialize_f64(self.0)
        }
    }
}

impl<'de> Deserialize<'de> for Kappa {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        #[derive(Deserialize)]
        #[serde(untagged)]
        enum Written {
            Number(f64),
            Word(Infinite),
        }
        #[derive(Deserialize)]
        enum Infinite {
            #[serde(rename = "inf")]
            Inf,
        }
        Ok(Self(match Written::deserialize(deserializer)? {
            Written::Number(kappa) => kappa,
            Written::Word(Infinite::Inf) => f64::INFINITY,
        }))
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

/// The formulations, by the paper's equation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum FormulationName {
    /// (18): no pressure; finite κ.
    Displacement,
    /// (28): β = 0.
    Position,
    /// (29): β > 0; the pressure's rate is an unknown.
    Rate,
    /// (31): β = 0; the constraint differentiated once.
    Velocity,
    /// (33), Gear–Gupta–Leimkuhler: β = 0, κ = inf.
    Stabilized,
    /// (26): β > 0; the pressure's rate is taken from the integrator.
    ImplicitRate,
}

/// A material on a group of triangles.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Material {
    /// Physical group of triangles [default: all triangles].
    pub group: Option<String>,
    /// Mass density ρ, kg/m³.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub density: f64,
    /// The material law.
    #[serde(flatten)]
    pub law: Law,
}

/// The material laws; the volume change is κ's matter for all but `st-venant-kirchhoff`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "law", rename_all = "kebab-case")]
pub enum Law {
    /// `W = c10 (Ī1 - 3) + c01 (Ī2 - 3)`, the paper's (20).
    MooneyRivlin {
        /// Coefficient of the first invariant, Pa.
        #[schemars(extend("exclusiveMinimum" = 0))]
        c10: f64,
        /// Coefficient of the second invariant, Pa.
        #[schemars(range(min = 0))]
        c01: f64,
    },
    /// `W = ζ/2 (Ī1 - 3)`.
    NeoHooke {
        /// Shear modulus ζ, Pa.
        #[schemars(extend("exclusiveMinimum" = 0))]
        shear_modulus: f64,
    },
    /// `W = ζ |dev E|²` with Green's strain E. Meant for moderate strains.
    DeviatoricStVenantKirchhoff {
        /// Shear modulus ζ, Pa.
        #[schemars(extend("exclusiveMinimum" = 0))]
        shear_modulus: f64,
    },
    /// `W = λ/2 (tr E)² + μ E:E` with Green's strain E: only with `displacement`, and without κ.
    StVenantKirchhoff {
        /// Lamé's first constant λ, Pa.
        #[schemars(range(min = 0))]
        lambda: f64,
        /// Shear modulus μ, Pa.
        #[schemars(extend("exclusiveMinimum" = 0))]
        shear_modulus: f64,
    },
    /// `σ = 2ζ dev ε`, the paper's (26): linear, for small displacements only.
    SmallStrain {
        /// Shear modulus ζ, Pa.
        #[schemars(extend("exclusiveMinimum" = 0))]
        shear_modulus: f64,
    },
}

/// A coordinate direction.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Axis {
    /// Along the muscle.
    X,
    /// Across.
    Y,
}

/// A group whose nodes do not move.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Fixed {
    /// Physical group of edges, points or triangles.
    pub group: String,
    /// The components that are held.
    #[serde(default = "both")]
    #[schemars(length(min = 1))]
    pub components: Vec<Axis>,
}

fn both() -> Vec<Axis> {
    vec![Axis::X, Axis::Y]
}

/// A group whose nodes move as prescribed; a component not given is free.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Displacement {
    /// Physical group of edges, points or triangles.
    pub group: String,
    /// Horizontal displacement, m.
    pub x: Option<Function>,
    /// Vertical displacement, m.
    pub y: Option<Function>,
}

/// A force per undeformed length of a boundary, with a fixed direction (dead load).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Traction {
    /// Physical group of edges.
    pub group: String,
    /// Horizontal component, Pa.
    pub x: Option<Function>,
    /// Vertical component, Pa.
    pub y: Option<Function>,
}

/// A pressure on a boundary that stays normal to it as the body deforms (follower load), per
/// deformed length.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Pressure {
    /// Physical group of edges of the boundary.
    pub group: String,
    /// The pressure, Pa, positive towards the body.
    pub value: Function,
}

/// A force per mass throughout a region, gravity for one.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct BodyForce {
    /// Physical group of triangles [default: all triangles].
    pub group: Option<String>,
    /// Horizontal acceleration, m/s².
    pub x: Option<Function>,
    /// Vertical acceleration, m/s²; gravity is -9.81.
    pub y: Option<Function>,
}
