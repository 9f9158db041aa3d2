//! `myovib modes`: the lowest eigenfrequencies and modes, compressible and incompressible.

use std::path::PathBuf;

use anyhow::Context;
use clap::Args;
use myovib_fem::Mesh;
use myovib_model::{Formulation, Muscle, Signal, paper, spectrum, statics, support};
use myovib_structure::Mode;
use serde::Serialize;

use crate::args::{self, CommonArgs};
use crate::exit::Exit;
use myovib_report::outline::outline;
use myovib_report::plot::{Axis, Figure, MeshPlot, Panel, SurfacePlot};
use myovib_report::spatial;
use myovib_report::table::{Align, Table, coloured_stdout, exponent, kappa};
use myovib_scene::InputError;
use myovib_scene::atomic_file;
use myovib_scene::json;
use myovib_scene::mesh_file;
use myovib_scene::{Body, Scene};

/// Modes where nothing says how many.
const DEFAULT_COUNT: usize = 10;
/// Largest displacement in a drawing as a fraction of the body's length.
const DRAWN: f64 = 0.06;

/// Options of `myovib modes`.
#[derive(Debug, Args)]
#[command(
    allow_negative_numbers = true,
    after_help = "Examples:\n  \
    myovib modes\n  \
    myovib modes --count 6 --svg modes.svg\n  \
    myovib modes --kappa 1e6 --load 100 --json\n  \
    myovib modes cantilever --count 4"
)]
pub struct ModesArgs {
    /// A scene whose body is looked at, about its unloaded state: a TOML file, or the name of a
    /// built-in scene [default: the paper's muscle, compressible and incompressible].
    #[arg(value_name = "SCENE", conflicts_with_all = ["mesh", "kappa", "load", "beta"])]
    pub scene: Option<PathBuf>,

    /// Change a value of the scene, as in solid.kappa=inf; may be repeated.
    #[arg(long, value_name = "KEY=VALUE", requires = "scene")]
    pub set: Vec<String>,

    /// Number of modes [default: the scene's, else 10].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=200))]
    pub count: Option<u16>,

    /// Mesh (Gmsh 4.1 ASCII) with the groups `fixed` and `load` [default: the built-in spindle].
    #[arg(long, value_name = "FILE")]
    pub mesh: Option<PathBuf>,

    /// Bulk modulus of the compressible muscle in Pa.
    #[arg(long, value_name = "X", default_value_t = paper::KAPPA)]
    pub kappa: f64,

    /// Linearise about the equilibrium under this constant traction (Pa, upwards on `load`), not
    /// about rest.
    #[arg(long, value_name = "X", default_value_t = 0.0)]
    pub load: f64,

    /// Stiffness-proportional damping β in s, for the damping ratios.
    #[arg(long, value_name = "X", default_value_t = paper::BETA)]
    pub beta: f64,

    /// Draw the modes, those of the incompressible muscle, as SVG.
    #[arg(long, value_name = "FILE", value_parser = args::output_file)]
    pub svg: Option<PathBuf>,

    /// Options of every command.
    #[command(flatten)]
    pub common: CommonArgs,
}

/// The modes of one body.
struct Found {
    muscle: Muscle,
    modes: Vec<Mode>,
}

/// The modes of all bodies that are looked at, and about which state.
struct Findings {
    mesh: String,
    /// Constant traction of the state linearised about, Pa.
    load: f64,
    /// α (1/s) and β (s), the same for all bodies.
    damping: [f64; 2],
    /// The frequency of the load, Hz, if it has one.
    drive: Option<f64>,
    bodies: Vec<Found>,
}

/// Finds, prints and draws the modes.
///
/// # Errors
/// Wrong options, mesh or scene, no equilibrium, or an output that cannot be written.
pub fn run(args: &ModesArgs) -> anyhow::Result<Exit> {
    let findings = match &args.scene {
        Some(scene) => {
            let loaded = Scene::load(scene, &args.set)?;
            of_scene(
                &scene.display().to_string(),
                loaded,
                args.count.map(usize::from),
            )?
        }
        None => of_the_paper(args)?,
    };
    if let (Some(path), Some(found)) = (&args.svg, findings.bodies.last()) {
        let drawing = figure(found).render();
        atomic_file::save(path, drawing)?;
    }
    for found in &findings.bodies {
        if let Some(free) = support::free_parts(&found.muscle) {
            eprintln!(
                "note: {} motions without strain, at 0 Hz: {free}",
                free.count
            );
        }
    }
    args.common
        .give("modes", &findings.text(), &findings.document())?;
    Ok(Exit::Done)
}

