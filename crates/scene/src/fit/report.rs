//! Descriptions of fit results.

use myovib_fit::{Direction, Ended};
use serde_json::{Value, json};

use super::{FitResult, LEVEL, Loss, Outcome, Point};
use crate::sensitivity::Abscissa;

/// A combination of parameters counts as undetermined if a relative change of 1 changes the weighted residuals by less
/// than this number of standard deviations.
const ONE_DEVIATION: f64 = 1.0;
/// Ratio of residuals to noise above which the model is considered not to describe the measurements. Smaller ratios may
/// result from an underestimated noise level.
const MAX_MISFIT: f64 = 3.0;
/// Median of the absolute value of normal noise with unit variance.
const MEDIAN_OF_NORMAL: f64 = 0.674_489_750_196_081_7;

impl FitResult {
    /// Returns how the fit ended. If it converged but the residuals are far above the noise, the outcome is
    /// [`Outcome::DoesNotFit`].
    pub fn outcome(&self) -> Outcome {
        match &self.fit.ended {
            Ended::Converged if self.does_not_fit() => Outcome::DoesNotFit,
            Ended::Converged => Outcome::Converged,
            Ended::MaxIterations => Outcome::MaxIterations,
            Ended::Interrupted => Outcome::Interrupted,
            Ended::Failed(message) => Outcome::Failed(message.clone()),
            other => Outcome::Failed(format!("{other:?}")),
        }
    }

    /// Returns whether the model does not describe the measurements, because the residuals are far above the given
    /// noise.
    pub fn does_not_fit(&self) -> bool {
        self.noise_is_known && self.misfit() > MAX_MISFIT
    }

    /// Returns the standard deviation of the residuals or its robust estimate, whichever is larger. With a robust loss,
    /// the standard deviation alone may hide a misfit.
    fn misfit(&self) -> f64 {
        self.deviation().max(self.robust_deviation())
    }

    /// Returns the median of the absolute residuals.
    pub fn median_residual(&self) -> f64 {
        let mut sizes: Vec<f64> = self.points.iter().map(|p| p.residual.abs()).collect();
        sizes.sort_by(f64::total_cmp);
        sizes.get(sizes.len() / 2).copied().unwrap_or(0.0)
    }

    /// Estimates the standard deviation of the residuals from their median absolute value, on which outliers have
    /// little effect.
    fn robust_deviation(&self) -> f64 {
        self.median_residual() / MEDIAN_OF_NORMAL
    }

    /// Returns whether a robust loss would help. This is the case if a least-squares fit fails because of outliers,
    /// while the median of the residuals is within the noise.
    pub fn needs_robust_loss(&self) -> bool {
        self.loss == Loss::Squares && self.does_not_fit() && self.robust_deviation() <= MAX_MISFIT
    }

    /// Returns the index of the measurement with the largest residual, and the measurement.
    pub fn largest_residual(&self) -> Option<(usize, &Point)> {
        let points = self.points.iter().enumerate();
        points.max_by(|(_, a), (_, b)| a.residual.abs().total_cmp(&b.residual.abs()))
    }

    /// Describes how the fit ended.
    pub fn ending(&self) -> String {
        match self.outcome() {
            Outcome::Converged => "converged".to_owned(),
            Outcome::DoesNotFit => format!(
                "the model does not fit the measurements (residuals {:.1} times the given noise); the search ended",
                self.misfit()
            ),
            Outcome::MaxIterations => "stopped at the iteration limit".to_owned(),
            Outcome::Interrupted => "interrupted".to_owned(),
            Outcome::Failed(message) => format!("failed: {message}"),
        }
    }

    /// Returns the standard deviation of the residuals. It is about 1 if the noise was given and the model fits.
    pub fn deviation(&self) -> f64 {
        self.uncertainty.variance.sqrt()
    }

    /// Returns the directions that the measurements do not determine. Along such a direction, even changes as large as
    /// the parameters themselves remain within the noise.
    pub fn unknown(&self) -> Vec<&Direction> {
        let noise = match self.noise_is_known {
            true => ONE_DEVIATION,
            false => ONE_DEVIATION * self.deviation(),
        };
        self.identifiability.unknown(noise).collect()
    }

    /// Returns whether the linear confidence interval of parameter `j` extends beyond a bound.
    pub fn passes_bound(&self, j: usize) -> bool {
        let [from, to] = self.uncertainty.intervals(LEVEL)[j];
        let [low, high] = self.bounds[j];
        self.fit.acts(j) && (from < low || to > high)
    }

