//! Trusted solutions: what the motion of a cell is compared with.
//!
//! A body's solution is computed when the first cell that finished asks for it, by an integrator that
//! is none of those under stress, and shared by all cells of the body.

use std::collections::HashMap;
use std::path::Path;
use std::sync::atomic::Ordering;
use std::sync::{Arc, Mutex, OnceLock};

use myovib_fem::Mesh;
use myovib_model::{Formulation, IntegratorKind};
use serde::{Deserialize, Serialize};

use super::cell::{self, Physics};
use super::measure::{Ended, Motion, Run, integrate};
use super::store::{Origin, Store};
use myovib_cli::interrupt;

/// Relative tolerances of the two runs of Radau IIA whose difference is claimed.
const TOLERANCES: [f64; 2] = [1e-6, 1e-7];

/// The part of the cells' cap that each run of Radau IIA may use: those that get through take a tenth
/// of it, the others (a hundred times the load) would not with all of it.
const PART_OF_CAP: f64 = 0.25;

/// A solution converged in time.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Trusted {
    /// The relative difference in u_y of the two runs, which bounds the error of the finer one.
    pub(super) claimed: f64,
    pub(super) motion: Motion,
}

impl Trusted {
    /// The solution of a body by Radau IIA of order 9 with all variables in the error test, if it
    /// gets to the end twice.
    fn new(physics: &Physics, mesh: &Mesh, cap: f64) -> Option<Self> {
        let formulation = match (physics.mixed, physics.beta > 0.0) {
            (false, _) => Formulation::Displacement,
            (true, false) => Formulation::Position,
            (true, true) => Formulation::ImplicitRate,
        };
        let solve = |rtol| {
            let settings =
                cell::settings(formulation, rtol).with_integrator(IntegratorKind::Radau9);
            let run = integrate(physics, formulation, &settings, mesh, PART_OF_CAP * cap).ok()?;
            (run.measured.ended == Ended::Finished).then_some(run.motion)
        };
        let coarse = solve(TOLERANCES[0])?;
        let motion = solve(TOLERANCES[1])?;
        Some(Self {
            claimed: relative_error(&coarse.u_y, &motion.u_y)?,
            motion,
        })
    }
}

/// A run beside the trusted solution, as far as the run goes.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub(super) struct Errors {
    /// At the origin, beside the largest value of the trusted solution.
    pub(super) error_u_y: Option<f64>,
    pub(super) error_p: Option<f64>,
    /// [`Trusted::claimed`].
    pub(super) trusted_to: Option<f64>,
}

impl Errors {
    pub(super) fn of(run: &Run, trusted: Option<&Trusted>) -> Self {
        trusted.map_or_else(Self::default, |trusted| Self {
            error_u_y: relative_error(&run.motion.u_y, &trusted.motion.u_y),
            error_p: relative_error(&run.motion.p, &trusted.motion.p),
            trusted_to: Some(trusted.claimed),
        })
    }
}

/// The largest difference over the largest value of `theirs`, as far as `ours` goes.
fn relative_error(ours: &[f64], theirs: &[f64]) -> Option<f64> {
    let compared = ours.iter().zip(theirs);
    let error = compared.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    let largest = theirs.iter().map(|b| b.abs()).fold(0.0, f64::max);
    let all_finite = ours.iter().all(|a| a.is_finite());
    match (ours.is_empty() || largest == 0.0, all_finite) {
        (true, _) => None,
        (false, true) => Some(error / largest),
        // `max` would pass over a NaN, and JSON has no infinity.
        (false, false) => Some(f64::MAX),
    }
}

/// Solved, or found to be beyond Radau IIA; empty until it is asked for, or if interrupted.
type Slot = Arc<OnceLock<Option<Trusted>>>;

/// The solutions that were asked for so far, of this and of interrupted matrices.
pub(super) struct Solutions<'a> {
    store: Store<Option<Trusted>>,
    slots: Mutex<HashMap<String, Slot>>,
    mesh: &'a Mesh,
    cap: f64,
}

impl<'a> Solutions<'a> {
    pub(super) fn open(
        path: &Path,
        origin: Origin,
        mesh: &'a Mesh,
        cap: f64,
    ) -> anyhow::Result<Self> {
        Ok(Self {
            store: Store::open(path, origin)?,
            slots: Mutex::default(),
            mesh,
            cap,
        })
    }

    /// The mesh of level 0.
    pub(super) fn mesh(&self) -> &'a Mesh {
        self.mesh
    }

    fn slot(&self, key: &str) -> Slot {
        let mut slots = self.slots.lock().expect("no thread panics with the lock");
        let slot = slots.entry(key.to_owned()).or_default();
        if let Some(known) = self.store.get(key) {
            slot.get_or_init(|| known.clone());
        }
        Arc::clone(slot)
    }

    /// Computes the solution of a body unless it is known; another thread that wants the same one
    /// waits for it.
    pub(super) fn ensure(&self, physics: &Physics) -> anyhow::Result<()> {
        let key = physics.to_string();
        let slot = self.slot(&key);
        let mut kept = Ok(());
        slot.get_or_init(|| {
            let found = Trusted::new(physics, self.mesh, self.cap);
            // What ran while an interruption came is no result.
            if !interrupt::flag().load(Ordering::Relaxed) {
                kept = self.store.append(&key, &found);
            }
            found
        });
        kept
    }

    /// The solution of a body, if one was asked for and found.
    pub(super) fn known(&self, physics: &Physics) -> Option<Trusted> {
        self.slot(&physics.to_string()).get()?.clone()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_are_relative_and_never_lost() {
        let theirs = [0.0, 2.0, -4.0];
        assert_eq!(relative_error(&[0.0, 2.5], &theirs), Some(0.125));
        assert_eq!(relative_error(&[0.0, f64::NAN], &theirs), Some(f64::MAX));
        assert_eq!(relative_error(&[], &theirs), None);
    }
}
