//! Harmonic response of a scene: frequencies, preload, and amplitudes of harmonic loads.

use num_complex::Complex64;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::spacing;

/// Harmonic response.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Response {
    /// Frequencies, Hz: numbers, or `"1..60:120"`, `"1..60:120:log"`, `"1..60:adaptive"`.
    pub frequencies: Frequencies,
    /// Time at which the preload is evaluated, s [default: rest, without loads].
    #[schemars(range(min = 0))]
    pub preload_time: Option<f64>,
    /// Frequencies at which complex fields of displacement and pressure are written, Hz. The fields are listed in
    /// `amplitudes.pvd`.
    #[serde(default)]
    pub fields: Vec<f64>,
    /// Ratios of two values, such as transmissibility, impedance or apparent mass.
    #[serde(default)]
    pub ratio: Vec<Ratio>,
}

/// Ratio of the complex amplitudes of two values. Its table is `NAME.csv`; the value in this table is `NAME`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Ratio {
    /// Name of the ratio.
    pub name: String,
    /// `PROBE.COLUMN`, such as `"clamp.R_x"`. A probe with a displacement `u_x` also has the velocity `v_x` and the acceleration
    /// `a_x`.
    pub numerator: String,
    /// `PROBE.COLUMN`, such as `"tip.v_x"`.
    pub denominator: String,
}

/// Frequencies: a list, or `"1..60:120"` for 120 equidistant values from 1 to 60, or `"1..60:120:log"`
/// for logarithmic spacing, or `"1..60:adaptive"` for values where the response needs them; `"1..60:adaptive:1e-4"` has a
/// relative tolerance (1e-3 by default).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum Frequencies {
    /// The frequencies, in any order.
    List(#[schemars(length(min = 1))] Vec<f64>),
    /// A single frequency.
    One(f64),
    /// A range, or values separated by commas.
    Text(String),
}

impl Frequencies {
    /// Returns the frequencies in ascending order, or the reason why they are invalid.
    ///
    /// # Errors
    /// Fails if the text is neither a range nor a list of numbers, or if a frequency is negative.
    pub fn grid(&self) -> Result<Grid, &'static str> {
        let mut values = match self {
            Self::List(values) => values.clone(),
            Self::One(value) => vec![*value],
            Self::Text(text) => match spacing::Range::read(text) {
                Some(range) => match range.spacing().map(str::trim) {
                    Some(spacing) if spacing.starts_with("adaptive") => {
                        return adaptive(range.ends()?, spacing);
                    }
                    _ => range.values()?,
                },
                None => {
                    let numbers = text.split(',').map(|word| word.trim().parse());
                    let numbers: Result<Vec<f64>, _> = numbers.collect();
                    numbers.map_err(|_| "neither a range nor a list of numbers")?
                }
            },
        };
        if !values.iter().all(|value| (0.0..f64::INFINITY).contains(value)) {
            return Err("a frequency is out of range");
        }
        values.sort_by(f64::total_cmp);
        values.dedup();
        Ok(Grid::Fixed(values))
    }
}

/// Frequencies of a response.
#[derive(Debug, Clone, PartialEq)]
pub enum Grid {
    /// Given frequencies in ascending order, Hz.
    Fixed(Vec<f64>),
    /// Frequencies chosen by the response.
    Adaptive(Adaptive),
}

/// Range of frequencies to be resolved.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Adaptive {
    /// Ends of the range, Hz.
    pub range: [f64; 2],
    /// Accepted error of the interpolation, relative to the larger of the amplitude and a hundredth of the median
    /// amplitude.
    pub tolerance: f64,
}

impl Grid {
    /// Returns the lowest and the highest frequency; NaN for an empty list.
    pub fn ends(&self) -> [f64; 2] {
        match self {
            Self::Fixed(values) => {
                [values.first(), values.last()].map(|end| end.copied().unwrap_or(f64::NAN))
            }
            Self::Adaptive(adaptive) => adaptive.range,
        }
    }
}

/// Default tolerance of adaptive frequencies: a tenth of a percent of the amplitude, far below the accuracy of measurements.
const TOLERANCE: f64 = 1e-3;

/// Reads `adaptive` or `adaptive:1e-3`.
fn adaptive([low, high]: [f64; 2], spacing: &str) -> Result<Grid, &'static str> {
    if !(0.0 <= low && low < high) {
        return Err("an adaptive range must ascend from 0 Hz or more");
    }
    let tolerance = match spacing.strip_prefix("adaptive").unwrap_or_default() {
        "" => Some(TOLERANCE),
        rest => rest.strip_prefix(':').and_then(|word| word.trim().parse().ok()),
    };
    match tolerance.filter(|tolerance| (1e-8..=0.5).contains(tolerance)) {
        Some(tolerance) => Ok(Grid::Adaptive(Adaptive { range: [low, high], tolerance })),
        None => Err("the tolerance of adaptive frequencies must be between 1e-8 and 0.5"),
    }
}

/// Harmonic load Re(amplitude · e^{i(ωt + phase)}).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Amplitudes {
    /// Amplitude, in the unit of the load.
    pub x: Option<f64>,
    /// Amplitude, in the unit of the load.
    pub y: Option<f64>,
    /// Amplitude, in the unit of the load.
    pub z: Option<f64>,
    /// Phase, degrees; a positive phase leads.
    #[serde(default)]
    pub phase: f64,
}

/// Harmonic load Re(value · e^{i(ωt + phase)}).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Amplitude {
    /// Amplitude, in the unit of the load.
    pub value: f64,
    /// Phase, degrees; a positive phase leads.
    #[serde(default)]
    pub phase: f64,
}

impl Amplitude {
    /// Returns the complex amplitude.
    pub fn complex(self) -> Complex64 {
        Complex64::from_polar(self.value, self.phase.to_radians())
    }
}

impl Amplitudes {
    /// Returns the complex amplitude of each component.
    pub fn complex(&self) -> [Option<Complex64>; 3] {
        let phase = self.phase;
        [self.x, self.y, self.z].map(|value| Some(Amplitude { value: value?, phase }.complex()))
    }
}
