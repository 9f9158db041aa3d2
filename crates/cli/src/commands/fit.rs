//! `myovib fit`: fits the parameters of a scene to measurements.

use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use myovib_report::fit::{describe, write};
use myovib_report::table::colored_stdout;
use myovib_scene::fit::{FitOptions, Loss, Outcome, compute};
use myovib_scene::run::Existing;

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
    The scene lists its parameters in [[parameter]] and the measured quantities in [[output]]. A data file is a table \
    with a column `t` (`f` for a response, `load` for a static analysis) and a column for each output, or with \
    PEtab's columns observableId, time, measurement and noiseParameters. Writes report.html, fit.json, residuals.csv, \
    residuals.svg and history.csv. The exit code is 3 if the fit does not converge, or if the residuals are more than \
    three times the given noise.")]
pub struct FitArgs {
    /// Scene: a TOML file or the name of a built-in scene.
    #[arg(value_name = "SCENE")]
    pub scene: PathBuf,

    /// File with the measurements of an experiment, followed by scene values that differ in this experiment; may be
    /// repeated. The file name may contain spaces and `=`. Write a name that starts with `-` as `./-NAME`.
    #[arg(long, value_name = "FILE [KEY=VALUE]...", required = true)]
    pub data: Vec<String>,

    /// Change a value of the scene in all experiments.
    #[arg(long, value_name = "KEY=VALUE")]
    pub set: Vec<String>,

    /// Folder for the results; created if missing. It must not contain a fit.
    #[arg(long, value_name = "DIR", default_value = "fit", value_parser = values::output_folder)]
    pub out: PathBuf,

    /// Continue the fit in the folder with the same arguments, without repeating its runs.
    #[arg(long, conflicts_with = "overwrite")]
    pub resume: bool,

    /// Replace the fit in the folder.
    #[arg(long)]
    pub overwrite: bool,

    /// Also compute intervals by profile likelihood: about ten fits per parameter.
    #[arg(long)]
    pub profile: bool,

    /// Loss function, which determines the weight of outliers.
    #[arg(long, value_enum, default_value_t)]
    pub loss: LossArg,

    /// Number of starting points. The first is taken from the scene; the others are drawn at random within the bounds
    /// (or between 0.5× and 2× the start). The best fit is kept.
    #[arg(long, value_name = "N", default_value = "1", value_parser = values::up_to::<10_000>)]
    pub starts: NonZeroUsize,

    /// Seed of the random starting points.
    #[arg(long, value_name = "SEED", default_value = "0")]
    pub seed: u64,

    /// The fit has converged when no parameter changes by more than this fraction of its value, or when the next step
    /// is below 1 % of the parameters' standard errors.
    #[arg(long, value_name = "FRACTION", default_value = "1e-5", value_parser = values::relative_tolerance)]
    pub tolerance: f64,

    /// Maximum iterations per phase, per starting point, and per profile point.
    #[arg(long, value_name = "N", default_value = "50", value_parser = values::up_to::<1_000_000>)]
    pub max_iterations: NonZeroUsize,

    #[command(flatten)]
    pub common: CommonArgs,
}

/// Loss functions. For normal noise, the two robust functions need 5 % more measurements than squares (Huber 1981;
/// Holland, Welsch 1977).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
pub enum LossArg {
    /// Least squares.
    #[default]
    Squares,
    /// Linear beyond 1.345 standard deviations.
    Huber,
    /// Logarithmic beyond 2.385 standard deviations.
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

/// Splits the value of `--data` into the file and its overrides. The overrides begin at a word that contains `=`. The
/// file is the longest beginning of the text that names an existing file. If no file exists, the overrides begin at the
/// first such word.
fn experiment(text: &str) -> (PathBuf, Vec<String>) {
    let text = text.trim();
    let is_start = |at: usize| at == 0 || text[..at].ends_with(char::is_whitespace);
    let word = |at: usize| text[at..].split(char::is_whitespace).next();
    let starts = text.char_indices().map(|(at, _)| at);
    let cuts: Vec<usize> = starts
        .filter(|&at| is_start(at) && word(at).is_some_and(|word| word.contains('=')))
        .chain([text.len()])
        .collect();
    let names_a_file = |at: &&usize| Path::new(text[..**at].trim_end()).exists();
    let cut = cuts.iter().rev().find(names_a_file).unwrap_or(&cuts[0]);
    let (file, overrides) = text.split_at(*cut);
    let overrides = overrides.split_whitespace().map(str::to_owned);
    (file.trim_end().into(), overrides.collect())
}

pub fn run(args: &FitArgs) -> anyhow::Result<Exit> {
    let progress = Progress::new(args.common.quiet);
    let result = compute(&FitOptions {
        scene: args.scene.clone(),
        set: args.set.clone(),
        experiments: args.data.iter().map(|text| experiment(text)).collect(),
        out: args.out.clone(),
        existing: Existing::of(args.resume, args.overwrite),
        tolerance: args.tolerance,
        max_iterations: args.max_iterations.get(),
        starts: args.starts.get(),
        seed: args.seed,
        loss: args.loss.into(),
        profile: args.profile,
        interrupt: Some(interrupt::flag()),
        progress: &progress,
    })?;
    drop(progress);
    let document = write(&args.out, &result)?;
    let text = describe(&result, colored_stdout());
    args.common.print_or_write("fit", &text, &document)?;
    Ok(match result.outcome() {
        _ if interrupt::is_interrupted() => Exit::Interrupted,
        Outcome::Converged => Exit::Done,
        _ => Exit::Stopped,
    })
}

#[cfg(test)]
mod tests {
    use super::experiment;

    #[test]
    fn file_names_may_contain_spaces_and_equals_signs() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| format!("{}/{name}", folder.path().display());
        for name in ["a=b.csv", "a b=c d.csv", "a b=c"] {
            std::fs::write(path(name), "").unwrap();
        }
        for (name, overrides) in [
            ("missing.csv", &[][..]),
            ("a=b.csv", &[]),
            ("a b=c d.csv", &[]),
            ("a=b.csv", &["k=1"]),
            ("a b=c", &["d=1", "l.m=2"]),
            ("my data/a b.csv", &["k=1"]),
        ] {
            let text = format!(" {}  {} ", path(name), overrides.join(" "));
            let (file, set) = experiment(&text);
            assert_eq!(file.to_str(), Some(&path(name)[..]));
            assert_eq!(set, overrides);
        }
    }
}
