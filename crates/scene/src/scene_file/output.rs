//! Output of a scene and conditions that end a run.

use myovib_model::Quantity;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::probe::ProbeKind;

/// Values over time in the CSV file `NAME.csv`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Probe {
    /// Name of the probe and of its file.
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

/// Fields of the whole body for ParaView: VTU files and a PVD collection.
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

/// Condition that ends the run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "type", rename_all = "kebab-case")]
pub enum Stop {
    /// The displacement |u| of a point is too large.
    Displacement {
        /// The point, m.
        #[schemars(length(min = 2, max = 3))]
        at: Vec<f64>,
        /// Upper bound, m.
        #[schemars(extend("exclusiveMinimum" = 0))]
        above: f64,
    },
    /// The volume ratio det F is too small at some point.
    Volume {
        /// Lower bound.
        #[schemars(range(min = 0), extend("exclusiveMaximum" = 1))]
        below: f64,
    },
    /// The order parameter |Ψ| of a chain is too large.
    Coherence {
        /// Name of the chain.
        chain: String,
        /// Upper bound.
        #[schemars(extend("exclusiveMinimum" = 0))]
        above: f64,
    },
}
