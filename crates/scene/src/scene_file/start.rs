//! Initial state of a motion.

use std::path::PathBuf;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Initial state of a motion; consistent pressures and rates are computed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "type", rename_all = "kebab-case", deny_unknown_fields)]
pub enum InitialState {
    /// Equilibrium under the loads at t = 0, at rest.
    Equilibrium,
    /// Undeformed, with the same velocity at all free nodes or at the free nodes of a group. For an incompressible
    /// body, the velocity is projected onto velocities that preserve the volume.
    Velocity {
        /// Group of nodes [default: all].
        group: Option<String>,
        /// Velocity, m/s.
        #[schemars(length(min = 2, max = 3))]
        value: Vec<f64>,
    },
    /// Final state of another run with the same mesh.
    Restart {
        /// Folder of the other run, relative to the scene.
        folder: PathBuf,
    },
}
