//! Fits the parameters of a scene to measurements.
//!
//! The module `data` reads the measurements. [`FitOptions`] specifies the scene and the experiments. [`compute`]
//! performs the fit with the crate `myovib_fit` and derivatives from forward sensitivities. It returns a [`FitResult`],
//! which the module `report` describes.

mod data;
mod evaluations;
mod history;
mod model;
mod phases;
mod profiles;
mod progress;
mod report;

use std::fmt;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

pub use myovib_fit::Loss;
use myovib_fit::{
    Ended, Fit, FitError, Identifiability, Iteration, Options, Parameter, Profile, Uncertainty,
    several_starts,
};
use serde_json::{Value, json};

use crate::inputs::sha256;
use crate::result_folder::{Existing, FolderRequest, program};
use crate::sensitivity::{Abscissa, Parameterized, SceneParameter, outputs};
use crate::watch::{ProgressSink, Watcher};
use crate::{Error, InputError, Scene};
use data::{DataError, Domain, read_file};
use evaluations::{EVALUATIONS, Evaluations};
use history::{HISTORY, History};
use model::{Experiment, SceneModel};
use phases::fit_in_phases;
use profiles::profiles;
use progress::FitProgress;

/// The scene, the measurements, and the settings of a fit.
pub struct FitOptions<'a> {
    /// The scene: a TOML file, or the name of a built-in scene.
    pub scene: PathBuf,
    /// Overrides that apply to all experiments.
    pub set: Vec<String>,
    /// Measurement file and additional overrides of each experiment.
    pub experiments: Vec<(PathBuf, Vec<String>)>,
    /// Folder for the results. Each iteration adds a row to `history.csv` in this folder.
    pub out: PathBuf,
    /// Policy if the folder already contains a fit. A resumed fit repeats the earlier iterations with stored
    /// evaluations instead of new runs.
    pub existing: Existing,
    /// Convergence tolerance. The fit has converged when no parameter changes by more than this fraction of its value,
    /// or when the next step is below 1 % of the parameters' standard errors.
    pub tolerance: f64,
    /// Maximum number of iterations in each phase, from each starting point, and for each profile point. An iteration
    /// takes one run with sensitivities and one or more runs without them.
    pub max_iterations: usize,
    /// Number of starting points. One of them consists of the starting values in the scene; the others are random.
    pub starts: usize,
    /// Seed of the random starting points.
    pub seed: u64,
    /// Loss function, applied to the residuals divided by the given noise. If no noise is given, only least squares is
    /// allowed.
    pub loss: Loss,
    /// Whether to compute confidence intervals by profile likelihood. This takes about ten fits per parameter.
    pub profile: bool,
    /// Flag that interrupts the fit. The results obtained so far are kept.
    pub interrupt: Option<&'static AtomicBool>,
    pub progress: &'a dyn ProgressSink,
}

impl FitOptions<'_> {
    /// Rejects options that are out of range.
    fn check(&self) -> Result<(), InputError> {
        let wrong = |place: &str, found: &dyn fmt::Display, allowed: &str| {
            let error = InputError::new("value out of range");
            Err(error.at(place).found(found).allowed(allowed))
        };
        if !(1..=MAX_STARTS).contains(&self.starts) {
            return wrong("starts", &self.starts, &format!("1 to {MAX_STARTS}"));
        }
        if !(self.tolerance > 0.0 && self.tolerance < 1.0) {
            return wrong("tolerance", &self.tolerance, "a number above 0 and below 1");
        }
        if self.max_iterations == 0 {
            return wrong("max_iterations", &self.max_iterations, "1 or more");
        }
        Ok(())
    }
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Outcome {
    /// The search found a minimum of the cost.
    Converged,
    /// The search found a minimum at which the residuals exceed three times the given noise.
    DoesNotFit,
    MaxIterations,
    Interrupted,
    /// The scene could not be computed at parameters with a smaller predicted cost, or its derivatives were unusable.
    /// Contains the message.
    Failed(String),
}

impl Outcome {
    /// Returns the name of the outcome in `fit.json`.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Converged => "converged",
            Self::DoesNotFit => "does_not_fit",
            Self::MaxIterations => "max_iterations",
            Self::Interrupted => "interrupted",
            Self::Failed(_) => "failed",
        }
    }
}

/// Confidence level of the intervals.
pub const LEVEL: f64 = 0.95;

/// The fit ends when the Gauss–Newton step is below this fraction of the parameters' uncertainty. Even a fraction of
/// 0.1 would reduce the coverage of 95 % intervals only slightly.
const OFFSET: f64 = 0.01;

/// Maximum number of starting points. Each point costs one fit.
const MAX_STARTS: usize = 10_000;

