//! Scene files: TOML text, its schema, and errors with the location of the mistake.
//!
//! [`read`] processes a file in four steps: TOML to a tree that records the location of each value (`source`), `--set`
//! overrides, validation against the JSON Schema derived from the types (`check`, [`schema`]), and deserialization into
//! [`SceneFile`]. Checks that need the mesh follow later, in `scene`; they report locations through the same
//! [`Source`].
//!
//! The root type is [`SceneFile`]; its parts are in [`function`], [`mesh`], [`solid`],
//! [`material`], [`chain`], [`integrator`] and [`output`]. [`Source`] holds text and locations.

pub mod active;
pub mod chain;
pub mod contact;
pub mod feedback;
pub mod function;
pub mod group;
pub mod identification;
pub mod integrator;
pub mod loading;
pub mod material;
pub mod mesh;
pub mod output;
pub mod periodic;
pub mod response;
pub mod solid;
pub mod start;
pub mod surface_load;

pub(crate) mod check;
pub(crate) mod number;
mod reference;
mod renamed;
mod schema;
mod source;

use std::sync::LazyLock;

use schemars::{JsonSchema, Schema};
use serde::{Deserialize, Serialize};

pub use reference::reference;
pub use schema::schema;
pub use source::Source;

use crate::InputError;
use chain::{Chain, Rod};
use contact::Contact;
use feedback::Feedback;
use group::Group;
use identification::{Output, Parameter};
use integrator::IntegratorSettings;
use loading::LoadingPath;
use material::Material;
use mesh::{Mesh, Region};
use output::{Fields, Probe, Stop};
use periodic::Periodic;
use response::Response;
use solid::{
    BodyForce, ElasticFoundation, Fixed, PointForce, PrescribedDisplacement, Solid, Spring,
    Traction,
};
use start::InitialState;
use surface_load::SurfaceLoads;

/// A scene: all input of a run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SceneFile {
    /// Title of reports, one line.
    #[serde(default)]
    pub title: String,
    /// Type of analysis.
    #[serde(default)]
    pub analysis: Analysis,
    /// Time interval; required for motions.
    pub time: Option<Time>,
    /// Initial state of a motion [default: at rest, without load].
    pub initial_state: Option<InitialState>,
    /// Mesh of the body; not needed for a rod or chains alone.
    pub mesh: Option<Mesh>,
    /// Elliptical regions that become element groups.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub region: Vec<Region>,
    /// Groups selected by position or direction, in addition to the groups of the mesh.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub group: Vec<Group>,
    /// Compressibility, damping and formulation of the body; required with `mesh`.
    pub solid: Option<Solid>,
    /// Materials. Each element must have exactly one.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub material: Vec<Material>,
    /// Groups whose nodes do not move.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub fixed: Vec<Fixed>,
    /// Groups with a prescribed motion.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub prescribed_displacement: Vec<PrescribedDisplacement>,
    /// Elastic foundations: springs and dampers on the boundary.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub elastic_foundation: Vec<ElasticFoundation>,
    /// Springs between points and the ground.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub spring: Vec<Spring>,
    /// Boundary forces with a fixed direction.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub traction: Vec<Traction>,
    /// Loads on the deformed boundary.
    #[serde(flatten)]
    pub surface_loads: SurfaceLoads,
    /// Contacts with rigid obstacles.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub contact: Vec<Contact>,
    /// Forces per mass, such as gravity.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub body_force: Vec<BodyForce>,
    /// Forces on points.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub point_force: Vec<PointForce>,
    /// Elastic rod, instead of a mesh.
    pub rod: Option<Rod>,
    /// Chains of oscillators.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub chain: Vec<Chain>,
    /// Effect of the coherence of chains on the stiffness of the body.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub feedback: Vec<Feedback>,
    /// Method and tolerances of the time integration.
    #[serde(default)]
    pub integrator: IntegratorSettings,
    /// Values written to CSV files during the run.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub probe: Vec<Probe>,
    /// Parameters of sensitivities and fits.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub parameter: Vec<Parameter>,
    /// Measured quantities of sensitivities and fits.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub output: Vec<Output>,
    /// Fields of the whole body for ParaView.
    pub fields: Option<Fields>,
    /// Conditions that end the run.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub stop: Vec<Stop>,
    /// Interval of checkpoints, from which a killed run resumes.
    pub checkpoint: Option<Checkpoint>,
    /// Loading path of a static analysis [default: only the equilibrium under all loads].
    #[serde(rename = "static")]
    pub loading_path: Option<LoadingPath>,
    /// Number and preload of eigenmodes.
    pub modes: Option<Modes>,
    /// Frequencies and preload of a harmonic response.
    pub response: Option<Response>,
    /// Frequency and accuracy of a periodic state.
    pub periodic: Option<Periodic>,
}

