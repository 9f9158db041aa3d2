//! Output of a scene and conditions that end a run.

use myovib_model::Quantity;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::probe::ProbeKind;

/// Values written to the CSV file `NAME.csv` at fixed times.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Probe {
    /// Name of the probe and its file.
    #[schemars(length(min = 1), regex(pattern = r"^[A-Za-z0-9_-]+$"))]
    pub name: String,
    /// Time between rows, s.
    #[serde(default = "probe_interval")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub interval: f64,
    /// Measured values.
    #[serde(flatten)]
    pub kind: ProbeKind,
}

fn probe_interval() -> f64 {
    0.01
}

/// Fields of the whole body: VTU files and a PVD collection for ParaView.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Fields {
    /// Time between fields, s.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub interval: f64,
    /// Quantities to write.
    #[serde(default = "all_fields")]
    #[schemars(length(min = 1), extend("uniqueItems" = true))]
    pub quantities: Vec<Quantity>,
}

fn all_fields() -> Vec<Quantity> {
    vec![
        Quantity::Displacement,
        Quantity::Velocity,
        Quantity::Pressure,
        Quantity::VolumeRatio,
        Quantity::VonMises,
    ]
}

/// A condition that ends the run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "type", rename_all = "kebab-case")]
pub enum Stop {
    /// The displacement |u| of a point exceeds a bound.
    Displacement {
        /// The point, m.
        #[schemars(length(min = 2, max = 3))]
        at: Vec<f64>,
        /// Upper bound, m.
        #[schemars(extend("exclusiveMinimum" = 0))]
        above: f64,
    },
    /// The volume ratio det F falls below a bound anywhere in the body.
    Volume {
        /// Lower bound.
        #[schemars(range(min = 0), extend("exclusiveMaximum" = 1))]
        below: f64,
    },
}
