//! Functions of time as a scene writes them.

use std::path::PathBuf;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A function of time: a number (constant), or a table with a `type`.
///
/// Its unit is that of what it drives: Pa for a traction or pressure, m for a displacement, m/s² for
/// a body force, none for the strain of a rod.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum Function {
    /// The same value at all times.
    Constant(f64),
    /// A value that changes.
    Shape(Shape),
}

/// The kinds of functions of time.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "type", rename_all = "kebab-case")]
pub enum Shape {
    /// `amplitude · sin(2π frequency t + phase)`.
    Sine {
        /// Amplitude, in the unit of what is driven.
        amplitude: f64,
        /// Frequency, Hz.
        #[schemars(extend("exclusiveMinimum" = 0))]
        frequency: f64,
        /// Phase, rad.
        #[serde(default)]
        phase: f64,
    },
    /// The paper's load: a sine introduced by a sigmoid that is 0 at t = 0,
    /// `amplitude · (1/(1+exp(-steepness t + shift)) - 1/(1+exp(shift))) · sin(2π frequency t)`.
    RampedSine {
        /// Amplitude once the ramp is over, in the unit of what is driven.
        amplitude: f64,
        /// Frequency, Hz.
        #[serde(default = "paper_frequency")]
        #[schemars(extend("exclusiveMinimum" = 0))]
        frequency: f64,
        /// Steepness of the sigmoid, 1/s.
        #[serde(default = "paper_steepness")]
        #[schemars(extend("exclusiveMinimum" = 0))]
        steepness: f64,
        /// Shift of the sigmoid; its middle lies at `shift / steepness`, in s.
        #[serde(default = "paper_shift")]
        shift: f64,
    },
    /// From 0 to `value` around `start`, over `rise` seconds, with two continuous derivatives
    /// (`s³ (6 s² - 15 s + 10)`). With `rise = 0` it jumps: loads and tensions may, and the integrator
    /// starts anew right after; displacements may not. At `start` itself the value is still 0, so that
    /// a body at rest, or in equilibrium, may be hit or released at t = 0.
    Step {
        /// Value after the step, in the unit of what is driven.
        value: f64,
        /// When it begins, s.
        #[serde(default)]
        start: f64,
        /// Seconds from 0 to `value`; 0 for a jump.
        #[schemars(extend("minimum" = 0))]
        rise: f64,
    },
    /// Linear from 0 at `start` to `value` at `end`, constant before and after. Its slope jumps,
    /// so that it is good for loads but not for displacements.
    Ramp {
        /// Value at and after `end`, in the unit of what is driven.
        value: f64,
        /// When it begins, s.
        #[serde(default)]
        start: f64,
        /// When it has reached `value`, s; after `start`.
        end: f64,
    },
    /// Values at given times from a CSV file, joined by a natural cubic spline (two continuous
    /// derivatives). The table must cover the run's whole time interval.
    Table {
        /// The CSV file, relative to the scene: a header, then rows of numbers.
        file: PathBuf,
        /// Name of the column with the times, s, ascending.
        #[serde(default = "time_column")]
        time: String,
        /// Name of the column with the values, in the unit of what is driven.
        column: String,
    },
    /// The sum of its terms.
    Sum {
        /// The terms.
        #[schemars(length(min = 1))]
        of: Vec<Function>,
    },
    /// The product of its factors.
    Product {
        /// The factors.
        #[schemars(length(min = 1))]
        of: Vec<Function>,
    },
}

fn paper_frequency() -> f64 {
    8.0
}

fn paper_steepness() -> f64 {
    10.0
}

fn paper_shift() -> f64 {
    8.0
}

fn time_column() -> String {
    "t".to_owned()
}
