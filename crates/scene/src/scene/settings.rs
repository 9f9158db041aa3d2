//! Integrator settings of a scene.

use myovib_model::advice::Advice;
use myovib_model::coupling::Feedback;
use myovib_model::{
    AbsoluteTolerances, Field, Formulation, LinearSolverKind, MultiplierWeights, Muscle, Settings,
    TypicalValues, default_ordering,
};
use myovib_sparse::{Ordering, Precision};

use serde_json::Value;

use super::Start;
use super::builder::Builder;
use crate::InputError;
use crate::scene_file::integrator::{
    Block, ChainSteps, IntegratorSettings, MaxOrder, Method, MultiplierWeightsName, OrderingName,
    PrecisionName,
};
use crate::scene_file::{Analysis, SceneFile};

impl Builder<'_> {
    /// Returns the settings for `muscle` in `formulation`, which begins its motion from `start`.
    pub(super) fn settings(
        &self,
        wanted: &IntegratorSettings,
        muscle: &Muscle,
        start: &Start,
        formulation: Formulation,
        linear_solver: LinearSolverKind,
    ) -> Settings {
        let defaults = Settings::paper(formulation)
            .with_integrator(wanted.method.kind())
            .with_relative_tolerance(wanted.rtol);
        let at_start = match start {
            Start::State(state) => [state.largest_displacement(), state.largest_velocity()],
            Start::Rest | Start::Equilibrium => [0.0; 2],
        };
        let mut settings = Settings {
            t_end: self.t_end,
            absolute_tolerances: absolute_tolerances(wanted, muscle, self.t_end, at_start),
            suppressed: match &wanted.error_test.exclude {
                Some(blocks) => suppressed(blocks, formulation),
                None => defaults.suppressed,
            },
            multiplier_weights: match wanted.multiplier_weights {
                MultiplierWeightsName::Plain => MultiplierWeights::Plain,
                MultiplierWeightsName::StepScaled => MultiplierWeights::StepScaled,
            },
            max_order: wanted
                .max_order
                .and_then(MaxOrder::fixed)
                .unwrap_or(defaults.max_order),
            ordering: wanted
                .ordering
                .map_or(default_ordering(formulation, linear_solver), ordering),
            precision: match wanted.precision {
                PrecisionName::Auto => Precision::Auto,
                PrecisionName::Double => Precision::Double,
                PrecisionName::Mixed => Precision::Mixed,
            },
            linear_solver,
            btf: wanted.btf,
            initial_step: wanted.initial_step,
            max_step: wanted.max_step,
            projection_interval: wanted.projection_interval,
            ..defaults
        };
        if wanted.max_order == Some(MaxOrder::Auto) {
            settings.max_order = Advice::new(muscle, formulation, &settings).max_order();
        }
        settings
    }

    /// Rejects settings without effect for the method or for the integration of chains.
    pub(super) fn integrator(&self, file: &SceneFile) -> Result<(), InputError> {
        let wanted = &file.integrator;
        let weighted = wanted.multiplier_weights != MultiplierWeightsName::Plain;
        let given = [
            ("max_order", wanted.max_order.is_some()),
            ("multiplier_weights", weighted),
            ("projection_interval", wanted.projection_interval.is_some()),
        ];
        for (key, _) in given.into_iter().filter(|(_, given)| *given) {
            let path = format!("integrator.{key}");
            if wanted.method != Method::Bdf {
                let error = InputError::new(format!("Radau IIA has no `{key}`"))
                    .next(format!("remove `{key}`, or use method = \"bdf\""));
                return Err(self.wrong(&path, error));
            }
            let of_muscle = key != "max_order";
            if file.solid.is_none() && wanted.max_order == Some(MaxOrder::Auto) {
                let error =
                    InputError::new("`auto` requires a muscle, whose damping determines the order")
                        .next("set an order, 1 to 5, or remove `max_order`");
                return Err(self.wrong(&path, error));
            }
            if of_muscle && (file.solid.is_none() || !file.chain.is_empty()) {
                let error = InputError::new(format!("`{key}` requires a body without chains"))
                    .next(format!("remove `{key}`"));
                return Err(self.wrong(&path, error));
            }
        }
        Ok(())
    }

    /// Rejects separate steps of chains that act on the body or are not in the error test.
    pub(super) fn chain_steps(
        &self,
        file: &SceneFile,
        feedbacks: &[Feedback],
    ) -> Result<(), InputError> {
        let wanted = &file.integrator;
        let wrong = |message: &str| {
            let error = InputError::new(message.to_owned())
                .found("\"separate\"")
                .allowed("\"together\"")
                .next("remove `chains`");
            Err(self.wrong("integrator.chains", error))
        };
        match wanted.chains {
            ChainSteps::Together => Ok(()),
            ChainSteps::Separate if file.chain.is_empty() => wrong("the scene has no chains"),
            ChainSteps::Separate if file.solid.is_none() && file.rod.is_none() => {
                wrong("separate steps need a body or a rod that drives the chains")
            }
            ChainSteps::Separate if !feedbacks.is_empty() => {
                wrong("chains that act on the body need its steps")
            }
            ChainSteps::Separate if !wanted.oscillators.in_error_test => {
                wrong("separate steps need the oscillators in the error test")
            }
            ChainSteps::Separate => Ok(()),
        }
    }
}

