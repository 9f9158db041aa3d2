//! Movie of a contracting muscle in 3D under a vibration: the scene `muscle3d`, colored by the displacement. The
//! oscillators, which do not act on the muscle, are shown next to it in the complex plane.

use anyhow::Context;
use myovib_dae::Problem;
use myovib_model::coupling::{CoherenceHistory, CoupledDae};
use myovib_model::{MuscleDae, SampleTimes, Sampler};

use super::{Movie, MovieArgs};
use crate::commands::figure::{complex_plane, largest_radius};
use crate::exit::Exit;
use crate::progress::Progress;
use crate::watched::run_watched;
use myovib_report::plot::{Axis, Figure};
use myovib_report::spatial::{displacement_plot, surroundings};
use myovib_scene::run::with_chains;

const SCENE: &str = "muscle3d";
/// Time between frames (s); there are eight frames per period of the vibration.
const EVERY: f64 = 1.0 / 64.0;
/// Width (mm) of the page that contains both panels.
const WIDTH: f64 = 120.0;

/// Makes a movie of the motion.
pub(super) fn film(args: &MovieArgs) -> anyhow::Result<Movie> {
    let scene = args.scene(SCENE, args.to)?;
    let body = scene.body.as_ref().context("the scene has no body")?;
    let mut integrator = with_chains(&scene)?;
    let unknowns = integrator.problem().n_unknowns();
    let mut history = CoherenceHistory::default();
    let mut displacements: Vec<Vec<[f64; 3]>> = Vec::new();
    let times = SampleTimes::new(EVERY, scene.t_end);
    let mut sampler =
        Sampler::new(times, unknowns, |dae: &mut CoupledDae<MuscleDae>, t, y: &[f64]| {
            let own = dae.body_range();
            let (displacement, _) = dae.body_mut().nodal_motion(t, &y[own]);
            displacements.push(displacement.as_chunks().0.to_vec());
            Ok(history.record(dae, 0, t, y)?)
        });
    let progress = Progress::new(args.common.quiet);
    let end = (SCENE, scene.t_end);
    let statistics = run_watched(&mut *integrator, &mut sampler, end, &progress)?;
    drop(sampler);

    let space = body.muscle.solid.space();
    let (around, largest) = surroundings(space, displacements.iter().map(|shot| &shot[..]));
    let radius = largest_radius(&history);
    let frame = |(i, displacement): (usize, &Vec<[f64; 3]>)| {
        let mut plot = displacement_plot(space, displacement);
        plot.around = around.clone();
        plot.field = Some(Axis::new("|*u*|", "m").between(0.0, largest));
        Figure {
            n_columns: 2,
            width_mm: WIDTH,
            ..Figure::column("", vec![Box::new(plot), Box::new(complex_plane(&history, i, radius))])
        }
    };
    let frames = displacements.iter().enumerate().map(frame).collect();
    Ok(Movie { frames, exit: Exit::of(&statistics.outcome) })
}
