//! `myovib figure N` and `myovib figures`: the paper's figures, drawn from new runs.

mod chain_plots;
mod deformation;
mod deformed;
mod last_period;
mod mesh;
mod muscle_coherence;
pub(super) mod muscle_run;
mod origin;
mod product;
mod radii;
mod snapshots;

use std::collections::BTreeMap;
use std::path::PathBuf;

use anyhow::Context;
use clap::Args;
use myovib_model::IntegratorKind;
use myovib_report::picture;
use myovib_scene::json::extend;
use myovib_scene::result_folder::FolderRequest;
use serde_json::json;

use crate::args::CommonArgs;
use crate::chains::{ChainRun, on_its_body};
use crate::exit::Exit;
use crate::overrides;
use crate::progress::Progress;
use crate::values;
pub(super) use chain_plots::{complex_plane, largest_radius};
pub(super) use deformation::frames;
pub(super) use deformed::Drawing;
pub(super) use last_period::{LastPeriod, PER_PERIOD};
pub(super) use mesh::fixed;
pub(super) use muscle_run::MuscleRun;
use myovib_scene::{InputError, Scene};

/// Options of `myovib figure`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    myovib figure 4\n  \
    myovib figure 3 --json\n  \
    myovib figure 3 --set chain[0].gain=4000 --set chain[0].frequency_spread=0.03 --set chain[0].seed=7\n  \
    myovib figure 7 --set 'chain[0].at=[0.03, 0.01]' --png\n  \
    myovib figure 6 --out figures --json=figure6.json\n\n\
    The figure shows a run of the built-in scene `figureN`. Writes figureN.svg, and figureN.csv\n\
    with the plotted data.")]
pub struct FigureArgs {
    /// Number of the figure in the paper: 2 (oscillators in the complex plane), 3 (their radii over time), 4 (mesh and
    /// boundary conditions), 5 (deformed muscle), 6 (displacement and pressure at the origin), or 7 (coherence of the
    /// chain in the muscle).
    #[arg(value_parser = clap::value_parser!(u8).range(2..=7))]
    pub number: u8,

    /// Change a value of the scene, for example `chain[0].gain=10`; may be repeated.
    #[arg(long, value_name = "KEY=VALUE")]
    pub set: Vec<String>,

    /// Options common to all figures.
    #[command(flatten)]
    pub options: Options,
}

/// Options of `myovib figures`.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  myovib figures --out figures")]
pub struct FiguresArgs {
    /// Options common to all figures.
    #[command(flatten)]
    pub options: Options,
}

/// Options common to `figure` and `figures`.
#[derive(Debug, Args)]
pub struct Options {
    /// Folder for the figures; created if missing.
    #[arg(long, value_name = "DIR", default_value = "figures", value_parser = values::output_folder)]
    pub out: PathBuf,

    /// Mesh (Gmsh) with the groups `fixed` and `load` [default: the built-in spindle].
    #[arg(long, value_name = "FILE")]
    pub mesh: Option<PathBuf>,

    /// End time in s [default: 200 with the rod, 50 with the muscle].
    #[arg(long, value_name = "T", value_parser = values::positive)]
    pub t_end: Option<f64>,

    /// Integrator: `bdf`, or Radau IIA of order 5, 9 or 13: `radau5`, `radau9`, `radau13`
    /// [default: bdf].
    #[arg(long, value_name = "NAME", value_parser = values::integrator)]
    pub integrator: Option<IntegratorKind>,

    /// Also write each picture as PNG.
    #[arg(long)]
    pub png: bool,

    #[command(flatten)]
    pub common: CommonArgs,
}

pub fn run(args: &FigureArgs) -> anyhow::Result<Exit> {
    args.check()?;
    draw(&[args.number], &args.set, &args.options, "figure")
}

pub fn run_all(args: &FiguresArgs) -> anyhow::Result<Exit> {
    draw(&[2, 3, 4, 5, 6, 7], &[], &args.options, "figures")
}

impl FigureArgs {
    /// Rejects options that have no effect on this figure.
    fn check(&self) -> Result<(), InputError> {
        let (number, options) = (self.number, &self.options);
        let mesh = options.mesh.as_ref().map(|_| "--mesh");
        let t_end = options.t_end.map(|_| "--t-end");
        let integrator = options.integrator.map(|_| "--integrator");
        let (shows, beside) = match number {
            2 | 3 => ("a chain on a rod, which has no mesh", vec![mesh]),
            4 => ("the mesh", vec![t_end, integrator]),
            _ => return Ok(()),
        };
        match beside.into_iter().flatten().next() {
            None => Ok(()),
            Some(option) => Err(InputError::new(format!(
                "the option has no effect on Figure {number}, which shows {shows}"
            ))
            .at(option)),
        }
    }
}