/// Returns the given absolute tolerances, or those for loads up to `t_end` (s) and the largest displacement (m) and
/// velocity (m/s) at the start.
pub(crate) fn absolute_tolerances(
    wanted: &IntegratorSettings,
    muscle: &Muscle,
    t_end: f64,
    at_start: [f64; 2],
) -> AbsoluteTolerances {
    let typical = TypicalValues::of(muscle, t_end, at_start);
    let (atol, default) = (&wanted.atol, typical.tolerances(wanted.rtol));
    AbsoluteTolerances {
        displacement: atol.u.unwrap_or(default.displacement),
        velocity: atol.v.unwrap_or(default.velocity),
        pressure: atol.p.unwrap_or(default.pressure),
        multiplier: atol.p_rate.unwrap_or(default.multiplier),
    }
}

/// Reports limits of time integration in a scene without motion. Other settings are accepted
/// because the same scene may also be used for a motion.
pub(super) fn without_effect(analysis: Analysis, source: &Value) -> Option<String> {
    let given = source["integrator"].as_object()?.keys();
    let limits = given.filter(|key| ["max_cpu", "max_steps"].contains(&key.as_str()));
    let keys: Vec<&str> = limits.map(String::as_str).collect();
    (!analysis.is_in_time() && !keys.is_empty()).then(|| {
        format!(
            "[integrator]: the scene has no motion, which {} would limit",
            keys.join(", ")
        )
    })
}

/// Describes blocks to exclude from the error test that the formulation does not have.
pub(super) fn missing(wanted: &IntegratorSettings, formulation: Formulation) -> Vec<String> {
    let blocks = wanted.error_test.exclude.iter().flatten();
    let missing = blocks.filter(|block| !fields(**block).iter().any(|f| formulation.has(*f)));
    let words = missing.map(|block| {
        format!(
            "integrator.error_test.exclude: `{}` has no {}, which is ignored",
            formulation.name(),
            block.name()
        )
    });
    words.collect()
}

fn fields(block: Block) -> &'static [Field] {
    match block {
        Block::U => &[Field::Displacement],
        Block::V => &[Field::Velocity],
        Block::P => &[Field::Pressure],
        Block::PRate => &[Field::PressureRate, Field::GglMultiplier],
    }
}

fn suppressed(blocks: &[Block], formulation: Formulation) -> Vec<Field> {
    let fields = blocks.iter().flat_map(|block| fields(*block));
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene_file::integrator::ErrorTest;

    /// Regression: a block that the formulation does not have was ignored silently.
    #[test]
    fn blocks_that_the_formulation_lacks_are_reported() {
        let wanted = IntegratorSettings {
            error_test: ErrorTest {
                exclude: Some(vec![Block::P, Block::PRate]),
            },
            ..IntegratorSettings::default()
        };
        let printed = missing(&wanted, Formulation::Position);
        assert_eq!(printed.len(), 1);
        assert!(printed[0].contains("p_rate"), "{printed:?}");
        assert!(missing(&wanted, Formulation::Rate).is_empty());
    }

    /// Regression: time limits of an equilibrium were ignored silently.
    #[test]
    fn time_limits_of_equilibria_are_reported_as_without_effect() {
        let source = serde_json::json!({ "integrator": { "max_cpu": 1.0, "max_steps": 1 } });
        let printed = without_effect(Analysis::Static, &source).expect("two keys");
        assert!(
            printed.contains("max_cpu") && printed.contains("max_steps"),
            "{printed}"
        );
        assert_eq!(without_effect(Analysis::Dynamic, &source), None);
        assert_eq!(
            without_effect(Analysis::Static, &serde_json::json!({})),
            None
        );
    }
}
