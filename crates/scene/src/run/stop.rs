//! Conditions of a scene that end the run.

use myovib_fem::Located;
use myovib_fem::quadrature::TriangleRule;
use myovib_model::{ModelError, Probe, Quantity, Snapshot};

use crate::scene::Scene;
use crate::scene_file::output::Stop;

/// A condition on the body's state.
pub(super) enum Condition {
    /// |u| at a point exceeds a bound, m.
    Displacement { probe: Probe, above: f64 },
    /// det F falls below a bound at a quadrature point.
    Volume { below: f64 },
}

impl Condition {
    /// What `stop` means in this scene.
    pub(super) fn new(stop: &Stop, scene: &Scene) -> Result<Self, ModelError> {
        let body = scene
            .body
            .as_ref()
            .ok_or(ModelError::NoSuchPart { part: "muscle" })?;
        let space = body.muscle.solid.space();
        Ok(match *stop {
            Stop::Displacement { at, above } => Self::Displacement {
                probe: Probe::at(space, at)?,
                above,
            },
            Stop::Volume { below } => Self::Volume { below },
        })
    }

    /// Positive where the condition is met.
    pub(super) fn excess(&self, snapshot: &Snapshot<'_>) -> f64 {
        match self {
            Self::Displacement { probe, above } => {
                let [x, y] = probe.vector(snapshot.displacement);
                x.hypot(y) - above
            }
            Self::Volume { below } => below - smallest_volume_ratio(snapshot),
        }
    }

    /// The condition in words.
    pub(super) fn describe(&self) -> String {
        match self {
            Self::Displacement { probe, above } => {
                let [x, y] = probe.point();
                format!("|u| at ({x}, {y}) exceeds {above} m")
            }
            Self::Volume { below } => format!("det F is below {below}"),
        }
    }
}

fn smallest_volume_ratio(snapshot: &Snapshot<'_>) -> f64 {
    let points = TriangleRule::default().points();
    let places = (0..snapshot.solid.space().n_elements()).flat_map(|element| {
        points.iter().map(move |point| Located {
            element,
            barycentric: point.barycentric,
        })
    });
    places
        .map(|place| snapshot.at(&place, Quantity::VolumeRatio)[0])
        .fold(f64::INFINITY, f64::min)
}
