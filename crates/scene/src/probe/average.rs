//! Averages over a group.

use myovib_fem::Solid;
use myovib_model::{Measurement, ModelError, Quantity};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::kind::{InvalidPlace, Kind, Reading, Wrong, at};
use super::places::{check_reference, displacement_and_pressure, relative};
use crate::Scene;

/// Averages over a group, weighted by undeformed size.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(inline)]
pub struct Average {
    /// Group of boundary facets or elements.
    pub group: String,
    /// Quantities to write.
    #[serde(default = "displacement_and_pressure")]
    #[schemars(length(min = 1), extend("uniqueItems" = true))]
    pub quantities: Vec<Quantity>,
    /// Group whose averages are subtracted.
    pub relative_to: Option<String>,
}

impl Kind for Average {
    fn check_place(&self, solid: &Solid) -> Result<(), Wrong<InvalidPlace>> {
        at(".group", solid.space().mesh().group(&self.group))?;
        check_reference(solid, self.relative_to.as_deref())
    }

    fn reading(&self, of: &Scene) -> Result<Box<dyn Reading>, ModelError> {
        let space = of.expect_body()?.muscle.solid.space();
        let measurement = Measurement::average(space, &self.group, &self.quantities)?;
        relative(space, measurement, self.relative_to.as_deref())
    }
}
