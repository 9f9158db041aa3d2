//! Integrators for rods and chains.

use myovib_dae::Problem;
use myovib_model::RodDae;
use myovib_model::coupling::{
    CoupledDae, CoupledOptions, ErrorTest, Multirate, NoBody, Oscillators, Source,
};

use super::{Boxed, Resumed, Starter, oscillators, tolerances};
use crate::Error;
use crate::scene::{DrivenChain, Scene};
use crate::scene_file::chain::Place;
use crate::scene_file::integrator::{IntegratorSettings, MaxOrder};

impl Starter<'_> {
    /// Starts a rod, with or without chains.
    pub(super) fn rod_and_chains(&self, rod: &RodDae) -> Result<Boxed<CoupledDae<RodDae>>, Error> {
        self.rod_with(rod, driven_by_rod(self.scene, rod)?, self.resumed(..))
    }

    /// Starts a rod with separately integrated chains.
    pub(super) fn rod_beside_chains(
        &self,
        rod: &RodDae,
    ) -> Result<Boxed<Multirate<CoupledDae<RodDae>>>, Error> {
        let n = rod.n_unknowns();
        let resumed = self.resumed(..n);
        let y = resumed.as_ref().map_or(vec![0.0; n], |own| own.y.to_vec());
        let alone = self.rod_with(rod, Vec::new(), resumed)?;
        self.beside((alone, y), driven_by_rod(self.scene, rod)?)
    }

    fn rod_with(
        &self,
        rod: &RodDae,
        chains: Vec<Oscillators>,
        resumed: Option<Resumed<'_>>,
    ) -> Result<Boxed<CoupledDae<RodDae>>, Error> {
        let test = ErrorTest::of_states(rod.n_unknowns(), tolerances(self.scene));
        let dae = CoupledDae::new(rod.clone(), chains);
        self.coupled(dae, (test, options(self.scene)), resumed, &[])
    }

    /// Starts chains without a body.
    pub(super) fn chains(
        &self,
        source: impl Fn() -> Source,
    ) -> Result<Boxed<CoupledDae<NoBody>>, Error> {
        let sources = |chain: &DrivenChain| Ok((0..chain.n_places()).map(|_| source()).collect());
        let dae = CoupledDae::new(NoBody, oscillators(self.scene, sources)?);
        let test = ErrorTest::of_states(0, tolerances(self.scene));
        self.coupled(dae, (test, options(self.scene)), self.resumed(..), &[])
    }
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
