//! The Levenberg–Marquardt iteration with bounds.

use std::ops::ControlFlow;

use nalgebra::{DMatrix, DVector};

use crate::error::FitError;
use crate::model::{Failed, Model};
use crate::options::Options;
use crate::parameter::Parameter;
use crate::result::{Ended, Fit, Iteration};
use crate::trust_region::LinearLeastSquares;

/// Fits the parameters.
///
/// # Errors
/// Returns a [`FitError`] if an argument is invalid or if the model fails at the start. A fit that does not converge is
/// not an error: check [`Fit::ended`].
pub fn fit(
    model: &mut dyn Model,
    parameters: &[Parameter],
    options: &Options,
) -> Result<Fit, FitError> {
    fit_observed(model, parameters, options, &mut |_| ControlFlow::Continue(()))
}

/// Fits the parameters and calls `observe` at each iteration. `observe` may end the fit.
///
/// # Errors
/// Returns the same errors as [`fit`].
pub fn fit_observed(
    model: &mut dyn Model,
    parameters: &[Parameter],
    options: &Options,
    observe: &mut dyn FnMut(&Iteration) -> ControlFlow<()>,
) -> Result<Fit, FitError> {
    search(model, parameters, None, options, observe)
}

/// Continues from `rough`, the fit of a slightly different model, for example the same model at a looser tolerance. The
/// iteration starts from the values of `rough`, and the first step uses its Jacobian.
///
/// # Errors
/// Returns the same errors as [`fit`].
pub fn refine(
    model: &mut dyn Model,
    parameters: &[Parameter],
    rough: &Fit,
    options: &Options,
    observe: &mut dyn FnMut(&Iteration) -> ControlFlow<()>,
) -> Result<Fit, FitError> {
    let starts = parameters.iter().zip(&rough.values);
    let starts: Vec<_> = starts.map(|(p, &value)| p.starting_from(value)).collect();
    search(model, &starts, Some(&rough.jacobian), options, observe)
}

fn search(
    model: &mut dyn Model,
    parameters: &[Parameter],
    known: Option<&DMatrix<f64>>,
    options: &Options,
    observe: &mut dyn FnMut(&Iteration) -> ControlFlow<()>,
) -> Result<Fit, FitError> {
    options.check()?;
    parameters.iter().try_for_each(Parameter::check)?;
    let (m, n) = (model.n_residuals(), parameters.len());
    if n == 0 || m < n {
        return Err(FitError::TooFewMeasurements { n_residuals: m, n_parameters: n });
    }
    let mut search = Search::new(model, parameters, options);
    search.start(known)?;
    let ended = search.run(observe)?;
    Ok(search.into_fit(ended))
}

/// Residuals at a point, their cost, and the Jacobian if the model returned it together with the residuals.
struct Evaluation {
    residuals: Vec<f64>,
    cost: f64,
    jacobian: Option<DMatrix<f64>>,
}

/// Measures of the distance from the minimum of the linearized problem.
struct Slope {
    /// Largest cosine of the angle between the vector of residuals and a column of the Jacobian.
    cosine: f64,
    /// Length of the Gauss–Newton step in units of the parameters' uncertainty.
    offset: f64,
}

/// Initial radius of the trust region for each parameter, relative to the scale of the parameter. Moré instead scales
/// steps by the norms of the columns of the Jacobian. With that choice, insensitive parameters would change most, far
/// beyond the range in which the linearization is valid.
const INITIAL_RADIUS: f64 = 0.3;

/// Bounds on the ratio of actual to predicted reduction: the trust region shrinks below the first bound and grows above
/// the second (Moré).
const POOR: f64 = 0.25;
const GOOD: f64 = 0.75;

/// The Jacobian is reused after steps shorter than this fraction of the parameters' uncertainty, if [`Options::offset`]
/// is positive. Over such a short step, the change of the Jacobian has no significant effect.
const JACOBIAN_REUSE_DISTANCE: f64 = 0.1;

