//! Interface of all kinds of probes: validation against a scene, and measurement.

use myovib_fem::Solid;
use myovib_model::harmonic::{Amplitude, DynamicStiffness};
use myovib_model::{Measurement, ModelError, Quantity};
use num_complex::Complex64;

use super::balance::EnergyBalance;
use super::column::ColumnKind;
use crate::scene_file::SceneFile;
use crate::system::System;
use crate::{InputError, Scene};

/// A key of the probe and the error in its value.
pub(crate) type Wrong<E> = (&'static str, E);

/// Reason why a position is invalid.
pub(crate) enum InvalidPlace {
    Model(ModelError),
    /// An error found by the probe itself.
    Input(InputError),
}

/// A kind of probe and its keys in a scene.
pub(crate) trait Kind {
    /// Returns the kinds of the probe's columns, except for those that [`Quantity`](myovib_model::Quantity) describes.
    fn columns() -> &'static [ColumnKind]
    where
        Self: Sized,
    {
        &[]
    }

    /// Returns whether the probe can only measure motions.
    fn requires_motion(&self) -> bool {
        false
    }

    /// Rejects a scene without the part that the probe measures. By default, this part is the body.
    fn check_part(&self, file: &SceneFile) -> Result<(), Wrong<InputError>> {
        match file.mesh.is_some() {
            true => Ok(()),
            false => Err((
                ".type",
                InputError::new("this probe needs a [mesh] with [solid]")
                    .next("for a rod or chains: coherence, oscillators, rod"),
            )),
        }
    }

    /// Rejects a position at which the probe cannot measure anything.
    fn check_place(&self, _: &Solid) -> Result<(), Wrong<InvalidPlace>> {
        Ok(())
    }

    /// Creates the reading for a scene that has been built. The existence of the part that the probe measures has already
    /// been checked.
    fn reading(&self, of: &Scene) -> Result<Box<dyn Reading>, ModelError>;
}

/// State y of a system and its derivative ẏ at time t.
#[derive(Clone, Copy)]
pub(crate) struct StateAt<'a> {
    pub(crate) t: f64,
    pub(crate) y: &'a [f64],
    pub(crate) y_dot: &'a [f64],
}

/// Measurement of a probe.
pub(crate) trait Reading: Send + Sync {
    /// Returns the names of the columns that follow the time.
    fn names(&self) -> Vec<String>;

    /// Returns the values at a given state. An energy balance ignores this state and returns the values at the time to
    /// which it has been integrated.
    fn values(&self, system: &mut dyn System, at: StateAt<'_>) -> Result<Vec<f64>, ModelError>;

    /// Returns whether the values depend on ẏ.
    fn needs_rates(&self, _system: &mut dyn System, _y: &[f64]) -> bool {
        false
    }

    /// Returns whether the error of the values can be estimated from the errors of the steps. This is not possible for
    /// values that start far from zero and change little.
    fn has_indicator(&self) -> bool {
        true
    }

    /// Returns whether a column contains an angle, which may jump by full turns.
    fn is_angle(&self, _column: usize) -> bool {
        false
    }

    /// Returns the number of points per row at which a stress is computed.
    fn stress_evaluations(&self) -> u64 {
        0
    }

    /// Returns whether the probe supports complex amplitudes of harmonic motions.
    fn is_harmonic(&self) -> bool {
        false
    }

    /// Returns the complex amplitudes of the values; empty if the probe does not support them.
    fn amplitudes(&self, _: &HarmonicMotion<'_>) -> Result<Vec<Complex64>, ModelError> {
        Ok(Vec::new())
    }

    /// Returns the measurements of probes for points, lines and averages; empty for probes of other kinds.
    fn measurements(&self) -> &[Measurement] {
        &[]
    }

    /// Removes the quantities that do not satisfy `is_kept`.
    fn retain(&mut self, _is_kept: &dyn Fn(Quantity) -> bool) {}

    /// Returns the accumulated energy balance, if the probe has one. Its values are not a function
    /// of the state.
    fn balance(&self) -> Option<&EnergyBalance> {
        None
    }

    /// Returns a mutable reference to the accumulated energy balance, if the probe has one.
    fn balance_mut(&mut self) -> Option<&mut EnergyBalance> {
        None
    }
}

/// Harmonic motion at one frequency.
pub(crate) enum HarmonicMotion<'a> {
    Body(&'a DynamicStiffness, &'a Amplitude),
    /// Amplitudes of the state (q, v) of a rod.
    Rod(&'a [Complex64]),
}

impl<'a> HarmonicMotion<'a> {
    /// Returns the motion of the body, or an error if it is missing.
    pub(crate) fn body(&self) -> Result<(&'a DynamicStiffness, &'a Amplitude), ModelError> {
        match self {
            Self::Body(stiffness, amplitude) => Ok((stiffness, amplitude)),
            Self::Rod(_) => Err(ModelError::NoSuchPart { part: "muscle" }),
        }
    }
}

impl dyn Reading {
    /// Returns the names of all columns. The first column contains the time or the parameter of a path; `parameter` is
    /// its name.
    pub(crate) fn columns(&self, parameter: &str) -> Vec<String> {
        std::iter::once(parameter.to_owned()).chain(self.names()).collect()
    }
}

/// Rejects a scene without a chain of this name.
pub(crate) fn expect_chain(file: &SceneFile, name: &str) -> Result<(), Wrong<InputError>> {
    let names: Vec<&str> = file.chain.iter().map(|chain| &*chain.name).collect();
    match names.contains(&name) {
        true => Ok(()),
        false => Err((
            ".chain",
            InputError::new(format!("unknown chain `{name}`")).allowed(names.join(", ")),
        )),
    }
}

/// Adds the key to the error of a result.
pub(crate) fn at<T, E>(key: &'static str, result: Result<T, E>) -> Result<T, Wrong<InvalidPlace>>
where
    ModelError: From<E>,
{
    result.map_err(|error| (key, InvalidPlace::Model(error.into())))
}
