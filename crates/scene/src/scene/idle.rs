//! Notes on parts of a scene's body without effect: valid, but probably not intended.

use myovib_model::Muscle;

use super::Body;
use super::supports::NAMES;
use crate::scene_file::solid::Traction;
use crate::scene_file::{Analysis, SceneFile};

pub(super) fn notes(file: &SceneFile, body: &Body, t_end: f64) -> Vec<String> {
    let tractions = file.traction.iter().enumerate();
    let mut notes: Vec<String> = tractions
        .flat_map(|(i, traction)| held(i, traction, &body.muscle))
        .collect();
    let materials = file.material.iter().enumerate();
    let unused = materials.filter(|(i, _)| !body.regions.contains(i));
    notes.extend(unused.map(|(i, material)| {
        let why = match &material.group {
            Some(group) => format!("[[region]] entries cover all of `{group}`"),
            None => "other materials cover the body".to_owned(),
        };
        format!("material[{i}] applies to no element: {why}")
    }));
    let of_modes = file.modes.as_ref().and_then(|modes| modes.preload_time);
    let of_static = (file.analysis == Analysis::Static).then_some(t_end);
    let of_response = file.response.as_ref().and_then(|own| own.preload_time);
    for (taken, key) in [
        (of_static, "[time] end"),
        (of_modes, "modes.preload_time"),
        (of_response, "response.preload_time"),
    ] {
        if let Some(t) = taken.filter(|t| rests(&body.muscle, *t)) {
            notes.push(format!(
                "all loads are 0 at t = {t} s, when the equilibrium is computed: {key} sets another time"
            ));
        }
    }
    notes
}

/// Returns notes on traction components along which all of the group is held or moved.
fn held(i: usize, traction: &Traction, muscle: &Muscle) -> Vec<String> {
    let solid = &muscle.solid;
    let (dimension, free) = (solid.space().dimension(), solid.dofs().free_to_full());
    let nodes = solid.space().nodes_of(&traction.group).unwrap_or_default();
    let given = [&traction.x, &traction.y, &traction.z];
    let axes = (0..dimension).filter(|&axis| given[axis].is_some());
    let is_held = |&axis: &usize| {
        let mut components = nodes.iter().map(|node| dimension * node + axis);
        components.all(|component| free.binary_search(&component).is_err())
    };
    let words = axes.filter(is_held).map(|axis| {
        format!(
            "traction[{i}].{} moves nothing: all of `{}` is fixed or moved along it",
            NAMES[axis], traction.group
        )
    });
    words.collect()
}

/// Returns whether all loads, tensions and support motions are zero, and there is at least one.
fn rests(muscle: &Muscle, t: f64) -> bool {
    let signals = muscle.signals().map(|signal| signal.at(t).value);
    let tensions = muscle.activations.iter().map(|(_, own)| own.at(t, 0.0));
    let values: Vec<f64> = signals.chain(tensions).collect();
    !values.is_empty() && values.iter().all(|value| *value == 0.0)
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use crate::Scene;

    const SQUARE: &str = r#"
analysis = "static"
[mesh]
type = "rectangle"
width = 1.0
height = 1.0
cells = [2, 2]
[solid]
bulk_modulus = 1e5
[[material]]
group = "body"
law = "neo-hooke"
density = 1e3
shear_modulus = 1e4
[[fixed]]
group = "left"
[[traction]]
group = "right"
y = { type = "step", value = 1.0, rise = 0.1 }
"#;

    fn notes(more: &str, set: &[&str]) -> Vec<String> {
        let text = format!("{SQUARE}{more}");
        let set: Vec<String> = set.iter().map(|&set| set.to_owned()).collect();
        let scene = Scene::build("scene.toml", &text, &set, Path::new(""));
        scene.expect("a valid scene").notes()
    }

    /// Regression: all of these scenes were accepted silently.
    #[test]
    fn settings_without_effect_are_reported() {
        let at_once = "traction[0].y=1.0";
        assert_eq!(notes("", &[at_once]), Vec::<String>::new());
        assert_eq!(notes("", &["time.end=0.1"]), Vec::<String>::new());

        let early = notes("", &[]);
        assert!(
            early.len() == 1 && early[0].contains("t = 0 s"),
            "{early:?}"
        );

        let modes = notes("", &["analysis=modes", "modes.preload_time=0"]);
        assert!(
            modes.len() == 1 && modes[0].contains("modes.preload_time"),
            "{modes:?}"
        );

        let held = notes("", &[at_once, "traction[0].group=left"]);
        let expected = "traction[0].y moves nothing: all of `left`";
        assert!(held.len() == 1 && held[0].starts_with(expected), "{held:?}");

        let all = "[[region]]\nname = \"all\"\ncenter = [0.5, 0.5]\nradii = [2.0, 2.0]\n[[material]]\n\
                   group = \"all\"\nlaw = \"neo-hooke\"\ndensity = 1e3\nshear_modulus = 1e4\n";
        let unused = notes(all, &[at_once]);
        let expected = "material[0] applies to no element";
        assert!(
            unused.len() == 1 && unused[0].starts_with(expected),
            "{unused:?}"
        );
    }
}
