//! State of a body at one point in time. It is stored in a file from which another run can start.

use myovib_dae::Problem;
use myovib_fem::Space;
use myovib_model::{Field, Muscle, MuscleDae};
use serde::{Deserialize, Serialize};

use crate::inputs::sha256;

/// Text before the checksum of the state.
const HEAD: &str = "{\"sha256\":\"";
/// Text between the checksum and the state.
const SEPARATOR: &str = "\",\"state\":";

/// Displacements and velocities of all nodes. They determine the pressures.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct State {
    /// Time (s) in the run that wrote the state.
    pub(crate) t: f64,
    /// SHA-256 hash of the node coordinates.
    mesh: String,
    /// Displacement components of all nodes (m).
    pub(crate) displacement: Vec<f64>,
    /// Velocity components of all nodes (m/s).
    velocity: Vec<f64>,
    /// Tensions of activation models (Pa).
    tensions: Vec<f64>,
    /// Internal stresses of Prony terms (Pa).
    internal_stresses: Vec<f64>,
    /// Fraction of the loads under which the state is in equilibrium; `None` for a state of a motion.
    #[serde(default)]
    pub(crate) load_reached: Option<f64>,
    /// Intended end time (s) of the run if the run stopped earlier.
    #[serde(default)]
    pub(crate) stopped_before: Option<f64>,
}

impl State {
    /// Name of the file in the folder of a run.
    pub(crate) const NAME: &'static str = "state.json";

    /// Returns the content of the file, including a checksum.
    pub(crate) fn encode(&self) -> serde_json::Result<String> {
        let body = serde_json::to_string(self)?;
        let hash = sha256(body.as_bytes());
        Ok(format!("{HEAD}{hash}{SEPARATOR}{body}}}\n"))
    }

    /// Decodes the state from the content of a file. The error is the reason why the file cannot be used.
    pub(crate) fn decode(text: &str) -> Result<Self, String> {
        let rest = text.strip_prefix(HEAD);
        let parts = rest.and_then(|rest| rest.strip_suffix("}\n")?.split_once(SEPARATOR));
        let (hash, body) = parts.ok_or("it is not a state of a run")?;
        if sha256(body.as_bytes()) != hash {
            return Err("it was changed after it was written: its checksum differs".to_owned());
        }
        serde_json::from_str(body).map_err(|error| error.to_string())
    }

    /// Returns the state of `dae` at time `t`, given the unknowns `y`.
    pub(crate) fn of(dae: &mut MuscleDae, t: f64, y: &[f64]) -> Self {
        let own = |field| dae.layout().range(field).map_or(Vec::new(), |own| y[own].to_vec());
        let tensions = own(Field::Tension);
        let internal_stresses = own(Field::InternalStress);
        let snapshot = dae.snapshot(t, y, &[]);
        Self {
            t,
            mesh: key(snapshot.solid.space()),
            displacement: snapshot.displacement.to_vec(),
            velocity: snapshot.velocity.to_vec(),
            tensions,
            internal_stresses,
            load_reached: None,
            stopped_before: None,
        }
    }

    /// Returns the undeformed state with the given velocity (m/s) at the given nodes and zero velocity at the other
    /// nodes.
    pub(crate) fn moving(space: &Space, nodes: &[usize], velocity: &[f64]) -> Self {
        let dimension = velocity.len();
        let mut velocities = vec![0.0; space.n_nodes() * dimension];
        for node in nodes {
            velocities[dimension * node..][..dimension].copy_from_slice(velocity);
        }
        Self {
            t: 0.0,
            mesh: key(space),
            displacement: vec![0.0; velocities.len()],
            velocity: velocities,
            tensions: Vec::new(),
            internal_stresses: Vec::new(),
            load_reached: None,
            stopped_before: None,
        }
    }