/// Relative changes of the cost below this bound may be caused by rounding errors, because residuals are differences of
/// larger numbers whose size is unknown. Such small changes are irrelevant to the statistics.
const NOISE: f64 = 1e-10;

struct Search<'a> {
    model: &'a mut dyn Model,
    parameters: &'a [Parameter],
    options: &'a Options,
    p: Vec<f64>,
    residuals: Vec<f64>,
    cost: f64,
    jacobian: DMatrix<f64>,
    /// Whether `jacobian` was computed at `p`.
    is_linearized: bool,
    /// Radius of the trust region, which bounds the Euclidean norm of the scaled step.
    radius: f64,
    /// Length of the last step for which the predicted reduction was below rounding errors.
    last_blind: f64,
    evaluations: usize,
    history: Vec<Iteration>,
}

impl<'a> Search<'a> {
    fn new(model: &'a mut dyn Model, parameters: &'a [Parameter], options: &'a Options) -> Self {
        let (m, n) = (model.n_residuals(), parameters.len());
        Self {
            model,
            parameters,
            p: parameters.iter().map(|p| p.start).collect(),
            options,
            residuals: vec![0.0; m],
            cost: 0.0,
            jacobian: DMatrix::zeros(m, n),
            is_linearized: false,
            radius: INITIAL_RADIUS * (n as f64).sqrt(),
            last_blind: f64::INFINITY,
            evaluations: 0,
            history: Vec::new(),
        }
    }

    /// Evaluates the model at the start. If an approximate Jacobian is `known`, takes a first step with it, unless this
    /// step would increase the cost.
    fn start(&mut self, known: Option<&DMatrix<f64>>) -> Result<(), FitError> {
        let start = self.p.clone();
        let evaluation = self.evaluate(&start, known.is_none());
        self.go_to(start, evaluation.map_err(FitError::Start)?);
        if let Some(known) = known {
            self.jacobian.copy_from(known);
            let (linear, free, _) = self.linear_problem();
            let (trial, _) = self.trial(&free, &linear.step(self.radius).0);
            if let Ok(evaluation) = self.evaluate(&trial, true)
                && evaluation.cost < self.cost
            {
                self.go_to(trial, evaluation);
            }
        }
        Ok(())
    }

    /// Returns the typical sizes of the parameters at `p`. The steps of difference quotients are derived from these
    /// sizes.
    fn scale(&self, p: &[f64]) -> Vec<f64> {
        let both = self.parameters.iter().zip(p);
        both.map(|(parameter, &p)| parameter.unit(p)).collect()
    }

    /// Returns the residuals at `p` and their cost. The Jacobian is included if `needs_jacobian` is true and the model
    /// returns it together with the residuals.
    fn evaluate(&mut self, p: &[f64], needs_jacobian: bool) -> Result<Evaluation, String> {
        let mut residuals = vec![0.0; self.residuals.len()];
        if let Some(j) = p.iter().position(|p| !p.is_finite()) {
            return Err(format!("{} is not finite", self.parameters[j].name));
        }
        self.evaluations += 1;
        let mut jacobian = None;
        let message = |failed: Failed| failed.0;
        if needs_jacobian {
            let mut buffer = self.jacobian.clone();
            let scale = self.scale(p);
            let both = self
                .model
                .residuals_with_jacobian(p, &scale, &mut residuals, &mut buffer)
                .map_err(message)?;
            jacobian = both.then_some(buffer);
        } else {
            self.model.residuals(p, &mut residuals).map_err(message)?;
        }
        if let Some(i) = residuals.iter().position(|r| !r.is_finite()) {
            return Err(format!("residual {i} is not finite"));
        }
        let losses = residuals.iter().map(|&r| self.options.loss.value(r));
        Ok(Evaluation { cost: 0.5 * losses.sum::<f64>(), residuals, jacobian })
    }

