//! Scenes as text: what a user writes in TOML, read with the place of every error.
//!
//! [`read`] takes a file through four steps: TOML to a tree that remembers where each value
//! stands (`source`), `--set` overrides, a check against the JSON Schema that the types
//! themselves give (`check`, [`schema`]), and only then the typed [`SceneFile`]. What needs a
//! mesh to be judged is checked later, in `scene`, and finds its place through the same
//! [`Source`].
//!
//! Cast of types: [`SceneFile`] (the root), its parts in [`function`], [`mesh`], [`solid`],
//! [`material`], [`chain`], [`integrator`], [`output`]; [`Source`] (text and places).

pub mod active;
pub mod chain;
pub mod feedback;
pub mod function;
pub mod identification;
pub mod integrator;
pub mod material;
pub mod mesh;
pub mod output;
pub mod solid;
pub mod start;

mod brackets;
pub(crate) mod check;
mod number;
mod reference;
mod schema;
mod source;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

pub use reference::reference;
pub use schema::schema;
pub use source::Source;

use crate::InputError;
use crate::modes::DEFAULT_COUNT;
use chain::{Chain, Rod};
use feedback::Feedback;
use identification::{Output, Parameter};
use integrator::Integrator;
use material::Material;
use mesh::{Mesh, Region};
use output::{Fields, Probe, Stop};
use solid::{Bed, BodyForce, Displacement, Fixed, Pressure, Solid, Traction};
use start::Start;

/// A scene: everything a run depends on.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SceneFile {
    /// What the scene shows, in one line.
    #[serde(default)]
    pub title: String,
    /// What to compute.
    #[serde(default)]
    pub analysis: Analysis,
    /// The time interval; a dynamic scene needs it.
    pub time: Option<Time>,
    /// Where the motion of a body starts [default: at rest, without load].
    pub start: Option<Start>,
    /// The mesh; a scene with a rod or chains alone needs none.
    pub mesh: Option<Mesh>,
    /// Regions cut out of groups of elements.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub region: Vec<Region>,
    /// Compressibility, damping and formulation of the body; goes with `mesh`.
    pub solid: Option<Solid>,
    /// Materials; together they cover each element once.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub material: Vec<Material>,
    /// Groups that do not move.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub fixed: Vec<Fixed>,
    /// Groups that move as prescribed.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub displacement: Vec<Displacement>,
    /// Elastic and viscous supports of the boundary.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub bed: Vec<Bed>,
    /// Boundary forces of fixed direction.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub traction: Vec<Traction>,
    /// Boundary pressures that follow the deformed body.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub pressure: Vec<Pressure>,
    /// Forces per mass.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub body_force: Vec<BodyForce>,
    /// The elastic rod, instead of a mesh.
    pub rod: Option<Rod>,
    /// Chains of oscillators.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub chain: Vec<Chain>,
    /// How the coherence of chains changes the stiffness of the body.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub feedback: Vec<Feedback>,
    /// The time integration.
    #[serde(default)]
    pub integrator: Integrator,
    /// Values written as the run goes.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub probe: Vec<Probe>,
    /// Numbers that sensitivities and fits are of.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub parameter: Vec<Parameter>,
    /// Columns that measurements are of.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub output: Vec<Output>,
    /// Fields for ParaView.
    pub fields: Option<Fields>,
    /// Conditions that end the run.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub stop: Vec<Stop>,
    /// Checkpoints, from which a killed run goes on.
    pub checkpoint: Option<Checkpoint>,
    /// The eigenmodes to report.
    pub modes: Option<Modes>,
}

/// The analyses.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Analysis {
    /// The equilibrium under the loads at `time.end` (or at 0).
    Static,
    /// The motion.
    #[default]
    Dynamic,
    /// The lowest modes, in `modes.csv`; probes and fields are not written.
    Modes,
}

/// The time interval, from 0.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Time {
    /// End time, s.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub end: f64,
}

/// When checkpoints are written.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Checkpoint {
    /// Simulated seconds between them.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub every: f64,
}

/// The eigenmodes to report.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Modes {
    /// Number of modes, lowest first.
    #[serde(default = "count")]
    #[schemars(range(min = 1))]
    pub count: usize,
    /// The modes are about the equilibrium under the loads at this time, s [default: about rest, without loads].
    #[schemars(range(min = 0))]
    pub loads_at: Option<f64>,
}

fn count() -> usize {
    DEFAULT_COUNT
}

/// A scene with the text it came from.
#[derive(Debug, Clone)]
pub struct Read {
    /// The scene.
    pub scene: SceneFile,
    /// Its text, for messages about what only later proves wrong.
    pub source: Source,
}

/// Reads the text of a scene; `name` stands for the file in messages, `overrides` are
/// `key=value` as given to `--set`.
///
/// # Errors
/// [`InputError`] with file, line, column, a snippet, and what was expected.
pub fn read(name: &str, text: &str, overrides: &[String]) -> Result<Read, InputError> {
    let mut source = Source::parse(name, text)?;
    for assignment in overrides {
        source.assign(assignment)?;
    }
    check::check(source.value(), schema().as_value()).map_err(|problem| source.report(problem))?;
    let scene = SceneFile::deserialize(source.value())
        .map_err(|e| InputError::new(e).at(name).next("see `myovib schema`"))?;
    Ok(Read { scene, source })
}

#[cfg(test)]
mod tests;