    /// Returns whether the state belongs to a body with the same node coordinates.
    pub(crate) fn is_of(&self, space: &Space) -> bool {
        let n = space.n_nodes() * space.dimension();
        self.mesh == key(space) && [self.displacement.len(), self.velocity.len()] == [n, n]
    }

    /// Returns the unknowns of `dae` for the stored displacements, velocities, tensions and internal stresses. If the
    /// tensions do not match `dae`, they are set to zero; if the internal stresses do not match, they are set to
    /// equilibrium. All other unknowns are zero.
    pub(crate) fn unknowns(&self, dae: &MuscleDae) -> Vec<f64> {
        let mut y = vec![0.0; dae.n_unknowns()];
        let free = dae.muscle().solid.dofs().free_to_full();
        for (field, range) in dae.layout().blocks() {
            let block = &mut y[range.clone()];
            match field {
                Field::Displacement => gather(&self.displacement, free, block),
                Field::Velocity => gather(&self.velocity, free, block),
                Field::Tension if block.len() == self.tensions.len() => {
                    block.copy_from_slice(&self.tensions);
                }
                Field::InternalStress if block.len() == self.internal_stresses.len() => {
                    block.copy_from_slice(&self.internal_stresses);
                }
                Field::InternalStress => {
                    let settled = dae.muscle().solid.equilibrium_overstress(&self.displacement);
                    block.copy_from_slice(&settled);
                }
                _ => {}
            }
        }
        y
    }

    /// Returns notes on the use of this state as the start of a motion of `muscle`, for example if internal variables
    /// do not match.
    pub(crate) fn notes(&self, muscle: &Muscle) -> Vec<String> {
        let mut notes = Vec::new();
        if let Some(end) = self.stopped_before {
            notes.push(format!(
                "initial_state.folder: that run stopped at t = {} s instead of {end} s; this motion starts from there",
                self.t
            ));
        }
        if let Some(part) = self.load_reached.filter(|part| *part < 1.0) {
            notes.push(format!(
                "initial_state.folder: that run reached only {:.1} % of its loads, and the body starts in equilibrium \
                 with these; all loads of this scene act from t = 0",
                100.0 * part
            ));
        }
        let others = |found: usize, own: usize| found != 0 && found != own;
        if others(self.internal_stresses.len(), muscle.solid.n_internal()) {
            notes.push(
                "initial_state.folder: that run has different Prony terms; the internal stresses start in equilibrium"
                    .to_owned(),
            );
        }
        if others(self.tensions.len(), muscle.models().count()) {
            notes.push(
                "initial_state.folder: that run has different activation models; the tensions of this scene start at 0"
                    .to_owned(),
            );
        }
        notes
    }

    /// Returns the largest component (m) of the difference between the stored displacement and the displacement at
    /// t = 0 in state `y` of `dae`. The latter includes the motion of the supports.
    pub(crate) fn moved_by_supports(&self, dae: &mut MuscleDae, y: &[f64]) -> f64 {
        let now = dae.snapshot(0.0, y, &[]).displacement.iter();
        let distances = now.zip(&self.displacement).map(|(now, own)| (now - own).abs());
        distances.fold(0.0, f64::max)
    }

    /// Returns the largest magnitude of a displacement component (m).
    pub(crate) fn largest_displacement(&self) -> f64 {
        self.displacement.iter().fold(0.0, |m, u| m.max(u.abs()))
    }

    /// Returns the largest magnitude of a velocity component (m/s).
    pub(crate) fn largest_velocity(&self) -> f64 {
        self.velocity.iter().fold(0.0, |m, v| m.max(v.abs()))
    }
}

fn gather(full: &[f64], free: &[usize], block: &mut [f64]) {
    for (value, &place) in block.iter_mut().zip(free) {
        *value = full[place];
    }
}

fn key(space: &Space) -> String {
    let coordinates = space.coordinates().iter();
    let bytes: Vec<u8> = coordinates.flat_map(|x| x.to_le_bytes()).collect();
    sha256(&bytes)
}
