//! The parameters of a scene from measurements.
//!
//! Cast: `data` reads measurements; a [`FitOptions`] says of which scene and experiments;
//! [`compute`] fits by `myovib_fit`, with derivatives from forward sensitivities, and gives a
//! [`FitResult`], of which `report` makes documents and words.

mod data;
mod history;
mod model;
mod phases;
mod profiles;
mod report;

use std::fmt::Display;
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
use crate::run::Existing;
use crate::sensitivity::{Known, Parametrised, outputs};
use crate::watch::{Tell, Watcher};
use crate::{Error, InputError};
use data::read_file;
pub use data::{DataError, DataProblem, Datum, read};
use history::History;
use model::{Experiment, SceneModel};
use phases::fit_in_phases;
use profiles::profiles;

/// A scene, the measurements, and where the history goes.
pub struct FitOptions<'a> {
    /// The scene: a TOML file, or the name of a built-in scene.
    pub scene: PathBuf,
    /// Overrides of all experiments.
    pub set: Vec<String>,
    /// For each experiment its measurements and its own overrides.
    pub experiments: Vec<(PathBuf, Vec<String>)>,
    /// Folder for `history.csv`, which grows as the fit goes.
    pub out: PathBuf,
    /// What is done with the `history.csv` that is there: a fit that is resumed starts from its least cost.
    pub existing: Existing,
    /// The fit is converged when no parameter changes by more than this fraction of itself, or when what
    /// is left is a hundredth of what the noise leaves open.
    pub tolerance: f64,
    /// Most iterations of each part of the fit, from each start, and of each fit of a profile; each with one
    /// run with sensitivities and one or more plain ones.
    pub max_iterations: usize,
    /// From how many starts it is fitted: that of the scene, and others by chance.
    pub starts: usize,
    /// The seed of that chance.
    pub seed: u64,
    /// How much a residual counts, in units of the noise that is given; without, squares alone make
    /// sense.
    pub loss: Loss,
    /// Whether intervals by profile likelihood are computed: some ten fits for each parameter.
    pub profile: bool,
    /// A flag that ends the fit in good order.
    pub interrupt: Option<&'static AtomicBool>,
    /// Who is told how far the fit is.
    pub progress: &'a dyn Tell,
}

/// Ratio of residuals to the noise above which a model does not describe the measurements: a hundred standard
/// deviations are not chance, whatever the distribution of the noise.
const HOPELESS: f64 = 100.0;

/// How a fit ended.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Outcome {
    /// The cost is least, and residuals are of the size of the noise where it is known.
    Converged,
    /// The cost is least near the values found, but residuals are hundreds of times the noise.
    DoesNotFit,
    /// The limit on iterations was reached.
    MaxIterations,
    /// The fit was interrupted.
    Interrupted,
    /// The scene could not be computed in the direction of smaller costs.
    Failed(String),
}

