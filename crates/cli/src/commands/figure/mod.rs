//! `myovib figure N` and `myovib figures`: the paper's figures, drawn from live runs.

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
use myovib_fem::Mesh;
use myovib_model::{IntegratorKind, paper};
use serde::Serialize;
use serde_json::{Map, Value};

use crate::args::CommonArgs;
use crate::exit::Exit;
use crate::experiments::{ChainArgs, Course, muscle_chain, rod_chain};
use crate::progress::Progress;
use crate::values;
use chain_plots::Chained;
pub(super) use chain_plots::{complex_plane, largest_radius};
pub(super) use deformation::frames;
pub(super) use deformed::Drawing;
pub(super) use last_period::{LastPeriod, PER_PERIOD};
pub(super) use mesh::fixed;
pub(super) use muscle_run::MuscleRun;
use myovib_scene::InputError;
use myovib_scene::mesh_file;

/// End time of the runs with the rod, s.
pub(super) const ROD_END: f64 = 200.0;
/// End time of the runs with the muscle, s.
pub(super) const MUSCLE_END: f64 = 50.0;

/// Options of `myovib figure`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    myovib figure 4\n  \
    myovib figure 3 --json\n  \
    myovib figure 3 --gamma 4000 --width 0.2 --seed 7\n  \
    myovib figure 7 --point 0.03,0.01 --png\n  \
    myovib figure 6 --out figures --json figure6.json\n\n\
    Writes figureN.svg, and figureN.csv with the numbers behind it.")]
pub struct FigureArgs {
    /// Number in the paper: 2 oscillators in the complex plane; 3 their radii over time; 4 mesh and
    /// boundary conditions; 5 the deformed muscle; 6 displacement and pressure in the origin;
    /// 7 coherence of the chain in the muscle.
    #[arg(value_parser = clap::value_parser!(u8).range(2..=7))]
    pub number: u8,

    /// Where the chain is driven: X on the rod [default: 0.05], X,Y in the muscle [default: 0,0].
    #[arg(
        long,
        value_name = "POINT",
        value_delimiter = ',',
        allow_negative_numbers = true
    )]
    pub point: Vec<f64>,

    /// What all figures can be told.
    #[command(flatten)]
    pub options: Options,
}

/// Options of `myovib figures`.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  myovib figures --out figures")]
pub struct FiguresArgs {
    /// What all figures can be told.
    #[command(flatten)]
    pub options: Options,
}

/// Options of one figure and of all.
#[derive(Debug, Args)]
pub struct Options {
    /// Folder to write to; made if there is none.
    #[arg(long, value_name = "DIR", default_value = "out", value_parser = values::output_folder)]
    pub out: PathBuf,

    /// Mesh (Gmsh 4.1 ASCII) with the groups `fixed` and `load` [default: the built-in spindle].
    #[arg(long, value_name = "FILE")]
    pub mesh: Option<PathBuf>,

    /// End time in s [default: 200 with the rod, 50 with the muscle].
    #[arg(long, value_name = "T")]
    pub t_end: Option<f64>,

    /// Integrator: `ida` (BDF), or Radau IIA of order 5, 9 or 13: `radau`, `radau9`, `radau13`
    /// [default: ida].
    #[arg(long, value_name = "NAME", value_parser = values::integrator)]
    pub integrator: Option<IntegratorKind>,

    /// Write each picture as PNG too.
    #[arg(long)]
    pub png: bool,

    /// Options of every command.
    #[command(flatten)]
    pub common: CommonArgs,

    /// The chain of Figures 2, 3 and 7.
    // Last, as its heading holds for all that follow.
    #[command(flatten)]
    pub chain: ChainArgs,
}

/// Draws one figure.
///
/// # Errors
/// Wrong options or mesh, or an output that cannot be written.
pub fn run(args: &FigureArgs) -> anyhow::Result<Exit> {
    args.check()?;
    draw(&[args.number], &args.point, &args.options, "figure")
}

/// Draws all figures.
///
/// # Errors
/// As [`run`].
pub fn run_all(args: &FiguresArgs) -> anyhow::Result<Exit> {
    draw(&[2, 3, 4, 5, 6, 7], &[], &args.options, "figures")
}

impl FigureArgs {
    /// Options that have nothing to say to this figure are refused.
    fn check(&self) -> Result<(), InputError> {
        let (number, options) = (self.number, &self.options);
        let chain = options.chain.given();
        let point = (!self.point.is_empty()).then_some("--point");
        let mesh = options.mesh.as_ref().map(|_| "--mesh");
        let t_end = options.t_end.map(|_| "--t-end");
        let integrator = options.integrator.map(|_| "--integrator");
        let (shows, beside) = match number {
            2 | 3 => ("a chain on a rod, which has no mesh", vec![mesh]),
            4 => ("the mesh", vec![chain, point, t_end, integrator]),
            5 | 6 => ("the muscle by itself", vec![chain, point]),
            _ => return Ok(()),
        };
        match beside.into_iter().flatten().next() {
            None => Ok(()),
            Some(option) => Err(InputError::new(format!(
                "the option has no meaning for Figure {number}, which shows {shows}"
            ))
            .at(option)
            .next("Figures 2 and 3 take chain and --point, 4 to 6 a mesh, 7 all of them")),
        }
    }
}

