//! Checks that probes and stop conditions are at positions where they can measure.

use myovib_model::Probe;

use super::Body;
use super::builder::{Builder, Explain};
use super::supports::NAMES;
use crate::error::InputError;
use crate::probe::{InvalidPlace, ProbeKind};
use crate::scene_file::SceneFile;
use crate::scene_file::output::Stop;

impl Builder<'_> {
    /// Rejects probes and stop conditions at points outside the mesh, probes of unknown groups, and
    /// reactions of groups without supports.
    pub(super) fn places(&self, body: &Body) -> Result<(), InputError> {
        for (i, probe) in self.file.probe.iter().enumerate() {
            let checked = probe.kind.kind().check_place(&body.muscle.solid);
            checked.map_err(|(key, objection)| {
                let error = match objection {
                    InvalidPlace::Model(error) => error.explain(),
                    InvalidPlace::Input(error) => error,
                };
                self.wrong(&format!("probe[{i}]{key}"), error)
            })?;
        }
        let space = body.muscle.solid.space();
        for (i, probe) in self.file.probe.iter().enumerate() {
            if let ProbeKind::Point(point) = &probe.kind {
                self.point(space, &point.at, &format!("probe[{i}]"))?;
            }
        }
        self.notes.borrow_mut().extend(shared_reactions(self.file, body));
        for (i, stop) in self.file.stop.iter().enumerate() {
            if let Stop::Displacement { at, .. } = stop {
                self.at(&format!("stop[{i}].at"), Probe::near(space, at))?;
            }
        }
        Ok(())
    }
}

/// Formats the coordinates of a point.
pub(super) fn written(point: &[f64]) -> String {
    let coordinates: Vec<String> = point.iter().map(|x| format!("{x:.6}")).collect();
    coordinates.join(", ")
}

