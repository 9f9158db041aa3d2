//! Integrator settings of a scene.

use myovib_model::{IntegratorKind, MultiplierWeights, StepOptions};
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// Time integration.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
#[schemars(rename = "Integrator")]
pub struct IntegratorSettings {
    /// Integration method.
    pub method: IntegratorKind,
    /// Relative tolerance.
    // Below 1e-14, the rounding errors of sums (2e-16 each) would dominate.
    #[schemars(extend("minimum" = 1e-14), extend("exclusiveMaximum" = 1))]
    pub rtol: f64,
    /// Absolute tolerances of the body.
    pub atol: Atol,
    /// Tolerances of rod and oscillators.
    pub oscillators: OscillatorTolerances,
    /// Time steps of chains without feedback [default: separate if a body or rod drives them and they are in the error
    /// test].
    pub chains: Option<ChainSteps>,
    /// Local error test.
    pub error_test: ErrorTest,
    /// Weights of multipliers in the error test (BDF, without chains).
    pub multiplier_weights: MultiplierWeights,
    /// Highest order of BDF; above 2 only with damping [default: 2 with a body, otherwise 5].
    pub max_order: Option<MaxOrder>,
    /// Adaptive steps.
    #[serde(flatten)]
    pub steps: StepOptions,
    /// Time between the projections that remove the drift of `velocity`, s (BDF, without chains).
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub projection_interval: Option<f64>,
    /// Maximum number of steps.
    #[schemars(range(min = 1))]
    pub max_steps: Option<u64>,
    /// Maximum CPU time, s.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub max_cpu: Option<f64>,
    /// Precision of the factors of matrices.
    pub precision: PrecisionName,
    /// Column ordering of the full matrix [default: by formulation].
    pub ordering: Option<OrderingName>,
    /// KLU's block triangular form; not recommended.
    pub btf: bool,
}

impl Default for IntegratorSettings {
    /// Returns settings for an accuracy of three digits over many periods. For undamped vibrations, the error of Radau
    /// IIA is about its tolerance; the error of BDF is 10 to 1000 times its tolerance.
    fn default() -> Self {
        Self {
            method: IntegratorKind::Radau9,
            rtol: 1e-4,
            atol: Atol::default(),
            oscillators: OscillatorTolerances::default(),
            chains: None,
            error_test: ErrorTest::default(),
            multiplier_weights: MultiplierWeights::Plain,
            max_order: None,
            steps: StepOptions::default(),
            projection_interval: None,
            max_steps: None,
            max_cpu: None,
            precision: PrecisionName::Auto,
            ordering: None,
            btf: false,
        }
    }
}

/// Highest order of BDF: a number, or `auto`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MaxOrder {
    /// The given order.
    Fixed(u8),
    /// The highest order that is stable for the modes that the steps do not resolve.
    Auto,
}

impl MaxOrder {
    /// Returns the order, if it is given.
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
            "description": "Highest order of BDF: a number, or `auto`.",
            "anyOf": [
                { "type": "integer", "minimum": 1, "maximum": 5, "description": "This order." },
                {
                    "const": "auto",
                    "description": "The highest order that is stable for the modes that the steps \
                                    do not resolve (body).",
                },
            ],
        })
    }
}

/// Absolute tolerances. The defaults follow from the length L, the shear modulus G, the speed c of shear waves and a
/// typical strain ε, which is stress/G for loads and displacement/L for supports.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct Atol {
    /// Displacement, m [default: rtol ε L/10].
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub u: Option<f64>,
    /// Velocity, m/s [default: rtol ε c/10].
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub v: Option<f64>,
    /// Pressure, Pa [default: rtol ε G/10].
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub p: Option<f64>,
    /// Pressure rate of `rate`, Pa/s, or multiplier of `stabilized` [default: rtol ε G c/(10 L)].
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub p_rate: Option<f64>,
}

/// Tolerances of rod and oscillators.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct OscillatorTolerances {
    /// Relative tolerance.
    // Below 1e-14, the rounding errors of sums (2e-16 each) would dominate.
    #[schemars(extend("minimum" = 1e-14), extend("exclusiveMaximum" = 1))]
    pub rtol: f64,
    /// Absolute tolerance.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub atol: f64,
    /// Whether the error test includes the oscillators.
    pub in_error_test: bool,
}

impl Default for OscillatorTolerances {
    fn default() -> Self {
        Self { rtol: 1e-7, atol: 1e-10, in_error_test: true }
    }
}

/// Time steps of chains without feedback.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum ChainSteps {
    /// Body and chains are one system with the same steps.
    Together,
    /// The chains follow the body with their own steps.
    Separate,
}

/// Local error test.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct ErrorTest {
    /// Excluded unknowns [default: none with Radau IIA; `p` and `p_rate` with BDF].
    pub exclude: Option<Vec<Block>>,
}

/// A block of unknowns.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Block {
    /// Displacement.
    U,
    /// Velocity.
    V,
    /// Pressure.
    P,
    /// Pressure rate of `rate`, or multiplier of `stabilized`.
    PRate,
}

impl Block {
    /// Returns the name in scenes and messages.
    pub fn name(self) -> &'static str {
        match self {
            Self::U => "u",
            Self::V => "v",
            Self::P => "p",
            Self::PRate => "p_rate",
        }
    }
}

/// Precision of the factors of the Newton matrices of a body. Solutions are in double precision.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum PrecisionName {
    /// `mixed` for large 3D bodies, otherwise `double`.
    Auto,
    /// Double precision.
    Double,
    /// Single precision with iterative refinement; double precision if the refinement does not converge. This saves
    /// half of the memory.
    Mixed,
}

/// Column ordering.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum OrderingName {
    /// Approximate minimum degree.
    Amd,
    /// Column approximate minimum degree.
    Colamd,
    /// Given numbering.
    Natural,
}
