//! Confidence intervals of parameters by profile likelihood.

use myovib_fit::{Fit, FitError, Options, Parameter, Profile, profile};

use super::LEVEL;
use super::model::SceneModel;
use crate::watch::ProgressSink;

/// Computes the profile of each parameter. If this fails, the result contains the reason instead; the fit itself
/// remains valid. Reports the current parameter to `progress`.
pub(super) fn profiles(
    model: &mut SceneModel<'_>,
    parameters: &[Parameter],
    fit: &Fit,
    options: &Options,
    progress: &dyn ProgressSink,
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
        progress
            .report_now(&|| format!("profile {} of {count}, about ten fits each: {name}", j + 1));
        profile(model, parameters, fit, j, LEVEL, options).map_err(|error| match error {
            _ if model.is_interrupted() => "interrupted".to_owned(),
            FitError::Start(message) => message,
            other => other.to_string(),
        })
    };
    (0..count).map(&mut one).collect()
}
