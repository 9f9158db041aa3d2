//! Pressures.

use std::sync::Arc;

use myovib_fem::{FemError, FollowerPressure, Solid, SurfaceOperator};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Amplitude, Function, SurfaceLoadKind};

/// Pressure on the deformed boundary (follower load).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Pressure {
    /// Group of edges or faces.
    pub group: String,
    /// Pressure, Pa; positive pushes against the body.
    pub value: Function,
    /// Harmonic part in a response, Pa.
    pub response: Option<Amplitude>,
}

impl Pressure {
    /// Section of the scene reference.
    pub(super) const EXAMPLE: &str = r#"[[pressure]]
group = "load"
value = { type = "step", value = 200.0, rise = 0.2 }"#;
}

impl SurfaceLoadKind for Pressure {
    fn operator(&self, solid: &Solid) -> Result<Arc<dyn SurfaceOperator>, FemError> {
        Ok(Arc::new(FollowerPressure::new(solid, &self.group)?))
    }
}
