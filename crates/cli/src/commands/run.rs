//! `myovib run`: computes a scene and writes the requested outputs.

use std::path::{Path, PathBuf};

use clap::Args;
use myovib_model::advice::Finding;
use myovib_model::check;
use myovib_report::table::{Align, Table, colored_stdout};
use myovib_report::{modes, page, periodic, response};
use myovib_scene::run::{Existing, RunOptions, VERIFY_MARGIN, compute};
use myovib_scene::scene_file::Analysis;
use myovib_scene::sensitivity::SceneParameter;
use myovib_scene::{Scene, plain};
use serde_json::{Map, Value};

use crate::args::CommonArgs;
use crate::exit::Exit;
use crate::interrupt;
use crate::output;
use crate::progress::Progress;
use crate::ranks;
use crate::values;

/// Options of `myovib run`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    myovib run scene.toml\n  \
    myovib run scene.toml --resume\n  \
    myovib run scene.toml --verify\n  \
    myovib run scene.toml --out soft --set 'material[0].c10=5e3' --set time.end=0.5\n  \
    mpirun -n 4 myovib run big.toml   (a program built with `--features mpi`)\n\n\
    Writes report.html, an overview for a browser; NAME.csv for each [[probe]] of the scene \
    (modes.csv with analysis = \"modes\"); fields.pvd for ParaView, if the scene has [fields]; run.json, the scene \
    with its defaults and all statistics; checkpoint.json for --resume; state.json, from which another scene can \
    start.\n\n\
    `myovib init` writes a scene to start from; `myovib check SCENE` inspects a scene before the run. An unknown name \
    lists the built-in scenes.")]
pub struct RunArgs {
    /// Scene: a TOML file or the name of a built-in scene.
    #[arg(value_name = "SCENE")]
    pub scene: PathBuf,

    /// Folder for the results; created if missing. It must not contain another run.
    #[arg(long, value_name = "DIR", default_value = "out", value_parser = values::output_folder)]
    pub out: PathBuf,

    /// Change a value of the scene, for example `solid.bulk_modulus=inf` or `material[0].c10=2e4`; `KEY=`
    /// restores the default. May be repeated.
    #[arg(long, value_name = "KEY=VALUE")]
    pub set: Vec<String>,

    /// Continue the run in the folder from its last checkpoint. A finished run continues to a later
    /// end time given by `--set time.end=…`.
    #[arg(long, conflicts_with = "overwrite")]
    pub resume: bool,

    /// Replace the run in the folder: all its files are removed first.
    #[arg(long)]
    pub overwrite: bool,

    /// Run the scene again with 30 to 300 times its tolerances, and estimate the time integration error of each probe
    /// from the difference.
    #[arg(long)]
    pub verify: bool,

    #[command(flatten)]
    pub common: CommonArgs,
}

pub fn run(args: &RunArgs) -> anyhow::Result<Exit> {
    let mut scene = load(&args.scene, &args.set)?;
    let file = scene.file();
    if file.analysis == Analysis::Static && file.solid.is_some() && file.fields.is_none() {
        output::note("no fields for pictures and movies: `--set fields.interval=1` writes them");
    }
    ranks::share(&mut scene)?;
    let request = Request {
        command: "run",
        out: &args.out,
        existing: Existing::of(args.resume, args.overwrite),
        verify: args.verify,
        common: &args.common,
    };
    request.compute(&scene)
}

/// Reads a scene, and prints its notes and warnings.
pub(super) fn load(path: &Path, set: &[String]) -> anyhow::Result<Scene> {
    let scene = Scene::load(path, set)?;
    SceneParameter::all(&scene)?;
    for note in scene.notes() {
        output::note(&note);
    }
    for finding in warnings(&scene) {
        output::warn(&finding.to_string());
    }
    Ok(scene)
}

/// Request to compute a scene and write the results to a folder.
pub(super) struct Request<'a> {
    pub(super) command: &'static str,
    pub(super) out: &'a Path,
    pub(super) existing: Existing,
    pub(super) verify: bool,
    pub(super) common: &'a CommonArgs,
}

