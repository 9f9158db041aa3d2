//! The integrator's settings from a scene.

use myovib_model::{
    AbsoluteTolerances, Field, Formulation, MultiplierWeights, Settings, default_ordering,
};
use sundials_wrap::klu::Ordering;

use super::builder::Builder;
use crate::scene_file::integrator::{Block, Integrator, MultiplierWeightsName, OrderingName};

impl Builder<'_> {
    /// The settings for a muscle in `formulation`.
    pub(super) fn settings(&self, wanted: &Integrator, formulation: Formulation) -> Settings {
        let defaults = Settings::paper(formulation);
        let atol = &wanted.atol;
        Settings {
            integrator: wanted.method.kind(),
            t_end: self.t_end,
            relative_tolerance: wanted.rtol,
            absolute_tolerances: AbsoluteTolerances {
                displacement: atol.displacement,
                velocity: atol.velocity,
                pressure: atol.pressure,
                multiplier: atol.multiplier,
            },
            suppressed: match &wanted.suppress {
                Some(blocks) => suppressed(blocks, formulation),
                None => defaults.suppressed,
            },
            multiplier_weights: match wanted.multiplier_weights {
                MultiplierWeightsName::Plain => MultiplierWeights::Plain,
                MultiplierWeightsName::StepScaled => MultiplierWeights::StepScaled,
            },
            max_order: wanted
                .max_order
                .map_or(defaults.max_order, |order| order as u8),
            ordering: wanted
                .ordering
                .map_or(default_ordering(formulation), ordering),
            btf: wanted.btf,
            initial_step: wanted.initial_step,
            max_step: wanted.max_step,
            project_every: wanted.project_every,
            ..defaults
        }
    }
}

fn suppressed(blocks: &[Block], formulation: Formulation) -> Vec<Field> {
    let fields = blocks.iter().flat_map(|block| match block {
        Block::Pressure => [Field::Pressure].as_slice(),
        Block::Multiplier => &[Field::PressureRate, Field::GglMultiplier],
    });
    fields
        .copied()
        .filter(|field| formulation.has(*field))
        .collect()
}

fn ordering(name: OrderingName) -> Ordering {
    match name {
        OrderingName::Amd => Ordering::Amd,
        OrderingName::Colamd => Ordering::Colamd,
        OrderingName::Natural => Ordering::Natural,
    }
}