/// The runs behind the figures asked for, each made once.
struct Runs {
    /// Figures 2 and 3.
    rod: Option<Chained>,
    /// Figures 5 and 6.
    muscle: Option<MuscleRun>,
    /// Figure 7.
    muscle_chain: Option<Chained>,
}

impl Runs {
    /// Wrong options of any run are found before the first.
    fn compute(
        numbers: &[u8],
        point: &[f64],
        mesh: &Mesh,
        options: &Options,
    ) -> anyhow::Result<Self> {
        let wanted = |figures: &[u8]| figures.iter().any(|number| numbers.contains(number));
        let progress = Progress::new(options.common.quiet);
        let on_muscle = wanted(&[7])
            .then(|| anyhow::Ok((options.chain.setup(5, 0.5)?, muscle_point(point)?)))
            .transpose()?;
        let on_rod = wanted(&[2, 3])
            .then(|| anyhow::Ok((options.chain.setup(20, 0.05)?, rod_point(point)?)))
            .transpose()?;
        if wanted(&[5, 6, 7]) {
            // The mesh may lack a group.
            paper::muscle(mesh, paper::KAPPA, paper::BETA)?;
        }
        let course = |t_end: f64| Course {
            t_end: options.t_end.unwrap_or(t_end),
            integrator: options.integrator.unwrap_or_default(),
            progress: &progress,
        };
        let rod = on_rod.map(|(setup, x)| {
            let run = rod_chain(&setup, x, course(ROD_END))?;
            anyhow::Ok(Chained { setup, run })
        });
        let rod = rod.transpose()?;
        let muscle = wanted(&[5, 6])
            .then(|| MuscleRun::compute(mesh, course(MUSCLE_END)))
            .transpose()?;
        let muscle_chain = on_muscle.map(|(setup, point)| {
            let run = muscle_chain(mesh, &setup, point, course(MUSCLE_END))?;
            anyhow::Ok(Chained { setup, run })
        });
        Ok(Self {
            rod,
            muscle,
            muscle_chain: muscle_chain.transpose()?,
        })
    }
}

fn needed<T>(run: &Option<T>) -> anyhow::Result<&T> {
    run.as_ref()
        .context("the run behind this figure was not made")
}

pub(super) fn rod_point(point: &[f64]) -> Result<f64, InputError> {
    match point {
        [] => Ok(paper::ROD_POINT),
        [x] => Ok(*x),
        _ => Err(wrong_point("one coordinate on the rod, 0 ≤ x ≤ 0.1")),
    }
}

pub(super) fn muscle_point(point: &[f64]) -> Result<[f64; 2], InputError> {
    match point {
        [] => Ok([0.0, 0.0]),
        [x, y] => Ok([*x, *y]),
        _ => Err(wrong_point("two coordinates in the muscle, X,Y")),
    }
}

fn wrong_point(allowed: &str) -> InputError {
    InputError::new("wrong number of coordinates")
        .at("--point")
        .allowed(allowed)
}

#[derive(Serialize)]
struct Document<'a> {
    figures: Vec<Entry<'a>>,
}

#[derive(Serialize)]
struct Entry<'a> {
    number: u8,
    files: Vec<String>,
    #[serde(flatten)]
    findings: BTreeMap<&'a str, Value>,
    #[serde(flatten)]
    run: &'a Map<String, Value>,
}

fn draw(numbers: &[u8], point: &[f64], options: &Options, command: &str) -> anyhow::Result<Exit> {
    if let Some(t_end) = options.t_end.filter(|t| !(*t >= 1.0 && t.is_finite())) {
        // Before the load has risen there is nothing to see.
        return Err(InputError::new("value out of range")
            .at("--t-end")
            .found(format!("{t_end:e}"))
            .allowed("a finite number, 1 at least (s)")
            .into());
    }
    let (mesh, _) = mesh_file::load_plane(options.mesh.as_deref())?;
    let runs = Runs::compute(numbers, point, &mesh, options)?;
    let products = numbers
        .iter()
        .map(|&number| match number {
            2 => snapshots::draw(needed(&runs.rod)?),
            3 => radii::draw(needed(&runs.rod)?),
            5 => deformation::draw(needed(&runs.muscle)?),
            6 => origin::draw(needed(&runs.muscle)?),
            7 => muscle_coherence::draw(needed(&runs.muscle_chain)?),
            _ => mesh::draw(&mesh),
        })
        .collect::<anyhow::Result<Vec<_>>>()?;

    let mut text = String::new();
    let mut document = Document {
        figures: Vec::new(),
    };
    for product in &products {
        let files = product.write(&options.out, options.png)?;
        text += &product.summary(&files);
        document.figures.push(Entry {
            number: product.number,
            files,
            findings: product.findings.iter().cloned().collect(),
            run: &product.run,
        });
    }
    options.common.give(command, &text, &document)?;
    Ok(products
        .iter()
        .map(|product| product.exit)
        .find(|exit| *exit != Exit::Done)
        .unwrap_or(Exit::Done))
}
