//! The body whose motion drives the chains.

use std::sync::Arc;

use clap::ValueEnum;
use myovib_fem::Mesh;
use myovib_model::IntegratorKind;
use myovib_model::coupling::Recording;
use serde_json::{Map, Value, json};

use super::SynchronizationArgs;
use crate::commands::figure::{MUSCLE_END, ROD_END, muscle_point, rod_point};
use crate::experiments::{Course, muscle_json, record_muscle, record_rod, rod_json};
use myovib_scene::InputError;
use myovib_scene::mesh_file;

/// A body, as typed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum BodyName {
    /// The rod of section 3.1.
    Rod,
    /// The muscle of section 3.2, by its u_y.
    Muscle,
}

impl BodyName {
    /// The paper's number of oscillators, half width of their frequencies (rad/s) and end time (s).
    pub(super) fn defaults(self) -> (usize, f64, f64) {
        match self {
            Self::Rod => (20, 0.05, ROD_END),
            Self::Muscle => (5, 0.5, MUSCLE_END),
        }
    }
}

/// A body with the point that drives.
pub(super) enum Driver {
    Rod { x: f64 },
    Muscle { mesh: Box<Mesh>, point: [f64; 2] },
}

impl Driver {
    pub(super) fn new(args: &SynchronizationArgs) -> anyhow::Result<Self> {
        match args.body {
            BodyName::Rod if args.mesh.is_some() => Err(InputError::new("a rod has no mesh")
                .at("--mesh")
                .next("--body muscle takes one")
                .into()),
            BodyName::Rod => Ok(Self::Rod {
                x: rod_point(&args.point)?,
            }),
            BodyName::Muscle => Ok(Self::Muscle {
                point: muscle_point(&args.point)?,
                mesh: Box::new(mesh_file::load_plane(args.mesh.as_deref())?.0),
            }),
        }
    }

    /// The motion of the point under a load of `frequency` Hz.
    pub(super) fn record(&self, frequency: f64, course: Course) -> anyhow::Result<Arc<Recording>> {
        match self {
            Self::Rod { x } => record_rod(frequency, *x, course),
            Self::Muscle { mesh, point } => record_muscle(mesh, frequency, *point, course),
        }
    }

    /// Body, point and load, for JSON.
    pub(super) fn json(&self, frequency: f64, integrator: IntegratorKind) -> Map<String, Value> {
        match self {
            Self::Rod { x } => rod_json(*x, frequency),
            Self::Muscle { point, .. } => muscle_json(*point, frequency, integrator),
        }
    }

    /// The point by itself: x on the rod, [x, y] in the muscle.
    pub(super) fn point(&self) -> Value {
        match self {
            Self::Rod { x } => json!(x),
            Self::Muscle { point, .. } => json!(point),
        }
    }
}
