//! Notes on parts of a scene's body that have no effect. Such parts are valid but probably unintended.

use myovib_model::{Muscle, Signal};

use super::Body;
use super::supports::NAMES;
use crate::scene_file::material::Material;
use crate::scene_file::solid::Traction;
use crate::scene_file::{Analysis, SceneFile};
use crate::spacing::times;

pub(super) fn notes(file: &SceneFile, body: &Body, t_end: f64) -> Vec<String> {
    let tractions = file.traction.iter().enumerate();
    let mut notes: Vec<String> =
        tractions.flat_map(|(i, traction)| held(i, traction, &body.muscle)).collect();
    let materials = file.material.iter().enumerate();
    let unused = materials.filter(|(i, _)| !body.regions.contains(i));
    notes.extend(unused.map(|(i, material)| {
        let why = match &material.group {
            Some(group) => format!("[[region]] entries cover all of `{group}`"),
            None => "other materials cover the body".to_owned(),
        };
        format!("material[{i}] applies to no element: {why}")
    }));
    let is_isotropic = |material: &Material| {
        let law = material.stiffened();
        material.active.is_none() && law.is_ok_and(|law| !law.has_fibers())
    };
    // Fibers may matter if there are chains: feedback may stiffen them, and a chain may be driven along them.
    let materials = file.material.iter().enumerate();
    let without_fibers = materials
        .filter(|(_, own)| file.chain.is_empty() && own.fiber.is_some() && is_isotropic(own));
    notes.extend(without_fibers.map(|(i, _)| {
        format!(
            "material[{i}].fiber has no effect: the law is isotropic and there is no active tension"
        )
    }));
    if matches!(file.analysis, Analysis::Dynamic | Analysis::QuasiStatic | Analysis::Static) {
        notes.extend(late_loads(file, body, t_end));
        notes.extend(missed(file, body, t_end));
    }
    let of_modes = file.modes.as_ref().and_then(|modes| modes.preload_time);
    let of_response = file.response.as_ref().and_then(|own| own.preload_time);
    let of_equilibrium = match file.analysis {
        Analysis::Static => Some((t_end, "[time] end")),
        Analysis::Modes => of_modes.map(|t| (t, "modes.preload_time")),
        Analysis::Response => of_response.map(|t| (t, "response.preload_time")),
        _ => None,
    };
    if let Some((t, key)) = of_equilibrium.filter(|(t, _)| is_unloaded(&body.muscle, *t)) {
        notes.push(format!(
            "all loads are 0 at t = {t} s, the time of the equilibrium: set another time with {key}"
        ));
    }
    notes
}

/// Number of intervals between the times at which signals are sampled.
const TIMES: u32 = 97;
/// A note is added if, during the motion, a load stays below this fraction of the maximum that it reaches later.
const MIN_LOAD_FRACTION: f64 = 0.05;

/// Returns notes on loads that reach their amplitude long after the end of a motion.
fn late_loads(file: &SceneFile, body: &Body, t_end: f64) -> Vec<String> {
    if file.analysis == Analysis::Static {
        return Vec::new();
    }
    let largest = |signal: &Signal, from: f64, to: f64| {
        let values = times(from, to, TIMES).map(|t| signal.at(t).value.abs());
        values.fold(0.0, f64::max)
    };
    let notes = body.keyed_loads().filter_map(|(path, signal)| {
        let own = largest(signal, 0.0, t_end);
        let later = largest(signal, t_end, signal.range().1.clamp(t_end, 10.0 * t_end));
        (own < MIN_LOAD_FRACTION * later).then(|| {
            format!(
                "{path} reaches only {:.1} % of its later maximum before [time] end = {t_end} s: extend the run, or \
                 start the load earlier",
                100.0 * own / later
            )
        })
    });
    notes.collect()
}

/// Returns notes on obstacles whose given motion does not bring them into contact with the undeformed body.
fn missed(file: &SceneFile, body: &Body, t_end: f64) -> Vec<String> {
    // Loads, supports and inertia may move the body toward the obstacle.
    let moves = !body.muscle.prescribed.is_empty() || body.keyed_loads().next().is_some();
    if moves || file.analysis == Analysis::Dynamic {
        return Vec::new();
    }
    let rest = vec![0.0; body.muscle.solid.space().n_components()];
    let is_static = file.analysis == Analysis::Static;
    let contacts = body.muscle.contacts.iter().enumerate();
    let missed = contacts.filter(|(_, contact)| {
        // A static analysis scales the displacement that the obstacle has at `t_end`.
        let mut places = times(0.0, 1.0, TIMES).map(|part| match is_static {
            true => (t_end, part),
            false => (part * t_end, 1.0),
        });
        !contact.is_driven()
            && places.all(|(t, part)| contact.sums(t, part, &rest).penetration <= 0.0)
    });
    let notes = missed.map(|(i, contact)| {
        format!(
            "the obstacle of contact[{i}] does not reach `{}` of the undeformed body: check its position, and its \
             displacement in m",
            contact.group()
        )
    });
    notes.collect()
}

