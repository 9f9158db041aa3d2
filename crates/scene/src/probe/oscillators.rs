//! States of a chain.

use myovib_model::ModelError;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::column::ColumnKind;
use super::kind::{Kind, Reading, StateAt, Wrong, expect_chain};
use crate::scene_file::SceneFile;
use crate::system::{System, network_of};
use crate::{InputError, Scene};

/// Positions and velocities of the oscillators of a chain.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(inline)]
pub struct Oscillators {
    /// Name of the chain.
    pub chain: String,
}

/// Columns for positions and velocities.
const COLUMNS: [ColumnKind; 2] = [ColumnKind::new("y", [""; 2]), ColumnKind::new("w", [""; 2])];

impl Kind for Oscillators {
    fn columns() -> &'static [ColumnKind] {
        &COLUMNS
    }

    fn requires_motion(&self) -> bool {
        true
    }

    fn check_part(&self, file: &SceneFile) -> Result<(), Wrong<InputError>> {
        expect_chain(file, &self.chain)
    }

    fn reading(&self, of: &Scene) -> Result<Box<dyn Reading>, ModelError> {
        let (network, chain) = of.chain(&self.chain)?;
        Ok(Box::new(States { network, count: chain.chain.omega.len() }))
    }
}

/// States of the network with the zero-based index `network`, which has `count` oscillators.
struct States {
    network: usize,
    count: usize,
}

impl Reading for States {
    fn names(&self) -> Vec<String> {
        let numbered = |of: ColumnKind| (1..=self.count).map(move |i| format!("{}_{i}", of.name));
        COLUMNS.into_iter().flat_map(numbered).collect()
    }

    fn values(&self, system: &mut dyn System, at: StateAt<'_>) -> Result<Vec<f64>, ModelError> {
        let y = at.y;
        let (_, range) = network_of(system, self.network)?;
        Ok(y[range].to_vec())
    }
}