    /// Makes `p` the current point.
    fn go_to(&mut self, p: Vec<f64>, evaluation: Evaluation) {
        (self.p, self.residuals, self.cost) = (p, evaluation.residuals, evaluation.cost);
        self.is_linearized = evaluation.jacobian.is_some();
        if let Some(jacobian) = evaluation.jacobian {
            self.jacobian = jacobian;
        }
    }

    fn linearize(&mut self) -> Result<(), String> {
        if !self.is_linearized {
            let scale = self.scale(&self.p);
            self.model.jacobian(&self.p, &scale, &mut self.jacobian).map_err(|failed| failed.0)?;
            self.is_linearized = true;
        }
        if self.jacobian.iter().any(|entry| !entry.is_finite()) {
            return Err("a derivative is not finite".into());
        }
        Ok(())
    }

    fn run(
        &mut self,
        observe: &mut dyn FnMut(&Iteration) -> ControlFlow<()>,
    ) -> Result<Ended, FitError> {
        for iteration in 0..self.options.max_iterations {
            if let Err(message) = self.linearize() {
                return match iteration {
                    0 => Err(FitError::Start(message)),
                    _ => Ok(Ended::Failed(message)),
                };
            }
            let entry = Iteration {
                cost: self.cost,
                values: self.p.clone(),
                evaluations: self.evaluations,
            };
            let go_on = observe(&entry);
            self.history.push(entry);
            if go_on.is_break() {
                return Ok(Ended::Interrupted);
            }
            if let Some(ended) = self.improve() {
                return Ok(ended);
            }
        }
        Ok(Ended::MaxIterations)
    }

    /// Reduces the trust region until a step lowers the cost.
    fn improve(&mut self) -> Option<Ended> {
        if self.cost > 0.0 && self.jacobian.iter().all(|entry| *entry == 0.0) {
            return Some(Ended::Failed("no residual depends on any parameter".into()));
        }
        let (linear, free, slope) = self.linear_problem();
        let is_least = slope.cosine <= self.options.tolerance * 1e-3;
        if free.is_empty() || is_least || slope.offset < self.options.offset || self.cost == 0.0 {
            return Some(Ended::Converged);
        }
        let is_near = slope.offset < JACOBIAN_REUSE_DISTANCE && self.options.offset > 0.0;
        // Most first trials are accepted, and the next iteration then needs the Jacobian at the trial point.
        let mut is_first = !is_near;
        loop {
            let (x, predicted) = linear.step(self.radius);
            let (trial, moved) = self.trial(&free, &x);
            let small = self.is_small(&trial);
            let outcome = self.evaluate(&trial, is_first);
            is_first = false;
            if predicted <= NOISE * self.cost {
                return self.blind_step(trial, outcome, moved, small);
            }
            let reduction =
                outcome.as_ref().map_or(f64::NAN, |evaluation| self.cost - evaluation.cost);
            let quality = reduction / predicted;
            // The ratio is NaN if the model failed. In this case, the step is too long.
            if quality < POOR || quality.is_nan() {
                self.radius = 0.25 * self.radius.min(moved);
            } else if quality >= GOOD {
                self.radius = self.radius.max(2.0 * moved);
            }
            match outcome {
                Ok(evaluation) if evaluation.cost < self.cost => {
                    self.go_to(trial, evaluation);
                    self.is_linearized |= is_near && quality > POOR;
                    return (small && quality > POOR).then_some(Ended::Converged);
                }
                Ok(_) if small => return Some(Ended::Converged),
                // Even the smallest step leaves the domain of the model. The current point is therefore at the edge of
                // the domain and is not a minimum.
                Err(message) if small => return Some(Ended::Failed(message)),
                _ => {}
            }
        }
    }

