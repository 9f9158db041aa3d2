//! Runs one cell.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::Instant;

use myovib_dae::Problem;
use myovib_fem::Mesh;
use myovib_model::{
    Formulation, Limits, ModelError, MuscleDae, Outcome, Probe, Settings, run, start_at_rest,
};
use serde::{Deserialize, Serialize};

use super::cell::{Cell, Physics};
use super::watch::Watch;
use myovib_cli::interrupt;

/// How a cell ended.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum Ended {
    #[default]
    Finished,
    Stopped,
    /// An error that is no outcome of an integration.
    Failed,
    Panicked,
}

/// What came of a cell.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub(super) struct Measured {
    #[serde(rename = "outcome")]
    pub(super) ended: Ended,
    pub(super) reason: Option<String>,
    pub(super) message: Option<String>,
    pub(super) index: u8,
    pub(super) t_reached: f64,
    pub(super) steps: u64,
    pub(super) error_test_failures: u64,
    pub(super) step_solve_failures: u64,
    pub(super) newton_iterations: u64,
    pub(super) linear_setups: u64,
    pub(super) constraint_drift: f64,
    /// Violation of the energy balance, relative.
    pub(super) energy_imbalance: Option<f64>,
    /// Of Newton's matrix at the smallest step.
    pub(super) rcond: Option<f64>,
    pub(super) cpu_seconds: f64,
    pub(super) wall_seconds: f64,
}

/// The motion of the origin at the times of [`Watch`].
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub(super) struct Motion {
    /// m.
    pub(super) u_y: Vec<f64>,
    /// Pa; empty where the pressure is no unknown.
    pub(super) p: Vec<f64>,
}

/// A run as it is kept: what came of it, and the motion that its error is found from.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub(super) struct Run {
    pub(super) measured: Measured,
    pub(super) motion: Motion,
}

/// Runs a cell; whatever happens is recorded.
pub(super) fn measure(cell: &Cell, mesh: &Mesh, cap: f64) -> Run {
    let started = Instant::now();
    let settings = cell.settings();
    let tried = catch_unwind(AssertUnwindSafe(|| {
        integrate(&cell.physics, cell.formulation, &settings, mesh, cap)
    }));
    let ended_by = |ended, message: String| Run {
        measured: Measured {
            ended,
            message: Some(message),
            ..Measured::default()
        },
        motion: Motion::default(),
    };
    let mut run = match tried {
        Ok(Ok(run)) => run,
        Ok(Err(error)) => ended_by(Ended::Failed, error.to_string()),
        Err(_) => ended_by(Ended::Panicked, "see standard error".to_owned()),
    };
    run.measured.wall_seconds = started.elapsed().as_secs_f64();
    run
}

/// Runs a physics in a formulation of it.
pub(super) fn integrate(
    physics: &Physics,
    formulation: Formulation,
    settings: &Settings,
    mesh: &Mesh,
    cap: f64,
) -> Result<Run, ModelError> {
    let muscle = physics.muscle(mesh)?;
    let origin = Probe::at(muscle.solid.space(), [0.0, 0.0])?;
    let dae = MuscleDae::new(muscle, formulation)?;
    let index = dae.index();
    let mut watch = Watch::new(dae.n_unknowns(), &origin);
    let mut limits = Limits::new(cap, Some(interrupt::flag()));
    let mut integrator = start_at_rest(dae, settings)?;
    let statistics = run(integrator.as_mut(), &mut [&mut watch, &mut limits])?;
    let (ended, message) = match &statistics.outcome {
        Outcome::Finished => (Ended::Finished, None),
        Outcome::Stopped { message, .. } => (Ended::Stopped, Some(message.clone())),
    };
    Ok(Run {
        measured: Measured {
            ended,
            reason: statistics.outcome.reason().map(|r| r.name().to_owned()),
            message,
            index,
            t_reached: statistics.t_reached,
            steps: statistics.counts.steps,
            error_test_failures: statistics.counts.error_test_failures,
            step_solve_failures: statistics.counts.step_solve_failures,
            newton_iterations: statistics.counts.newton_iterations,
            linear_setups: statistics.counts.linear_setups,
            constraint_drift: watch.drift,
            energy_imbalance: watch.imbalance(),
            rcond: watch.rcond(integrator.problem_mut()),
            cpu_seconds: statistics.cpu_seconds,
            wall_seconds: 0.0,
        },
        motion: Motion {
            u_y: watch.u_y,
            p: watch.p,
        },
    })
}
