//! Cost of a run, estimated from its first steps.

use myovib_report::table::counted;
use myovib_scene::run::{PeriodTrial, Trial, TrialEnd};
use myovib_scene::{Scene, plain};
use serde_json::{Value, json};

/// Minimum part of a period from which the cost of a period is extrapolated. The first steps are much shorter than the
/// others.
const RESOLVED: f64 = 0.1;

/// Describes the cost of computing a periodic state.
pub(super) fn of_period(trial: &PeriodTrial) -> String {
    let PeriodTrial { unknowns, differential_variables, part, steps, seconds, stopped } = trial;
    let cost = match stopped {
        Some(reason) => {
            format!("unknown, because the trial from the initial state stopped: {reason}")
        }
        None if *part < RESOLVED => format!(
            "{:.1e} s per step; the trial of {} is too short for the number of steps per period",
            seconds / (*steps).max(1) as f64,
            counted(*steps, "step")
        ),
        None => format!(
            "{:.1e} s per period, estimated from a trial of {} over {:.0} % of a period; the number of periods depends \
             on damping and nonlinearity",
            seconds / part,
            counted(*steps, "step"),
            100.0 * part
        ),
    };
    format!(
        "Each period is integrated by Radau IIA.\n\
         unknowns        {unknowns}, of which {differential_variables} differential\n\
         cost            {cost}"
    )
}

/// Known cost of a run.
pub(super) enum Cost {
    /// Result of running the first steps.
    Tried(Trial),
    /// Predicted CPU time (s) per step for a body that is too large for a trial.
    Predicted(f64),
}

impl Cost {
    /// Formats the cost as text.
    pub(super) fn line(&self, scene: &Scene) -> String {
        let Trial { steps, t, seconds, end } = match self {
            Self::Tried(trial) => trial,
            Self::Predicted(seconds) => {
                return format!(
                    "cost            {seconds:.1} s per step, estimated from the size of the factors and the speed of this machine"
                );
            }
        };
        let steps = counted(*steps, "step");
        let unless = match scene.file().stop.is_empty() {
            true => "",
            false => ", unless a [[stop]] ends it earlier",
        };
        match end {
            TrialEnd::Finished => {
                format!(
                    "cost            {steps}, {seconds:.2} s: a trial computed the entire run{unless}"
                )
            }
            TrialEnd::Patience => {
                let t = match *t {
                    0.01.. => format!("{t:.2}"),
                    t => format!("{t:.1e}"),
                };
                format!(
                    "cost            at least {steps}{unless}: a trial run of {seconds:.1} s reached t = {t} of {} s",
                    scene.t_end
                )
            }
            TrialEnd::Stopped(message) => {
                format!("cost            a trial run stops{unless}: {}", plain(message))
            }
        }
    }

    /// Returns the cost for the JSON document. `steps` is a lower bound, and `t` is the time (s) that these steps
    /// reach; both are null if no steps were tried. `seconds_per_step` is the CPU time (s) per step; null if no step
    /// was completed. `end` is "patience" if the trial ended before the run would, "finished" or "stopped" if the run
    /// itself ended during the trial, and "predicted" if no steps were tried.
    pub(super) fn json(&self) -> Value {
        match self {
            Self::Tried(trial) => json!({
                "steps": trial.steps,
                "t": trial.t,
                "seconds_per_step": (trial.steps > 0).then(|| trial.seconds / trial.steps as f64),
                "end": match trial.end {
                    TrialEnd::Patience => "patience",
                    TrialEnd::Finished => "finished",
                    TrialEnd::Stopped(_) => "stopped",
                },
            }),
            Self::Predicted(seconds) => json!({
                "steps": null,
                "t": null,
                "seconds_per_step": seconds,
                "end": "predicted",
            }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Regression: the cost of a period was extrapolated to 1e7 s from two steps that covered 1e-7 of the period.
    #[test]
    fn the_cost_of_a_period_is_not_extrapolated_from_its_first_steps() {
        let trial = |part| PeriodTrial {
            unknowns: 10,
            differential_variables: 4,
            part,
            steps: 2,
            seconds: 1.0,
            stopped: None,
        };
        assert!(of_period(&trial(1e-7)).contains("5.0e-1 s"));
        assert!(of_period(&trial(0.5)).contains("2.0e0 s"));
    }
}
