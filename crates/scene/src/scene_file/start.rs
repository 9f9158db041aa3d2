//! Where a motion starts.

use std::path::PathBuf;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Where the motion of a body starts; chains start where they say.
///
/// What the equations ask for beyond that (pressures, accelerations, the constraint of an
/// incompressible body) is computed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "type", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Start {
    /// At rest, in equilibrium with loads and supports as they stand at t = 0: a body under its
    /// weight, a pre-stress.
    Equilibrium,
    /// Undeformed, all that is free moving at one velocity.
    Velocity {
        /// The velocity, m/s.
        #[schemars(length(min = 2, max = 3))]
        value: Vec<f64>,
    },
    /// As another run ended (a motion or an equilibrium) on the same mesh.
    Run {
        /// Folder of that run, relative to the scene.
        folder: PathBuf,
    },
}
