//! A muscle in space that contracts under a vibration: the scene `muscle3d`, in the colours of its
//! displacement. The oscillators in it do not act on it and are left out.

use anyhow::Context;
use myovib_dae::Problem;
use myovib_model::{MuscleDae, SampleTimes, Sampler, start_at_rest};

use super::Movie;
use crate::exit::Exit;
use crate::experiments::run_watched;
use crate::progress::Progress;
use myovib_report::plot::{Axis, Figure};
use myovib_report::spatial::{displacement_plot, surroundings};
use myovib_scene::Scene;

/// Name of the scene.
const SCENE: &str = "muscle3d";
/// Time between frames, s: eight in a period of the vibration.
const EVERY: f64 = 1.0 / 64.0;

/// The motion up to `to` (s), or to the scene's own end.
pub(super) fn film(to: Option<f64>, quiet: bool) -> anyhow::Result<Movie> {
    let end = to.map(|to| format!("time.end={to:?}"));
    let scene = Scene::built_in(SCENE, end.as_slice())?;
    let body = scene.body.as_ref().context("the scene has no body")?;
    let dae = MuscleDae::new(body.muscle.clone(), body.formulation)?;
    let unknowns = dae.n_unknowns();
    let mut integrator = start_at_rest(dae, &body.settings)?;
    let mut shots: Vec<(f64, Vec<[f64; 3]>)> = Vec::new();
    let times = SampleTimes::new(EVERY, scene.t_end);
    let mut sampler = Sampler::new(times, unknowns, |dae: &mut MuscleDae, t, y: &[f64]| {
        let (displacement, _) = dae.nodal_motion(t, y);
        shots.push((t, displacement.as_chunks().0.to_vec()));
        Ok(())
    });
    let progress = Progress::new(quiet);
    let end = (SCENE, scene.t_end);
    let statistics = run_watched(&mut *integrator, &mut sampler, end, &progress)?;
    drop(sampler);

    let space = body.muscle.solid.space();
    let displacements = shots.iter().map(|(_, displacement)| &displacement[..]);
    let (around, largest) = surroundings(space, displacements);
    let frame = |(t, displacement): &(f64, Vec<[f64; 3]>)| {
        let mut plot = displacement_plot(space, displacement);
        plot.title = format!("*t* = {t:.3} s");
        plot.around = around.clone();
        plot.field = Some(Axis::new("|*u*|", "m").between(0.0, largest));
        Figure::of("", plot)
    };
    let frames = shots.iter().map(frame).collect();
    Ok(Movie::new(frames, Exit::of(&statistics.outcome)))
}