/// Returns notes on reactions of groups that share fixed components with other supports or with other reactions. Such a
/// reaction includes forces of the other supports.
fn shared_reactions(file: &SceneFile, body: &Body) -> Vec<String> {
    let solid = &body.muscle.solid;
    let (dimension, free) = (solid.space().dimension(), solid.dofs().free_to_full());
    let held = |group: &str, axes: &[usize]| -> Vec<usize> {
        let nodes = solid.space().nodes_of(group).unwrap_or_default();
        let axes = axes.iter().filter(|&&axis| axis < dimension);
        let components =
            nodes.iter().flat_map(|n| axes.clone().map(move |axis| dimension * n + axis));
        let held = components.filter(|component| free.binary_search(component).is_err());
        let mut held: Vec<usize> = held.collect();
        held.sort_unstable();
        held
    };
    let all = [0, 1, 2];
    let fixed = file.fixed.iter().map(|fixed| {
        let axes = fixed.components.as_ref();
        let axes = axes.map_or(all.to_vec(), |axes| axes.iter().map(|&a| a as usize).collect());
        (&fixed.group, axes)
    });
    let moved = file.prescribed_displacement.iter().map(|moved| {
        let given = [&moved.x, &moved.y, &moved.z].map(Option::is_some);
        let is_moved = |&axis: &usize| given[axis] || moved.rotation.is_some();
        (&moved.group, all.into_iter().filter(is_moved).collect())
    });
    let supports: Vec<(&String, Vec<usize>)> =
        fixed.chain(moved).map(|(group, axes)| (group, held(group, &axes))).collect();
    let reactions = file.probe.iter().filter_map(|probe| match &probe.kind {
        ProbeKind::Reaction(reaction) => Some((&reaction.group, held(&reaction.group, &all))),
        _ => None,
    });
    let reactions: Vec<_> = reactions.collect();
    let shared = |a: &[usize], b: &[usize]| -> Vec<usize> {
        a.iter().copied().filter(|x| b.binary_search(x).is_ok()).collect()
    };
    let columns = |list: &[usize]| {
        let names = (0..dimension).filter(|axis| list.iter().any(|c| c % dimension == *axis));
        let names: Vec<String> = names.map(|axis| format!("R_{}", NAMES[axis])).collect();
        names.join(", ")
    };
    let mut notes = Vec::new();
    for (i, (group, own)) in reactions.iter().enumerate() {
        for (other, components) in reactions[..i].iter().filter(|(other, _)| other != group) {
            let common = shared(own, components);
            if !common.is_empty() {
                notes.push(format!(
                    "the reactions of `{other}` and `{group}` share {} fixed components at common nodes: their \
                     sum counts these forces twice in {}",
                    common.len(),
                    columns(&common)
                ));
            }
        }
        for (support, components) in supports.iter().filter(|(support, _)| support != group) {
            let of_probe = reactions.iter().any(|(other, _)| other == support);
            let common = shared(own, components);
            let n = common.len();
            // A probe whose group consists of several supports includes these supports as a whole.
            if n > 0 && n < components.len() && n < own.len() && !of_probe {
                notes.push(format!(
                    "the reaction of `{group}` also includes, in {}, the forces of the support `{support}` at {n} \
                     components of shared nodes",
                    columns(&common)
                ));
            }
        }
    }
    notes
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use crate::scene::{Scene, builtin};

    fn refusal(probe: &str) -> String {
        let text = builtin::find("init").unwrap().text;
        let text = format!("{text}\n[[probe]]\nname = \"own\"\ninterval = 0.1\n{probe}\n");
        match Scene::build("scene.toml", &text, &[], Path::new("")) {
            Ok(_) => "accepted".to_owned(),
            Err(error) => error.to_string(),
        }
    }

    /// Regression: `check` accepted all of these scenes.
    #[test]
    fn probes_where_nothing_can_be_measured_are_refused() {
        let outside = refusal("type = \"point\"\nat = [1.0, 0.0]");
        assert!(outside.contains("(1, 0)"), "{outside}");
        let line = "type = \"line\"\nfrom = [0.0, 0.0]\nto = [0.0, 9.0]\npoints = 3";
        assert!(refusal(line).contains("(0, 9)"));
        let in_space = refusal("type = \"point\"\nat = [0.0, 0.0, 0.0]");
        assert!(in_space.contains("2 coordinates"), "{in_space}");
        let free = refusal("type = \"reaction\"\ngroup = \"load\"");
        assert!(free.contains("`load`"), "{free}");
        assert_eq!(refusal("type = \"reaction\"\ngroup = \"fixed\""), "accepted");
    }

    /// Checks a point slightly outside the facets, as on a curved boundary. Regression: it was treated as outside the
    /// mesh.
    #[test]
    fn points_near_the_boundary_are_noted_with_their_distance() {
        let text = builtin::find("init").unwrap().text;
        let notes = |x: f64| {
            let at = [format!("probe[0].at=[{x:?}, 0.0]")];
            let scene = Scene::build("scene.toml", text, &at, Path::new("")).unwrap();
            let notes = scene.notes().into_iter().filter(|note| note.contains("probe[0].at"));
            notes.collect::<Vec<_>>()
        };
        assert!(notes(0.1).is_empty());
        // The tip of the muscle is slanted, so the nearest point is approximate.
        let [note] = &notes(0.1 + 7e-6)[..] else { panic!("one note") };
        assert!(note.contains(" 7.00"), "{note}");
    }

    /// Checks two sides of a box that share an edge of 2 cells. On this edge, 5 nodes with 3 components each are fixed.
    #[test]
    fn reactions_that_share_nodes_are_noted() {
        let notes = |text: &str| {
            let scene = Scene::build("scene.toml", text, &[], Path::new("")).unwrap();
            let notes = scene.notes().into_iter().filter(|note| note.contains("reaction"));
            notes.collect::<Vec<_>>()
        };
        let probe = |group: &str| {
            format!("[[probe]]\nname = \"{group}\"\ntype = \"reaction\"\ngroup = \"{group}\"\n")
        };
        let body = "analysis = \"static\"\n[mesh]\ntype = \"box\"\nsize = [1.0, 1.0, 1.0]\ncells = [2, 2, 2]\n\
                    [solid]\nbulk_modulus = 1e5\n[[material]]\nlaw = \"neo-hooke\"\ndensity = 1e3\nshear_modulus = 1e4\n\
                    [[fixed]]\ngroup = \"left\"\n[[fixed]]\ngroup = \"bottom\"\n";
        let [both] = &notes(&format!("{body}{}{}", probe("left"), probe("bottom")))[..] else {
            panic!("one note")
        };
        assert!(both.contains("`left` and `bottom`") && both.contains(" 15 fixed"), "{both}");
        let [one] = &notes(&format!("{body}{}", probe("left")))[..] else { panic!("one note") };
        assert!(one.contains("`left`") && one.contains("`bottom` at 15 "), "{one}");
        let right = body.replace("\"bottom\"", "\"right\"");
        assert!(notes(&format!("{right}{}{}", probe("left"), probe("right"))).is_empty());
    }

    /// Regression: the side of a box next to a fixed side was treated as a support.
    #[test]
    fn a_group_that_shares_an_edge_with_a_support_has_no_reaction() {
        let reaction = |group: &str| {
            let set = ["mesh.cells=[2,1,1]".to_owned(), format!("probe[1].group={group}")];
            Scene::built_in("land1", &set).map(|_| ())
        };
        let printed = reaction("bottom").unwrap_err().to_string();
        assert!(printed.contains("`bottom`"), "{printed}");
        reaction("left").expect("the support");
    }
}
