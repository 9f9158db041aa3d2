//! What a run will cost, told before it.
//!
//! The number of steps is that of a dry run: steps that follow a vibration at the load's frequency to
//! the tolerance, shortened at the breaks of what drives the body as they are in a run. Whatever wakes faster
//! vibrations takes more. The time of a step is measured on the first ones; where these would take long, it
//! is told from the size of the factors and the speed of the machine.

use std::f64::consts::TAU;
use std::time::Duration;

use myovib_dae::Problem;
use myovib_radau::RadauOptions;
use myovib_sparse::Prediction;

use crate::advice::Advice;
use crate::analysis::speed::Speed;
use crate::cpu::CpuClock;
use crate::error::ModelError;
use crate::integration::integrator::{Advance, Integrator};
use crate::integration::launch::start_from;
use crate::integration::radau;
use crate::integration::settings::Settings;
use crate::muscle::Muscle;
use crate::muscle_dae::MuscleDae;
use crate::signal::schedule::Schedule;

/// Error of a step of order k of BDF: this times (ω h)^(k+1), from the steps of the runs of Table 2.
const ERROR_CONSTANT: f64 = 1.0 / 5.8;
/// Both integrators keep a step until it may be twice as long.
pub const KEPT: f64 = 2.0;
/// Times at which functions of time are looked at for their onset.
const ONSET_SAMPLES: usize = 1000;
/// Steps of a dry run: beyond them the rest is taken to go on alike.
const DRY_STEPS: usize = 100_000;
/// Steps in which the step size grows to that of the run, each with a factorisation of its own.
const START_STEPS: usize = 15;
/// Steps after these whose time is taken.
const TIMED_STEPS: usize = 15;
/// How long each may take; a large body is timed by fewer steps.
const START_PATIENCE: Duration = Duration::from_secs(1);
const PATIENCE: Duration = Duration::from_millis(300);
/// Set-ups, evaluations of the matrices and Newton iterations of a step of Radau IIA: those of the
/// coarse ventricle, whose stiffness changes throughout.
const OF_RADAU: [f64; 3] = [0.8, 0.4, 3.2];
/// The same of BDF: those of row 1 of Table 2.
const OF_BDF: [f64; 3] = [0.13, 0.13, 1.6];

/// The expected cost of a run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cost {
    /// The steps of a motion that follows its load, or its lowest mode, alone; where neither
    /// is known, those that end where what drives the body changes.
    pub steps: f64,
    /// Whether the load is a vibration without breaks and nothing else moves the body: the run then takes
    /// at most [`KEPT`] times as many steps.
    pub follows_load: bool,
    /// CPU time of a step, s; NaN if the run does not get that far.
    pub seconds_per_step: f64,
    /// Whether that was measured on the first steps.
    pub is_measured: bool,
}

impl Cost {
    /// The most steps to expect, where that can be told.
    pub fn most_steps(&self) -> Option<f64> {
        self.follows_load.then_some(KEPT * self.steps)
    }
}

/// The cost of a run of `dae` from the `start`: for a body of lowest frequency `lowest`, if that is known, and
/// matrices that take `needs`, if the steps are not to be tried.
pub(super) fn cost(
    mut dae: MuscleDae,
    advice: &Advice,
    settings: &Settings,
    lowest: Option<f64>,
    needs: Option<Prediction>,
    start: [&[f64]; 2],
) -> Result<Cost, ModelError> {
    let muscle = dae.muscle();
    let schedule = muscle.schedule();
    let follows_load = follows_load(muscle, &schedule, settings.t_end);
    let step = match muscle.drive().or(lowest) {
        Some(f) => angle(&dae, advice, settings)? / (TAU * f),
        None => f64::INFINITY,
    };
    let step = settings.max_step.map_or(step, |most| step.min(most));
    // A body at rest stays there until a load is more than the tolerance's fraction of what it comes to.
    let is_at_rest = start
        .iter()
        .all(|values| values.iter().all(|value| *value == 0.0));
    let awake = match is_at_rest {
        true => onset(muscle, settings),
        false => 0.0,
    };
    let steps = steps(&schedule, step, [awake, settings.t_end]);
    let (seconds_per_step, is_measured) = match needs {
        None => (measured(dae, settings, start)?, true),
        Some(needs) => (predicted(&mut dae, settings, needs, start)?, false),
    };
    Ok(Cost {
        steps,
        follows_load,
        seconds_per_step,
        is_measured,
    })
}

/// Whether a vibration without breaks is all that moves the body.
fn follows_load(muscle: &Muscle, schedule: &Schedule, t_end: f64) -> bool {
    let breaks = schedule.next_break(0.0).is_some_and(|next| next.t < t_end);
    muscle.drive().is_some() && muscle.activations.is_empty() && !breaks
}

/// The angle ωh of the steps of a vibration.
fn angle(dae: &MuscleDae, advice: &Advice, settings: &Settings) -> Result<f64, ModelError> {
    if settings.integrator.stages().is_some() {
        let options: RadauOptions = radau::options(dae, settings);
        return Ok(options.vibration_angle()?);
    }
    let order = settings.max_order.min(advice.max_order());
    let exponent = 1.0 / f64::from(order + 1);
    Ok((settings.relative_tolerance / ERROR_CONSTANT).powf(exponent))
}

