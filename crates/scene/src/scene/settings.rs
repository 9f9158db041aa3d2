//! Integrator settings of a scene.

use myovib_model::advice::Advice;
use myovib_model::coupling::Feedback;
use myovib_model::{
    AbsoluteTolerances, Field, Formulation, IntegratorKind, LinearSolverKind, MultiplierWeights,
    Muscle, Settings, TypicalStart, TypicalValues, default_ordering,
};
use myovib_sparse::{Ordering, Precision};

use serde_json::Value;

use super::builder::Builder;
use super::{Body, Start};
use crate::InputError;
use crate::scene_file::SceneFile;
use crate::scene_file::integrator::{
    Block, ChainSteps, IntegratorSettings, MaxOrder, OrderingName, PrecisionName,
};

impl Builder<'_> {
    /// Returns the settings for the motion of `muscle` in `formulation` from the given `start`.
    pub(super) fn settings(
        &self,
        muscle: &Muscle,
        start: &Start,
        formulation: Formulation,
        linear_solver: LinearSolverKind,
    ) -> Settings {
        let wanted = &self.file.integrator;
        let defaults = Settings::paper(formulation)
            .with_integrator(wanted.method)
            .with_relative_tolerance(wanted.rtol);
        let at_start = match start {
            Start::State(state) => {
                TypicalStart::At([state.largest_displacement(), state.largest_velocity()])
            }
            Start::Rest => TypicalStart::At([0.0; 2]),
            Start::Equilibrium => TypicalStart::Equilibrium,
        };
        let mut settings = Settings {
            t_end: self.t_end,
            absolute_tolerances: absolute_tolerances(wanted, muscle, self.t_end, at_start),
            suppressed: match &wanted.error_test.exclude {
                Some(blocks) => suppressed(blocks, formulation),
                None => defaults.suppressed,
            },
            multiplier_weights: wanted.multiplier_weights,
            max_order: wanted.max_order.and_then(MaxOrder::fixed).unwrap_or(defaults.max_order),
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
            steps: wanted.steps,
            projection_interval: wanted.projection_interval,
            ..defaults
        };
        if wanted.max_order == Some(MaxOrder::Auto) {
            settings.max_order = Advice::new(muscle, formulation, &settings).max_order();
        }
        settings
    }

    /// Rejects settings that have no effect with the chosen method or with the chosen integration of chains.
    pub(super) fn integrator(&self) -> Result<(), InputError> {
        let wanted = &self.file.integrator;
        let weighted = wanted.multiplier_weights != MultiplierWeights::Plain;
        let given = [
            ("max_order", wanted.max_order.is_some()),
            ("multiplier_weights", weighted),
            ("projection_interval", wanted.projection_interval.is_some()),
        ];
        for (key, _) in given.into_iter().filter(|(_, given)| *given) {
            let path = format!("integrator.{key}");
            if wanted.method != IntegratorKind::Bdf {
                let error = InputError::new(format!("Radau IIA has no `{key}`"))
                    .next(format!("remove `{key}`, or use method = \"bdf\""));
                return Err(self.wrong(&path, error));
            }
            let of_muscle = key != "max_order";
            if self.file.solid.is_none() && wanted.max_order == Some(MaxOrder::Auto) {
                let error =
                    InputError::new("`auto` requires a body, whose damping determines the order")
                        .next("set an order, 1 to 5, or remove `max_order`");
                return Err(self.wrong(&path, error));
            }
            if of_muscle && (self.file.solid.is_none() || !self.file.chain.is_empty()) {
                let error = InputError::new(format!("`{key}` requires a body without chains"))
                    .next(format!("remove `{key}`"));
                return Err(self.wrong(&path, error));
            }
        }
        Ok(())
    }

    /// Rejects separate steps for chains that act on the body or that are excluded from the error test.
    pub(super) fn chain_steps(&self, feedbacks: &[Feedback]) -> Result<(), InputError> {
        let wanted = &self.file.integrator;
        let wrong = |message: &str| {
            let error = InputError::new(message.to_owned())
                .found("\"separate\"")
                .allowed("\"together\"")
                .next("remove `chains`");
            Err(self.wrong("integrator.chains", error))
        };
        if wanted.chains != Some(ChainSteps::Separate) {
            return Ok(());
        }
        if self.file.chain.is_empty() {
            wrong("the scene has no chains")
        } else if self.file.solid.is_none() && self.file.rod.is_none() {
            wrong("separate steps need a body or a rod that drives the chains")
        } else if !feedbacks.is_empty() {
            wrong("chains that act on the body must use the steps of the body")
        } else if !wanted.oscillators.in_error_test {
            wrong("separate steps need the oscillators in the error test")
        } else {
            Ok(())
        }
    }
}

