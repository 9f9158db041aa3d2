//! Probe for the stiffness factors of feedbacks.

use myovib_model::ModelError;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::column::ColumnKind;
use super::kind::{Kind, Reading, StateAt, Wrong};
use crate::scene_file::SceneFile;
use crate::system::System;
use crate::{InputError, Scene};

/// Stiffness factor of each feedback.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(inline)]
pub struct Feedback {}

const FACTOR: ColumnKind = ColumnKind::new("factor", [""; 2]);

impl Kind for Feedback {
    fn columns() -> &'static [ColumnKind] {
        &[FACTOR]
    }

    fn requires_motion(&self) -> bool {
        true
    }

    fn check_part(&self, file: &SceneFile) -> Result<(), Wrong<InputError>> {
        match file.feedback.is_empty() {
            false => Ok(()),
            true => Err((".type", InputError::new("the scene has no [[feedback]]"))),
        }
    }

    fn reading(&self, of: &Scene) -> Result<Box<dyn Reading>, ModelError> {
        let names = of.file.feedback.iter().map(|own| format!("{}_{}", FACTOR.name, own.chain));
        Ok(Box::new(FactorReading(names.collect())))
    }
}

/// Reading of the stiffness factors. Contains the names of the columns.
struct FactorReading(Vec<String>);

impl Reading for FactorReading {
    fn names(&self) -> Vec<String> {
        self.0.clone()
    }

    fn values(&self, system: &mut dyn System, at: StateAt<'_>) -> Result<Vec<f64>, ModelError> {
        let y = at.y;
        // Stiffness factors precede tensions.
        Ok(system.factors(y)[..self.0.len()].to_vec())
    }
}
