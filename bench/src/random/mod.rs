//! `myovib-bench random`: random scenes against tighter runs by another method.
//!
//! A run that finishes must not be off by more than [`MOST`] times what its tolerance promises
//! ([`promise`], stated in the guide). The same seed gives the same scenes.

mod scenes;

use std::path::{Path, PathBuf};

use anyhow::Context;
use clap::Args;
use myovib_cli::args::CommonArgs;
use myovib_cli::exit::Exit;
use myovib_report::table::{Align, Table, coloured_stdout};
use myovib_scene::csv::Table as Csv;
use myovib_scene::run::{RunOptions, compute};
use myovib_scene::scene_file::integrator::Method;
use myovib_scene::{Scene, parallel};
use serde::Serialize;

use scenes::Drawn;

/// How many times its promise a finished run may be off.
const MOST: f64 = 20.0;

/// Options of `myovib-bench random`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    myovib-bench random --seed 1 --scenes 200 --out out/random\n  \
    myovib-bench random --seed 1 --only 17\n\n\
    Returns 1 when a finished run is off by more than 20 times what its tolerance promises.")]
pub(crate) struct RandomArgs {
    /// Seed of the scenes.
    #[arg(long, default_value_t = 1)]
    seed: u64,

    /// Number of scenes.
    #[arg(long, default_value_t = 200)]
    scenes: u64,

    /// One scene only, by its number.
    #[arg(long, value_name = "K")]
    only: Option<u64>,

    /// Folder for the scenes, their tables and runs.
    #[arg(long, value_name = "DIR", default_value = "out/random")]
    out: PathBuf,

    /// Options of every command.
    #[command(flatten)]
    common: CommonArgs,
}

/// What came of a scene.
#[derive(Debug, Serialize)]
struct Judged {
    number: u64,
    method: Method,
    formulation: String,
    rtol: f64,
    outcome: String,
    steps: u64,
    /// Periods of the motion, by its turning points.
    periods: f64,
    /// Largest error of the displacements, of the largest displacement.
    error: Option<f64>,
    /// Largest error of the pressure, of the largest pressure.
    error_of_pressure: Option<f64>,
    promised: f64,
}

impl Judged {
    /// How many times its promise the displacements are off.
    fn ratio(&self) -> Option<f64> {
        Some(self.error? / self.promised)
    }

    fn verdict(&self) -> &'static str {
        match self.ratio() {
            Some(ratio) if ratio > MOST => "WRONG",
            Some(_) => "ok",
            None if self.outcome == "finished" => "unverified",
            None => "stopped",
        }
    }
}

/// The relative error of displacements that a tolerance promises after some periods.
///
/// Radau IIA errs by about its tolerance a period. BDF of order 2 takes steps h with h³ in proportion
/// to the tolerance, and its phase errs by h² a period.
fn promise(method: Method, rtol: f64, periods: f64) -> f64 {
    let per_period = match method {
        Method::Bdf => rtol.powf(2.0 / 3.0),
        Method::Radau | Method::Radau9 | Method::Radau13 => rtol,
    };
    per_period * (1.0 + periods)
}

/// Draws the scenes, runs them, and judges each.
///
/// # Errors
/// When a scene cannot be built or written.
pub(crate) fn run(args: &RandomArgs) -> anyhow::Result<Exit> {
    let numbers: Vec<u64> = match args.only {
        Some(number) => vec![number],
        None => (1..=args.scenes).collect(),
    };
    let judged = parallel::map(&numbers, args.common.n_threads(), |&number| {
        let drawn = Drawn::new(args.seed, number);
        judge(&drawn, &args.out.join(format!("{number:04}")))
            .with_context(|| format!("scene {number} of seed {}", args.seed))
    });
    let judged = judged.into_iter().collect::<anyhow::Result<Vec<_>>>()?;
    args.common.give("random", &text(&judged), &judged)?;
    let wrong = judged.iter().any(|judged| judged.verdict() == "WRONG");
    Ok(if wrong { Exit::Differs } else { Exit::Done })
}