/// The modes of the body of the `scene` called `name`, as the body of the JSON document.
///
/// # Errors
/// A scene without a body, or one whose modes cannot be found.
pub fn document(name: &str, scene: Scene, count: Option<usize>) -> anyhow::Result<String> {
    let findings = of_scene(name, scene, count)?;
    Ok(serde_json::to_string(&findings.document())?)
}

/// The body of a scene, about its unloaded state.
fn of_scene(name: &str, loaded: Scene, count: Option<usize>) -> anyhow::Result<Findings> {
    let Some(Body { muscle, .. }) = loaded.body else {
        let error = InputError::new("the scene has no body whose modes could be found");
        return Err(error.allowed("a scene with a [mesh] and [solid]").into());
    };
    let wanted = loaded.file.modes.map_or(DEFAULT_COUNT, |modes| modes.count);
    let rest = vec![0.0; muscle.solid.dofs().n_free()];
    let pressure = vec![0.0; muscle.solid.space().n_pressures()];
    let count = count.unwrap_or(wanted);
    let modes = spectrum::lowest(&muscle, &rest, &pressure, count)?;
    Ok(Findings {
        mesh: name.to_owned(),
        load: 0.0,
        damping: [muscle.parameters.alpha, muscle.parameters.beta],
        drive: muscle.drive(),
        bodies: vec![Found { muscle, modes }],
    })
}

/// The paper's muscle under a constant load, compressible and incompressible.
fn of_the_paper(args: &ModesArgs) -> anyhow::Result<Findings> {
    if !args.load.is_finite() {
        let error = InputError::new("value out of range").at("--load");
        return Err(error.found(args.load).allowed("a finite number").into());
    }
    let (mesh, mesh_name) = mesh_file::load_plane(args.mesh.as_deref())?;
    let found = |kappa: f64| find(&mesh, kappa, args).with_context(|| format!("κ = {kappa}"));
    Ok(Findings {
        mesh: mesh_name,
        load: args.load,
        damping: [paper::ALPHA, args.beta],
        drive: Some(paper::LOAD_FREQUENCY),
        bodies: vec![found(args.kappa)?, found(f64::INFINITY)?],
    })
}

fn find(mesh: &Mesh, kappa: f64, args: &ModesArgs) -> anyhow::Result<Found> {
    let load = Signal::Constant(args.load);
    let muscle = paper::muscle_with_load(mesh, paper::LAW, kappa, args.beta, load)?;
    let at = statics::equilibrium(&muscle, Formulation::Position, 0.0)?;
    let count = args.count.map_or(DEFAULT_COUNT, usize::from);
    let modes = spectrum::lowest(&muscle, &at.displacement, &at.pressure, count)?;
    Ok(Found { muscle, modes })
}

/// A frequency in Hz; the rate of an instability is said to be one.
fn frequency(mode: &Mode) -> String {
    mode.frequency()
        .map_or("unstable".into(), |f| format!("{f:.3}"))
}

impl Findings {
    fn damping_ratio(&self, mode: &Mode) -> Option<f64> {
        let [alpha, beta] = self.damping;
        mode.damping_ratio(alpha, beta)
    }

    /// Headings of a body's columns.
    fn headings(&self, found: &Found) -> [String; 3] {
        let kappa = kappa(found.muscle.parameters.kappa());
        let drive = self.drive.map_or("load".into(), |f| format!("{f} Hz"));
        [
            format!("κ = {kappa}: f, Hz"),
            format!("f / {drive}"),
            "damping ratio".to_owned(),
        ]
    }

    /// A body's columns for mode `n`; empty where it has fewer.
    fn columns(&self, found: &Found, n: usize) -> [String; 3] {
        let Some(mode) = found.modes.get(n) else {
            return Default::default();
        };
        let dash = || "–".to_owned();
        let of_drive = mode.frequency().zip(self.drive).map(|(f, drive)| f / drive);
        [
            frequency(mode),
            of_drive.map_or_else(dash, |ratio| format!("{ratio:.2}")),
            self.damping_ratio(mode)
                .map_or_else(dash, |ratio| format!("{ratio:.4}")),
        ]
    }

