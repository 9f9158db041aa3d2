//! Energies, work and dissipation.

use myovib_model::ModelError;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::balance::EnergyBalance;
use super::kind::{Kind, Reading, Systems};
use crate::run::system::System;

/// Kinetic and elastic energy, work of the loads, dissipation and imbalance, J; in the plane J/m.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(inline)]
pub struct Energy {}

impl Kind for Energy {
    fn is_of_motion(&self) -> bool {
        true
    }

    fn reading(&self, _: &Systems<'_>) -> Result<Box<dyn Reading>, ModelError> {
        Ok(Box::new(EnergyBalance::default()))
    }
}

impl Reading for EnergyBalance {
    fn names(&self) -> Vec<String> {
        Self::NAMES.map(str::to_owned).into()
    }

    fn values(
        &self,
        _: &mut dyn System,
        _: f64,
        _: &[f64],
        _: &[f64],
    ) -> Result<Vec<f64>, ModelError> {
        Ok(self.row().into())
    }

    fn balance(&self) -> Option<&EnergyBalance> {
        Some(self)
    }

    fn balance_mut(&mut self) -> Option<&mut EnergyBalance> {
        Some(self)
    }
}