/// The validity of the scene is tested at this distance from a bound, relative to the distance between the starting
/// value and the bound.
const WITHIN: f64 = 1e-6;

#[derive(Debug)]
pub struct FitResult {
    /// Title of the scene; may be empty.
    pub title: String,
    pub known: Vec<SceneParameter>,
    pub fit: Fit,
    /// Standard errors and correlations.
    pub uncertainty: Uncertainty,
    /// Combinations of parameters, sorted from best to worst determined.
    pub identifiability: Identifiability,
    /// Profile of each parameter, or the reason why it was not computed; empty if profiles were not requested.
    pub profiles: Vec<Result<Profile, String>>,
    /// The measurements, in the same order as the residuals.
    pub points: Vec<Point>,
    /// Number of runs without sensitivities and number of runs with sensitivities.
    pub runs: [u64; 2],
    /// Whether the standard deviations of the measurements were given.
    pub noise_is_known: bool,
    pub loss: Loss,
    /// Whether the body is three-dimensional. Otherwise, forces are per meter of depth.
    pub in_space: bool,
    /// Lower and upper bounds of each parameter, within the range that the scene allows.
    pub bounds: Vec<[f64; 2]>,
}

/// A measurement with its residual.
#[derive(Debug, Clone, PartialEq)]
pub struct Point {
    /// One-based number of the experiment.
    pub experiment: usize,
    pub output: String,
    pub column: String,
    /// Time (s), frequency (Hz) or load factor.
    pub t: f64,
    pub abscissa: Abscissa,
    pub measured: f64,
    pub fitted: f64,
    /// (fitted − measured)/σ, with σ = 1 if the standard deviation is unknown.
    pub residual: f64,
}

/// Fits the parameters of a scene to measurements.
///
/// # Errors
/// Fails if the scene or the measurements are invalid, if the scene cannot be computed at the starting values, or if a
/// file cannot be written. A fit that does not converge is not an error; see [`FitResult::outcome`].
pub fn compute(options: &FitOptions<'_>) -> Result<FitResult, Error> {
    options.check()?;
    let reads: Vec<PathBuf> = options.experiments.iter().map(|(file, _)| file.clone()).collect();
    request(options, &reads, Value::Null).check()?;
    let scene = Parameterized::load(&options.scene, &options.set)?;
    let mut parameters = parameters(&scene)?;
    let experiments = experiments(options, &scene)?;
    let noise_is_known = noise_is_known(options, &experiments, parameters.len())?;
    let start: Vec<f64> = parameters.iter().map(|p| p.start).collect();
    for experiment in &experiments {
        experiment.expect_computable(&start).map_err(not_computed)?;
    }
    expect_bounds(&scene, &start)?;
    restrict(&scene, &mut parameters);
    let progress = FitProgress::new(options.progress);
    let watcher = Watcher { interrupt: options.interrupt, progress: &progress };
    let request = request(options, &reads, origin(options, &experiments));
    let evaluations = match options.existing {
        Existing::Resume => Evaluations::read(&request)?,
        _ => Evaluations::default(),
    };
    let mut model = SceneModel::new(experiments, watcher, &evaluations);
    let wanted = Options {
        tolerance: options.tolerance,
        offset: OFFSET,
        max_iterations: options.max_iterations,
        loss: options.loss,
    };
    let mut history = History::new(request, &parameters, &evaluations);
    let mut number = 0;
    let mut observe = |part: f64, iteration: &Iteration| {
        let is_written = history.add(number, part, iteration);
        number += 1;
        progress.iteration(number, part, iteration.cost);
        match watcher.is_interrupted() || !is_written {
            true => ControlFlow::Break(()),
            false => ControlFlow::Continue(()),
        }
    };
    let starts = several_starts(&parameters, options.starts, options.seed);
    let fitted = fit_in_phases(&mut model, &starts, &wanted, &mut observe);
    history.end(fitted.is_ok())?;
    let fit = fitted.map_err(|error| explain(error, &mut model))?;
    let profiles = match options.profile && fit.ended == Ended::Converged {
        true => profiles(&mut model, &parameters, &fit, &wanted, options.progress),
        false => Vec::new(),
    };
    history.end(true)?;
    let uncertainty = fit.uncertainty().map_err(InputError::new)?;
    let body = scene.scene.body.as_ref();
    let in_space = body.is_some_and(|body| body.muscle.solid.space().dimension() == 3);
    Ok(FitResult {
        title: scene.scene.file.title.clone(),
        known: scene.parameters,
        identifiability: fit.identifiability(),
        uncertainty,
        profiles,
        points: model.points(&fit.residuals),
        runs: model.runs(),
        noise_is_known,
        loss: options.loss,
        in_space,
        bounds: parameters.iter().map(|p| [p.low, p.high]).collect(),
        fit,
    })
}