    /// Accepts a step whose predicted reduction is below rounding errors, as long as such steps become shorter. The
    /// cost is so flat there that it determines the parameters only to half of their digits.
    fn blind_step(
        &mut self,
        trial: Vec<f64>,
        outcome: Result<Evaluation, String>,
        moved: f64,
        small: bool,
    ) -> Option<Ended> {
        let shrinks = moved < 0.9 * self.last_blind;
        match outcome {
            Ok(evaluation) if shrinks && evaluation.cost <= (1.0 + NOISE) * self.cost => {
                self.last_blind = moved;
                self.go_to(trial, evaluation);
                small.then_some(Ended::Converged)
            }
            _ => Some(Ended::Converged),
        }
    }

    /// Returns the linearized problem for the free parameters (those that are not held at a bound), the indices of
    /// these parameters, and the distance from the minimum.
    fn linear_problem(&mut self) -> (LinearLeastSquares, Vec<usize>, Slope) {
        let weights: Vec<f64> =
            self.residuals.iter().map(|&r| self.options.loss.weight(r)).collect();
        let residuals = DVector::from_iterator(
            weights.len(),
            self.residuals.iter().zip(&weights).map(|(r, w)| r * w),
        );
        let weighted = |j: usize| {
            let column = self.jacobian.column(j).into_iter().zip(&weights);
            DVector::from_iterator(weights.len(), column.map(|(d, w)| d * w))
        };
        let (mut free, mut columns, mut cosine) = (Vec::new(), Vec::new(), 0.0_f64);
        let length = residuals.norm();
        for (j, parameter) in self.parameters.iter().enumerate() {
            let column = weighted(j);
            let norm = column.norm();
            let slope = column.dot(&residuals);
            let held = (self.p[j] <= parameter.low && slope > 0.0)
                || (self.p[j] >= parameter.high && slope < 0.0);
            if held || norm == 0.0 {
                continue;
            }
            if length > 0.0 {
                cosine = cosine.max(slope.abs() / (norm * length));
            }
            free.push(j);
            columns.push(column * parameter.unit(self.p[j]));
        }
        let scaled = match columns.is_empty() {
            true => DMatrix::zeros(residuals.len(), 1),
            false => DMatrix::from_columns(&columns),
        };
        let linear = LinearLeastSquares::new(scaled, &residuals);
        let offset = linear.offset(&residuals);
        (linear, free, Slope { cosine, offset })
    }

    /// Returns the parameters after the scaled step `x`, clamped to the bounds, and the length of the resulting scaled
    /// change.
    fn trial(&self, free: &[usize], x: &DVector<f64>) -> (Vec<f64>, f64) {
        let mut trial = self.p.clone();
        let mut square = 0.0;
        for (&j, x) in free.iter().zip(x.iter()) {
            let parameter = &self.parameters[j];
            trial[j] = parameter.step(self.p[j], *x);
            square += parameter.distance(self.p[j], trial[j]).powi(2);
        }
        (trial, square.sqrt())
    }

    /// Returns whether the step to `trial` changes every parameter by less than the tolerance.
    fn is_small(&self, trial: &[f64]) -> bool {
        let tolerance = self.options.tolerance;
        let mut changes = self.p.iter().zip(trial).zip(self.parameters);
        changes.all(|((a, b), parameter)| {
            (a - b).abs() <= tolerance * a.abs().max(1e-3 * tolerance * parameter.scale)
        })
    }

    fn into_fit(mut self, ended: Ended) -> Fit {
        // The result has the Jacobian at the final point or, if it cannot be computed, the previous one.
        let before = self.jacobian.clone();
        if self.linearize().is_err() {
            self.jacobian = before;
        }
        let held = self
            .parameters
            .iter()
            .zip(&self.p)
            .map(|(parameter, &p)| p <= parameter.low || p >= parameter.high)
            .collect();
        Fit {
            names: self.parameters.iter().map(|p| p.name.clone()).collect(),
            values: self.p,
            at_bound: held,
            cost: self.cost,
            residuals: self.residuals,
            jacobian: self.jacobian,
            ended,
            history: self.history,
            evaluations: self.evaluations,
            loss: self.options.loss,
        }
    }
}
