//! The volume of a cavity.

use myovib_fem::{EnclosedVolume, Solid};
use myovib_model::ModelError;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::kind::{Kind, Objection, Reading, Systems, Wrong, at};
use crate::run::system::{System, muscle_of};

/// Volume enclosed by a connected group of the boundary, m³; in the plane m². An opening is closed by
/// a cone with its apex at the center of the rim.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(inline)]
pub struct Volume {
    /// Group of boundary facets.
    pub group: String,
}

impl Kind for Volume {
    fn check_place(&self, solid: &Solid) -> Result<(), Wrong<Objection>> {
        at(".group", EnclosedVolume::new(solid, &self.group)).map(drop)
    }

    fn reading(&self, of: &Systems<'_>) -> Result<Box<dyn Reading>, ModelError> {
        Ok(Box::new(EnclosedVolume::new(of.solid()?, &self.group)?))
    }
}

impl Reading for EnclosedVolume {
    fn names(&self) -> Vec<String> {
        vec!["V".to_owned()]
    }

    fn values(
        &self,
        system: &mut dyn System,
        t: f64,
        y: &[f64],
        _: &[f64],
    ) -> Result<Vec<f64>, ModelError> {
        let (dae, range) = muscle_of(system, y)?;
        let (displacement, _) = dae.nodal_motion(t, &y[range]);
        // Of a group around the body it is the negative of what is inside.
        Ok(vec![self.at(displacement).abs()])
    }

    fn has_indicator(&self) -> bool {
        false
    }
}
