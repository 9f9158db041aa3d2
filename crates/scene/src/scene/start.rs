//! Initial state of a body's motion.

use std::path::Path;

use myovib_model::Muscle;
use serde_json::Value;

use super::builder::Builder;
use super::contraction::chains_that_act;
use crate::result_folder::DOCUMENT;
use crate::scene_file::Analysis;
use crate::scene_file::start::InitialState;
use crate::state::State;
use crate::{InputError, inputs};

/// Initial state of a body's motion.
#[derive(Debug, Clone, Default)]
pub(crate) enum Start {
    /// Rest without loads.
    #[default]
    Rest,
    /// Equilibrium with the loads at t = 0.
    Equilibrium,
    /// State of another motion.
    State(State),
}

impl Builder<'_> {
    /// Returns the initial state of the scene's motion.
    pub(super) fn start(&self, muscle: Option<&Muscle>) -> Result<Start, InputError> {
        let Some(start) = &self.file.initial_state else {
            return Ok(Start::Rest);
        };
        let wrong = |message: &str, next: &str| {
            let error = InputError::new(message).next(next);
            Err(self.wrong("initial_state", error))
        };
        let Some(muscle) = muscle else {
            return wrong(
                "only a body on a mesh can have an initial state other than rest",
                "remove [initial_state]",
            );
        };
        if !self.file.analysis.has_initial_state() {
            return Ok(Start::Rest);
        }
        if !self.file.feedback.is_empty() {
            return wrong(
                "a body with feedback must start at rest",
                "remove [initial_state], or the feedback",
            );
        }
        let of_equilibrium = matches!(start, InitialState::Equilibrium);
        if self.file.analysis == Analysis::QuasiStatic && !of_equilibrium {
            return wrong(
                "a quasi-static analysis must start without load or in equilibrium",
                "give [initial_state] type = \"equilibrium\", or remove it",
            );
        }
        if chains_that_act(self.file).next().is_some() && !of_equilibrium {
            return wrong(
                "a body whose tension depends on the coherence of a chain must start at rest or in equilibrium",
                "give [initial_state] type = \"equilibrium\", or remove it",
            );
        }
        match start {
            InitialState::Equilibrium => Ok(Start::Equilibrium),
            InitialState::Velocity { group, value } => {
                let space = muscle.solid.space();
                if value.len() != space.dimension() {
                    let error = InputError::new(
                        "the velocity needs one component for each axis of the mesh",
                    )
                    .found(value.len())
                    .allowed(space.dimension());
                    return Err(self.wrong("initial_state.value", error));
                }
                let nodes = match group {
                    None => (0..space.n_nodes()).collect(),
                    Some(group) => self.at("initial_state.group", space.nodes_of(group))?,
                };
                Ok(Start::State(State::moving(space, &nodes, value)))
            }
            InitialState::Restart { folder } => Ok(Start::State(self.ended(folder, muscle)?)),
        }
    }

    /// Returns the final state of the run in `folder`.
    fn ended(&self, folder: &Path, muscle: &Muscle) -> Result<State, InputError> {
        let place = "initial_state.folder";
        let (text, name) = self.read_text(&folder.join(State::NAME), place)?;
        let state = State::decode(&text).map_err(|reason| {
            let error = InputError::new(format!("{name} cannot be used: {reason}"));
            self.wrong(place, error.next("`myovib run` writes it to its folder"))
        })?;
        let run = self.document_of_run(folder).unwrap_or_default();
        if let Some(end) = run["t_reached"].as_f64()
            && end != state.t
        {
            let error = InputError::new(format!("{name} belongs to another run"))
                .found(format!("t = {} s", state.t))
                .allowed(format!("t = {end} s, where the run of {DOCUMENT} ended"));
            return Err(self.wrong(place, error.next("run that scene again")));
        }
        if !state.is_of(muscle.solid.space()) {
            let error = InputError::new(format!("{name} belongs to another mesh"))
                .next("start from a run with the mesh of this scene and the same refinement");
            return Err(self.wrong(place, error));
        }
        if run["scene"].is_object() {
            self.note_differences(&run["scene"], &state);
        }
        Ok(state)
    }

    /// Returns the statistics of the run in `folder`, if they exist.
    fn document_of_run(&self, folder: &Path) -> Option<Value> {
        let text = inputs::content(&self.inputs.resolve(folder).join(DOCUMENT)).ok()?;
        serde_json::from_slice(&text).ok()
    }
}
