//! What a run is expected to take.

use myovib_model::check::Report;
use myovib_report::table::counted;
use myovib_scene::run::{ChainCost, cost_of_chains};
use myovib_scene::{Body, Error, Scene};

/// Steps and time of a run, its chains included.
pub(super) struct Expected {
    /// Those of a motion that follows its load or its lowest mode. Faster ones take more; those that are small
    /// beside the absolute tolerances take fewer.
    pub(super) steps: f64,
    /// At most, where that can be told.
    pub(super) most: Option<f64>,
    /// CPU time of a step, s.
    pub(super) seconds_per_step: f64,
    /// Whether the steps are those of the chains.
    of_chains: bool,
}

impl Expected {
    /// Of a scene with a body.
    ///
    /// # Errors
    /// Those of the chains' integrator.
    pub(super) fn new(scene: &Scene, report: &Report) -> Result<Self, Error> {
        let cost = &report.cost;
        let alone = cost.most_steps().filter(|_| scene.feedbacks.is_empty());
        Ok(match cost_of_chains(scene)? {
            None => Self {
                steps: cost.steps,
                most: alone,
                seconds_per_step: cost.seconds_per_step,
                of_chains: false,
            },
            Some(ChainCost {
                steps,
                seconds_per_step,
            }) => Self {
                steps: cost.steps.max(steps),
                most: alone.filter(|_| steps <= cost.steps),
                seconds_per_step: cost.seconds_per_step + seconds_per_step,
                of_chains: steps > cost.steps,
            },
        })
    }

    /// CPU time of the run at least, s.
    pub(super) fn seconds(&self) -> f64 {
        self.steps * self.seconds_per_step
    }

    /// For people.
    pub(super) fn lines(&self, body: &Body, report: &Report) -> Vec<String> {
        if !self.seconds().is_finite() {
            return Vec::new();
        }
        let steps = self.steps.ceil();
        let (steps, bound) = match self.most {
            Some(most) => (format!("{steps} to {:.0} steps", most.ceil()), "up to"),
            None => (format!("at least {}", counted(steps, "step")), "at least"),
        };
        let seconds = match self.most.unwrap_or(self.steps) * self.seconds_per_step {
            seconds if seconds < 0.1 => format!("{seconds:.2}"),
            seconds => format!("{seconds:.1}"),
        };
        let told = match report.cost.is_measured {
            true => "as measured on the first",
            false => "by the size of the factors and the speed of this machine",
        };
        vec![
            format!(
                "cost            {steps} to t = {} s; {:.1e} s each, {told}: {bound} {seconds} s",
                body.settings.t_end, self.seconds_per_step
            ),
            format!("                {}", self.origin(report)),
        ]
    }

    /// What the number of steps rests on.
    fn origin(&self, report: &Report) -> String {
        let wake = "faster vibrations, which rises, tensions and large motions wake, take more";
        match (self.of_chains, self.most, report.drive) {
            (true, ..) => "the steps are those of the chains by themselves, once they oscillate; \
                           those of both together may be more"
                .to_owned(),
            (_, Some(_), Some(f)) => format!(
                "the steps are those of a motion that follows the load at {f} Hz; one that is small beside \
                 atol takes fewer"
            ),
            (_, _, Some(f)) => format!("the steps are those of a motion at the load's {f} Hz; {wake}"),
            (_, _, None) if report.slow_modes.is_empty() => {
                "the steps are those in which what drives the body changes; its vibrations, which are not known, take more".to_owned()
            }
            (_, _, None) => format!("the steps are those of a motion in the lowest mode; {wake}"),
        }
    }
}