/// Checks the measurements. Returns whether their standard deviations are given.
fn noise_is_known(
    options: &FitOptions<'_>,
    experiments: &[Experiment],
    n_parameters: usize,
) -> Result<bool, InputError> {
    let n_data = experiments.iter().map(|e| e.data.len()).sum::<usize>();
    if n_data <= n_parameters {
        return Err(InputError::new("too few measurements")
            .found(format!("{n_data} measurements, {n_parameters} parameters"))
            .allowed("more measurements than parameters"));
    }
    let mut with_noise = experiments.iter().map(|e| e.data[0].noise.is_some());
    let is_known = with_noise.clone().all(|is_given| is_given);
    if !is_known && with_noise.any(|is_given| is_given) {
        let error = InputError::new("only some experiments have standard deviations");
        return Err(error.next("set `noise` of every [[output]], or remove it from all"));
    }
    if !is_known && options.loss != Loss::Squares {
        let error = InputError::new("a robust loss needs the noise, which defines outliers");
        return Err(error.next("set `noise` of every [[output]]"));
    }
    Ok(is_known)
}

/// Files written at the end of a fit.
const RESULTS: [&str; 4] = ["fit.json", "report.html", "residuals.csv", "residuals.svg"];

/// Returns the request for the result folder of a fit. The folder is opened at the first iteration.
fn request<'a>(
    options: &'a FitOptions<'_>,
    reads: &'a [PathBuf],
    origin: Value,
) -> FolderRequest<'a> {
    let files = RESULTS.into_iter().chain([HISTORY, EVALUATIONS]);
    FolderRequest {
        path: &options.out,
        command: "fit",
        existing: options.existing,
        can_resume: true,
        files: files.map(str::to_owned).collect(),
        origin,
        reads,
    }
}

/// Converts the error of a fit. If a run failed at the starting values, returns the error of that run, which may
/// include the location of its cause in the scene.
fn explain(error: FitError, model: &mut SceneModel<'_>) -> Error {
    match (&error, model.take_failure()) {
        _ if model.is_interrupted() => {
            Error::Stopped("interrupted before the first iteration of the fit".to_owned())
        }
        (FitError::Start(_), Some(failure)) => not_computed(failure),
        _ => InputError::new(error).into(),
    }
}

fn not_computed(failure: Error) -> Error {
    if failure.lacks_memory() {
        return failure;
    }
    InputError::new("the scene cannot be computed at the starting values")
        .found(failure)
        .next("set a `start` of the [[parameter]] at which `myovib run` succeeds")
        .into()
}

/// Returns the parameters with their starting values and bounds.
fn parameters(scene: &Parameterized) -> Result<Vec<Parameter>, InputError> {
    let all = scene.parameters.iter().enumerate().map(|(i, known)| {
        let wanted = &known.wanted;
        let start = wanted.start.unwrap_or(known.value);
        let low = wanted.low.unwrap_or(f64::NEG_INFINITY);
        let high = wanted.high.unwrap_or(f64::INFINITY);
        let refuse = |key: &str, error: InputError| {
            Err(scene.scene.wrong(&format!("parameter[{i}].{key}"), error))
        };
        if low >= high {
            let error = InputError::new("the lower bound must be below the upper bound");
            return refuse("low", error.found(format!("low = {low:e}, high = {high:e}")));
        }
        if start < low || start > high {
            let key = if start < low { "low" } else { "high" };
            let error = InputError::new(format!("a bound of `{}` excludes its start", known.key))
                .found(format!("start = {start:e}, low = {low:e}, high = {high:e}"));
            return refuse(key, error.next("move the bound, or set a `start` between the bounds"));
        }
        Ok(Parameter {
            name: known.label(),
            start,
            scale: known.scale,
            low,
            high,
            logarithmic: false,
        })
    });
    all.collect()
}

/// A parameter may become negative if the scene accepts minus this multiple of the parameter's typical size. A constant
/// whose lower bound depends on other constants, such as `c01`, stays nonnegative unless its `low` is given.
const DEFAULT_LOWER_BOUND: f64 = 1e6;

/// Restricts parameters to the range that the scene allows, because an unrestricted search can end at the edge of that
/// range. This applies to parameters with a nonnegative starting value and without a positive lower bound. They stay
/// positive if the scene rejects zero, and nonnegative if it rejects negative values.
fn restrict(scene: &Parameterized, parameters: &mut [Parameter]) {
    let start: Vec<f64> = parameters.iter().map(|p| p.start).collect();
    for (j, parameter) in parameters.iter_mut().enumerate() {
        let is_allowed = |value: f64| {
            let mut values = start.clone();
            values[j] = value;
            scene.at(&values).is_ok()
        };
        if parameter.start < 0.0 || parameter.low > 0.0 || parameter.high <= 0.0 {
            continue;
        }
        if parameter.start > 0.0 && !is_allowed(0.0) {
            *parameter = parameter.clone().positive();
        } else if parameter.low < 0.0
            && !is_allowed(parameter.low.max(-DEFAULT_LOWER_BOUND * parameter.scale))
        {
            parameter.low = 0.0;
        }
    }
}