    /// Describes a direction by the changes of the parameters. They are divided by the change of the parameter with the
    /// largest relative change. Parameters whose relative change is below 1 % of the largest are omitted.
    pub fn in_words(&self, direction: &Direction) -> String {
        let shares = direction.shares.iter().zip(&self.fit.values);
        let changes: Vec<f64> = shares
            .map(|(share, &value)| share * if value == 0.0 { 1.0 } else { value.abs() })
            .collect();
        let sizes: Vec<f64> = changes
            .iter()
            .zip(&self.known)
            .map(|(change, known)| change.abs() / known.scale)
            .collect();
        let (most, size) = (0..sizes.len())
            .map(|j| (j, sizes[j]))
            .max_by(|a, b| a.1.total_cmp(&b.1))
            .unwrap_or((0, 0.0));
        let shown = (0..changes.len()).filter(|&j| sizes[j] > 0.01 * size);
        let term = |j: usize| {
            let (change, name) = (changes[j] / changes[most], &self.fit.names[j]);
            match change.abs() < 0.01 {
                true => format!("{change:+.2e} × {name}"),
                false => format!("{change:+.3} × {name}"),
            }
        };
        shown.map(term).collect::<Vec<_>>().join("  ")
    }

    /// Returns the independent variables of the measurements.
    pub fn abscissas(&self) -> Vec<Abscissa> {
        let is_used = |one: &Abscissa| self.points.iter().any(|point| point.abscissa == *one);
        let all = [Abscissa::Time, Abscissa::Frequency, Abscissa::Load];
        all.into_iter().filter(is_used).collect()
    }

    /// Returns the usual small-strain shear viscosity η/2 (Pa·s) if parameter `j` is the viscosity η of a material.
    pub fn shear_viscosity(&self, j: usize) -> Option<f64> {
        let key = &self.known[j].key;
        let is_viscosity = key.starts_with("material[") && key.ends_with("].viscosity");
        is_viscosity.then(|| self.fit.values[j] / 2.0)
    }

    /// Returns the body of `fit.json`.
    pub fn document(&self) -> Value {
        let intervals = self.uncertainty.intervals(LEVEL);
        let parameter = |j: usize| {
            json!({
                "key": self.known[j].key,
                "name": self.fit.names[j],
                "value": self.fit.values[j],
                "shear_viscosity": self.shear_viscosity(j),
                "set": self.known[j].assignment(self.fit.values[j]),
                "standard_error": finite(self.uncertainty.standard_errors[j]),
                "interval": intervals[j].map(finite),
                "profile_interval": self.profiles.get(j).and_then(|p| p.as_ref().ok()).map(|profile| profile.interval),
                "at_bound": self.fit.at_bound[j],
                "passes_bound": self.passes_bound(j),
                "acts": self.fit.acts(j),
            })
        };
        let n = self.fit.values.len();
        let correlation = |i: usize| -> Vec<Value> {
            let row = (0..n).map(|j| self.uncertainty.correlation[(i, j)]);
            row.map(finite).collect()
        };
        let direction = |d: &Direction| json!({"sensitivity": d.sensitivity, "shares": d.shares});
        let point = |p: &Point| {
            json!({
                "experiment": p.experiment, "output": p.output, p.abscissa.name(): p.t,
                "measured": p.measured, "fitted": p.fitted, "residual": p.residual,
            })
        };
        json!({
            "ended": self.ending(),
            "outcome": self.outcome().name(),
            "converged": self.outcome() == Outcome::Converged,
            "cost": self.fit.cost,
            "deviation": self.deviation(),
            "noise_is_known": self.noise_is_known,
            "level": LEVEL,
            "parameters": (0..n).map(parameter).collect::<Vec<_>>(),
            "correlation": (0..n).map(correlation).collect::<Vec<_>>(),
            "directions": self.identifiability.directions.iter().map(direction).collect::<Vec<_>>(),
            "unknown": self.unknown().into_iter().map(|d| self.in_words(d)).collect::<Vec<_>>(),
            "iterations": self.fit.history.len(),
            "runs": self.runs[0],
            "runs_with_sensitivities": self.runs[1],
            "residuals": self.points.iter().map(point).collect::<Vec<_>>(),
        })
    }
}

/// Converts a number to JSON. Non-finite numbers, which JSON cannot represent, become null.
fn finite(x: f64) -> Value {
    if x.is_finite() { json!(x) } else { Value::Null }
}