/// Returns the absolute tolerances. If tolerances are not given, they are derived from typical values of the body,
/// which depend on its loads up to `t_end` (s) and on its initial state.
pub(crate) fn absolute_tolerances(
    wanted: &IntegratorSettings,
    muscle: &Muscle,
    t_end: f64,
    at_start: TypicalStart,
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

/// Keys of `[integrator]` that control time steps.
const OF_MOTIONS: [&str; 4] = ["initial_step", "max_cpu", "max_step", "max_steps"];
/// Keys of `[integrator]` that have no effect on a rod or on chains without a body, in addition to [`OF_FULL_MATRIX`].
const ONLY_FOR_BODIES: [&str; 3] = ["atol", "error_test", "precision"];
/// Keys of `[integrator]` for KLU, which is used only for full matrices.
const OF_FULL_MATRIX: [&str; 2] = ["ordering", "btf"];
/// Keys of `[[chain]]` that describe how the body drives a chain.
const OF_DRIVEN_CHAINS: [&str; 3] = ["gain", "component", "driven"];

/// Returns notes on settings without effect, such as step limits in a static scene. Such settings are
/// accepted because parts of a scene may be reused in another scene.
pub(super) fn without_effect(file: &SceneFile, source: &Value, body: Option<&Body>) -> Vec<String> {
    let given = |table: &Value, keys: &[&str]| {
        let keys = keys.iter().filter(|key| table.get(key).is_some()).copied();
        keys.collect::<Vec<_>>().join(", ")
    };
    let is_full = |body: &Body| body.settings.linear_solver == LinearSolverKind::Full;
    let has_chains = !file.chain.is_empty();
    let settings = [
        (file.analysis.is_in_time(), &OF_MOTIONS[..], "time integration"),
        (body.is_some(), &ONLY_FOR_BODIES, "body"),
        (
            body.is_some_and(is_full),
            &OF_FULL_MATRIX,
            "feedback on elements other than those that drive the chain",
        ),
        (has_chains, &["chains"], "chains"),
        (has_chains || file.rod.is_some(), &["oscillators"], "chains or a rod"),
    ];
    let unused = settings.into_iter().filter(|(applies, ..)| !applies);
    let mut notes: Vec<String> = unused
        .map(|(_, keys, part)| (given(&source["integrator"], keys), part))
        .filter(|(keys, _)| !keys.is_empty())
        .map(|(keys, part)| format!("[integrator] {keys}: no effect in a scene without {part}"))
        .collect();
    for (i, chain) in source["chain"].as_array().into_iter().flatten().enumerate() {
        let keys = given(chain, &OF_DRIVEN_CHAINS);
        if !keys.is_empty() && file.chain[i].at.is_none() {
            notes
                .push(format!("chain[{i}] {keys}: no effect without `at`, which drives the chain"));
        }
    }
    notes
}

/// Returns a note for each block that is excluded from the error test in the scene but does not exist in the
/// formulation.
pub(super) fn missing(wanted: &IntegratorSettings, formulation: Formulation) -> Vec<String> {
    let blocks = wanted.error_test.exclude.iter().flatten();
    let missing = blocks.filter(|block| !fields(**block).iter().any(|f| formulation.has(*f)));
    let words = missing.map(|block| {
        format!(
            "integrator.error_test.exclude: `{}` has no {}: this entry is ignored",
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
    fields.copied().filter(|field| formulation.has(*field)).collect()
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
    use std::path::Path;

    use super::*;
    use crate::Scene;
    use crate::scene_file::integrator::ErrorTest;

    /// Regression: a block that does not exist in the formulation was ignored silently.
    #[test]
    fn blocks_that_the_formulation_lacks_are_reported() {
        let wanted = IntegratorSettings {
            error_test: ErrorTest { exclude: Some(vec![Block::P, Block::PRate]) },
            ..IntegratorSettings::default()
        };
        let printed = missing(&wanted, Formulation::Position);
        assert_eq!(printed.len(), 1);
        assert!(printed[0].contains("p_rate"), "{printed:?}");
        assert!(missing(&wanted, Formulation::Rate).is_empty());
    }

    /// Regression: settings for full matrices, for chains and for driven chains were ignored silently.
    #[test]
    fn settings_of_a_body_and_its_chains_without_effect_are_reported() {
        const BODY: &str = "[time]\nend = 1.0\n[mesh]\ntype = \"rectangle\"\nwidth = 1.0\nheight = 1.0\ncells = [1, 1]\n\
             [solid]\nbulk_modulus = 1e5\n[[material]]\nlaw = \"neo-hooke\"\ndensity = 1e3\nshear_modulus = 1e4\n\
             [[fixed]]\ngroup = \"left\"\n";
        const CHAIN: &str = "chain=[{ name = \"a\", oscillators = 2 }]";
        const CONTACT: &str = "contact=[{ group = \"top\", type = \"plane\", point = [0.0, 1.0], normal = [0.0, -1.0] }]";
        const DRIVEN: &str = "chain[0].at=[0.5, 0.5]";
        const STATIC: &str = "analysis=static";
        const MODES: &str = "analysis=modes";
        for (set, expected) in [
            (&["integrator.ordering=amd"][..], "ordering"),
            (&["integrator.btf=true"], "btf"),
            (&["integrator.chains=together"], "chains"),
            (&["integrator.oscillators.rtol=1e-6"], "oscillators"),
            (&[CHAIN, "integrator.chains=together", "integrator.oscillators.rtol=1e-6"], ""),
            (&[CHAIN, "chain[0].gain=2.0"], "chain[0] gain"),
            (&[CHAIN, "chain[0].component=x", "chain[0].driven=boundary"], "component, driven"),
            (&[CHAIN, DRIVEN, "chain[0].gain=2.0"], ""),
            (&[MODES, CHAIN], "[[chain]]"),
            (&[STATIC, CHAIN], "[[chain]]"),
            (&[MODES, "fields.interval=0.1"], ""),
            (&["fields.interval=0.1"], ""),
            (&[MODES, CONTACT], "[[contact]]"),
        ] {
            let set: Vec<String> = set.iter().map(|&set| set.to_owned()).collect();
            let scene = Scene::build("scene.toml", BODY, &set, Path::new("")).expect("a scene");
            let notes = scene.notes();
            match expected {
                "" => assert_eq!(notes, Vec::<String>::new(), "{set:?}"),
                key => assert!(notes.len() == 1 && notes[0].contains(key), "{set:?}: {notes:?}"),
            }
        }
    }

    /// Regression: time limits for an equilibrium, and settings for a body in a scene with only chains, were ignored
    /// silently.
    #[test]
    fn settings_without_effect_are_reported() {
        let notes = |text: &str| {
            let scene = Scene::build("scene.toml", text, &[], Path::new(""));
            scene.expect("a valid scene").notes()
        };
        let of_chains = |setting: &str| {
            notes(&format!(
                "[time]\nend = 1.0\n[integrator]\n{setting}\n[[chain]]\nname = \"a\"\noscillators = 2\n"
            ))
        };
        for setting in [
            "atol = { u = 1e-6 }",
            "error_test = { exclude = [\"p\"] }",
            "precision = \"mixed\"",
            "ordering = \"amd\"",
            "btf = true",
        ] {
            let key = setting.split(' ').next().expect("a key");
            let notes = of_chains(setting);
            assert!(notes.len() == 1 && notes[0].contains(key), "{notes:?}");
        }
        assert_eq!(of_chains("max_cpu = 1.0"), Vec::<String>::new());
        let of_equilibrium = notes(
            "analysis = \"static\"\n[mesh]\ntype = \"rectangle\"\nwidth = 1.0\nheight = 1.0\ncells = [1, 1]\n\
             [solid]\nbulk_modulus = 1e5\n[[material]]\nlaw = \"neo-hooke\"\ndensity = 1e3\nshear_modulus = 1e4\n\
             [[fixed]]\ngroup = \"left\"\n[integrator]\nmax_cpu = 1.0\nmax_steps = 1\nbtf = true\n",
        );
        let limits = of_equilibrium.iter().filter(|note| note.contains("max_cpu, max_steps"));
        assert_eq!(limits.count(), 1, "{of_equilibrium:?}");
    }
}
