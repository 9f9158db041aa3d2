//! What a scene asks to see, and when it stops early.

use myovib_model::Quantity;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Values written to a CSV file as the run goes, at fixed times by dense output.
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

/// What a probe measures.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "type", rename_all = "kebab-case")]
pub enum ProbeKind {
    /// Values at a point.
    Point {
        /// The point, m.
        #[schemars(length(min = 2, max = 3))]
        at: Vec<f64>,
        /// The quantities.
        #[serde(default = "displacement_and_pressure")]
        #[schemars(length(min = 1))]
        quantities: Vec<Quantity>,
    },
    /// Values at equidistant points of a line; columns are numbered from 0.
    Line {
        /// First point, m.
        #[schemars(length(min = 2, max = 3))]
        from: Vec<f64>,
        /// Last point, m.
        #[schemars(length(min = 2, max = 3))]
        to: Vec<f64>,
        /// Number of points.
        #[schemars(range(min = 2, max = 1000))]
        points: usize,
        /// The quantities.
        #[serde(default = "displacement_and_pressure")]
        #[schemars(length(min = 1))]
        quantities: Vec<Quantity>,
    },
    /// Averages over a group, by its measure at rest: length, area or volume.
    Average {
        /// Physical group of the boundary, or of elements.
        group: String,
        /// The quantities.
        #[serde(default = "displacement_and_pressure")]
        #[schemars(length(min = 1))]
        quantities: Vec<Quantity>,
    },
    /// The force that the supports exert on the body at a fixed group: N, in the plane N/m of
    /// depth.
    Reaction {
        /// Physical group of fixed nodes.
        group: String,
    },
    /// Kinetic and elastic energy, work of the loads, and dissipated energy: J, in the plane per m
    /// of depth (J/m).
    Energy,
    /// Order parameters of a chain: |Ψ|, arg Ψ, |χ|.
    Coherence {
        /// Name of the chain.
        chain: String,
    },
    /// Positions and velocities of a chain's oscillators.
    Oscillators {
        /// Name of the chain.
        chain: String,
    },
    /// The factor of the stiffness that each feedback gives at the time.
    Feedback,
    /// Displacement and velocity of the rod at a position.
    Rod {
        /// Position, from 0 to the rod's length.
        at: f64,
    },
}

fn displacement_and_pressure() -> Vec<Quantity> {
    vec![Quantity::Displacement, Quantity::Pressure]
}

/// Fields written for ParaView (VTU files and a PVD collection).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Fields {
    /// Seconds between files.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub every: f64,
    /// The quantities.
    #[serde(default = "all_fields")]
    #[schemars(length(min = 1))]
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
    /// The volume ratio det F falls below a bound somewhere.
    Volume {
        /// The bound; 0 is loss of det F > 0, where the model ends.
        #[schemars(range(min = 0), extend("exclusiveMaximum" = 1))]
        below: f64,
    },
}
