//! `myovib modes`: the lowest eigenfrequencies and modes, compressible and incompressible.

use std::path::PathBuf;

use anyhow::Context;
use clap::Args;
use myovib_fem::Mesh;
use myovib_model::{Muscle, Signal, paper, spectrum, statics};
use myovib_structure::Mode;
use serde::Serialize;

use super::figure::outline;
use crate::args::{self, CommonArgs};
use crate::error::InputError;
use crate::exit::Exit;
use crate::plot::{Figure, MeshPlot, Panel};
use crate::report::{Align, Table, coloured_stdout};
use crate::{atomic_file, json, mesh_file};

/// Largest displacement in a drawing as a fraction of the body's length.
const DRAWN: f64 = 0.06;

/// Options of `myovib modes`.
#[derive(Debug, Args)]
#[command(
    allow_negative_numbers = true,
    after_help = "Examples:\n  \
    myovib modes\n  \
    myovib modes --count 6 --svg modes.svg\n  \
    myovib modes --kappa 1e6 --load 100 --json"
)]
pub struct ModesArgs {
    /// Number of modes.
    #[arg(long, value_name = "N", default_value_t = 10, value_parser = clap::value_parser!(u16).range(1..=200))]
    pub count: u16,

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

    /// Draw the incompressible modes as SVG.
    #[arg(long, value_name = "FILE", value_parser = args::output_file)]
    pub svg: Option<PathBuf>,

    /// Options of every command.
    #[command(flatten)]
    pub common: CommonArgs,
}

/// The modes for one κ.
struct Found {
    muscle: Muscle,
    modes: Vec<Mode>,
}

/// Finds, prints and draws the modes.
///
/// # Errors
/// Wrong options or mesh, no equilibrium, or an output that cannot be written.
pub fn run(args: &ModesArgs) -> anyhow::Result<Exit> {
    if !args.load.is_finite() {
        let error = InputError::new("value out of range").at("--load");
        return Err(error.found(args.load).allowed("a finite number").into());
    }
    let (mesh, mesh_name) = mesh_file::load(args.mesh.as_deref())?;
    let found = [args.kappa, f64::INFINITY]
        .map(|kappa| find(&mesh, kappa, args).with_context(|| format!("modes for κ = {kappa}")));
    let [soft, stiff] = found;
    let found = [soft?, stiff?];
    if let Some(path) = &args.svg {
        let drawing = figure(&found[1]).render();
        atomic_file::save(path, drawing)?;
    }
    let document = Document {
        mesh: &mesh_name,
        load: args.load,
        alpha: paper::ALPHA,
        beta: args.beta,
        drive: paper::LOAD_FREQUENCY,
        muscles: found.iter().map(|f| muscle_json(f, args.beta)).collect(),
    };
    args.common.give("modes", &text(&found, args), &document)?;
    Ok(Exit::Done)
}

fn find(mesh: &Mesh, kappa: f64, args: &ModesArgs) -> anyhow::Result<Found> {
    let load = Signal::Constant(args.load);
    let muscle = paper::muscle_with_load(mesh, paper::LAW, kappa, args.beta, load)?;
    let at = statics::equilibrium(&muscle, 0.0)?;
    let count = usize::from(args.count);
    let modes = spectrum::lowest(&muscle, &at.displacement, &at.pressure, count)?;
    Ok(Found { muscle, modes })
}

/// A frequency in Hz; the rate of an instability is said to be one.
fn frequency(mode: &Mode) -> String {
    mode.frequency()
        .map_or("unstable".into(), |f| format!("{f:.3}"))
}

fn damping(mode: &Mode, beta: f64) -> String {
    mode.damping_ratio(paper::ALPHA, beta)
        .map_or("–".into(), |ratio| format!("{ratio:.4}"))
}

fn text(found: &[Found; 2], args: &ModesArgs) -> String {
    use Align::Right;
    let [soft, stiff] = found;
    let soft_heading = format!("κ = {:e}: f, Hz", args.kappa);
    let mut table = Table::new(&[
        ("mode", Right),
        (&soft_heading, Right),
        ("f / 8 Hz", Right),
        ("damping ratio", Right),
        ("κ = ∞: f, Hz", Right),
        ("f / 8 Hz", Right),
        ("damping ratio", Right),
    ]);
    for (n, (a, b)) in soft.modes.iter().zip(&stiff.modes).enumerate() {
        let of_drive = |mode: &Mode| {
            mode.frequency().map_or("–".into(), |f| {
                format!("{:.2}", f / paper::LOAD_FREQUENCY)
            })
        };
        table.row([
            (n + 1).to_string().into(),
            frequency(a).into(),
            of_drive(a).into(),
            damping(a, args.beta).into(),
            frequency(b).into(),
            of_drive(b).into(),
            damping(b, args.beta).into(),
        ]);
    }
    let mut text = table.render(coloured_stdout());
    text.push_str(&format!(
        "\ndamping ratio: (α/ω + βω)/2 with α = {} 1/s, β = {:e} s; 1 is critical.\n",
        paper::ALPHA,
        args.beta
    ));
    text
}

/// The modes drawn two beside each other.
fn figure(found: &Found) -> Figure {
    let panels = found
        .modes
        .iter()
        .enumerate()
        .map(|(n, mode)| Box::new(panel(&found.muscle, n, mode)) as Box<dyn Panel>)
        .collect();
    Figure {
        n_columns: 2,
        width_mm: 170.0,
        ..Figure::column("Modes of the incompressible muscle", panels)
    }
}

fn panel(muscle: &Muscle, n: usize, mode: &Mode) -> MeshPlot {
    let (solid, space) = (&muscle.solid, muscle.solid.space());
    let mut shape = vec![0.0; solid.dofs().n_full()];
    solid.dofs().expand(&mode.shape, &mut shape);
    let largest = shape
        .chunks_exact(2)
        .map(|u| u[0].hypot(u[1]))
        .fold(0.0, f64::max);
    let across = |k: usize| {
        let x = space.node_points().iter().map(|point| point[k]);
        let (low, high) = x.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| {
            (low.min(x), high.max(x))
        });
        high - low
    };
    // A mode has no size of its own: moved nodes, not a displacement with a scale to print.
    let scale = DRAWN * across(0).max(across(1)) / largest;
    let nodes = space
        .node_points()
        .iter()
        .zip(shape.chunks_exact(2))
        .map(|(point, u)| [point[0] + scale * u[0], point[1] + scale * u[1]])
        .collect();
    MeshPlot {
        title: format!("mode {}: {} Hz", n + 1, frequency(mode)),
        nodes,
        ..outline(space)
    }
}

#[derive(Serialize)]
struct Document<'a> {
    mesh: &'a str,
    /// Constant traction of the state linearised about, Pa.
    load: f64,
    alpha: f64,
    beta: f64,
    /// Hz.
    drive: f64,
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

fn muscle_json(found: &Found, beta: f64) -> MuscleJson {
    MuscleJson {
        kappa: found.muscle.parameters.kappa(),
        modes: found
            .modes
            .iter()
            .map(|mode| ModeJson {
                omega_squared: mode.omega_squared,
                frequency: mode.frequency(),
                damping_ratio: mode.damping_ratio(paper::ALPHA, beta),
                residual: mode.residual,
            })
            .collect(),
    }
}
