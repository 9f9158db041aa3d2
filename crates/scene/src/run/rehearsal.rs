//! Rehearsal of a run, which builds all parts of the run but does not search for the initial state.

use myovib_model::{Integrator, MuscleDae};

use super::dynamic::conditions;
use super::start::{Driver, driven_by, expect_start, start};
use crate::system::System;
use crate::watch::Watcher;
use crate::{Body, Error, Scene};

/// Rejects all scenes that a dynamic run rejects before it writes a file. This function does not search for the initial
/// state.
pub(super) fn motion(scene: &Scene) -> Result<(), Error> {
    scene.readings()?;
    conditions(scene)?;
    match &scene.body {
        Some(body) => driving(scene, body).map_err(Error::before_any_output),
        None => start(scene, None, Watcher::NOBODY, Nothing),
    }
}

/// Builds a body and the chains that it drives.
fn driving(scene: &Scene, body: &Body) -> Result<(), Error> {
    let mut dae = MuscleDae::new(body.muscle.clone(), body.formulation)?;
    expect_start(body, &mut dae)?;
    driven_by(scene, &dae).map(drop)
}

/// Driver that takes no steps.
struct Nothing;

impl Driver for Nothing {
    type Result = ();

    fn drive<P: System>(self, _: Box<dyn Integrator<P>>) -> Result<(), Error> {
        Ok(())
    }
}
