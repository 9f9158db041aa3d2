//! Volume of a cavity.

use myovib_fem::{EnclosedVolume, FemError, Solid};
use myovib_model::ModelError;
use num_complex::Complex64;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::column::ColumnKind;
use super::kind::{HarmonicMotion, InvalidPlace, Kind, Reading, StateAt, Wrong, at};
use crate::scene_file::solid::Axis;
use crate::system::{System, muscle_of};
use crate::{InputError, Scene};

/// Volume enclosed by a connected boundary group, m³ (in 2D, m²). Each opening is closed by a cone from its rim to the
/// center of the rim.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(inline)]
pub struct Volume {
    /// Boundary group.
    pub group: String,
    /// Normals of the symmetry planes that contain the rim; with `[]`, cones close the openings instead.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub symmetry: Option<Vec<Axis>>,
}

impl Volume {
    fn enclosed(&self, solid: &Solid) -> Result<EnclosedVolume, FemError> {
        let axes: Vec<usize> = self.symmetry.iter().flatten().map(|&axis| axis as usize).collect();
        EnclosedVolume::new(solid, &self.group)?.with_symmetry(&axes)
    }
}

const VOLUME: ColumnKind = ColumnKind::new("V", ["m²", "m³"]);

impl Kind for Volume {
    fn columns() -> &'static [ColumnKind] {
        &[VOLUME]
    }

    fn check_place(&self, solid: &Solid) -> Result<(), Wrong<InvalidPlace>> {
        at(".group", EnclosedVolume::new(solid, &self.group))?;
        let enclosed = at(".symmetry", self.enclosed(solid))?;
        if self.symmetry.is_none() && enclosed.may_end_at_symmetry(solid) {
            let error = InputError::new(format!(
                "the group `{}` ends at nodes that are fixed along some axes, and its rim is not flat: closing the \
                 opening with a cone over the rim would cut off part of the volume",
                self.group
            ));
            let error = error.next(
                "specify the planes of symmetry, such as symmetry = [\"x\", \"y\"] for planes normal to x and y, or \
                 symmetry = [] to accept this cone",
            );
            return Err((".group", InvalidPlace::Input(error)));
        }
        Ok(())
    }

    fn reading(&self, of: &Scene) -> Result<Box<dyn Reading>, ModelError> {
        Ok(Box::new(self.enclosed(&of.expect_body()?.muscle.solid)?))
    }
}

impl Reading for EnclosedVolume {
    fn names(&self) -> Vec<String> {
        vec![VOLUME.name.to_owned()]
    }

    fn values(&self, system: &mut dyn System, at: StateAt<'_>) -> Result<Vec<f64>, ModelError> {
        let StateAt { t, y, .. } = at;
        let (dae, range) = muscle_of(system, y)?;
        let (displacement, _) = dae.nodal_motion(t, &y[range]);
        // If the group surrounds the body, the sum is the negative of the enclosed volume.
        Ok(vec![self.at(displacement).abs()])
    }

    fn has_indicator(&self) -> bool {
        false
    }

    fn is_harmonic(&self) -> bool {
        true
    }

    fn amplitudes(&self, of: &HarmonicMotion<'_>) -> Result<Vec<Complex64>, ModelError> {
        let (stiffness, amplitude) = of.body()?;
        let volume = |displacement: &[f64]| vec![self.at(displacement).abs()];
        Ok(stiffness.amplitudes(amplitude, |snapshot| volume(snapshot.displacement)))
    }
}
