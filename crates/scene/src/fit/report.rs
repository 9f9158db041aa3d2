//! Descriptions of fits.

use std::collections::BTreeMap;

use myovib_fit::{Direction, Ended};
use serde_json::{Value, json};

use super::{FitResult, HOPELESS, LEVEL, Outcome, Point};
use crate::sensitivity::Abscissa;

/// A combination of parameters counts as undetermined if a relative change of 1 changes the weighted residuals by less than
/// this number of standard deviations.
const ONE_DEVIATION: f64 = 1.0;
/// Ratio of residuals to noise above which a model that describes the measurements worse than constants does not fit.
const POOR: f64 = 10.0;

impl FitResult {
    /// Returns how the fit ended. A search that converged at residuals far above the noise did not fit.
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

    /// Returns whether the model does not describe the measurements: the residuals are far above the given noise, or well
    /// above it and above the residuals of constants.
    fn does_not_fit(&self) -> bool {
        let of_constants = self.residuals_of_constants();
        let of_model: f64 = self.points.iter().map(|point| point.residual.powi(2)).sum();
        let deviation = self.deviation();
        let is_worse = deviation > POOR && of_model > of_constants;
        self.noise_is_known && (deviation > HOPELESS || is_worse)
    }

    /// Returns the sum of squared residuals if each output of each experiment had the mean of its measurements.
    fn residuals_of_constants(&self) -> f64 {
        let mut outputs: BTreeMap<(usize, &str), Vec<&Point>> = BTreeMap::new();
        for point in &self.points {
            let own = outputs
                .entry((point.experiment, &point.output))
                .or_default();
            own.push(point);
        }
        let of_output = |points: Vec<&Point>| {
            let weight = |point: &Point| match point.fitted - point.measured {
                0.0 => 0.0,
                difference => (point.residual / difference).powi(2),
            };
            let n = points.len() as f64;
            let mean = points.iter().map(|point| point.measured).sum::<f64>() / n;
            let squares = points
                .iter()
                .map(|point| weight(point) * (point.measured - mean).powi(2));
            squares.sum::<f64>()
        };
        outputs.into_values().map(of_output).sum()
    }

    /// Describes how the fit ended.
    pub fn ending(&self) -> String {
        match self.outcome() {
            Outcome::Converged => "converged".to_owned(),
            Outcome::DoesNotFit => {
                "the model does not fit the measurements; the search ended".to_owned()
            }
            Outcome::MaxIterations => "stopped at the limit on iterations".to_owned(),
            Outcome::Interrupted => "interrupted".to_owned(),
            Outcome::Failed(message) => format!("failed: {message}"),
        }
    }

    /// Returns the standard deviation of the residuals: about 1 if the noise was given and the model fits.
    pub fn deviation(&self) -> f64 {
        self.uncertainty.variance.sqrt()
    }

    /// Returns the directions in which the parameters can change by their own size within the noise.
    pub fn unknown(&self) -> Vec<&Direction> {
        let noise = match self.noise_is_known {
            true => ONE_DEVIATION,
            false => ONE_DEVIATION * self.deviation(),
        };
        self.identifiability.unknown(noise).collect()
    }

    /// Returns whether the linear interval of parameter `j` exceeds a bound.
    pub fn passes_bound(&self, j: usize) -> bool {
        let [from, to] = self.uncertainty.intervals(LEVEL)[j];
        let [low, high] = self.bounds[j];
        self.fit.acts(j) && (from < low || to > high)
    }

    /// Describes a direction as changes of the parameters, normalized by the parameter with the largest relative change.
    /// Relative changes below a hundredth of it are omitted.
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

    /// Returns the independent variables.
    pub fn abscissas(&self) -> Vec<Abscissa> {
        let is_used = |one: &Abscissa| self.points.iter().any(|point| point.abscissa == *one);
        let all = [Abscissa::Time, Abscissa::Frequency, Abscissa::Load];
        all.into_iter().filter(is_used).collect()
    }

    /// Returns the body of `fit.json`.
    pub fn document(&self) -> Value {
        let intervals = self.uncertainty.intervals(LEVEL);
        let parameter = |j: usize| {
            json!({
                "key": self.known[j].key,
                "name": self.fit.names[j],
                "value": self.fit.values[j],
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

/// Returns null for non-finite numbers, which JSON does not have.
fn finite(x: f64) -> Value {
    if x.is_finite() { json!(x) } else { Value::Null }
}