impl Outcome {
    /// Returns its name in `fit.json`.
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

/// The probability with which intervals cover.
pub const LEVEL: f64 = 0.95;

/// The fit ends where the way to the least is this fraction of the parameters' uncertainty: intervals of
/// 95 % would cover as often as they say if it were a tenth.
const OFFSET: f64 = 0.01;

/// Maximum number of starting points: each costs a fit.
const MAX_STARTS: usize = 10_000;

/// How far within a bound the scene must be right, in parts of the way to the start.
const WITHIN: f64 = 1e-6;

/// What a fit came to.
#[derive(Debug)]
pub struct FitResult {
    /// The scene's title, which may be empty.
    pub title: String,
    /// The parameters as the scene has them.
    pub known: Vec<Known>,
    /// The fit itself.
    pub fit: Fit,
    /// Standard errors and correlations.
    pub uncertainty: Uncertainty,
    /// What the measurements tell of combinations of parameters.
    pub identifiability: Identifiability,
    /// For each parameter its profile, or why it was not computed; none if they were not asked for.
    pub profiles: Vec<Result<Profile, String>>,
    /// The measurements, in the order of the residuals.
    pub points: Vec<Point>,
    /// Runs of the scenes, with and without sensitivities.
    pub runs: [u64; 2],
    /// Whether the standard deviations of the measurements were given.
    pub noise_is_known: bool,
    /// Whether the body is in space: forces of one in the plane are per metre of depth.
    pub in_space: bool,
    /// Lower and upper bound of each parameter: those of the scene, within the values that its meaning allows.
    pub bounds: Vec<[f64; 2]>,
}

/// A measurement with its residual.
#[derive(Debug, Clone, PartialEq)]
pub struct Point {
    /// Number of the experiment, from 1.
    pub experiment: usize,
    /// The output.
    pub output: String,
    /// The column of a probe that it is.
    pub column: String,
    /// When, s.
    pub t: f64,
    /// What was measured.
    pub measured: f64,
    /// What the fit gives.
    pub fitted: f64,
    /// (fitted − measured)/σ, with σ = 1 where it is not known.
    pub residual: f64,
}

/// Fits the parameters of a scene.
///
/// # Errors
/// What is wrong with the scene or the measurements; a start at which the scene cannot be computed;
/// a history that cannot be written. A fit that does not converge is a result that says so.
pub fn compute(options: &FitOptions<'_>) -> Result<FitResult, Error> {
    if options.starts > MAX_STARTS {
        let error = InputError::new("too many starting points").at("--starts");
        let error = error
            .found(options.starts)
            .allowed(format!("1 to {MAX_STARTS}"));
        return Err(error.into());
    }
    expect_free(options)?;
    let scene = Parametrised::load(&options.scene, &options.set)?;
    let mut parameters = parameters(&scene)?;
    let experiments = experiments(options, &scene)?;
    let n_data = experiments.iter().map(|e| e.data.len()).sum::<usize>();
    if n_data <= parameters.len() {
        let error = InputError::new("the measurements cannot tell the parameters and their noise")
            .found(format!(
                "{n_data} measurements, {} parameters",
                parameters.len()
            ))
            .allowed("more measurements than parameters");
        return Err(error.into());
    }
    let noise_is_known = experiments.iter().all(|e| e.data[0].noise.is_some());
    if !noise_is_known && experiments.iter().any(|e| e.data[0].noise.is_some()) {
        let error = InputError::new("one experiment has standard deviations, another has none");
        return Err(error
            .next("give `noise` to each [[output]], or to none")
            .into());
    }
    if !noise_is_known && options.loss != Loss::Squares {
        let error =
            InputError::new("a robust loss needs the noise: what is far off is so in units of it");
        return Err(error.next("give `noise` to each [[output]]").into());
    }
    let start: Vec<f64> = parameters.iter().map(|p| p.start).collect();
    for experiment in &experiments {
        experiment.expect_computable(&start).map_err(not_computed)?;
    }
    expect_bounds(&scene, &start)?;
    restrict(&scene, &mut parameters);
    let watcher = Watcher {
        interrupt: options.interrupt,
        progress: &(),
    };
    let origin = origin(options, &experiments);
    let mut model = SceneModel::new(experiments, watcher);
    let wanted = Options {
        tolerance: options.tolerance,
        offset: OFFSET,
        max_iterations: options.max_iterations,
        loss: options.loss,
    };
    let mut history = match options.existing {
        Existing::Resume => History::resume(&options.out, &mut parameters, origin)?,
        _ => History::begin(&options.out, &parameters, origin),
    };
    let mut number = 0;
    let mut observe = |part: f64, iteration: &Iteration| {
        history.add(number, part, iteration);
        number += 1;
        let cost = iteration.cost;
        let of = match part < 1.0 {
            true => " of the beginning",
            false => "",
        };
        options
            .progress
            .tell(&|| format!("iteration {number}: half the sum of squares {cost:.6e}{of}"));
        match watcher.is_interrupted() {
            true => ControlFlow::Break(()),
            false => ControlFlow::Continue(()),
        }
    };
    let starts = several_starts(&parameters, options.starts, options.seed);
    let fitted = fit_in_phases(&mut model, &starts, &wanted, &mut observe);
    history.end()?;
    let fit = fitted.map_err(|error| explain(error, &model))?;
    let profiles = match options.profile && fit.ended == Ended::Converged {
        true => profiles(&mut model, &parameters, &fit, &wanted, options.progress),
        false => Vec::new(),
    };
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
        in_space,
        bounds: parameters.iter().map(|p| [p.low, p.high]).collect(),
        fit,
    })
}

/// What a fit writes in the end.
const RESULTS: [&str; 4] = ["fit.json", "report.html", "residuals.csv", "residuals.svg"];

/// Refuses a folder that holds a run, or a fit that is to stay: one that came to an iteration.
fn expect_free(options: &FitOptions<'_>) -> Result<(), InputError> {
    let folder = options.out.display();
    let (what, next) = if options.out.join("run.json").exists() {
        ("run", "give another folder")
    } else if options.existing == Existing::Refuse && history::has_begun(&options.out) {
        let next = "give another folder, or --overwrite, or --resume to go on with it";
        ("fit", next)
    } else if let Some(file) = history::foreign_file(&options.out) {
        let error = InputError::new("the fit would replace a file that no fit made");
        let error = error.at("--out").found(file.display());
        return Err(error.next("give another folder"));
    } else {
        return Ok(());
    };
    let error = InputError::new(format!("{folder} holds a {what} already"));
    Err(error.at("--out").next(next))
}

/// What went wrong at the start is told by the run, with the place in the scene if it has one.
fn explain(error: FitError, model: &SceneModel<'_>) -> Error {
    match (&error, model.last_failure()) {
        _ if model.is_interrupted() => Error::Stopped("interrupted".to_owned()),
        (FitError::Start(_), Some(message)) => not_computed(message).into(),
        _ => InputError::new(error).into(),
    }
}

fn not_computed(message: impl Display) -> InputError {
    InputError::new("the scene cannot be computed where the fit starts")
        .found(message)
        .next("give the [[parameter]] a `start` at which `myovib run` comes to its end")
}

