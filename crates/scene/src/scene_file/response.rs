//! Harmonic response of a scene: frequencies, preload, and amplitudes of harmonic loads.

use num_complex::Complex64;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::spacing;

/// Harmonic response.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Response {
    /// Frequencies, Hz: numbers, or a range `"1..60:120"` (120 values) or `"1..60:120:log"`.
    pub frequencies: Frequencies,
    /// Time, s, of the preload [default: rest, without loads].
    #[schemars(range(min = 0))]
    pub preload_time: Option<f64>,
}

/// Frequencies: a list, or `"1..60:120"` for 120 equidistant values from 1 to 60, or `"1..60:120:log"`
/// for logarithmic spacing.
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
    /// Returns the frequencies, or the reason why the text is invalid.
    ///
    /// # Errors
    /// The text is neither a range nor a list of numbers.
    pub fn values(&self) -> Result<Vec<f64>, &'static str> {
        match self {
            Self::List(values) => Ok(values.clone()),
            Self::One(value) => Ok(vec![*value]),
            Self::Text(text) => match spacing::Range::read(text) {
                Some(range) => range.values(),
                None => {
                    let numbers = text.split(',').map(|word| word.trim().parse());
                    let numbers: Result<Vec<f64>, _> = numbers.collect();
                    numbers.map_err(|_| "neither a range nor a list of numbers")
                }
            },
        }
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
    /// Phase, degrees; positive leads.
    #[serde(default)]
    pub phase: f64,
}

/// Harmonic load Re(value · e^{i(ωt + phase)}).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Amplitude {
    /// Amplitude, in the unit of the load.
    pub value: f64,
    /// Phase, degrees; positive leads.
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
        [self.x, self.y, self.z].map(|value| {
            Some(
                Amplitude {
                    value: value?,
                    phase,
                }
                .complex(),
            )
        })
    }
}