/// Returns notes on traction components along which every node of the group is fixed or moved.
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
            "traction[{i}].{} has no effect: all of `{}` is fixed or has a prescribed displacement in this direction",
            NAMES[axis], traction.group
        )
    });
    words.collect()
}

/// Returns whether there are loads, tensions or support motions and all of them are zero at time `t`.
fn is_unloaded(muscle: &Muscle, t: f64) -> bool {
    let signals = muscle.signals().map(|signal| signal.at(t).value);
    let tensions = muscle.activations.iter().map(|(_, own)| own.at(t, 0.0));
    let values: Vec<f64> = signals.chain(tensions).collect();
    !values.is_empty() && values.iter().all(|value| *value == 0.0)
}

#[cfg(test)]
pub(super) mod tests {
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

    pub(in super::super) fn notes(more: &str, set: &[&str]) -> Vec<String> {
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
        assert!(early.len() == 1 && early[0].contains("t = 0 s"), "{early:?}");

        let modes = notes("", &["analysis=modes", "modes.preload_time=0"]);
        assert!(modes.len() == 1 && modes[0].contains("modes.preload_time"), "{modes:?}");

        let held = notes("", &[at_once, "traction[0].group=left"]);
        let expected = "traction[0].y ";
        assert!(held.len() == 1 && held[0].starts_with(expected), "{held:?}");
        assert!(held[0].contains("`left`"), "{held:?}");

        let fiber = notes("", &[at_once, "material[0].fiber=[1.0, 0.0]"]);
        let expected = "material[0].fiber ";
        assert!(fiber.len() == 1 && fiber[0].starts_with(expected), "{fiber:?}");
        let active = "material[0].active={ type = \"given\", tension = 1.0 }";
        let active = notes("", &[at_once, "material[0].fiber=[1.0, 0.0]", active]);
        assert_eq!(active, Vec::<String>::new());

        // The ramp of the load is centered at 0.8 s.
        let slow = "traction[0].y={ type = \"ramped-sine\", amplitude = 1.0, frequency = 8.0 }";
        let stiff = "material[0].shear_modulus=1e7";
        let short = notes("", &["analysis=dynamic", slow, stiff, "time.end=0.3"]);
        let expected = "traction[0].y ";
        assert!(short.len() == 1 && short[0].starts_with(expected), "{short:?}");
        let long = notes("", &["analysis=dynamic", slow, stiff, "time.end=1.0"]);
        assert_eq!(long, Vec::<String>::new());

        // A sphere above the square moves down by 0.1 m.
        let sphere = |height: f64, radius: f64, motion: &str| {
            format!(
                "[[contact]]\ngroup = \"top\"\ntype = \"sphere\"\ncenter = [0.5, {}]\nradius = {radius}\n{motion}\n",
                height + radius
            )
        };
        for (height, radius, count) in [(1.05, 0.6, 0), (1.15, 0.6, 1), (1.05, 0.4, 1)] {
            // The radius of the last sphere is smaller than the facets.
            let found = notes(&sphere(height, radius, "y = -0.1"), &["traction=[]"]);
            assert_eq!(found.len(), count, "{found:?}");
        }
        let late = "direction = [0.0, -1.0]\nforce = { type = \"step\", value = 1.0, start = 1.0, rise = 0.1 }";
        let late = notes(
            &sphere(1.0, 0.6, late),
            &["traction=[]", "analysis=quasi-static", "time.end=0.5"],
        );
        let expected = "contact[0].force ";
        assert!(late.len() == 1 && late[0].starts_with(expected), "{late:?}");

        let all = "[[region]]\nname = \"all\"\ncenter = [0.5, 0.5]\nradii = [2.0, 2.0]\n[[material]]\n\
                   group = \"all\"\nlaw = \"neo-hooke\"\ndensity = 1e3\nshear_modulus = 1e4\n";
        let unused = notes(all, &[at_once]);
        let expected = "material[0] ";
        assert!(unused.len() == 1 && unused[0].starts_with(expected), "{unused:?}");
    }
}
