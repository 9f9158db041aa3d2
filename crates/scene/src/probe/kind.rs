//! What a kind of probe says of itself, and what is read by it.

use myovib_fem::Solid;
use myovib_model::{Measurement, ModelError, Muscle, RodDae};

use super::balance::EnergyBalance;
use crate::InputError;
use crate::run::system::System;

/// What a scene's text has that a probe may be of.
pub(crate) struct Parts<'a> {
    /// A body with a mesh.
    pub(crate) body: bool,
    /// A rod.
    pub(crate) rod: bool,
    /// The names of its chains.
    pub(crate) chains: Vec<&'a str>,
    /// Whether a chain acts back.
    pub(crate) feedback: bool,
}

/// The parts of a scene, once they are made.
pub(crate) struct Systems<'a> {
    /// The body, if there is one.
    pub(crate) muscle: Option<&'a Muscle>,
    /// The rod, if there is one.
    pub(crate) rod: Option<&'a RodDae>,
    /// Name and number of oscillators of each chain.
    pub(crate) chains: Vec<(&'a str, usize)>,
    /// The names of the chains that act back.
    pub(crate) feedbacks: Vec<&'a str>,
}

/// A key of the probe, and what is wrong there.
pub(crate) type Wrong<E> = (&'static str, E);

/// What is wrong with a place.
pub(crate) enum Objection {
    /// The library's words.
    Model(ModelError),
    /// Ours.
    Input(InputError),
}

/// A kind of probe, as a scene has it.
pub(crate) trait Kind {
    /// Whether only a motion has what it measures.
    fn is_of_motion(&self) -> bool {
        false
    }

    /// Refuses a scene without the part it is of; by default the body.
    fn check_part(&self, parts: &Parts<'_>) -> Result<(), Wrong<InputError>> {
        match parts.body {
            true => Ok(()),
            false => Err((
                ".type",
                InputError::new("this probe needs a [mesh] with [solid]")
                    .next("for a rod or chains: coherence, oscillators, rod"),
            )),
        }
    }

    /// Refuses a place where there is nothing to measure.
    fn check_place(&self, _: &Solid) -> Result<(), Wrong<Objection>> {
        Ok(())
    }

    /// What it reads of these parts, which have been checked to be there.
    fn reading(&self, of: &Systems<'_>) -> Result<Box<dyn Reading>, ModelError>;
}

/// What a probe reads.
pub(crate) trait Reading: Send {
    /// Names of the columns after the time.
    fn names(&self) -> Vec<String>;

    /// The values at a time; an energy balance gives those of the time it was advanced to.
    fn values(
        &self,
        system: &mut dyn System,
        t: f64,
        y: &[f64],
        y_dot: &[f64],
    ) -> Result<Vec<f64>, ModelError>;

    /// Whether ẏ is needed.
    fn needs_rates(&self, _system: &mut dyn System, _y: &[f64]) -> bool {
        false
    }

    /// Whether its error can be told from those of the steps: not where it starts far from zero, beside which its
    /// changes are small.
    fn has_indicator(&self) -> bool {
        true
    }

    /// Whether the column with this number is an angle, which jumps by a full turn.
    fn is_angle(&self, _column: usize) -> bool {
        false
    }

    /// How many places have a stress computed for one row.
    fn stress_evaluations(&self) -> u64 {
        0
    }

    /// What it measures at places; nothing for others.
    fn measurements(&self) -> &[Measurement] {
        &[]
    }

    /// What adds up over the time before, if something does: it is then no function of the state.
    fn balance(&self) -> Option<&EnergyBalance> {
        None
    }

    /// The same, to go on with.
    fn balance_mut(&mut self) -> Option<&mut EnergyBalance> {
        None
    }
}

impl dyn Reading {
    /// Names of all columns.
    pub(crate) fn columns(&self) -> Vec<String> {
        std::iter::once("t".to_owned())
            .chain(self.names())
            .collect()
    }
}

impl<'a> Systems<'a> {
    /// The body.
    pub(crate) fn solid(&self) -> Result<&'a Solid, ModelError> {
        let muscle = self.muscle.ok_or(ModelError::NoSuchPart { part: "muscle" });
        Ok(&muscle?.solid)
    }

    /// The number of a chain, and that of its oscillators.
    pub(crate) fn chain(&self, name: &str) -> Result<(usize, usize), ModelError> {
        let mut chains = self.chains.iter().enumerate();
        let found = chains.find(|(_, (own, _))| *own == name);
        let (k, (_, n)) = found.ok_or(ModelError::NoSuchPart {
            part: "chain of that name",
        })?;
        Ok((k, *n))
    }
}

impl Parts<'_> {
    /// Refuses a chain that the scene does not have.
    pub(crate) fn expect_chain(&self, name: &str) -> Result<(), Wrong<InputError>> {
        match self.chains.contains(&name) {
            true => Ok(()),
            false => Err((
                ".chain",
                InputError::new(format!("there is no chain `{name}`"))
                    .allowed(self.chains.join(", ")),
            )),
        }
    }
}

/// With the key of what is wrong.
pub(crate) fn at<T, E>(key: &'static str, result: Result<T, E>) -> Result<T, Wrong<Objection>>
where
    ModelError: From<E>,
{
    result.map_err(|error| (key, Objection::Model(error.into())))
}
