//! Runs one cell, or computes the solution it is compared with.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::Instant;

use myovib_fem::Mesh;
use myovib_model::{
    Formulation, IntegratorKind, Limits, ModelError, MuscleDae, Outcome, Probe, Settings,
    Statistics, run, start_at_rest,
};
use serde::{Deserialize, Serialize};
use sundials_wrap::DaeProblem;

use super::cell::{Cell, Physics, scaled};
use super::watch::Watch;
use crate::interrupt;

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
    /// Errors at the origin beside the largest value of the trusted solution.
    pub(super) error_u_y: Option<f64>,
    pub(super) error_p: Option<f64>,
    /// The relative difference of the two runs that the trusted solution comes from.
    pub(super) trusted_to: Option<f64>,
    pub(super) constraint_drift: f64,
    /// Violation of the energy balance, relative.
    pub(super) energy_imbalance: Option<f64>,
    /// Of Newton's matrix at the smallest step.
    pub(super) rcond: Option<f64>,
    pub(super) cpu_seconds: f64,
    pub(super) wall_seconds: f64,
}

/// A solution converged in time, by an integrator that is none of those under stress.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Trusted {
    /// The relative difference in u_y of the two runs, which bounds the error of the finer one.
    pub(super) claimed: f64,
    u_y: Vec<f64>,
    p: Vec<f64>,
}

/// Relative tolerances of the two runs of Radau IIA whose difference is claimed.
const TRUSTED_TOLERANCES: [f64; 2] = [1e-6, 1e-7];

/// Runs a cell; whatever happens is recorded.
pub(super) fn measure(cell: &Cell, mesh: &Mesh, cap: f64, trusted: Option<&Trusted>) -> Measured {
    let started = Instant::now();
    let settings = cell.settings();
    let tried = catch_unwind(AssertUnwindSafe(|| {
        integrate(&cell.physics, cell.formulation, &settings, mesh, cap)
    }));
    let ended_by = |ended, message: String| Measured {
        ended,
        message: Some(message),
        ..Measured::default()
    };
    let measured = match tried {
        Ok(Ok(run)) => run.measured(trusted),
        Ok(Err(error)) => ended_by(Ended::Failed, error.to_string()),
        Err(_) => ended_by(Ended::Panicked, "see standard error".to_owned()),
    };
    Measured {
        wall_seconds: started.elapsed().as_secs_f64(),
        ..measured
    }
}

/// The trusted solution of a physics, if Radau IIA reaches the end twice.
pub(super) fn trusted(physics: &Physics, mesh: &Mesh, cap: f64) -> Option<Trusted> {
    let formulation = match (physics.mixed, physics.beta > 0.0) {
        (false, _) => Formulation::Displacement,
        (true, false) => Formulation::Position,
        (true, true) => Formulation::ImplicitRate,
    };
    let [coarse, fine] = TRUSTED_TOLERANCES.map(|rtol| {
        let settings = Settings {
            integrator: IntegratorKind::Radau,
            max_order: 5,
            ..scaled(formulation, rtol)
        };
        let run = integrate(physics, formulation, &settings, mesh, cap).ok()?;
        (run.statistics.outcome == Outcome::Finished).then_some(run)
    });
    let (coarse, fine) = (coarse?, fine?);
    Some(Trusted {
        claimed: relative_error(&coarse.u_y, &fine.u_y)?,
        u_y: fine.u_y,
        p: fine.p,
    })
}

/// A run with what was recorded of it.
struct Run {
    statistics: Statistics,
    index: u8,
    u_y: Vec<f64>,
    p: Vec<f64>,
    drift: f64,
    imbalance: Option<f64>,
    rcond: Option<f64>,
}

fn integrate(
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
    let rcond = watch.rcond(integrator.problem_mut());
    Ok(Run {
        statistics,
        index,
        drift: watch.drift,
        imbalance: watch.imbalance(),
        rcond,
        u_y: watch.u_y,
        p: watch.p,
    })
}

impl Run {
    fn measured(self, trusted: Option<&Trusted>) -> Measured {
        let statistics = self.statistics;
        let (ended, message) = match &statistics.outcome {
            Outcome::Finished => (Ended::Finished, None),
            Outcome::Stopped { message, .. } => (Ended::Stopped, Some(message.clone())),
        };
        Measured {
            ended,
            reason: statistics.outcome.reason().map(|r| r.name().to_owned()),
            message,
            index: self.index,
            t_reached: statistics.t_reached,
            steps: statistics.steps,
            error_test_failures: statistics.error_test_failures,
            step_solve_failures: statistics.step_solve_failures,
            newton_iterations: statistics.newton_iterations,
            linear_setups: statistics.linear_setups,
            error_u_y: trusted.and_then(|t| relative_error(&self.u_y, &t.u_y)),
            error_p: trusted.and_then(|t| relative_error(&self.p, &t.p)),
            trusted_to: trusted.map(|t| t.claimed),
            constraint_drift: self.drift,
            energy_imbalance: self.imbalance,
            rcond: self.rcond,
            cpu_seconds: statistics.cpu_seconds,
            wall_seconds: 0.0,
        }
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