impl Request<'_> {
    /// Computes the scene, writes the results and the report to the folder, and prints a summary.
    pub(super) fn compute(self, scene: &Scene) -> anyhow::Result<Exit> {
        let progress = Progress::new(self.common.quiet);
        let result = compute(
            scene,
            &RunOptions {
                out: self.out.to_owned(),
                existing: self.existing,
                // A computation of modes has no partial results that could be kept.
                interrupt: (scene.file().analysis != Analysis::Modes).then(interrupt::flag),
                progress: &progress,
                neighbor: None,
                verify: self.verify,
            },
        )?;
        drop(progress);
        for note in &result.notes {
            output::note(note);
        }
        page::write(self.out, scene, &result)?;
        let text = match (&result.modes, &result.response) {
            (Some(found), _) => modes::text(found),
            (_, Some(found)) => response::text(found),
            _ => match &result.periodic {
                Some(found) => periodic::text(found),
                None => text(&result.document),
            },
        };
        let text = format!(
            "{text}\nFull report: {}\n",
            plain(&self.out.join(page::NAME).display().to_string())
        );
        self.common.print_or_write(self.command, &text, &result.document)?;
        Ok(Exit::of(&result.outcome))
    }
}

/// Returns the warnings of `check`, except for warnings that are expensive to compute.
fn warnings(scene: &Scene) -> Vec<Finding> {
    let mut findings = match (&scene.body, scene.file().analysis) {
        (Some(body), Analysis::Dynamic) => {
            check::warnings(&body.muscle, body.formulation, &body.settings)
        }
        (Some(body), Analysis::Static) => check::static_warnings(&body.muscle, body.formulation),
        _ => Vec::new(),
    };
    findings.extend(scene.unusual());
    findings
}

/// Formats a value with only a few digits.
fn rounded(value: f64) -> String {
    match value.abs() {
        0.0 | 1e-3..1e6 => format!("{value:.3}"),
        _ => format!("{value:.1e}"),
    }
}

/// Threshold, relative to columns of the same kind, below which a column is considered to be rounding error. It is 1e6
/// times a rounding error of 1e-16, because ill-conditioned matrices may cause such errors.
const NOISE: f64 = 1e-10;

/// Returns the kind of a column. A column is compared with the columns of the same kind: the components of one vector,
/// or all stresses.
fn kind(column: &str) -> &str {
    match column.split('_').next().unwrap_or_default() {
        "principal" if column.starts_with("principal_strain") => "strain",
        "p" | "principal" | "von" | "tension" => "stress",
        name => name,
    }
}

/// Returns the largest value among all columns of the same kind. A column of very small values is compared with this
/// value; for example, u_x is compared with u_y, and the pressure with stresses.
fn size_of_kind(columns: &Map<String, Value>, of: &str) -> f64 {
    let alike = columns.iter().filter(|(column, _)| kind(column) == kind(of));
    let sizes = alike.filter_map(|(_, numbers)| numbers["largest"].as_f64());
    sizes.fold(0.0, f64::max)
}

/// Formats the estimated errors of the probes, if there are any.
fn errors(estimate: &Value) -> String {
    let Some(probes) = estimate["probes"].as_object() else {
        return String::new();
    };
    let mut table = Table::new(&[
        ("probe", Align::Left),
        ("column", Align::Left),
        ("largest", Align::Right),
        ("error", Align::Right),
        ("relative", Align::Right),
    ]);
    for (probe, columns) in probes {
        let Some(columns) = columns.as_object() else {
            continue;
        };
        for (column, numbers) in columns {
            let number =
                |key: &str| numbers[key].as_f64().map_or("–".to_owned(), |x| format!("{x:.1e}"));
            let largest = numbers["largest"].as_f64().unwrap_or(0.0);
            let error = numbers["error"].as_f64();
            let is_small = largest <= NOISE * size_of_kind(columns, column);
            table.row([
                plain(probe).into(),
                plain(column).into(),
                number("largest").into(),
                number("error").into(),
                match error {
                    None => "not comparable".into(),
                    Some(error) if error > 0.0 && is_small => "rounding".into(),
                    Some(_) => number("relative").into(),
                },
            ]);
        }
    }
    let cut = match estimate["outcome"].as_str() {
        Some("finished") => String::new(),
        _ => format!(
            " The second run ended at t = {:.3} s; the errors cover the time until then.",
            estimate["t_reached"].as_f64().unwrap_or(f64::NAN)
        ),
    };
    format!(
        "\nTime integration errors from a second run at rtol = {:.0e}; the true errors are at most \
         {VERIFY_MARGIN} times as large. The mesh error is not included.{cut}\n{}",
        estimate["rtol"].as_f64().unwrap_or(f64::NAN),
        table.render(colored_stdout())
    )
}

