//! `myovib fit`: the parameters of a scene from measurements.

use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use myovib_report::picture;
use myovib_report::plot::{Axis, Figure, LinePlot, Panel, Series};
use myovib_report::table::{Align, Table, coloured_stdout};
use myovib_scene::fit::{FitOptions, FitResult, LEVEL, Loss, Point, compute};
use myovib_scene::{atomic_file, json};
use serde_json::Value;

use crate::args::CommonArgs;
use crate::exit::Exit;
use crate::interrupt;
use crate::progress::Progress;
use crate::values;

/// Options of `myovib fit`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    myovib fit scene.toml --data measured.csv\n  \
    myovib fit scene.toml --data low.csv --data 'high.csv traction[0].y.amplitude=200' --profile\n\n\
    The scene names its parameters in [[parameter]] and what was measured in [[output]]. Data are a \
    table with a column `t` and one for each output, or PEtab's columns observableId, time, \
    measurement and noiseParameters. Writes fit.json, residuals.csv, residuals.svg and history.csv. \
    Returns 3 when the fit does not converge.")]
pub struct FitArgs {
    /// The scene: a TOML file, or the name of a built-in scene.
    #[arg(value_name = "SCENE")]
    pub scene: PathBuf,

    /// Measurements of an experiment, and what was different in it, after spaces; may be repeated.
    #[arg(long, value_name = "FILE [KEY=VALUE]...", required = true)]
    pub data: Vec<String>,

    /// Change a value of the scene in all experiments.
    #[arg(long, value_name = "KEY=VALUE")]
    pub set: Vec<String>,

    /// Folder for the results.
    #[arg(long, value_name = "DIR", default_value = "fit", value_parser = values::output_folder)]
    pub out: PathBuf,

    /// Go on with the history in the folder for the results, from the iteration that fits best there.
    #[arg(long, conflicts_with = "starts")]
    pub resume: bool,

    /// Compute intervals by profile likelihood too: some ten fits for each parameter.
    #[arg(long)]
    pub profile: bool,

    /// How much a measurement far off counts.
    #[arg(long, value_enum, default_value_t)]
    pub loss: LossArg,

    /// From how many starts to fit: the scene's own, and others by chance, anywhere between the bounds, or
    /// from half to twice the start; the best is kept.
    #[arg(long, value_name = "N", default_value = "1")]
    pub starts: NonZeroUsize,

    /// Seed of the starts.
    #[arg(long, value_name = "SEED", default_value = "0")]
    pub seed: u64,

    /// Converged when no parameter changes by more than this fraction of itself, or when what is left is a
    /// hundredth of what the noise leaves open.
    #[arg(long, value_name = "FRACTION", default_value = "1e-5", value_parser = values::relative_tolerance)]
    pub tolerance: f64,

    /// Most iterations.
    #[arg(long, value_name = "N", default_value = "50")]
    pub max_iterations: usize,

    /// Options of every command.
    #[command(flatten)]
    pub common: CommonArgs,
}

/// What a residual counts. Both that are robust need 5 % more measurements than squares do where the
/// noise is normal after all (Huber 1981; Holland, Welsch 1977).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
pub enum LossArg {
    /// By its square: least squares.
    #[default]
    Squares,
    /// Beyond 1.345 standard deviations by its size.
    Huber,
    /// Hardly at all far beyond 2.385 standard deviations.
    Cauchy,
}

impl From<LossArg> for Loss {
    fn from(loss: LossArg) -> Self {
        match loss {
            LossArg::Squares => Self::Squares,
            LossArg::Huber => Self::Huber(1.345),
            LossArg::Cauchy => Self::Cauchy(2.385),
        }
    }
}

/// Fits the parameters.
///
/// # Errors
/// A wrong scene or wrong data, and a scene that cannot be computed at the start.
pub fn run(args: &FitArgs) -> anyhow::Result<Exit> {
    let progress = Progress::new(args.common.quiet);
    let experiments = args.data.iter().map(|text| {
        let mut words = text.split_whitespace().map(str::to_owned);
        let file = PathBuf::from(words.next().unwrap_or_default());
        (file, words.collect())
    });
    let result = compute(&FitOptions {
        scene: args.scene.clone(),
        set: args.set.clone(),
        experiments: experiments.collect(),
        out: args.out.clone(),
        resume: args.resume,
        tolerance: args.tolerance,
        max_iterations: args.max_iterations,
        starts: args.starts.get(),
        seed: args.seed,
        loss: args.loss.into(),
        profile: args.profile,
        interrupt: Some(interrupt::flag()),
        progress: &progress,
    })?;
    drop(progress);
    let document = write(&args.out, &result)?;
    args.common.give("fit", &words(&result), &document)?;
    Ok(if interrupt::has_come() {
        Exit::Interrupted
    } else if result.fit.is_converged() {
        Exit::Done
    } else {
        Exit::Stopped
    })
}

