//! Derivatives of chains with respect to parameters of a scene.

use myovib_model::MuscleDae;
use myovib_model::coupling::Oscillators;
use myovib_model::sensitivity::ChainDependence;

use super::influence::{Influence, SceneParameter};
use super::parameters::{At, STEP};
use crate::Error;
use crate::run::start::driven_by;

impl At<'_> {
    /// Returns the dependence of the chain that each parameter affects. The entries are `None` for parameters of the body.
    pub(super) fn of_chains(&self) -> Result<Vec<Option<ChainDependence>>, Error> {
        let parameters = &self.scene.parameters;
        if !parameters.iter().any(SceneParameter::affects_chains) {
            return Ok(Vec::new());
        }
        let dae = MuscleDae::for_analysis(self.body.muscle.clone(), self.body.formulation);
        let one = |(j, known): (usize, &SceneParameter)| match known.chain() {
            None => Ok(None),
            Some(network) if known.influence == Influence::Start => {
                Ok(Some(ChainDependence::of_start(network)))
            }
            Some(network) => self.of_chain(j, network, &dae).map(Some),
        };
        parameters.iter().enumerate().map(one).collect()
    }

    fn of_chain(
        &self,
        j: usize,
        network: usize,
        dae: &MuscleDae,
    ) -> Result<ChainDependence, Error> {
        let (known, value) = (&self.scene.parameters[j], self.values[j]);
        let perturbed_chain = |value: f64| -> Result<Oscillators, Error> {
            let mut chains = driven_by(&self.scene_with(j, value)?, dae)?;
            Ok(chains.swap_remove(network))
        };
        if known.influence == Influence::Affine {
            let next = value + known.scale;
            let weight = 1.0 / (next - value);
            let chains = vec![(weight, perturbed_chain(next)?)];
            return Ok(ChainDependence::new(network, -weight, chains));
        }
        let (stencil, delta, chains) = self.around(j, STEP, perturbed_chain)?;
        let weights = stencil.points().iter().map(|(_, weight)| weight / delta);
        Ok(ChainDependence::new(network, 0.0, weights.zip(chains).collect()))
    }
}