/// The first time at which one of the functions of time is above the relative tolerance times its largest
/// value over the run, or a model of activation switches on; 0 where there is neither.
fn onset(muscle: &Muscle, settings: &Settings) -> f64 {
    let times = || (0..=ONSET_SAMPLES).map(|k| settings.t_end * k as f64 / ONSET_SAMPLES as f64);
    let first = muscle.signals().filter_map(|signal| {
        let size = |t: f64| signal.at(t).value.abs();
        let largest = times().map(size).fold(0.0, f64::max);
        times().find(|&t| size(t) > settings.relative_tolerance * largest)
    });
    let models = muscle.models().map(|(_, model)| model.systole);
    first.chain(models).reduce(f64::min).unwrap_or(0.0)
}

/// Steps of size `step` to the end of a motion that begins when the body is `awake`, shortened as in a run.
fn steps(schedule: &Schedule, step: f64, [awake, t_end]: [f64; 2]) -> f64 {
    if (t_end - awake) / step > DRY_STEPS as f64 {
        return (t_end - awake) / step;
    }
    let (mut t, mut taken) = (0.0, 0);
    while t < t_end && taken < DRY_STEPS {
        let proposed = if t < awake { awake - t } else { step };
        t = schedule.limit(t, proposed, t_end).min(t + proposed);
        taken += 1;
    }
    taken as f64 * t_end / t
}

/// CPU time of a step of the run, s; NaN if it does not get beyond its start.
fn measured(
    dae: MuscleDae,
    settings: &Settings,
    [y, y_dot]: [&[f64]; 2],
) -> Result<f64, ModelError> {
    let mut integrator = start_from(dae, settings, 0.0, y, y_dot)?;
    let [start, timed] = [
        tried(&mut *integrator, START_STEPS, START_PATIENCE)?,
        tried(&mut *integrator, TIMED_STEPS, PATIENCE)?,
    ];
    let (seconds, steps) = if timed.1 > 0 { timed } else { start };
    Ok(match steps {
        0 => f64::NAN,
        n => seconds / n as f64,
    })
}

/// CPU time of the next steps, s, and their number: as many as are wanted, or as are done when patience ends.
///
/// # Errors
/// Those of the integrator.
pub fn tried<P>(
    integrator: &mut dyn Integrator<P>,
    steps: usize,
    patience: Duration,
) -> Result<(f64, u64), ModelError> {
    let before = integrator.counts().steps;
    let clock = CpuClock::start();
    for _ in 0..steps {
        if integrator.advance()? != Advance::Stepped || clock.elapsed() > patience {
            break;
        }
    }
    let seconds = clock.elapsed().as_secs_f64();
    Ok((seconds, integrator.counts().steps - before))
}

/// CPU time of a step, s, from what its matrices take.
fn predicted(
    dae: &mut MuscleDae,
    settings: &Settings,
    needs: Prediction,
    [y, y_dot]: [&[f64]; 2],
) -> Result<f64, ModelError> {
    let stages = settings.integrator.stages();
    let speed = Speed::measure(stages.is_some_and(|stages| stages > 1))?;
    let [set_ups, evaluations, iterations] = match stages {
        Some(_) => OF_RADAU,
        None => OF_BDF,
    };
    let mut residual = vec![0.0; y.len()];
    let clock = CpuClock::start();
    dae.residual(0.0, y, y_dot, &mut residual)?;
    let residual = clock.elapsed().as_secs_f64();
    let clock = CpuClock::start();
    dae.update_matrices(0.0, y, y_dot)?;
    let matrices = clock.elapsed().as_secs_f64();
    let residuals = stages.unwrap_or(1) as f64 * residual;
    Ok(set_ups * needs.flops / speed.operations
        + evaluations * matrices
        + iterations * (residuals + needs.entries as f64 / speed.entries))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::signal::{Signal, formula};

    /// A rise of 0.02 s takes four steps; before it two share what is left.
    #[test]
    fn a_dry_run_ends_steps_where_a_run_does() {
        assert_eq!(steps(&Schedule::default(), 0.125, [0.0, 1.0]), 8.0);
        assert_eq!(steps(&Schedule::default(), 0.125, [0.5, 1.0]), 5.0);
        assert_eq!(steps(&Schedule::default(), 0.1, [0.0, 1e6]), 1e7);
        let mut driven = Schedule::default();
        let (value, start, rise) = (1.0, 0.55, 0.02);
        driven.add(Signal::from(formula::Step { value, start, rise }), 0);
        let found = steps(&driven, 0.1, [0.0, 1.0]);
        // Six before, four in it, five after.
        assert!((14.0..=16.0).contains(&found), "{found}");
        let breaks_alone = steps(&driven, f64::INFINITY, [0.0, 1.0]);
        assert_eq!(breaks_alone, 1.0 + 4.0 + 1.0);
    }
}