/// Writes a fit's residuals, their figure and `fit.json`; gives the body of the latter.
///
/// # Errors
/// A file that cannot be written.
pub fn write(out: &Path, result: &FitResult) -> anyhow::Result<Value> {
    let rows: Vec<Vec<f64>> = result.points.iter().map(row).collect();
    let columns = ["experiment", "t", "measured", "fitted", "residual"].map(str::to_owned);
    let table = (&columns[..], &rows[..]);
    picture::write(out, "residuals", &figure(result), table, false)?;
    let document = result.document();
    atomic_file::save(&out.join("fit.json"), json::document("fit", &document)?)?;
    Ok(document)
}

fn row(point: &Point) -> Vec<f64> {
    let Point {
        experiment,
        t,
        measured,
        fitted,
        residual,
        ..
    } = point;
    vec![*experiment as f64, *t, *measured, *fitted, *residual]
}

/// The result for people.
fn words(result: &FitResult) -> String {
    let percent = 100.0 * LEVEL;
    let interval = format!("{percent} % interval");
    let mut columns = vec![
        ("parameter", Align::Left),
        ("value", Align::Right),
        ("standard error", Align::Right),
        (interval.as_str(), Align::Right),
    ];
    let by_profile = !result.profiles.is_empty();
    if by_profile {
        columns.push(("by profile", Align::Right));
    }
    let mut table = Table::new(&columns);
    let intervals = result.uncertainty.intervals(LEVEL);
    for (j, name) in result.fit.names.iter().enumerate() {
        let held = if result.fit.at_bound[j] {
            " (at its bound)"
        } else {
            ""
        };
        let mut cells = vec![
            format!("{name}{held}"),
            format!("{:.6e}", result.fit.values[j]),
            format!("{:.2e}", result.uncertainty.standard_errors[j]),
            between(intervals[j].map(Some)),
        ];
        if by_profile {
            cells.push(between(result.profiles[j].interval));
        }
        table.row(cells.into_iter().map(Into::into));
    }
    let mut text = format!(
        "{} after {} iterations: {} runs, {} with sensitivities\n{}",
        result.ending(),
        result.fit.history.len(),
        result.runs[0],
        result.runs[1],
        table.render(coloured_stdout())
    );
    text += &format!(
        "residuals: standard deviation {:.3}{}\n",
        result.deviation(),
        if result.noise_is_known {
            " of the noise given; 1 if the model fits"
        } else {
            ""
        },
    );
    let unknown = result.unknown();
    for direction in &unknown {
        text += &format!(
            "not told by the data (a change this way, by the parameters' own size, is within the \
             noise): {}\n",
            result.in_words(direction)
        );
    }
    if !unknown.is_empty() {
        text += "keep one of these parameters fixed, or measure what tells them apart: another load, \
                 larger strains, another place\n";
    }
    text
}

/// An interval; a side that the data leave open is a dash.
fn between(interval: [Option<f64>; 2]) -> String {
    let [low, high] = interval.map(|end| match end {
        Some(end) if end.is_finite() => format!("{end:.4e}"),
        _ => "–".to_owned(),
    });
    format!("{low} … {high}")
}

/// Measurements with the fit, and below them the residuals.
fn figure(result: &FitResult) -> Figure {
    let mut names: Vec<(usize, &str)> = Vec::new();
    for point in &result.points {
        let name = (point.experiment, point.output.as_str());
        if !names.contains(&name) {
            names.push(name);
        }
    }
    let several = names.iter().any(|(experiment, _)| *experiment > 1);
    let panels = names.iter().map(|&(experiment, output)| {
        let of = || {
            let points = result.points.iter();
            points.filter(move |p| p.experiment == experiment && p.output == output)
        };
        let t: Vec<f64> = of().map(|p| p.t).collect();
        let measured: Vec<f64> = of().map(|p| p.measured).collect();
        let fitted: Vec<f64> = of().map(|p| p.fitted).collect();
        let plot = LinePlot {
            title: match several {
                true => format!("{output}, experiment {experiment}"),
                false => output.to_owned(),
            },
            x: Axis::new("t", "s"),
            series: vec![
                Series::curve("measured", &t, &measured).unjoined(),
                Series::curve("fitted", &t, &fitted),
            ],
            ..LinePlot::default()
        };
        Box::new(plot) as Box<dyn Panel>
    });
    let mut panels: Vec<Box<dyn Panel>> = panels.collect();
    let t: Vec<f64> = result.points.iter().map(|p| p.t).collect();
    let residuals: Vec<f64> = result.points.iter().map(|p| p.residual).collect();
    panels.push(Box::new(LinePlot {
        title: "residuals".to_owned(),
        x: Axis::new("t", "s"),
        series: vec![Series::curve("", &t, &residuals).unjoined()],
        ..LinePlot::default()
    }));
    Figure::column("Measurements and fit", panels)
}