/// The parameters as the fit sees them.
fn parameters(scene: &Parametrised) -> Result<Vec<Parameter>, InputError> {
    let all = scene.parameters.iter().enumerate().map(|(i, known)| {
        let wanted = &known.wanted;
        let start = wanted.start.unwrap_or(known.value);
        let low = wanted.low.unwrap_or(f64::NEG_INFINITY);
        let high = wanted.high.unwrap_or(f64::INFINITY);
        let refuse = |key: &str, error: InputError| {
            Err(scene.scene.wrong(&format!("parameter[{i}].{key}"), error))
        };
        if low >= high {
            let error = InputError::new("the lower bound is not below the upper one");
            return refuse(
                "low",
                error.found(format!("low = {low:e}, high = {high:e}")),
            );
        }
        if start < low || start > high {
            let key = if start < low { "low" } else { "high" };
            let error = InputError::new(format!("a bound of `{}` excludes its start", known.key))
                .found(format!("start = {start:e}, low = {low:e}, high = {high:e}"));
            return refuse(
                key,
                error.next("move the bound, or give a `start` between the bounds"),
            );
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

/// Restricts parameters that start at zero or above, and have no positive lower bound, to the values that the scene
/// allows: to positive values where it refuses zero, to nonnegative values where it refuses negative ones. A search
/// that is not restricted ends at that edge.
fn restrict(scene: &Parametrised, parameters: &mut [Parameter]) {
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
        } else if parameter.low < 0.0 && !is_allowed(-parameter.scale) {
            parameter.low = 0.0;
        }
    }
}

/// Refuses bounds beyond what the scene allows: a fit would fail there, and not at its bound.
fn expect_bounds(scene: &Parametrised, start: &[f64]) -> Result<(), InputError> {
    for (i, known) in scene.parameters.iter().enumerate() {
        for (key, bound) in [("low", known.wanted.low), ("high", known.wanted.high)] {
            let Some(bound) = bound else { continue };
            let mut values = start.to_vec();
            // The end of a range may be excluded: what lies just within a bound there is allowed.
            values[i] += (1.0 - WITHIN) * (bound - start[i]);
            if let Err(error) = scene.at(&values) {
                let message = format!("`{}` cannot go to this bound", known.label());
                let error = InputError::new(message).found(error);
                return Err(scene.scene.wrong(&format!("parameter[{i}].{key}"), error));
            }
        }
    }
    Ok(())
}

/// What costs are of: of all experiments the scenes, the files they read, and the measurements.
fn origin(options: &FitOptions<'_>, experiments: &[Experiment]) -> Value {
    let of_each =
        |of: &dyn Fn(&Experiment) -> Value| -> Value { experiments.iter().map(of).collect() };
    json!({
        "loss": format!("{:?}", options.loss),
        "scene": of_each(&|experiment| json!(sha256(experiment.computed().to_string().as_bytes()))),
        "files": of_each(&|experiment| json!(experiment.scene().inputs)),
        "measurements": of_each(&|experiment| {
            json!(sha256(format!("{:?}", experiment.data).as_bytes()))
        }),
    })
}

/// Refuses an experiment that sets what is fitted: the fit's value would replace it.
fn expect_free_parameters(
    scene: &Parametrised,
    file: &Path,
    set: &[String],
) -> Result<(), InputError> {
    let key = |word: &String| word.split('=').next().map(str::to_owned);
    let keys: Vec<String> = set.iter().filter_map(key).collect();
    let fitted = scene
        .parameters
        .iter()
        .find(|known| keys.contains(&known.key));
    match fitted {
        None => Ok(()),
        Some(known) => {
            let error = InputError::new("an experiment sets a parameter that is fitted");
            Err(error
                .at(format!("--data {}", file.display()))
                .found(&known.key)
                .next("leave it out here, or remove the [[parameter]]"))
        }
    }
}

fn experiments(
    options: &FitOptions<'_>,
    scene: &Parametrised,
) -> Result<Vec<Experiment>, InputError> {
    let given = &options.experiments;
    let experiments = given.iter().map(|(file, set)| {
        expect_free_parameters(scene, file, set)?;
        let scene = scene.with(set)?;
        let outputs = outputs(&scene.scene)?;
        let data = read_file(file, &outputs, scene.scene.t_end);
        let data = data.map_err(DataError::into_input_error)?;
        Ok(Experiment::new(scene, outputs, data))
    });
    let experiments: Vec<Experiment> = experiments.collect::<Result<_, InputError>>()?;
    let is_same =
        |j: usize, k: usize| given[j].1 == given[k].1 && experiments[j].data == experiments[k].data;
    let twice = (1..given.len()).find(|&k| (0..k).any(|j| is_same(j, k)));
    if let Some(k) = twice {
        let error = InputError::new("the same measurements are given twice").at("--data");
        return Err(error
            .found(given[k].0.display())
            .next("give each experiment once"));
    }
    Ok(experiments)
}