    fn text(&self) -> String {
        let headings = self.bodies.iter().flat_map(|found| self.headings(found));
        let headings: Vec<String> = ["mode".to_owned()].into_iter().chain(headings).collect();
        let columns: Vec<_> = headings
            .iter()
            .map(|name| (name.as_str(), Align::Right))
            .collect();
        let mut table = Table::new(&columns);
        let n_modes = self.bodies.iter().map(|found| found.modes.len()).max();
        for n in 0..n_modes.unwrap_or(0) {
            let cells = self.bodies.iter().flat_map(|found| self.columns(found, n));
            let number = [(n + 1).to_string()];
            table.row(number.into_iter().chain(cells).map(Into::into));
        }
        let [alpha, beta] = self.damping;
        format!(
            "{}\ndamping ratio: (α/ω + βω)/2 with α = {alpha} 1/s, β = {} s; 1 is critical.\n",
            table.render(coloured_stdout()),
            exponent(beta)
        )
    }
}

/// The modes drawn two beside each other.
fn figure(found: &Found) -> Figure {
    let panels = found
        .modes
        .iter()
        .enumerate()
        .map(|(n, mode)| panel(&found.muscle, n, mode))
        .collect();
    Figure {
        n_columns: 2,
        width_mm: 170.0,
        ..Figure::column(
            match found.muscle.parameters.is_incompressible() {
                true => "Modes of the incompressible body",
                false => "Modes of the body",
            },
            panels,
        )
    }
}

fn panel(muscle: &Muscle, n: usize, mode: &Mode) -> Box<dyn Panel> {
    let (solid, space) = (&muscle.solid, muscle.solid.space());
    let dimension = space.dimension();
    let mut shape = vec![0.0; solid.dofs().n_full()];
    solid.dofs().expand(&mode.shape, &mut shape);
    let length = |u: &[f64]| u.iter().map(|x| x * x).sum::<f64>().sqrt();
    let largest = shape.chunks(dimension).map(length).fold(0.0, f64::max);
    let across = |axis: usize| {
        let x = space.coordinates().iter().skip(axis).step_by(dimension);
        let (low, high) = x.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &x| {
            (f64::min(low, x), f64::max(high, x))
        });
        high - low
    };
    // A mode has no size of its own: moved nodes, not a displacement with a scale to print.
    let scale = DRAWN * (0..dimension).map(across).fold(0.0, f64::max) / largest;
    shape.iter_mut().for_each(|u| *u *= scale);
    let title = format!("mode {}: {} Hz", n + 1, frequency(mode));
    if dimension == 3 {
        let shape = shape.as_chunks::<3>().0;
        return Box::new(SurfacePlot {
            title,
            field: Some(Axis::new("motion, of any size", "")),
            ..spatial::displacement_plot(space, shape)
        });
    }
    let moved = space.coordinates().iter().zip(&shape).map(|(x, u)| x + u);
    let moved: Vec<f64> = moved.collect();
    Box::new(MeshPlot {
        title,
        nodes: moved.as_chunks().0.to_vec(),
        ..outline(space)
    })
}

#[derive(Serialize)]
struct Document<'a> {
    mesh: &'a str,
    /// Constant traction of the state linearised about, Pa.
    load: f64,
    alpha: f64,
    beta: f64,
    /// Hz; null for loads without a frequency.
    drive: Option<f64>,
    muscles: Vec<MuscleJson>,
}

#[derive(Serialize)]
struct MuscleJson {
    #[serde(serialize_with = "json::kappa")]
    kappa: f64,
    modes: Vec<ModeJson>,
}

#[derive(Serialize)]
struct ModeJson {
    omega_squared: f64,
    /// Hz; null where the state is unstable.
    frequency: Option<f64>,
    damping_ratio: Option<f64>,
    residual: f64,
}

impl Findings {
    fn document(&self) -> Document<'_> {
        let [alpha, beta] = self.damping;
        Document {
            mesh: &self.mesh,
            load: self.load,
            alpha,
            beta,
            drive: self.drive,
            muscles: self.bodies.iter().map(|found| self.muscle(found)).collect(),
        }
    }

    fn muscle(&self, found: &Found) -> MuscleJson {
        let mode = |mode: &Mode| ModeJson {
            omega_squared: mode.omega_squared,
            frequency: mode.frequency(),
            damping_ratio: self.damping_ratio(mode),
            residual: mode.residual,
        };
        MuscleJson {
            kappa: found.muscle.parameters.kappa(),
            modes: found.modes.iter().map(mode).collect(),
        }
    }
}
