//! Parameters and outputs of sensitivities and fits.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Scene value that is fitted, or with respect to which outputs are differentiated.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Parameter {
    /// Key of the value. For `solid.bulk_modulus`, the parameter is 1/κ, which is 0 for `inf`.
    #[schemars(length(min = 1))]
    pub key: String,
    /// Starting value of a fit [default: the value in the scene].
    pub start: Option<f64>,
    /// Typical size; required if the value is 0 [default: the value].
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub scale: Option<f64>,
    /// Lower bound of a fit.
    pub low: Option<f64>,
    /// Upper bound of a fit.
    pub high: Option<f64>,
}

/// Measured column of a probe or ratio [default: all columns, named `PROBE.COLUMN`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Output {
    /// Column name in the data, or `observableId`.
    #[schemars(length(min = 1))]
    pub name: String,
    /// Name of the probe or of the ratio of a response.
    pub probe: String,
    /// Column of its table.
    pub column: String,
    /// Plane shear wave whose complex shear modulus, Pa, is the response of the value `column`, such as `"R_x"`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shear_wave: Option<ShearWave>,
    /// Standard deviation of a measurement; the data may override it.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub noise: Option<f64>,
}

/// Measured quantity of a plane shear wave.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ShearWave {
    /// Measured quantity.
    pub quantity: WaveQuantity,
    /// Density of the tissue, kg/m³.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub density: f64,
}

/// Quantity of a wave.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum WaveQuantity {
    /// Phase velocity, m/s.
    Speed,
    /// Decay of the amplitude, 1/m.
    Attenuation,
}
