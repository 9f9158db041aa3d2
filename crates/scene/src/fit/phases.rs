//! A fit to rough runs first, then to those that are asked for.

use std::ops::ControlFlow;

use myovib_fit::{
    Ended, Fit, FitError, Iteration, Options, Parameter, best_fit, fit_observed, refine,
};

use super::model::SceneModel;

/// The first iterations compute the motion to this relative tolerance, where the scene's is smaller,
const ROUGH: f64 = 1e-3;

/// until no parameter changes by more than this fraction of itself: what a motion of three digits tells of
/// them,
const NEAR: f64 = 1e-2;

/// or until the way to the least is this fraction of the parameters' uncertainty: what rough runs err may be
/// as much of it.
const NEAR_OFFSET: f64 = 0.3;

/// Fits to rough runs from all `starts`, and from the best of what comes of them to the runs that the scene
/// asks for.
pub(super) fn fit_in_phases(
    model: &mut SceneModel<'_>,
    starts: &[Vec<Parameter>],
    wanted: &Options,
    observe: &mut dyn FnMut(&Iteration) -> ControlFlow<()>,
) -> Result<Fit, FitError> {
    let near = Options {
        tolerance: wanted.tolerance.max(NEAR),
        offset: wanted.offset.max(NEAR_OFFSET),
        ..wanted.clone()
    };
    let mut before = 0;
    let mut phase = |fit: &mut Phase<'_>| {
        let counted = |iteration: &Iteration| Iteration {
            evaluations: before + iteration.evaluations,
            ..iteration.clone()
        };
        let mut fit = fit(&mut |iteration| observe(&counted(iteration)))?;
        fit.history = fit.history.iter().map(counted).collect();
        before += fit.evaluations;
        fit.evaluations = before;
        Ok(fit)
    };
    model.set_least_tolerance(ROUGH);
    let rough = best_fit(starts, &mut |start| {
        phase(&mut |observe| fit_observed(model, start, &near, observe))
    });
    model.set_least_tolerance(0.0);
    // Where rough runs fail, those that were asked for may not.
    let Ok(mut rough) = rough else {
        return best_fit(starts, &mut |start| {
            phase(&mut |observe| fit_observed(model, start, wanted, observe))
        });
    };
    if rough.ended == Ended::Interrupted || model.is_interrupted() {
        rough.ended = Ended::Interrupted;
        return Ok(rough);
    }
    let mut fit = phase(&mut |observe| refine(model, &starts[0], &rough, wanted, observe))?;
    fit.history = [rough.history, fit.history].concat();
    Ok(fit)
}

/// A fit that shows its iterations to whom it is given.
type Phase<'a> =
    dyn FnMut(&mut dyn FnMut(&Iteration) -> ControlFlow<()>) -> Result<Fit, FitError> + 'a;