fn judge(drawn: &Drawn, folder: &Path) -> anyhow::Result<Judged> {
    drawn.write(folder)?;
    let integrate = |name: &str, set: &[String]| -> anyhow::Result<_> {
        let scene = Scene::load(&folder.join("scene.toml"), set)?;
        let out = folder.join(name);
        if out.exists() {
            std::fs::remove_dir_all(&out)?;
        }
        let result = compute(&scene, &RunOptions::into_folder(&out))?;
        let text = std::fs::read_to_string(out.join("tip.csv"))?;
        let table = Csv::parse(&text)?;
        let rows = table.rows.iter().filter_map(|row| table.numbers(row));
        Ok((result, rows.collect::<Vec<_>>()))
    };
    let (result, rows) = integrate("run", &[])?;
    let (trusted, exact) = integrate("trusted", &drawn.trusted())?;
    let outcome = |document: &serde_json::Value| match document["reason"].as_str() {
        None => "finished".to_owned(),
        Some(reason) => reason.to_owned(),
    };
    let finished = |document: &serde_json::Value| outcome(document) == "finished";
    let verified = finished(&result.document) && finished(&trusted.document);
    let periods = periods(&exact);
    Ok(Judged {
        number: drawn.number,
        method: drawn.method,
        formulation: drawn.formulation.to_owned(),
        rtol: drawn.rtol,
        outcome: outcome(&result.document),
        steps: result.document["steps"].as_u64().unwrap_or(0),
        periods,
        error: verified.then(|| error(&rows, &exact, &[1, 2])),
        error_of_pressure: (verified && exact[0].len() > 3).then(|| error(&rows, &exact, &[3])),
        promised: promise(drawn.method, drawn.rtol, periods),
    })
}

/// The largest difference in some columns, of the largest value in them.
fn error(rows: &[Vec<f64>], exact: &[Vec<f64>], columns: &[usize]) -> f64 {
    let pairs = || {
        let rows = rows.iter().zip(exact);
        rows.flat_map(|(a, b)| columns.iter().map(|&j| (a[j], b[j])))
    };
    let largest = pairs().fold(0.0, |m: f64, (_, b)| m.max(b.abs()));
    pairs().fold(0.0, |m: f64, (a, b)| m.max((a - b).abs())) / largest
}

/// Half the number of turning points of u_y.
fn periods(rows: &[Vec<f64>]) -> f64 {
    let differences = rows.windows(2).map(|pair| pair[1][2] - pair[0][2]);
    let moving: Vec<f64> = differences.filter(|d| *d != 0.0).collect();
    let turns = moving.windows(2).filter(|pair| pair[0] * pair[1] < 0.0);
    turns.count() as f64 / 2.0
}

fn text(judged: &[Judged]) -> String {
    use Align::{Left, Right};
    let mut table = Table::new(&[
        ("scene", Right),
        ("method", Left),
        ("formulation", Left),
        ("rtol", Right),
        ("periods", Right),
        ("steps", Right),
        ("error of u", Right),
        ("promised", Right),
        ("ratio", Right),
        ("error of p", Right),
        ("verdict", Left),
    ]);
    let number =
        |value: Option<f64>| value.map_or("–".to_owned(), |value| format!("{value:.1e}"));
    for one in judged {
        table.row([
            one.number.to_string().into(),
            one.method.kind().name().into(),
            one.formulation.clone().into(),
            format!("{:.0e}", one.rtol).into(),
            one.periods.to_string().into(),
            one.steps.to_string().into(),
            number(one.error).into(),
            number(Some(one.promised)).into(),
            one.ratio()
                .map_or("–".to_owned(), |r| format!("{r:.2}"))
                .into(),
            number(one.error_of_pressure).into(),
            match one.outcome.as_str() {
                "finished" => one.verdict().to_owned(),
                reason => format!("{}: {reason}", one.verdict()),
            }
            .into(),
        ]);
    }
    let count = |verdict: &str| judged.iter().filter(|j| j.verdict() == verdict).count();
    let ratios = judged.iter().filter_map(Judged::ratio);
    format!(
        "{}\n{} ok, {} wrong, {} unverified, {} stopped; largest ratio {:.1}\n",
        table.render(coloured_stdout()),
        count("ok"),
        count("WRONG"),
        count("unverified"),
        count("stopped"),
        ratios.fold(0.0, f64::max)
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Issue 15, acceptance 2, on a sample; `myovib-bench random` goes through 200 scenes.
    #[test]
    fn what_finishes_keeps_its_promise() {
        let folder = tempfile::tempdir().unwrap();
        let judge_one = |number| {
            let drawn = Drawn::new(1, number);
            judge(&drawn, &folder.path().join(number.to_string())).unwrap()
        };
        let judged: Vec<Judged> = [2, 4, 5, 6, 7, 12].map(judge_one).into();
        for one in &judged {
            assert_eq!(one.verdict(), "ok", "{one:?}");
        }
        // A loose run that pretends to be a tight one is found out.
        let pretended = Judged {
            promised: promise(Method::Radau, 1e-7, judged[0].periods),
            outcome: "finished".to_owned(),
            formulation: String::new(),
            ..judge_one(2)
        };
        assert_eq!(pretended.verdict(), "WRONG");
    }

    #[test]
    fn the_seed_decides_the_scene() {
        let (a, b) = (Drawn::new(1, 7), Drawn::new(1, 7));
        assert_eq!(a.text(), b.text());
        assert_ne!(a.text(), Drawn::new(2, 7).text());
        assert_ne!(a.text(), Drawn::new(1, 8).text());
    }
}
