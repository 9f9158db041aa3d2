//! Motion of a rod.

use myovib_fem::rod::PointValue;
use myovib_model::ModelError;
use num_complex::Complex64;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::kind::{HarmonicMotion, Kind, Reading, StateAt, Wrong};
use crate::scene_file::SceneFile;
use crate::system::System;
use crate::{InputError, Scene};

/// Displacement and velocity of the rod at a position.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(inline)]
pub struct Rod {
    /// Position, from 0 to the rod's length.
    pub at: f64,
}

impl Kind for Rod {
    fn requires_motion(&self) -> bool {
        true
    }

    fn check_part(&self, file: &SceneFile) -> Result<(), Wrong<InputError>> {
        match &file.rod {
            Some(_) => Ok(()),
            None => Err((".type", InputError::new("the scene has no [rod]"))),
        }
    }

    fn reading(&self, of: &Scene) -> Result<Box<dyn Reading>, ModelError> {
        match &of.rod {
            Some(rod) => Ok(Box::new(rod.rod().displacement_at(self.at)?)),
            None => Err(ModelError::NoSuchPart { part: "rod" }),
        }
    }
}

impl Reading for PointValue {
    fn names(&self) -> Vec<String> {
        ["u", "v"].map(str::to_owned).into()
    }

    fn values(&self, system: &mut dyn System, at: StateAt<'_>) -> Result<Vec<f64>, ModelError> {
        let y = at.y;
        let n = system.rod().map_or(0, |rod| rod.rod().n_free());
        Ok(vec![self.of(&y[..n]), self.of(&y[n..2 * n])])
    }

    fn is_harmonic(&self) -> bool {
        true
    }

    fn amplitudes(&self, of: &HarmonicMotion<'_>) -> Result<Vec<Complex64>, ModelError> {
        let HarmonicMotion::Rod(states) = of else {
            return Err(ModelError::NoSuchPart { part: "rod" });
        };
        let of = |states: &[Complex64]| {
            let entries = self.entries.iter();
            entries.map(|&(unknown, weight)| weight * states[unknown]).sum()
        };
        let (q, v) = states.split_at(states.len() / 2);
        Ok(vec![of(q), of(v)])
    }
}
