//! Derivatives of chains with respect to parameters of a scene.

use myovib_model::MuscleDae;
use myovib_model::coupling::Oscillators;
use myovib_model::sensitivity::ChainDependence;

use super::influence::{Influence, SceneParameter};
use super::parameters::{Parameterized, STEP, around, body};
use crate::Error;
use crate::run::start::driven_by;
use crate::scene::Scene;

impl Parameterized {
    /// Returns the dependence of the chain that each parameter affects, where `scene` is the scene at `values`. The
    /// entries are `None` for parameters of the body.
    pub(super) fn of_chains(
        &self,
        values: &[f64],
        scene: &Scene,
    ) -> Result<Vec<Option<ChainDependence>>, Error> {
        if !self.parameters.iter().any(SceneParameter::affects_chains) {
            return Ok(Vec::new());
        }
        let body = body(scene)?;
        let dae = MuscleDae::for_analysis(body.muscle.clone(), body.formulation);
        let one = |(j, known): (usize, &SceneParameter)| match known.chain() {
            None => Ok(None),
            Some(network) if known.influence == Influence::Start => {
                Ok(Some(ChainDependence::of_start(network)))
            }
            Some(network) => self.of_chain(j, network, values, &dae).map(Some),
        };
        self.parameters.iter().enumerate().map(one).collect()
    }

    fn of_chain(
        &self,
        j: usize,
        network: usize,
        values: &[f64],
        dae: &MuscleDae,
    ) -> Result<ChainDependence, Error> {
        let (known, value) = (&self.parameters[j], values[j]);
        let perturbed_chain = |value: f64| -> Result<Oscillators, Error> {
            let mut values = values.to_vec();
            values[j] = value;
            let mut chains = driven_by(&self.at(&values)?, dae)?;
            Ok(chains.swap_remove(network))
        };
        if known.influence == Influence::Affine {
            let next = value + known.scale;
            let weight = 1.0 / (next - value);
            let chains = vec![(weight, perturbed_chain(next)?)];
            return Ok(ChainDependence::new(network, -weight, chains));
        }
        let delta = known.step(STEP, value);
        let (stencil, chains) = around(value, delta, perturbed_chain)?;
        let weights = stencil.points().iter().map(|(_, weight)| weight / delta);
        Ok(ChainDependence::new(network, 0.0, weights.zip(chains).collect()))
    }
}
