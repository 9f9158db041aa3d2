//! Profile-likelihood intervals: one parameter is fixed at several values, and all other parameters are fitted for each
//! value.

use nalgebra::DMatrix;

use crate::driver::fit;
use crate::error::FitError;
use crate::model::{Failed, Model};
use crate::options::Options;
use crate::parameter::Parameter;
use crate::result::Fit;
use crate::uncertainty::student_quantile;

/// Point of a profile.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ProfilePoint {
    /// Value at which the parameter is fixed.
    pub value: f64,
    /// Minimum cost over the other parameters.
    pub cost: f64,
}

/// Profile of one parameter.
#[derive(Debug, Clone, PartialEq)]
pub struct Profile {
    /// Computed points, sorted by value.
    pub points: Vec<ProfilePoint>,
    /// Confidence interval. An end is `None` if the cost does not reach the limit on that side, that is, if the
    /// measurements do not bound the parameter there.
    pub interval: [Option<f64>; 2],
}

/// Distance from the fit, in multiples of the linear interval, beyond which the interval is considered open on that
/// side.
const FARTHEST: f64 = 64.0;

/// Computes the profile of the parameter with the index `which` around the fit. The profile extends to a cost increase
/// of t² s²/2, where t is the quantile of Student's distribution at `level` (Bates and Watts, 6.1.2).
///
/// # Errors
/// Returns the errors of [`fit`] and [`Fit::uncertainty`].
pub fn profile(
    model: &mut dyn Model,
    parameters: &[Parameter],
    fitted: &Fit,
    which: usize,
    level: f64,
    options: &Options,
) -> Result<Profile, FitError> {
    let uncertainty = fitted.uncertainty()?;
    let t = student_quantile(0.5 + 0.5 * level, fitted.degrees_of_freedom());
    let limit = fitted.cost + 0.5 * t * t * uncertainty.variance;
    let center = fitted.values[which];
    let error = uncertainty.standard_errors[which];
    let unit = if error.is_finite() && error > 0.0 { error } else { parameters[which].scale };
    let fit = ProfilePoint { value: center, cost: fitted.cost };
    let mut points = vec![fit];
    let mut interval = [None, None];
    for (end, sign) in interval.iter_mut().zip([-1.0, 1.0]) {
        let mut inside = fit;
        let mut others = fitted.values.clone();
        let mut point_at = |value| {
            let cost = refit(model, parameters, &mut others, which, value, options)?;
            let point = ProfilePoint { value, cost };
            points.push(point);
            Ok(point)
        };
        let mut distance = t;
        while distance <= FARTHEST * t {
            let bound = if sign < 0.0 { parameters[which].low } else { parameters[which].high };
            let wanted = match parameters[which].logarithmic {
                true => center * (sign * distance * unit / center).exp(),
                false => center + sign * distance * unit,
            };
            let value = if sign < 0.0 { wanted.max(bound) } else { wanted.min(bound) };
            let point = point_at(value)?;
            if point.cost > limit {
                *end = Some(crossing(&mut point_at, limit, inside, point)?);
                break;
            }
            if value == bound {
                break;
            }
            inside = point;
            distance *= 2.0;
        }
    }
    points.sort_by(|a, b| a.value.total_cmp(&b.value));
    Ok(Profile { points, interval })
}

/// Returns the value at which the profile crosses `limit`. Bisection reduces the bracket to a thousandth of its width,
/// followed by linear interpolation.
fn crossing(
    point_at: &mut impl FnMut(f64) -> Result<ProfilePoint, FitError>,
    limit: f64,
    mut inside: ProfilePoint,
    mut outside: ProfilePoint,
) -> Result<f64, FitError> {
    let width = (outside.value - inside.value).abs();
    for _ in 0..20 {
        let point = point_at(0.5 * (inside.value + outside.value))?;
        if point.cost > limit {
            outside = point;
        } else {
            inside = point;
        }
        if (outside.value - inside.value).abs() < 1e-3 * width {
            break;
        }
    }
    let share = (limit - inside.cost) / (outside.cost - inside.cost);
    Ok(inside.value + share * (outside.value - inside.value))
}

/// Returns the minimum cost with one parameter fixed. The fit of the other parameters starts from `others`, which is
/// then updated.
fn refit(
    model: &mut dyn Model,
    parameters: &[Parameter],
    others: &mut [f64],
    which: usize,
    value: f64,
    options: &Options,
) -> Result<f64, FitError> {
    let free: Vec<_> = parameters
        .iter()
        .zip(others.iter())
        .enumerate()
        .filter(|(j, _)| *j != which)
        .map(|(_, (parameter, &start))| parameter.starting_from(start))
        .collect();
    let mut held = Held { model, which, value };
    if free.is_empty() {
        let mut residuals = vec![0.0; held.n_residuals()];
        held.residuals(&[], &mut residuals).map_err(|failed| FitError::Start(failed.0))?;
        return Ok(0.5 * residuals.iter().map(|&r| options.loss.value(r)).sum::<f64>());
    }
    let fitted = fit(&mut held, &free, options)?;
    others.copy_from_slice(&held.with_held(&fitted.values, value));
    Ok(fitted.cost)
}

/// Model in which one parameter is fixed.
struct Held<'a> {
    model: &'a mut dyn Model,
    which: usize,
    value: f64,
}

impl Held<'_> {
    fn with_held(&self, p: &[f64], held: f64) -> Vec<f64> {
        let mut all = p.to_vec();
        all.insert(self.which, held);
        all
    }

    /// Returns the values and scales of all parameters, and a matrix that can hold their derivatives.
    fn of_all(
        &self,
        p: &[f64],
        scale: &[f64],
        of_free: &DMatrix<f64>,
    ) -> (Vec<f64>, Vec<f64>, DMatrix<f64>) {
        let size = match self.value {
            0.0 => 1.0,
            value => value.abs(),
        };
        let all = DMatrix::zeros(of_free.nrows(), of_free.ncols() + 1);
        (self.with_held(p, self.value), self.with_held(scale, size), all)
    }
}

impl Model for Held<'_> {
    fn n_residuals(&self) -> usize {
        self.model.n_residuals()
    }

    fn residuals(&mut self, p: &[f64], out: &mut [f64]) -> Result<(), Failed> {
        self.model.residuals(&self.with_held(p, self.value), out)
    }

    fn jacobian(&mut self, p: &[f64], scale: &[f64], out: &mut DMatrix<f64>) -> Result<(), Failed> {
        let (p, scale, mut all) = self.of_all(p, scale, out);
        self.model.jacobian(&p, &scale, &mut all)?;
        out.copy_from(&all.remove_column(self.which));
        Ok(())
    }

    fn residuals_with_jacobian(
        &mut self,
        p: &[f64],
        scale: &[f64],
        out: &mut [f64],
        jacobian: &mut DMatrix<f64>,
    ) -> Result<bool, Failed> {
        let (p, scale, mut all) = self.of_all(p, scale, jacobian);
        let both = self.model.residuals_with_jacobian(&p, &scale, out, &mut all)?;
        if both {
            jacobian.copy_from(&all.remove_column(self.which));
        }
        Ok(both)
    }
}
