//! Conditions of a scene that end the run.

use myovib_model::{ModelError, Probe, Snapshot};

use crate::scene::Scene;
use crate::scene_file::output::Stop;

/// A condition on the body's state.
pub(super) enum Condition {
    /// u| at a point exceeds a bound, m.
    Displacement { probe: Probe, above: f64 },
    /// det F falls below a bound at a quadrature point.
    Volume { below: f64 },
}

impl Condition {
    /// Creates the condition from `stop` for this scene.
    pub(super) fn new(stop: &Stop, scene: &Scene) -> Result<Self, ModelError> {
        let body = scene
            .body
            .as_ref()
            .ok_or(ModelError::NoSuchPart { part: "muscle" })?;
        let space = body.muscle.solid.space();
        Ok(match stop {
            Stop::Displacement { at, above } => Self::Displacement {
                probe: Probe::near(space, at)?.0,
                above: *above,
            },
            Stop::Volume { below } => Self::Volume { below: *below },
        })
    }

    /// Returns a positive value if the condition is met.
    pub(super) fn excess(&self, snapshot: &Snapshot<'_>) -> f64 {
        match self {
            Self::Displacement { probe, above } => {
                let [x, y, z] = probe.vector(snapshot.displacement);
                x.hypot(y).hypot(z) - above
            }
            Self::Volume { below } => below - smallest_volume_ratio(snapshot),
        }
    }

    /// Describes the condition.
    pub(super) fn describe(&self) -> String {
        match self {
            Self::Displacement { probe, above } => {
                let point = probe.point().iter().map(f64::to_string);
                let point = point.collect::<Vec<_>>().join(", ");
                format!("|u| at ({point}) exceeds {above} m")
            }
            Self::Volume { below } => format!("det F is below {below}"),
        }
    }
}

fn smallest_volume_ratio(snapshot: &Snapshot<'_>) -> f64 {
    snapshot.solid.volume_ratios(snapshot.displacement).smallest
}
