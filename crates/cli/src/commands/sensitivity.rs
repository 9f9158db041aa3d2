//! `myovib sensitivity`: sensitivities of the outputs of a scene to its parameters.

use std::path::{Path, PathBuf};

use clap::Args;
use myovib_report::fit::axis;
use myovib_report::plot::{Figure, LinePlot, Panel, Series};
use myovib_report::table::{Align, Table, colored_stdout};
use myovib_report::{picture, stiffness_map};
use myovib_scene::result_folder::{Existing, FolderRequest, ResultFolder};
use myovib_scene::sensitivity::{Curves, Parameterized, Precision, StiffnessMap, compute};
use myovib_scene::watch::Watcher;
use myovib_scene::{Error, Scene, json};
use serde_json::Value;

use crate::args::CommonArgs;
use crate::exit::Exit;
use crate::interrupt;
use crate::progress::Progress;
use crate::values;

/// Name of the command and of its files.
const NAME: &str = "sensitivity";
const DOCUMENT: &str = "sensitivity.json";

/// Options of `myovib sensitivity`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    myovib sensitivity scene.toml\n  \
    myovib sensitivity scene.toml --out soft --set 'material[0].c10=5e3'\n  \
    myovib sensitivity scene.toml --map\n\n\
    The scene names its parameters in [[parameter]]. Writes sensitivity.csv with each output and its derivatives, \
    sensitivity.svg and sensitivity.json. With --map, no [[parameter]] is needed; writes stiffness.vtu for ParaView, \
    stiffness.svg and stiffness.json. Motions are integrated by Radau IIA (radau9 unless the scene selects another \
    method); a static analysis is differentiated at its load factors.")]
pub struct SensitivityArgs {
    /// Scene: a TOML file or the name of a built-in scene.
    #[arg(value_name = "SCENE")]
    pub scene: PathBuf,

    /// Change a value of the scene.
    #[arg(long, value_name = "KEY=VALUE")]
    pub set: Vec<String>,

    /// Compute a stiffness map instead: for each displacement or velocity, the influence of the
    /// stiffness at each position of the body, by the discrete adjoint.
    #[arg(long)]
    pub map: bool,

    /// Include the sensitivities in the error test.
    #[arg(long, conflicts_with = "map")]
    pub in_error_test: bool,

    /// Folder for the results; created if missing. It must not contain other results.
    #[arg(long, value_name = "DIR", default_value = "sensitivity", value_parser = values::output_folder)]
    pub out: PathBuf,

    /// Replace the results in the folder.
    #[arg(long)]
    pub overwrite: bool,

    #[command(flatten)]
    pub common: CommonArgs,
}

/// Computes the sensitivities.
pub fn run(args: &SensitivityArgs) -> anyhow::Result<Exit> {
    let progress = Progress::new(args.common.quiet);
    let watcher = Watcher { interrupt: Some(interrupt::flag()), progress: &progress };
    let existing = Existing::of(false, args.overwrite);
    let (schema, table, (files, document)) = if args.map {
        let scene = Scene::load(&args.scene, &args.set)?;
        let request = request_of_map(&args.out, existing, &scene)?;
        request.check()?;
        let map = StiffnessMap::of(&scene, watcher)?;
        let written = stiffness_map::write(&request.open()?, &map)?;
        (stiffness_map::SCHEMA, stiffness_map::text(&map), written)
    } else {
        let scene = Parameterized::load(&args.scene, &args.set)?;
        let request = request(&args.out, existing, &scene.scene)?;
        request.check()?;
        let precision = match args.in_error_test {
            true => Precision::Tested,
            false => Precision::OfMotion,
        };
        let curves = compute(&scene, precision, watcher)?;
        let written = write(&request.open()?, &curves)?;
        (NAME, table(&curves), written)
    };
    drop(progress);
    let text = format!("{table}{}\n", files.join(", "));
    args.common.print_or_write(schema, &text, &document)?;
    Ok(Exit::Done)
}

/// Returns the request to create or reuse the result folder of this command.
pub fn request<'a>(
    out: &'a Path,
    existing: Existing,
    scene: &'a Scene,
) -> Result<FolderRequest<'a>, Error> {
    let mut files = picture::names(NAME, false);
    files.push(DOCUMENT.to_owned());
    FolderRequest::of_scene(out, NAME, existing, scene, files)
}

/// Returns the request for the folder of a stiffness map.
pub fn request_of_map<'a>(
    out: &'a Path,
    existing: Existing,
    scene: &'a Scene,
) -> Result<FolderRequest<'a>, Error> {
    let files = stiffness_map::FILES.map(str::to_owned).to_vec();
    FolderRequest::of_scene(out, NAME, existing, scene, files)
}

/// Writes `sensitivity.csv`, its figure, and `sensitivity.json`. Returns the paths of the first two files and the body
/// of the JSON document.
pub fn write(folder: &ResultFolder, curves: &Curves) -> anyhow::Result<(Vec<String>, Value)> {
    let (columns, rows) = (curves.columns(), curves.rows());
    let table = (&columns[..], &rows[..]);
    let files = picture::write(folder, NAME, &figure(curves), table, false)?;
    let document = curves.document();
    folder.write(DOCUMENT, json::document(NAME, &document)?)?;
    Ok((files, document))
}

/// Formats a table that shows how important each parameter is for each output.
fn table(curves: &Curves) -> String {
    let parameters = curves.parameters.iter();
    let columns: Vec<_> = std::iter::once(("p · du/dp relative to u (rms)", Align::Left))
        .chain(parameters.map(|name| (name.as_str(), Align::Right)))
        .collect();
    let mut table = Table::new(&columns);
    for (output, row) in curves.outputs.iter().zip(curves.importance()) {
        let shown = row.into_iter().map(|share| match share.is_finite() {
            // Adding 0.0 removes the sign of a negative zero.
            true => format!("{:.3e}", share + 0.0),
            false => "–".to_owned(),
        });
        let cells = std::iter::once(output.clone()).chain(shown);
        table.row(cells.map(Into::into));
    }
    table.render(colored_stdout())
}

/// Draws a panel for each output, with a curve of p̄ ∂u/∂p for each parameter.
fn figure(curves: &Curves) -> Figure {
    let times: Vec<f64> = curves.samples.iter().map(|sample| sample.t).collect();
    let panel = |k: usize| {
        let series = curves.parameters.iter().enumerate().map(|(j, name)| {
            let scaled = curves.samples.iter().map(|s| curves.scales[j] * s.derivatives[j][k]);
            Series::curve(name, &times, &scaled.collect::<Vec<_>>())
        });
        let plot = LinePlot {
            title: format!("p ∂({})/∂p", curves.outputs[k]),
            x: axis(curves.abscissa),
            series: series.collect(),
            ..LinePlot::default()
        };
        Box::new(plot) as Box<dyn Panel>
    };
    let panels = (0..curves.outputs.len()).map(panel).collect();
    Figure::column("Sensitivities of the outputs", panels)
}
