//! Where a motion starts.

use std::path::PathBuf;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Where the motion of a body starts. What the equations ask for beyond that is computed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "type", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Start {
    /// At rest, in equilibrium under the loads at t = 0.
    Equilibrium,
    /// Undeformed; all that is free moves at one velocity.
    Velocity {
        /// The velocity, m/s.
        #[schemars(length(min = 2, max = 3))]
        value: Vec<f64>,
    },
    /// As another run on the same mesh ended, a motion or an equilibrium.
    Run {
        /// Folder of that run, relative to the scene.
        folder: PathBuf,
    },
}
