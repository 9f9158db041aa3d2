//! Eigenfrequencies and modes of bodies: table and drawings.

use myovib_model::{Muscle, support};
use myovib_scene::modes::{BodyModes, Mode, Modes};

use crate::outline::outline;
use crate::plot::{Axis, Figure, MeshPlot, Panel, SurfacePlot};
use crate::spatial;
use crate::table::{Align, Table, colored_stdout, kappa};

/// Largest displacement in the drawing of a mode, as a fraction of the body's length.
const DRAWN: f64 = 0.06;

/// Formats the frequency of a mode in Hz, or `unstable` if the mode has no frequency.
pub(crate) fn frequency(mode: &Mode) -> String {
    mode.frequency.map_or("unstable".into(), |f| format!("{f:.3}"))
}

fn headings(modes: &Modes, body: &BodyModes) -> [String; 3] {
    let drive = modes.drive.map_or("load".into(), |f| format!("{f} Hz"));
    [
        format!("κ = {}: f, Hz", kappa(body.kappa)),
        format!("f / {drive}"),
        "damping ratio".to_owned(),
    ]
}

/// Returns the table entries of a body for mode `n`; they are empty if the body has fewer modes.
fn columns(modes: &Modes, body: &BodyModes, n: usize) -> [String; 3] {
    let Some(mode) = body.modes.get(n) else {
        return Default::default();
    };
    let dash = || "–".to_owned();
    let of_drive = mode.frequency.zip(modes.drive).map(|(f, drive)| f / drive);
    [
        frequency(mode),
        of_drive.map_or_else(dash, |ratio| format!("{ratio:.2}")),
        mode.damping_ratio.map_or_else(dash, |ratio| format!("{ratio:.4}")),
    ]
}

/// Describes the state about which the modes are computed.
pub(crate) fn about(preload_time: Option<f64>) -> String {
    match preload_time {
        None => "about the unloaded state".to_owned(),
        Some(t) => format!("about the equilibrium under the loads at t = {t} s"),
    }
}

/// Returns the table of modes, in which the bodies are next to each other.
pub fn text(modes: &Modes) -> String {
    let bodies = &modes.muscles;
    let own = bodies.iter().flat_map(|body| headings(modes, body));
    let axes = match &bodies[..] {
        [BodyModes { modes, .. }] => modes.first().map_or(0, |mode| mode.effective_mass.len()),
        _ => 0,
    };
    let of_masses = ["m_x/m", "m_y/m", "m_z/m"].into_iter().take(axes).map(str::to_owned);
    let headings = ["mode".to_owned()].into_iter().chain(own).chain(of_masses);
    let headings: Vec<String> = headings.collect();
    let names: Vec<_> = headings.iter().map(|name| (name.as_str(), Align::Right)).collect();
    let mut table = Table::new(&names);
    let n_modes = bodies.iter().map(|body| body.modes.len()).max();
    for n in 0..n_modes.unwrap_or(0) {
        let cells = bodies.iter().flat_map(|body| columns(modes, body, n));
        let number = [(n + 1).to_string()];
        let masses = bodies.iter().take(axes.min(1)).flat_map(|body| {
            let mode = body.modes.get(n).into_iter();
            mode.flat_map(|mode| {
                mode.effective_mass.iter().map(|m| format!("{:.4}", m / body.mass))
            })
        });
        table.row(number.into_iter().chain(cells).chain(masses).map(Into::into));
    }
    let masses = match axes {
        0 => "",
        _ => "m_x/m: effective mass of translations along x, relative to the mass of the body.\n",
    };
    format!(
        "{}\nModes {}.\n\
         damping ratio: from α, β, viscosity and foundations, without Prony terms; 1 is critical.\n{masses}",
        table.render(colored_stdout()),
        about(modes.preload_time),
    )
}

/// Draws the modes of a body in two columns.
pub fn figure(muscle: &Muscle, body: &BodyModes) -> Figure {
    let modes = body.modes.iter().enumerate();
    let panels = modes.map(|(n, mode)| panel(muscle, n, mode)).collect();
    Figure {
        n_columns: 2,
        width_mm: 170.0,
        ..Figure::column(
            match muscle.parameters.is_incompressible() {
                true => "Modes of the incompressible body",
                false => "Modes of the body",
            },
            panels,
        )
    }
}

/// Returns the displacement of all nodes in a mode. It is scaled so that the largest displacement is a fraction of the
/// body's length.
pub(crate) fn shape(muscle: &Muscle, mode: &Mode) -> Vec<f64> {
    let dimension = muscle.solid.space().dimension();
    let mut shape = mode.shape.clone();
    let length = |u: &[f64]| u.iter().map(|x| x * x).sum::<f64>().sqrt();
    let largest = shape.chunks(dimension).map(length).fold(0.0, f64::max);
    let scale = DRAWN * support::extent(muscle) / largest;
    shape.iter_mut().for_each(|u| *u *= scale);
    shape
}

fn panel(muscle: &Muscle, n: usize, mode: &Mode) -> Box<dyn Panel> {
    let space = muscle.solid.space();
    let shape = shape(muscle, mode);
    let title = format!("mode {}: {} Hz", n + 1, frequency(mode));
    if space.dimension() == 3 {
        let shape = shape.as_chunks::<3>().0;
        return Box::new(SurfacePlot {
            title,
            field: Some(Axis::new("motion (arbitrary scale)", "")),
            ..spatial::displacement_plot(space, shape)
        });
    }
    let moved = space.coordinates().iter().zip(&shape).map(|(x, u)| x + u);
    let moved: Vec<f64> = moved.collect();
    Box::new(MeshPlot { title, nodes: moved.as_chunks().0.to_vec(), ..outline(space) })
}
