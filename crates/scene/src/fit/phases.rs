//! A fit to short and rough runs first, then to those that are asked for.

use std::ops::ControlFlow;

use myovib_fit::{
    Ended, Fit, FitError, Iteration, Options, Parameter, best_fit, fit_observed, refine,
};

use super::model::{Effort, SceneModel};

/// What comes before the runs that are asked for: how runs are computed, and the way to the least, in units
/// of the parameters' uncertainty, at which that is near enough. The beginning of a motion costs a part of
/// it, and its phases are not yet so far from those measured that the linearised problem tells nothing of
/// them; to be better known than what the beginning tells is in vain. What rough runs err may be a third of
/// the uncertainty.
const BEFORE: [(Effort, f64); 2] = [
    (
        Effort {
            part: 0.5,
            least_tolerance: 1e-2,
        },
        1.0,
    ),
    (
        Effort {
            part: 1.0,
            least_tolerance: 1e-3,
        },
        0.3,
    ),
];

/// Or it is near enough where no parameter changes by more than this fraction of itself.
const NEAR: f64 = 1e-2;

/// Shown each iteration with the part of the measurements' time whose residuals its cost is of.
pub(super) type Observe<'a> = dyn FnMut(f64, &Iteration) -> ControlFlow<()> + 'a;

/// Fits to short and rough runs from all `starts`, and from the best of what comes of them to the runs that
/// the scene asks for.
pub(super) fn fit_in_phases(
    model: &mut SceneModel<'_>,
    starts: &[Vec<Parameter>],
    wanted: &Options,
    observe: &mut Observe<'_>,
) -> Result<Fit, FitError> {
    let mut phases = Phases {
        observe,
        history: Vec::new(),
        evaluations: 0,
    };
    let mut reached: Option<Effort> = None;
    let rough = best_fit(starts, &mut |start| {
        let (fit, effort) = phases.before(model, start, wanted)?;
        // Less of the measurements costs less, and is no better for it.
        if reached.is_some_and(|reached| effort.part < reached.part) {
            return Err(FitError::Start("interrupted".into()));
        }
        reached = Some(effort);
        Ok(fit)
    });
    let fit = if model.is_interrupted() {
        model.set_effort(reached.unwrap_or(Effort::FULL));
        rough
    } else {
        phases.last(model, starts, rough, wanted)
    };
    let mut fit = fit?;
    (fit.history, fit.evaluations) = (phases.history, phases.evaluations);
    if model.is_interrupted() {
        fit.ended = Ended::Interrupted;
    }
    Ok(fit)
}

/// A fit that shows its iterations to whom it is given.
type OnePhase<'a> =
    dyn FnMut(&mut dyn FnMut(&Iteration) -> ControlFlow<()>) -> Result<Fit, FitError> + 'a;

struct Phases<'a, 'o> {
    observe: &'a mut Observe<'o>,
    /// The iterations of all phases, with evaluations counted through.
    history: Vec<Iteration>,
    evaluations: usize,
}

impl Phases<'_, '_> {
    /// The phases before the last, from one start: the fit of the last that came to an end, and its effort.
    fn before(
        &mut self,
        model: &mut SceneModel<'_>,
        start: &[Parameter],
        wanted: &Options,
    ) -> Result<(Fit, Effort), FitError> {
        let mut start = start.to_vec();
        let mut last = None;
        for (effort, offset) in BEFORE {
            model.set_effort(effort);
            let near = Options {
                tolerance: wanted.tolerance.max(NEAR),
                offset: wanted.offset.max(offset),
                ..wanted.clone()
            };
            let next = self.one(effort.part, &mut |observe| {
                fit_observed(model, &start, &near, observe)
            });
            if next.is_err() && last.is_some() && model.is_interrupted() {
                break;
            }
            // What the beginning does not tell, the whole may.
            if let Ok(fit) = &next {
                for (parameter, &value) in start.iter_mut().zip(&fit.values) {
                    parameter.start = value;
                }
            }
            last = Some(next.map(|fit| (fit, effort)));
        }
        last.expect("there is a phase before the last")
    }

    /// The runs that are asked for, from what is known of their least.
    fn last(
        &mut self,
        model: &mut SceneModel<'_>,
        starts: &[Vec<Parameter>],
        rough: Result<Fit, FitError>,
        wanted: &Options,
    ) -> Result<Fit, FitError> {
        model.set_effort(Effort::FULL);
        match rough {
            Ok(rough) => self.one(1.0, &mut |observe| {
                refine(model, &starts[0], &rough, wanted, observe)
            }),
            // Where rough runs fail, these may not.
            Err(_) => best_fit(starts, &mut |start| {
                self.one(1.0, &mut |observe| {
                    fit_observed(model, start, wanted, observe)
                })
            }),
        }
    }

    fn one(&mut self, part: f64, fit: &mut OnePhase<'_>) -> Result<Fit, FitError> {
        let before = self.evaluations;
        let fit = fit(&mut |iteration| {
            let counted = Iteration {
                evaluations: before + iteration.evaluations,
                ..iteration.clone()
            };
            let go_on = (self.observe)(part, &counted);
            self.history.push(counted);
            go_on
        })?;
        self.evaluations += fit.evaluations;
        Ok(fit)
    }
}