/// Type of analysis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Analysis {
    /// Equilibrium under the loads at `time.end` (at 0 without `[time]`), or a path of equilibria up to these loads
    /// (`[static]`).
    Static,
    /// Motion from t = 0 to `time.end`.
    #[default]
    Dynamic,
    /// Relaxation, creep and slow loads from t = 0 to `time.end`, without inertia.
    QuasiStatic,
    /// Lowest eigenmodes, in `modes.csv`.
    Modes,
    /// Harmonic response to the loads with a `response`.
    Response,
    /// Periodic motion under periodic loads, with its stability. Fields are not written.
    Periodic,
}

impl Analysis {
    /// Returns whether the state of the scene is integrated in time.
    pub fn is_in_time(self) -> bool {
        matches!(self, Self::Dynamic | Self::QuasiStatic)
    }

    /// Returns whether the scene's initial state is used.
    pub fn has_initial_state(self) -> bool {
        self.is_in_time() || self == Self::Periodic
    }
}

/// Time interval.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Time {
    /// End time, s.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub end: f64,
}

/// Checkpoints, from which a killed run resumes [default: ten per run].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Checkpoint {
    /// Simulated time between checkpoints, s.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub interval: f64,
}

/// Default number of modes.
pub const DEFAULT_MODES: usize = 10;

/// Eigenmodes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Modes {
    /// Number of modes, lowest first.
    #[serde(default = "count")]
    #[schemars(range(min = 1, max = 100_000))]
    pub count: usize,
    /// Time at which the preload is evaluated, s [default: rest, without loads].
    #[schemars(range(min = 0))]
    pub preload_time: Option<f64>,
}

fn count() -> usize {
    DEFAULT_MODES
}

/// A scene and its source text.
#[derive(Debug, Clone)]
pub struct Read {
    /// The scene.
    pub scene: SceneFile,
    /// The text, for the locations of later errors.
    pub source: Source,
}

/// Reads a scene. `name` is the file name in messages; `overrides` are `key=value` pairs as given
/// to `--set`.
///
/// # Errors
/// Returns an [`InputError`] with the file, the line, the column, a snippet, and the expected value.
pub fn read(name: &str, text: &str, overrides: &[String]) -> Result<Read, InputError> {
    // The schema is cached because sweeps and curves of periodic states read their scene for each value.
    static SCHEMA: LazyLock<Schema> = LazyLock::new(schema);
    let mut source = Source::parse(name, text)?;
    for assignment in overrides {
        source.assign(assignment)?;
    }
    renamed::check(&source)?;
    check::check(source.value(), SCHEMA.as_value()).map_err(|problem| source.report(problem))?;
    let scene = SceneFile::deserialize(source.value()).map_err(|error| {
        let other = || InputError::new(error).at(name).next("see `myovib schema`");
        invalid_law(&source).unwrap_or_else(other)
    })?;
    Ok(Read { scene, source })
}

/// Returns the error of the first material whose constants are inconsistent, with the location of the constant that the
/// error names.
fn invalid_law(source: &Source) -> Option<InputError> {
    let materials = source.value().get("material")?.as_array()?;
    materials.iter().enumerate().find_map(|(i, own)| {
        let error = material::Material::deserialize(own).err()?.to_string();
        let constant = error.split_once(" = ").map_or("", |(name, _)| name);
        let path = format!("material[{i}].{constant}");
        Some(source.report(check::Problem::new(&path, InputError::new(error))))
    })
}

#[cfg(test)]
mod tests;
