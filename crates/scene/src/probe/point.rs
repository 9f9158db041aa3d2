//! Values at a point.

use myovib_fem::Solid;
use myovib_model::{Measurement, ModelError, Probe, Quantity};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::kind::{InvalidPlace, Kind, Reading, Wrong, at};
use super::places::{check_reference, displacement_and_pressure, relative};
use crate::Scene;

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
    /// Group whose averages are subtracted.
    pub relative_to: Option<String>,
}

impl Kind for Point {
    fn check_place(&self, solid: &Solid) -> Result<(), Wrong<InvalidPlace>> {
        at(".at", Probe::near(solid.space(), &self.at))?;
        check_reference(solid, self.relative_to.as_deref())
    }

    fn reading(&self, of: &Scene) -> Result<Box<dyn Reading>, ModelError> {
        let space = of.expect_body()?.muscle.solid.space();
        let measurement = Measurement::at(space, &self.at, &self.quantities)?;
        relative(space, measurement, self.relative_to.as_deref())
    }
}
