//! A run is rehearsed: all that is read and built for it, without a search for where it starts.

use myovib_model::{Integrator, MuscleDae};

use super::dynamic::conditions;
use super::start::{Driver, driven_by, expect_start, start};
use super::system::System;
use crate::watch::Watcher;
use crate::{Body, Error, Scene};

/// Refuses what a motion refuses before it writes anything, but for what the search for its start finds.
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

/// Starts and goes no further.
struct Nothing;

impl Driver for Nothing {
    type Result = ();

    fn drive<P: System>(self, _: Box<dyn Integrator<P>>) -> Result<(), Error> {
        Ok(())
    }
}
