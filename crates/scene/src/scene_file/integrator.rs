//! The integrator's settings in a scene.

use myovib_model::IntegratorKind;
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// The time integration; the defaults give three digits of displacements and pressures.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct Integrator {
    /// The method.
    pub method: Method,
    /// Relative tolerance.
    // Below 1e-14 the rounding of sums (2e-16 each) is the larger error.
    #[schemars(extend("minimum" = 1e-14), extend("exclusiveMaximum" = 1))]
    pub rtol: f64,
    /// Absolute tolerances.
    pub atol: Atol,
    /// Tolerances of rod and chain.
    pub oscillators: OscillatorTolerances,
    /// Blocks left out of the error test [default: none with Radau IIA; with BDF `pressure` and
    /// `multiplier`].
    pub suppress: Option<Vec<Block>>,
    /// How the error test weighs multipliers that are in it (BDF, body without chains).
    pub multiplier_weights: MultiplierWeightsName,
    /// Highest order of BDF; undamped modes need 2 [default: 2 with a body, else 5].
    pub max_order: Option<MaxOrder>,
    /// First step, s [default: an estimate, at most 0.08 of the shortest period or rise of loads
    /// and oscillators].
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub initial_step: Option<f64>,
    /// Largest step, s.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub max_step: Option<f64>,
    /// Time between projections onto the constraint, s: for `velocity`, which drifts (BDF, body
    /// without chains). The integrator starts again after each.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub project_every: Option<f64>,
    /// Steps after which the run stops.
    #[schemars(range(min = 1))]
    pub max_steps: Option<u64>,
    /// CPU time after which the run stops, s.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub max_cpu: Option<f64>,
    /// Column ordering of the factorisation [default: by formulation].
    pub ordering: Option<OrderingName>,
    /// KLU permutes to block triangular form, which ruins the pivots of these systems.
    pub btf: bool,
}

impl Default for Integrator {
    /// What gives three digits over many periods: BDF errs by a factor of ten to a thousand more than
    /// its tolerance on undamped vibration, Radau IIA by about its tolerance.
    fn default() -> Self {
        Self {
            method: Method::Radau9,
            rtol: 1e-4,
            atol: Atol::default(),
            oscillators: OscillatorTolerances::default(),
            suppress: None,
            multiplier_weights: MultiplierWeightsName::Plain,
            max_order: None,
            initial_step: None,
            max_step: None,
            project_every: None,
            max_steps: None,
            max_cpu: None,
            ordering: None,
            btf: false,
        }
    }
}

/// The time integration methods.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Method {
    /// Variable-order BDF (IDAS).
    Bdf,
    /// Radau IIA, order 5.
    Radau,
    /// Radau IIA, order 9.
    Radau9,
    /// Radau IIA, order 13.
    Radau13,
}

impl Method {
    /// The integrator of this name.
    pub fn kind(self) -> IntegratorKind {
        match self {
            Self::Bdf => IntegratorKind::Ida,
            Self::Radau => IntegratorKind::Radau,
            Self::Radau9 => IntegratorKind::Radau9,
            Self::Radau13 => IntegratorKind::Radau13,
        }
    }
}

/// The highest order of BDF: a number, or `auto`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MaxOrder {
    /// This one.
    Fixed(u8),
    /// The highest whose sector of stability holds the modes that the steps do not resolve.
    Auto,
}

impl MaxOrder {
    /// The order, if it is given.
    pub fn fixed(self) -> Option<u8> {
        match self {
            Self::Fixed(order) => Some(order),
            Self::Auto => None,
        }
    }
}

impl Serialize for MaxOrder {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Fixed(order) => serializer.serialize_u8(*order),
            Self::Auto => serializer.serialize_str("auto"),
        }
    }
}

impl<'de> Deserialize<'de> for MaxOrder {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        #[derive(Deserialize)]
        #[serde(untagged)]
        enum Written {
            Number(u8),
            Word(Auto),
        }
        #[derive(Deserialize)]
        enum Auto {
            #[serde(rename = "auto")]
            Auto,
        }
        Ok(match Written::deserialize(deserializer)? {
            Written::Number(order) => Self::Fixed(order),
            Written::Word(Auto::Auto) => Self::Auto,
        })
    }
}

impl JsonSchema for MaxOrder {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "MaxOrder".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({
            "description": "The highest order of BDF: a number, or `auto`.",
            "anyOf": [
                { "type": "integer", "minimum": 1, "maximum": 5, "description": "This order." },
                {
                    "const": "auto",
                    "description": "The highest whose sector of stability holds the modes that the \
                                    steps do not resolve (muscle).",
                },
            ],
        })
    }
}

/// Absolute tolerances by block of unknowns.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct Atol {
    /// Displacement q, m [default: 1e-2 rtol].
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub displacement: Option<f64>,
    /// Velocity v, m/s [default: 1e-2 rtol].
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub velocity: Option<f64>,
    /// Pressure λ, Pa [default: 1e2 rtol].
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub pressure: Option<f64>,
    /// Pressure rate μ of (29), Pa/s, or the multiplier of (33) [default: 5e3 rtol].
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub multiplier: Option<f64>,
}

/// Tolerances of rod and chain, whose response begins near 2e-5.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct OscillatorTolerances {
    /// Relative tolerance.
    // Below 1e-14 the rounding of sums (2e-16 each) is the larger error.
    #[schemars(extend("minimum" = 1e-14), extend("exclusiveMaximum" = 1))]
    pub rtol: f64,
    /// Absolute tolerance.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub atol: f64,
    /// Whether the chain takes part in the error test.
    pub in_error_test: bool,
}

impl Default for OscillatorTolerances {
    fn default() -> Self {
        Self {
            rtol: 1e-7,
            atol: 1e-10,
            in_error_test: true,
        }
    }
}

/// A block of unknowns.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Block {
    /// q.
    Displacement,
    /// v.
    Velocity,
    /// λ.
    Pressure,
    /// μ of (29) or (33).
    Multiplier,
}

/// How the error test weighs multipliers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum MultiplierWeightsName {
    /// By their tolerances alone.
    Plain,
    /// A multiplier of index i by its tolerances over (Ωh)^(i−1), Ω the angular frequency of the
    /// drive, h the step: for index 2 and 3 in the error test.
    StepScaled,
}

/// Column orderings.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum OrderingName {
    /// Approximate minimum degree.
    Amd,
    /// Column approximate minimum degree.
    Colamd,
    /// As numbered.
    Natural,
}
