//! Energies, work and dissipation.

use myovib_model::ModelError;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::balance::EnergyBalance;
use super::column::ColumnKind;
use super::kind::{Kind, Reading, StateAt};
use crate::Scene;
use crate::scene_file::Analysis;
use crate::system::{System, muscle_of};

/// Kinetic energy, elastic energy (with foundations and contacts), work of the loads, dissipated energy and imbalance, J
/// (in 2D, J/m). Static analyses write only the elastic energy.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(inline)]
pub struct Energy {}

const ENERGY: [&str; 2] = ["J/m", "J"];
const COLUMNS: [ColumnKind; 5] = [
    ColumnKind::new("kinetic", ENERGY),
    ColumnKind::new("elastic", ENERGY),
    ColumnKind::new("work", ENERGY),
    ColumnKind::new("dissipated", ENERGY),
    ColumnKind::new("imbalance", ENERGY),
];

impl Kind for Energy {
    fn columns() -> &'static [ColumnKind] {
        &COLUMNS
    }

    fn reading(&self, of: &Scene) -> Result<Box<dyn Reading>, ModelError> {
        Ok(match of.file.analysis == Analysis::Static {
            true => Box::new(ElasticEnergy),
            false => Box::new(EnergyBalance::default()),
        })
    }
}

/// Reading for the elastic energy in static analyses.
struct ElasticEnergy;

impl Reading for ElasticEnergy {
    fn names(&self) -> Vec<String> {
        vec!["elastic".to_owned()]
    }

    fn values(&self, system: &mut dyn System, at: StateAt<'_>) -> Result<Vec<f64>, ModelError> {
        let (dae, range) = muscle_of(system, at.y)?;
        let energies = dae.energies(at.t, &at.y[range.clone()], &at.y_dot[range]);
        Ok(vec![energies.elastic])
    }
}

impl Reading for EnergyBalance {
    fn names(&self) -> Vec<String> {
        COLUMNS.map(|column| column.name.to_owned()).into()
    }

    fn values(&self, _: &mut dyn System, _: StateAt<'_>) -> Result<Vec<f64>, ModelError> {
        Ok(self.row().into())
    }

    fn balance(&self) -> Option<&EnergyBalance> {
        Some(self)
    }

    fn balance_mut(&mut self) -> Option<&mut EnergyBalance> {
        Some(self)
    }
}
