//! Movie of waves at a stiff inclusion: the scene `hardening`, colored by the stress, which concentrates in the
//! inclusion.

use anyhow::Context;
use myovib_dae::Problem;
use myovib_fem::{Group, Space};
use myovib_model::{MuscleDae, Quantity, SampleTimes, Sampler};

use super::{Movie, MovieArgs};
use crate::commands::figure::{Drawing, LastPeriod, PER_PERIOD, fixed};
use crate::exit::Exit;
use crate::progress::Progress;
use crate::watched::run_watched;
use myovib_report::outline::outline;
use myovib_report::plot::mesh_plot::boundary;
use myovib_report::plot::{Axis, Color, EdgeGroup, Field, Figure};
use myovib_scene::vtu::Grid;
use myovib_scene::{Scene, run};

const SCENE: &str = "hardening";
/// Name of the group that contains the triangles of the inclusion.
const INCLUSION: &str = "hardened";

/// Nodal values at one point in time.
struct Shot {
    t: f64,
    displacement: Vec<[f64; 2]>,
    /// Von Mises stress, Pa.
    stress: Vec<f64>,
}

/// Makes a movie of the last cycle of the load before `to` (s), or before the end of the scene.
pub(super) fn film(args: &MovieArgs) -> anyhow::Result<Movie> {
    let scene = args.scene(SCENE, args.to)?;
    let body = scene.body.as_ref().context("the scene has no body")?;
    let space = body.muscle.solid.space();
    let inclusion = inclusion(space)?;

    let (shots, exit) = compute(&scene, &Progress::new(args.common.quiet))?;
    // The color range ends at the maximum inside the inclusion. Only values at the corners of the supports exceed it.
    let inside = |shot: &Shot| {
        let values = inclusion.iter().flatten().map(|&node| shot.stress[node]);
        values.fold(0.0, f64::max)
    };
    let axis = Axis::new("von Mises stress", "Pa");
    let axis = axis.between(0.0, shots.iter().map(inside).fold(0.0, f64::max));
    let outline = EdgeGroup {
        name: "stiffer inclusion".into(),
        edges: boundary(&inclusion),
        color: Color::VERMILION,
        arrows: None,
    };
    let displacements = shots.iter().map(|shot| &shot.displacement[..]);
    let drawing = Drawing::of(space, vec![fixed(space)?, outline], displacements);
    let frame = |shot: &Shot| {
        let field = Field { axis: axis.clone(), values: shot.stress.clone() };
        Figure::of("", drawing.panel(shot.t, &shot.displacement, field))
    };
    Ok(Movie { frames: shots.iter().map(frame).collect(), exit })
}

/// Returns the triangles of the inclusion.
fn inclusion(space: &Space) -> anyhow::Result<Vec<[usize; 6]>> {
    let Group::Elements(members) = space.mesh().group(INCLUSION)? else {
        anyhow::bail!("the group `{INCLUSION}` contains no triangles");
    };
    let triangles = outline(space).triangles;
    Ok(members.iter().map(|&member| triangles[member]).collect())
}

/// Runs the body and returns the last period of its load, with the exit code.
fn compute(scene: &Scene, progress: &Progress) -> anyhow::Result<(Vec<Shot>, Exit)> {
    let mut integrator = run::muscle_alone(scene)?;
    let unknowns = integrator.problem().n_unknowns();
    let frequency = integrator.problem().muscle().forcing_frequency();
    let frequency = frequency.context("the load has no period")?;

    let mut states = LastPeriod::new(1.0 / frequency);
    let times = SampleTimes::new(1.0 / frequency / PER_PERIOD, scene.t_end);
    let mut sampler = Sampler::new(times, unknowns, |_: &mut MuscleDae, t, y: &[f64]| {
        states.push(t, y.to_vec());
        Ok(())
    });
    let end = (SCENE, scene.t_end);
    let statistics = run_watched(&mut *integrator, &mut sampler, end, progress)?;
    drop(sampler);
    let dae = integrator.problem_mut();
    let shots = states.iter().map(|(t, y)| shot(dae, *t, y)).collect();
    Ok((shots, Exit::of(&statistics.outcome)))
}

fn shot(dae: &mut MuscleDae, t: f64, y: &[f64]) -> Shot {
    // The pressure rate is the only part of ẏ that affects the stress, and the von Mises stress does not depend on it.
    let snapshot = dae.snapshot(t, y, &[]);
    let space = snapshot.solid.space();
    let grid = Grid::new(space, &vec![0; space.n_elements()]);
    let stress = grid.values(&snapshot, Quantity::VonMises);
    Shot { t, displacement: snapshot.displacement.as_chunks().0.to_vec(), stress: stress.concat() }
}