/// Formats the integrator's error estimates for the probes on one line.
fn indicator(probes: &Value) -> String {
    let probes = probes.as_object().into_iter().flatten();
    let worst = probes.filter_map(|(probe, columns)| {
        let columns = columns.as_object()?;
        let relative = columns.iter().filter_map(|(column, numbers)| {
            let relative = numbers["error"].as_f64()? / size_of_kind(columns, column);
            relative.is_finite().then_some((relative, probe, column))
        });
        relative.max_by(|a, b| a.0.total_cmp(&b.0))
    });
    match worst.max_by(|a, b| a.0.total_cmp(&b.0)) {
        None => String::new(),
        Some((relative, probe, column)) => format!(
            "\nTime integration errors, estimated from the steps: about {relative:.0e} of the largest value \
             (`{}` of `{}`); --verify measures them.\n",
            plain(column),
            plain(probe)
        ),
    }
}

/// Formats the outcome as text.
fn text(document: &Value) -> String {
    let mut table = Table::new(&[("run", Align::Left), ("", Align::Left)]);
    let range = |value: &Value| {
        let [smallest, largest] = [value.get(0)?.as_f64()?, value.get(1)?.as_f64()?];
        Some(format!("{smallest:.3} to {largest:.3}"))
    };
    let shown = |value: &Value| match value {
        Value::String(text) => text.clone(),
        Value::Number(number) if number.is_f64() => rounded(number.as_f64().unwrap_or_default()),
        other => other.to_string(),
    };
    for (key, label) in [
        ("outcome", "outcome"),
        ("formulation", "formulation"),
        ("index", "index"),
        ("unknowns", "unknowns"),
        ("t_reached", "t reached, s"),
        ("steps", "steps"),
        ("error_test_failures", "error-test failures"),
        ("step_solve_failures", "step-solve failures"),
        ("newton_iterations", "Newton iterations"),
        ("constraint_drift", "constraint drift"),
        ("volume_ratios", "det F at vertices"),
        ("cpu_seconds", "CPU, s"),
    ] {
        match &document[key] {
            Value::Null => {}
            value @ Value::Array(_) => {
                table.row([label.into(), range(value).unwrap_or_default().into()]);
            }
            value => table.row([label.into(), shown(value).into()]),
        }
    }
    let mut text = table.render(colored_stdout());
    text += &match &document["error_estimate"] {
        Value::Null => indicator(&document["error_indicator"]),
        estimate => errors(estimate),
    };
    // A long message would make the table too wide.
    if let Some(message) = document["message"].as_str() {
        text += &format!("\n{}\n", plain(message));
    }
    if document["reason"] == "interrupted" && document["analysis"] != "static" {
        text += "To continue from there, repeat the command with --resume.\n";
    }
    text
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    /// Regression: a pressure that was pure rounding error dominated the estimate with an error of 90 %.
    #[test]
    fn rounding_does_not_lead_the_estimate() {
        let column = |largest: f64, error: f64| json!({ "largest": largest, "error": error, "relative": error / largest });
        let probes = json!({ "av": {
            "u_x": column(1e-3, 2e-9),
            "p": column(1e-25, 9e-26),
            "stress_xy": column(10.0, 1e-6),
        } });
        let printed = indicator(&probes);
        assert!(printed.contains("about 2e-6") && printed.contains("`u_x`"), "{printed}");
        let estimate = json!({ "probes": probes, "outcome": "finished", "rtol": 1e-4 });
        let table = errors(&estimate);
        let pressure = table.lines().find(|line| line.contains(" p ")).expect("a row");
        assert!(pressure.contains("rounding"), "{table}");
        assert_eq!(table.matches("rounding").count(), 1, "{table}");
    }

    /// Regression: a column that had no value in either run was reported with an error of zero.
    #[test]
    fn a_column_that_cannot_be_compared_has_no_error() {
        let column = json!({ "largest": null, "error": null, "relative": null });
        let probes = json!({ "tip": { "phase": column } });
        assert_eq!(indicator(&probes), "");
        let table = errors(&json!({ "probes": probes, "outcome": "finished", "rtol": 1e-4 }));
        let row = table.lines().find(|line| line.contains("phase")).expect("a row");
        assert!(row.contains("not comparable") && !row.contains('0'), "{table}");
    }
}
