//! `myovib figure N` and `myovib figures`: the paper's figures, drawn from live runs.

mod deformation;
mod mesh;
mod muscle_run;
mod origin;
mod product;

use std::collections::BTreeMap;
use std::fs;
use std::path::PathBuf;

use anyhow::Context;
use clap::Args;
use serde::Serialize;
use serde_json::{Map, Value};

use crate::args::CommonArgs;
use crate::error::InputError;
use crate::exit::Exit;
use crate::mesh_file;
use muscle_run::MuscleRun;

/// Options of `myovib figure`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    myovib figure 4\n  \
    myovib figure 6 --out figures --json figure6.json\n\n\
    Writes figureN.svg, and figureN.csv with the numbers behind it.")]
pub struct FigureArgs {
    /// Number in the paper: 4 mesh and boundary conditions; 5 the deformed muscle; 6 displacement
    /// and pressure in the origin.
    #[arg(value_parser = clap::value_parser!(u8).range(4..=6))]
    pub number: u8,

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
    #[arg(long, value_name = "DIR", default_value = "out")]
    pub out: PathBuf,

    /// Mesh (Gmsh 4.1 ASCII) with the groups `fixed` and `load` [default: the built-in spindle].
    #[arg(long, value_name = "FILE")]
    pub mesh: Option<PathBuf>,

    /// End time in s.
    #[arg(long, value_name = "T", default_value_t = 50.0)]
    pub t_end: f64,

    /// Options of every command.
    #[command(flatten)]
    pub common: CommonArgs,
}

/// Draws one figure.
///
/// # Errors
/// Wrong options or mesh, or an output that cannot be written.
pub fn run(args: &FigureArgs) -> anyhow::Result<Exit> {
    draw(&[args.number], &args.options, "figure")
}

/// Draws all figures.
///
/// # Errors
/// As [`run`].
pub fn run_all(args: &FiguresArgs) -> anyhow::Result<Exit> {
    draw(&[4, 5, 6], &args.options, "figures")
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

fn draw(numbers: &[u8], options: &Options, command: &str) -> anyhow::Result<Exit> {
    if !(options.t_end >= 1.0 && options.t_end.is_finite()) {
        // Before the load has risen there is nothing to see.
        return Err(InputError::new("value out of range")
            .at("--t-end")
            .found(options.t_end)
            .allowed("a finite number, 1 at least (s)")
            .into());
    }
    options.common.check()?;
    let (mesh, _) = mesh_file::load(options.mesh.as_deref())?;
    fs::create_dir_all(&options.out)
        .with_context(|| format!("cannot make the folder `{}`", options.out.display()))?;

    // Figures 5 and 6 show one run.
    let needs_run = numbers.iter().any(|number| [5, 6].contains(number));
    let muscle_run =
        needs_run.then(|| MuscleRun::compute(&mesh, options.t_end, options.common.quiet));
    let muscle_run = muscle_run.transpose()?;
    let mut products = Vec::new();
    for &number in numbers {
        products.push(match (number, &muscle_run) {
            (5, Some(run)) => deformation::draw(run)?,
            (6, Some(run)) => origin::draw(run)?,
            _ => mesh::draw(&mesh)?,
        });
    }

    let mut text = String::new();
    let mut document = Document {
        figures: Vec::new(),
    };
    for product in &products {
        let files = product.write(&options.out)?;
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
