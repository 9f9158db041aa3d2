//! Fits motions in phases: first with short runs at loose tolerances, then with full runs.

use std::ops::ControlFlow;

use myovib_fit::{
    Ended, Fit, FitError, Iteration, Options, Parameter, best_fit, fit_observed, refine,
};

use super::model::{Effort, SceneModel};

/// Effort and convergence offset of each phase before the last. The offset is in units of the parameters' uncertainty.
/// A short run costs less, and its oscillations are still close enough in phase to the measurements for the
/// linearization to hold. The first phase need not be more accurate than its measurements allow. In the second phase,
/// the error due to loose tolerances may be a third of the uncertainty.
const EARLY_PHASES: [(Effort, f64); 2] = [
    (Effort { part: 0.5, least_tolerance: 1e-2 }, 1.0),
    (Effort { part: 1.0, least_tolerance: 1e-3 }, 0.3),
];

/// Tolerance for relative changes of the parameters in the early phases.
const EARLY_TOLERANCE: f64 = 1e-2;

/// Callback for each iteration. Its first argument is the computed fraction of the measured time span.
pub(super) type Observe<'a> = dyn FnMut(f64, &Iteration) -> ControlFlow<()> + 'a;

/// Fits with short, inaccurate runs from all `starts`, then continues from the best result with full runs. For analyses
/// other than motions, there is only one phase, with full runs.
pub(super) fn fit_in_phases(
    model: &mut SceneModel<'_>,
    starts: &[Vec<Parameter>],
    requested: &Options,
    observe: &mut Observe<'_>,
) -> Result<Fit, FitError> {
    let mut phases = Phases { observe, history: Vec::new(), evaluations: 0 };
    let fit = match model.is_in_time() {
        true => phases.all(model, starts, requested),
        false => phases.full(model, starts, requested),
    };
    let mut fit = fit?;
    (fit.history, fit.evaluations) = (phases.history, phases.evaluations);
    if model.is_interrupted() {
        fit.ended = Ended::Interrupted;
    }
    Ok(fit)
}

/// A function that performs a fit and passes each iteration to the given observer.
type OnePhase<'a> =
    dyn FnMut(&mut dyn FnMut(&Iteration) -> ControlFlow<()>) -> Result<Fit, FitError> + 'a;

struct Phases<'a, 'o> {
    observe: &'a mut Observe<'o>,
    /// Iterations of all phases. Their numbers of evaluations accumulate over the phases.
    history: Vec<Iteration>,
    evaluations: usize,
}

impl Phases<'_, '_> {
    /// Fits with short, inaccurate runs from all starts, then with full runs from the best result.
    fn all(
        &mut self,
        model: &mut SceneModel<'_>,
        starts: &[Vec<Parameter>],
        requested: &Options,
    ) -> Result<Fit, FitError> {
        let mut reached: Option<Effort> = None;
        let rough = best_fit(starts, &mut |start| {
            let (fit, effort) = self.before(model, start, requested)?;
            // The cost over fewer measurements is smaller and cannot be compared with the cost over all measurements.
            if reached.is_some_and(|reached| effort.part < reached.part) {
                return Err(FitError::Start("interrupted".into()));
            }
            reached = Some(effort);
            Ok(fit)
        });
        if !model.is_interrupted() {
            model.set_effort(Effort::FULL);
            let last = match &rough {
                Ok(rough) => self
                    .one(1.0, &mut |observe| refine(model, &starts[0], rough, requested, observe)),
                // Full runs may succeed where inaccurate runs fail.
                Err(_) => self.full(model, starts, requested),
            };
            if last.is_ok() || !model.is_interrupted() {
                return last;
            }
        }
        model.set_effort(reached.unwrap_or(Effort::FULL));
        rough
    }

    fn full(
        &mut self,
        model: &mut SceneModel<'_>,
        starts: &[Vec<Parameter>],
        requested: &Options,
    ) -> Result<Fit, FitError> {
        model.set_effort(Effort::FULL);
        best_fit(starts, &mut |start| {
            self.one(1.0, &mut |observe| fit_observed(model, start, requested, observe))
        })
    }

    /// Performs all phases except the last from one starting point. Returns the fit and the effort of the last
    /// completed phase.
    fn before(
        &mut self,
        model: &mut SceneModel<'_>,
        start: &[Parameter],
        requested: &Options,
    ) -> Result<(Fit, Effort), FitError> {
        let mut start = start.to_vec();
        let mut last = None;
        for (effort, offset) in EARLY_PHASES {
            model.set_effort(effort);
            let near = Options {
                tolerance: requested.tolerance.max(EARLY_TOLERANCE),
                offset: requested.offset.max(offset),
                ..requested.clone()
            };
            let next =
                self.one(effort.part, &mut |observe| fit_observed(model, &start, &near, observe));
            if next.is_err() && last.is_some() && model.is_interrupted() {
                break;
            }
            // The next phase may succeed where this one fails.
            if let Ok(fit) = &next {
                for (parameter, &value) in start.iter_mut().zip(&fit.values) {
                    parameter.start = value;
                }
            }
            last = Some(next.map(|fit| (fit, effort)));
        }
        last.expect("there is a phase before the last")
    }

    fn one(&mut self, part: f64, fit: &mut OnePhase<'_>) -> Result<Fit, FitError> {
        let before = self.evaluations;
        let fit = fit(&mut |iteration| {
            let counted =
                Iteration { evaluations: before + iteration.evaluations, ..iteration.clone() };
            let go_on = (self.observe)(part, &counted);
            self.history.push(counted);
            go_on
        })?;
        self.evaluations += fit.evaluations;
        Ok(fit)
    }
}
