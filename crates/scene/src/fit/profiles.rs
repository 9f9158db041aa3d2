//! Intervals by profile likelihood of a scene's parameters.

use myovib_fit::{Fit, FitError, Options, Parameter, Profile, profile};

use super::LEVEL;
use super::model::SceneModel;
use crate::watch::Tell;

/// For each parameter its profile, or why there is none: what was fitted stands, whatever becomes of them.
/// Tells `progress` which one is at work.
pub(super) fn profiles(
    model: &mut SceneModel<'_>,
    parameters: &[Parameter],
    fit: &Fit,
    wanted: &Options,
    progress: &dyn Tell,
) -> Vec<Result<Profile, String>> {
    let count = parameters.len();
    let mut one = |j: usize| {
        if model.is_interrupted() {
            return Err("interrupted".to_owned());
        }
        if !fit.acts(j) {
            return Err("no measurement depends on it".to_owned());
        }
        let name = &parameters[j].name;
        progress.tell_now(&|| {
            format!(
                "profile {} of {count}, some ten fits for each: {name}",
                j + 1
            )
        });
        profile(model, parameters, fit, j, LEVEL, wanted).map_err(|error| match error {
            _ if model.is_interrupted() => "interrupted".to_owned(),
            FitError::Start(message) => message,
            other => other.to_string(),
        })
    };
    (0..count).map(&mut one).collect()
}
