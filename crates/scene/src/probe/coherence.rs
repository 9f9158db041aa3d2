//! Order parameters of a chain.

use myovib_model::ModelError;
use myovib_oscillators::Coherence as OrderParameters;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::column::ColumnKind;
use super::kind::{Kind, Reading, StateAt, Wrong, expect_chain};
use crate::scene_file::SceneFile;
use crate::system::{System, network_of};
use crate::{InputError, Scene};

/// Order parameters |Ψ|, arg Ψ and |χ| of a chain.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(inline)]
pub struct Coherence {
    /// Name of the chain.
    pub chain: String,
}

/// Columns for |Ψ|, arg Ψ and |χ|.
const COLUMNS: [ColumnKind; 3] = [
    ColumnKind::new("Psi_abs", [""; 2]),
    ColumnKind::new("Psi_arg", ["rad"; 2]),
    ColumnKind::new("chi_abs", [""; 2]),
];

impl Kind for Coherence {
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
        let (network, _) = of.chain(&self.chain)?;
        Ok(Box::new(Parameters { network }))
    }
}

/// Order parameters of the network with the zero-based index `network`.
struct Parameters {
    network: usize,
}

impl Reading for Parameters {
    fn names(&self) -> Vec<String> {
        COLUMNS.map(|column| column.name.to_owned()).into()
    }

    fn values(&self, system: &mut dyn System, at: StateAt<'_>) -> Result<Vec<f64>, ModelError> {
        let y = at.y;
        let (network, range) = network_of(system, self.network)?;
        let (position, velocity) = y[range].split_at(network.n_oscillators());
        let found = OrderParameters::new(network.omega(), position, velocity);
        let centroid = found.centroid;
        Ok(vec![centroid.norm(), centroid.arg(), found.phase.norm()])
    }

    fn is_angle(&self, column: usize) -> bool {
        column == 1
    }
}
