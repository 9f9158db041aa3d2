//! Integrators for rods and chains.

use myovib_dae::Problem;
use myovib_model::coupling::{
    CoupledDae, CoupledOptions, ErrorTest, Multirate, NoBody, Oscillators, Source,
};
use myovib_model::{Integrator, RodDae};

use super::{Resumed, beside, coupled, oscillators, tolerances};
use crate::Error;
use crate::run::checkpoint::Checkpoint;
use crate::scene::{DrivenChain, Scene};
use crate::scene_file::chain::Place;
use crate::scene_file::integrator::{IntegratorSettings, MaxOrder};

/// Starts a rod, with or without chains.
pub(super) fn rod_and_chains(
    scene: &Scene,
    rod: &RodDae,
    checkpoint: Option<&Checkpoint>,
) -> Result<Box<dyn Integrator<CoupledDae<RodDae>>>, Error> {
    let resumed = checkpoint.map(|checkpoint| checkpoint.of(..));
    rod_with(scene, rod, driven_by_rod(scene, rod)?, resumed)
}

/// Starts a rod with separately integrated chains.
pub(super) fn rod_beside_chains(
    scene: &Scene,
    rod: &RodDae,
    checkpoint: Option<&Checkpoint>,
) -> Result<Box<dyn Integrator<Multirate<CoupledDae<RodDae>>>>, Error> {
    let n = rod.n_unknowns();
    let resumed = checkpoint.map(|checkpoint| checkpoint.of(..n));
    let y = resumed.as_ref().map_or(vec![0.0; n], |own| own.y.to_vec());
    let alone = rod_with(scene, rod, Vec::new(), resumed)?;
    beside(scene, (alone, y), driven_by_rod(scene, rod)?, checkpoint)
}

fn rod_with(
    scene: &Scene,
    rod: &RodDae,
    chains: Vec<Oscillators>,
    resumed: Option<Resumed<'_>>,
) -> Result<Box<dyn Integrator<CoupledDae<RodDae>>>, Error> {
    let test = ErrorTest::of_states(rod.n_unknowns(), tolerances(scene));
    let dae = CoupledDae::new(rod.clone(), chains);
    coupled(scene, dae, test, options(scene), resumed, &[])
}

/// Returns the chains of a scene, driven by the rod.
pub(in crate::run) fn driven_by_rod(
    scene: &Scene,
    rod: &RodDae,
) -> Result<Vec<Oscillators>, Error> {
    oscillators(scene, |chain| match &chain.at {
        Some(Place::Position(x)) => Ok(vec![Source::Body(rod.displacement_at(*x)?)]),
        _ => Ok(vec![Source::Rest]),
    })
}

pub(super) fn chains(
    scene: &Scene,
    checkpoint: Option<&Checkpoint>,
) -> Result<Box<dyn Integrator<CoupledDae<NoBody>>>, Error> {
    chains_on(scene, checkpoint, || Source::Rest)
}

pub(super) fn chains_on(
    scene: &Scene,
    checkpoint: Option<&Checkpoint>,
    source: impl Fn() -> Source,
) -> Result<Box<dyn Integrator<CoupledDae<NoBody>>>, Error> {
    let sources = |chain: &DrivenChain| Ok((0..chain.n_places()).map(|_| source()).collect());
    let dae = CoupledDae::new(NoBody, oscillators(scene, sources)?);
    let test = ErrorTest::of_states(0, tolerances(scene));
    let resumed = checkpoint.map(|checkpoint| checkpoint.of(..));
    coupled(scene, dae, test, options(scene), resumed, &[])
}

/// Returns the options for systems without a muscle. The pattern lists all keys, so that each new key must either be
/// used here or be reported as having no effect.
pub(in crate::run) fn options(scene: &Scene) -> CoupledOptions {
    let IntegratorSettings {
        method,
        max_order,
        steps,
        // These keys are used by the error test, the error estimate, and the run.
        rtol: _,
        oscillators: _,
        chains: _,
        max_steps: _,
        max_cpu: _,
        // These keys are rejected in scenes without a body.
        multiplier_weights: _,
        projection_interval: _,
        // These keys are reported as having no effect; see `ONLY_FOR_BODIES`.
        atol: _,
        error_test: _,
        precision: _,
        ordering: _,
        btf: _,
    } = &scene.file.integrator;
    let options = CoupledOptions::of_states(*method);
    let mut options = options.with_steps(*steps);
    if let Some(order) = max_order.and_then(MaxOrder::fixed) {
        options.ida.max_order = usize::from(order);
    }
    options
}
