//! Values at a point.

use myovib_fem::Solid;
use myovib_model::{Measurement, ModelError, Probe, Quantity};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::kind::{InvalidPlace, Kind, Reading, Systems, Wrong, at};
use super::places::{Places, displacement_and_pressure};

/// Values at a point.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(inline)]
pub struct Point {
    /// The point, m.
    #[schemars(length(min = 2, max = 3))]
    pub at: Vec<f64>,
    /// Quantities to write.
    #[serde(default = "displacement_and_pressure")]
    #[schemars(length(min = 1), extend("uniqueItems" = true))]
    pub quantities: Vec<Quantity>,
}

impl Kind for Point {
    fn check_place(&self, solid: &Solid) -> Result<(), Wrong<InvalidPlace>> {
        at(".at", Probe::near(solid.space(), &self.at)).map(drop)
    }

    fn reading(&self, of: &Systems<'_>) -> Result<Box<dyn Reading>, ModelError> {
        let measurement = Measurement::at(of.solid()?.space(), &self.at, &self.quantities)?;
        Ok(Box::new(Places(vec![measurement])))
    }
}
