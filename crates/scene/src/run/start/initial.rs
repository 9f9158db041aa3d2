//! Initial values of the motion of a body.

use myovib_model::{InitialValues, MuscleDae};

use super::checks::expect_start;
use crate::Error;
use crate::scene::{Body, Start};
use crate::watch::{Watcher, search};

/// Returns y and ẏ at the start of the motion of a body. The `watcher` receives the progress of the search for an
/// equilibrium.
///
/// # Errors
/// Returns the errors of [`Body::initial_values`]. Also fails if the loads or supports at t = 0 contradict the initial
/// state.
pub fn initial(
    body: &Body,
    dae: &mut MuscleDae,
    watcher: Watcher<'_>,
) -> Result<[Vec<f64>; 2], Error> {
    expect_start(body, dae)?;
    if let Some(start) = body.initial_values(dae, watcher)? {
        return Ok(start);
    }
    let start = InitialValues::at_rest(dae)?;
    Ok([start.y, start.y_dot])
}

impl Body {
    /// Returns consistent values of y and ẏ at t = 0, or `None` if the scene starts at rest. `dae` must belong to this
    /// body. The `watcher` receives the progress of the search for an equilibrium.
    ///
    /// # Errors
    /// Fails if no equilibrium is found.
    pub fn initial_values(
        &self,
        dae: &mut MuscleDae,
        watcher: Watcher<'_>,
    ) -> Result<Option<[Vec<f64>; 2]>, Error> {
        let start = match &self.start {
            Start::Rest => return Ok(None),
            Start::Equilibrium => InitialValues::equilibrium(dae, 0.0, &mut search(watcher))?,
            Start::State(state) => {
                let y = state.unknowns(dae);
                InitialValues::of(dae, 0.0, &y)?
            }
        };
        Ok(Some([start.y, start.y_dot]))
    }
}