/// Runs from which the figures are drawn. Figures 2 and 3 share a run, as do Figures 5 and 6, because their scenes
/// differ only in the recorded values.
struct Runs {
    /// Figures 2 and 3.
    rod: Option<ChainRun>,
    /// Figure 4.
    mesh: Option<Scene>,
    /// Figures 5 and 6.
    muscle: Option<MuscleRun>,
    /// Figure 7.
    muscle_chain: Option<ChainRun>,
}

impl Runs {
    /// Computes the runs. Invalid options are reported before the first run starts.
    fn compute(numbers: &[u8], set: &[String], options: &Options) -> anyhow::Result<Self> {
        let scene = |figures: &[u8]| {
            let number = figures.iter().find(|number| numbers.contains(number));
            number.map(|number| options.scene(*number, set)).transpose()
        };
        let (rod, mesh, muscle) = (scene(&[3, 2])?, scene(&[4])?, scene(&[5, 6])?);
        let muscle_chain = scene(&[7])?;
        let progress = Progress::new(options.common.quiet);
        let chained = |scene: Option<Scene>| {
            let run = scene.map(|scene| on_its_body(scene, &progress));
            run.transpose()
        };
        Ok(Self {
            rod: chained(rod)?,
            mesh,
            muscle: muscle.map(|scene| MuscleRun::compute(scene, &progress)).transpose()?,
            muscle_chain: chained(muscle_chain)?,
        })
    }
}

impl Options {
    /// Returns the scene of a figure. Options that do not apply are ignored: the end time and the integrator for the
    /// figure of the mesh, and the mesh for figures of the rod.
    fn scene(&self, number: u8, set: &[String]) -> Result<Scene, InputError> {
        let (has_mesh, has_run) = (number > 3, number != 4);
        let mut changes = Vec::new();
        if has_run {
            changes.extend(self.t_end.map(overrides::end));
            changes.extend(self.integrator.into_iter().flat_map(overrides::integrator));
        }
        if has_mesh {
            changes.extend(self.mesh.as_deref().map(overrides::mesh));
        }
        changes.extend(set.iter().cloned());
        Scene::built_in(&format!("figure{number}"), &changes)
    }
}

fn needed<T>(run: &Option<T>) -> anyhow::Result<&T> {
    run.as_ref().context("the run for this figure has not been computed")
}

fn draw(numbers: &[u8], set: &[String], options: &Options, command: &str) -> anyhow::Result<Exit> {
    if let Some(t_end) = options.t_end.filter(|t| *t < 1.0) {
        // The deformation is invisible until the load has risen.
        return Err(InputError::new("value out of range")
            .at("--t-end")
            .found(format!("{t_end:e}"))
            .allowed("a finite number of at least 1 s")
            .into());
    }
    let names = numbers.iter().map(|&number| product::name(number));
    let files = names.flat_map(|name| picture::names(&name, options.png));
    let request = FolderRequest::to_add(&options.out, "figure", files.collect());
    request.check()?;
    let runs = Runs::compute(numbers, set, options)?;
    let products = numbers
        .iter()
        .map(|&number| match number {
            2 => snapshots::draw(needed(&runs.rod)?),
            3 => radii::draw(needed(&runs.rod)?),
            5 => deformation::draw(needed(&runs.muscle)?),
            6 => origin::draw(needed(&runs.muscle)?),
            7 => muscle_coherence::draw(needed(&runs.muscle_chain)?),
            _ => mesh::draw(needed(&runs.mesh)?),
        })
        .collect::<anyhow::Result<Vec<_>>>()?;

    let folder = request.open()?;
    let mut text = String::new();
    let mut figures = Vec::new();
    for product in &products {
        let files = product.write(&folder, options.png)?;
        text += &product.summary(&files);
        let findings: BTreeMap<_, _> = product.findings.iter().cloned().collect();
        let mut figure = product.run.clone();
        extend(&mut figure, json!(findings));
        extend(&mut figure, json!({ "number": product.number, "files": files }));
        figures.push(figure);
    }
    options.common.print_or_write(command, &text, &json!({ "figures": figures }))?;
    Ok(products
        .iter()
        .map(|product| product.exit)
        .find(|exit| *exit != Exit::Done)
        .unwrap_or(Exit::Done))
}

#[cfg(test)]
mod tests {
    use myovib_scene::Scene;
    use myovib_scene::scene_file::SceneFile;

    /// Returns the scene that a figure runs, without its recorded values.
    fn run(figure: &str) -> SceneFile {
        SceneFile {
            title: String::new(),
            probe: Vec::new(),
            fields: None,
            ..Scene::built_in(figure, &[]).unwrap().file().clone()
        }
    }

    #[test]
    fn figures_of_one_run_have_scenes_of_one_run() {
        assert_eq!(run("figure2"), run("figure3"));
        assert_eq!(run("figure5"), run("figure6"));
    }
}
