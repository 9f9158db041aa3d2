//! What a scene asks to see, and when it stops early.

use myovib_model::Quantity;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::probe::ProbeKind;

/// Values written to a CSV file at fixed times.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Probe {
    /// Name of the probe; its file is `NAME.csv`.
    #[schemars(length(min = 1), regex(pattern = r"^[A-Za-z0-9_-]+$"))]
    pub name: String,
    /// Seconds between rows.
    #[serde(default = "probe_interval")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub every: f64,
    /// What is measured.
    #[serde(flatten)]
    pub kind: ProbeKind,
}

fn probe_interval() -> f64 {
    0.01
}

/// Fields for ParaView (VTU files and a PVD collection).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Fields {
    /// Seconds between them.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub every: f64,
    /// The quantities.
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
    /// |u| at a point exceeds a bound.
    Displacement {
        /// The point, m.
        #[schemars(length(min = 2, max = 3))]
        at: Vec<f64>,
        /// The bound, m.
        #[schemars(extend("exclusiveMinimum" = 0))]
        above: f64,
    },
    /// det F falls below a bound somewhere.
    Volume {
        /// The bound; at 0 the model ends.
        #[schemars(range(min = 0), extend("exclusiveMaximum" = 1))]
        below: f64,
    },
}