/// Rejects bounds outside the range that the scene allows, because the fit would fail before it reaches such bounds.
fn expect_bounds(scene: &Parameterized, start: &[f64]) -> Result<(), InputError> {
    for (i, known) in scene.parameters.iter().enumerate() {
        for (key, bound) in [("low", known.wanted.low), ("high", known.wanted.high)] {
            let Some(bound) = bound else { continue };
            let mut values = start.to_vec();
            // The range that the scene allows may exclude its end, so the test point is just inside the bound.
            values[i] += (1.0 - WITHIN) * (bound - start[i]);
            if let Err(error) = scene.at(&values) {
                let message =
                    format!("the scene is invalid near this bound of `{}`", known.label());
                let error = InputError::new(message).found(error);
                return Err(scene.scene.wrong(&format!("parameter[{i}].{key}"), error));
            }
        }
    }
    Ok(())
}

/// Returns the origin of a fit: the loss, the program, and hashes of the scenes, their input files and the
/// measurements. Evaluations of an earlier fit are valid if it has the same origin.
fn origin(options: &FitOptions<'_>, experiments: &[Experiment]) -> Value {
    let of_each =
        |of: &dyn Fn(&Experiment) -> Value| -> Value { experiments.iter().map(of).collect() };
    json!({
        "loss": format!("{:?}", options.loss),
        "program": program(),
        "scene": of_each(&|experiment| json!(sha256(experiment.computed().to_string().as_bytes()))),
        "files": of_each(&|experiment| json!(experiment.scene().inputs)),
        "measurements": of_each(&|experiment| {
            json!(sha256(format!("{:?}", experiment.data).as_bytes()))
        }),
    })
}

/// Rejects an experiment that overrides a fitted parameter, because the fit would replace the value.
fn expect_free_parameters(
    scene: &Parameterized,
    file: &Path,
    set: &[String],
) -> Result<(), InputError> {
    let key = |word: &String| word.split('=').next().map(str::to_owned);
    let keys: Vec<String> = set.iter().filter_map(key).collect();
    let fitted = scene.parameters.iter().find(|known| keys.contains(&known.key));
    match fitted {
        None => Ok(()),
        Some(known) => {
            let error = InputError::new("an experiment sets a fitted parameter");
            Err(error
                .at(format!("--data {}", file.display()))
                .found(&known.key)
                .next("remove it here, or remove the [[parameter]]"))
        }
    }
}

/// Returns the independent variable of a scene and the range in which measurements are accepted.
fn domain(scene: &Scene) -> Result<Domain, InputError> {
    let abscissa = Abscissa::of(scene);
    let [low, high] = match (abscissa, &scene.file.response) {
        (Abscissa::Load, _) => {
            let loads = scene.loads()?;
            [f64::min, f64::max].map(|end| loads.iter().copied().fold(0.0, end))
        }
        (Abscissa::Frequency, Some(response)) => {
            response.frequencies.grid().map_err(InputError::new)?.ends()
        }
        _ => [0.0, scene.t_end],
    };
    Ok(Domain { abscissa, low, high })
}

fn experiments(
    options: &FitOptions<'_>,
    scene: &Parameterized,
) -> Result<Vec<Experiment>, InputError> {
    let given = &options.experiments;
    let experiments = given.iter().map(|(file, set)| {
        expect_free_parameters(scene, file, set)?;
        let scene = scene.with(set)?;
        let outputs = outputs(&scene.scene)?;
        let domain = domain(&scene.scene)?;
        let data = read_file(file, &outputs, domain);
        let data = data.map_err(DataError::into_input_error)?;
        Ok(Experiment::new(scene, outputs, data))
    });
    let experiments: Vec<Experiment> = experiments.collect::<Result<_, InputError>>()?;
    let is_same = |j: usize, k: usize| {
        given[j].1 == given[k].1 && experiments[j].has_data_of(&experiments[k])
    };
    let twice = (1..given.len()).find(|&k| (0..k).any(|j| is_same(j, k)));
    if let Some(k) = twice {
        let error = InputError::new("duplicate measurements").at("--data");
        return Err(error.found(given[k].0.display()).next("list each experiment once"));
    }
    Ok(experiments)
}
