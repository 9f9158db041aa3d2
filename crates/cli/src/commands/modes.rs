//! `myovib modes`: the lowest eigenfrequencies and modes, compressible and incompressible.

use std::path::PathBuf;

use anyhow::Context;
use clap::Args;
use myovib_fem::Mesh;
use myovib_model::{Formulation, Muscle, Signal, paper, statics};
use myovib_report::modes;
use myovib_scene::modes::{BodyModes, Modes};
use myovib_scene::scene_file::DEFAULT_MODES;
use myovib_scene::vtu::{self, Grid};
use myovib_scene::watch::Watcher;
use myovib_scene::{Error, Scene, mesh_file};
use serde::Serialize;

use crate::args::CommonArgs;
use crate::exit::Exit;
use crate::output;
use crate::overrides;
use crate::progress::Progress;
use crate::values;

/// Options of `myovib modes`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    myovib modes\n  \
    myovib modes --count 6 --svg modes.svg\n  \
    myovib modes --kappa 1e6 --load 100 --json\n  \
    myovib modes cantilever --count 4\n  \
    myovib modes cook-static --set modes.preload_time=0")]
pub struct ModesArgs {
    /// Scene (TOML file or built-in name) whose body is analyzed about rest or, with `--set
    /// modes.preload_time=T`, about the equilibrium under its loads at time T [default: the paper's
    /// muscle, compressible and incompressible].
    #[arg(value_name = "SCENE", conflicts_with_all = ["mesh", "kappa", "load", "beta"])]
    pub scene: Option<PathBuf>,

    /// Change a value of the scene, for example solid.bulk_modulus=inf; may be repeated.
    #[arg(long, value_name = "KEY=VALUE", requires = "scene")]
    pub set: Vec<String>,

    /// Number of modes [default: the scene's, otherwise 10].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=200))]
    pub count: Option<u16>,

    /// Mesh (Gmsh) with the groups `fixed` and `load` [default: the built-in spindle].
    #[arg(long, value_name = "FILE")]
    pub mesh: Option<PathBuf>,

    /// Bulk modulus of the compressible muscle in Pa.
    #[arg(long, value_name = "X", default_value_t = paper::KAPPA, value_parser = values::positive)]
    pub kappa: f64,

    /// Linearize about the equilibrium under this constant traction (Pa, upward on `load`) instead
    /// of about rest.
    #[arg(long, value_name = "X", default_value_t = 0.0, value_parser = values::finite)]
    pub load: f64,

    /// Stiffness-proportional damping β in s, for the damping ratios.
    #[arg(long, value_name = "X", default_value_t = paper::BETA, value_parser = values::finite)]
    pub beta: f64,

    /// Draw the modes as SVG. Without a scene, these are the modes of the incompressible muscle.
    #[arg(long, value_name = "FILE", value_parser = values::output_file)]
    pub svg: Option<PathBuf>,

    /// Write the shapes of the modes, with φᵀ M φ = 1, as vector fields for ParaView (VTU). Without a scene, these are the
    /// modes of the incompressible muscle.
    #[arg(long, value_name = "FILE", value_parser = values::output_file)]
    pub vtu: Option<PathBuf>,

    #[command(flatten)]
    pub common: CommonArgs,
}

/// Computes, prints and draws the modes.
pub fn run(args: &ModesArgs) -> anyhow::Result<Exit> {
    let findings = match &args.scene {
        Some(scene) => {
            let count =
                args.count.map(|count| (overrides::change("modes.count", count), "--count"));
            let analysis = ("analysis=modes".to_owned(), "this command");
            overrides::expect_free(
                &args.set,
                &count.into_iter().chain([analysis]).collect::<Vec<_>>(),
            )?;
            let loaded = Scene::load(scene, &args.set)?;
            for note in loaded.notes() {
                output::note(&note);
            }
            let name = scene.display().to_string();
            let progress = Progress::new(args.common.quiet);
            let watcher = Watcher { progress: &progress, ..Watcher::NOBODY };
            of_scene(name, loaded, args.count.map(usize::from), watcher)?
        }
        None => of_the_paper(args)?,
    };
    if let (Some(path), Some(body), Some(muscle)) =
        (&args.svg, findings.modes.muscles.last(), findings.muscles.last())
    {
        output::save(path, modes::figure(muscle, body).render())?;
    }
    if let (Some(path), Some(of_body), Some(muscle)) =
        (&args.vtu, findings.modes.muscles.last(), findings.muscles.last())
    {
        let space = muscle.solid.space();
        let grid = Grid::new(space, &vec![0; space.n_elements()]);
        output::save(path, vtu::of_modes(space, &grid, of_body.modes.iter()))?;
    }
    for note in findings.modes.muscles.iter().flat_map(|body| &body.notes) {
        output::note(note);
    }
    let text = modes::text(&findings.modes);
    args.common.print_or_write("modes", &text, &findings)?;
    Ok(Exit::Done)
}

/// Computes the modes of the body of the `scene` called `name`. Returns the body of the JSON document and the numbers
/// for drawing: the coordinates of the nodes, followed by the mode shapes.
pub fn document(name: &str, scene: Scene) -> anyhow::Result<(String, Vec<f64>)> {
    let findings = of_scene(name.to_owned(), scene, None, Watcher::NOBODY)?;
    let points = findings.muscles.iter().map(|muscle| muscle.solid.space().coordinates());
    let shapes = findings.modes.all().map(|mode| &mode.shape[..]);
    let arrays: Vec<&[f64]> = points.chain(shapes).collect();
    Ok((serde_json::to_string(&findings)?, arrays.concat()))
}

/// Bodies that were examined, and their modes.
#[derive(Serialize)]
struct Findings {
    mesh: String,
    #[serde(flatten)]
    modes: Modes,
    #[serde(skip)]
    muscles: Vec<Muscle>,
}

/// Computes the modes of a scene's body.
fn of_scene(
    mesh: String,
    scene: Scene,
    count: Option<usize>,
    watcher: Watcher<'_>,
) -> anyhow::Result<Findings> {
    let modes = Modes::of_scene(&scene, count, watcher).map_err(Error::before_any_output)?;
    Ok(Findings { mesh, modes, muscles: scene.body.into_iter().map(|body| body.muscle).collect() })
}

/// Computes the modes of the paper's muscle under a constant load, compressible and incompressible.
fn of_the_paper(args: &ModesArgs) -> anyhow::Result<Findings> {
    let (mesh, mesh_name) = mesh_file::load_plane(args.mesh.as_deref())?;
    let found = |kappa: f64| find(&mesh, kappa, args).with_context(|| format!("κ = {kappa}"));
    let found = [found(args.kappa)?, found(f64::INFINITY)?];
    let (muscles, modes) = found.into_iter().unzip();
    Ok(Findings {
        mesh: mesh_name,
        modes: Modes {
            load: args.load,
            preload_time: (args.load != 0.0).then_some(0.0),
            alpha: paper::ALPHA,
            beta: args.beta,
            drive: Some(paper::LOAD_FREQUENCY),
            muscles: modes,
        },
        muscles,
    })
}

fn find(mesh: &Mesh, kappa: f64, args: &ModesArgs) -> anyhow::Result<(Muscle, BodyModes)> {
    let load = Signal::constant(args.load);
    let muscle = paper::muscle_with_load(mesh, paper::LAW, kappa, args.beta, load)?;
    let at = statics::equilibrium(&muscle, Formulation::Position, 0.0)?;
    let count = args.count.map_or(DEFAULT_MODES, usize::from);
    let modes = BodyModes::about(&muscle, &at, count)?;
    Ok((muscle, modes))
}
