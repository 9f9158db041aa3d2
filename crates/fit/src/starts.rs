//! The best of several fits.

use crate::driver::{Options, fit};
use crate::error::FitError;
use crate::model::Model;
use crate::parameter::Parameter;
use crate::result::Fit;

/// Fits from the parameters' own starts and from each of the `others`, and keeps the fit of the
/// least cost. Starts at which the model fails are passed over.
///
/// # Errors
/// As for [`fit`], if no start does.
pub fn fit_from_several_starts(
    model: &mut dyn Model,
    parameters: &[Parameter],
    others: &[Vec<f64>],
    options: &Options,
) -> Result<Fit, FitError> {
    let mut best = fit(model, parameters, options);
    for start in others {
        let moved: Vec<_> = parameters
            .iter()
            .zip(start)
            .map(|(parameter, &start)| Parameter {
                start,
                ..parameter.clone()
            })
            .collect();
        let next = fit(model, &moved, options);
        let better = match (&best, &next) {
            (Ok(best), Ok(next)) => next.cost < best.cost,
            (Err(_), Ok(_)) => true,
            _ => false,
        };
        if better {
            best = next;
        }
    }
    best
}
