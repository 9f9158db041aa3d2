//! Whether probes and stops lie where there is something to measure.

use myovib_model::Probe;

use super::Body;
use super::builder::Builder;
use crate::error::InputError;
use crate::scene_file::SceneFile;
use crate::scene_file::output::{ProbeKind, Stop};

impl Builder<'_> {
    /// Refuses probes and stops at points outside the mesh, probes of groups that it does
    /// not have, and of reactions where nothing is held.
    pub(super) fn places(&self, file: &SceneFile, body: &Body) -> Result<(), InputError> {
        for (i, probe) in file.probe.iter().enumerate() {
            self.place(&probe.kind, body, &format!("probe[{i}]"))?;
        }
        let space = body.muscle.solid.space();
        for (i, stop) in file.stop.iter().enumerate() {
            if let Stop::Displacement { at, .. } = stop {
                self.at(&format!("stop[{i}].at"), Probe::at(space, at))?;
            }
        }
        Ok(())
    }

    fn place(&self, probe: &ProbeKind, body: &Body, path: &str) -> Result<(), InputError> {
        let solid = &body.muscle.solid;
        let space = solid.space();
        match probe {
            ProbeKind::Point { at, .. } => {
                self.at(&format!("{path}.at"), Probe::at(space, at))?;
            }
            ProbeKind::Line { from, to, .. } => {
                self.at(&format!("{path}.from"), Probe::at(space, from))?;
                self.at(&format!("{path}.to"), Probe::at(space, to))?;
            }
            ProbeKind::Average { group, .. } => {
                self.at(&format!("{path}.group"), space.mesh().group(group))?;
            }
            ProbeKind::Reaction { group } => {
                let place = format!("{path}.group");
                let nodes = self.at(&place, space.nodes_of(group))?;
                let dimension = space.dimension();
                let free = solid.dofs().free_to_full();
                let is_held = |node: usize| {
                    (0..dimension)
                        .any(|axis| free.binary_search(&(dimension * node + axis)).is_err())
                };
                if !nodes.into_iter().any(is_held) {
                    let error = InputError::new(format!(
                        "no node of the group `{group}` is held, so that it has no reaction"
                    ))
                    .next("name the group of a [[fixed]] or [[displacement]]");
                    return Err(self.wrong(&place, error));
                }
            }
            _ => {}
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use crate::scene::{Scene, builtin_text};

    fn refusal(probe: &str) -> String {
        let text = builtin_text("init").expect("built in");
        let text = format!("{text}\n[[probe]]\nname = \"own\"\nevery = 0.1\n{probe}\n");
        match Scene::build("scene.toml", &text, &[], Path::new("")) {
            Ok(_) => "accepted".to_owned(),
            Err(error) => error.to_string(),
        }
    }

    /// Regression: `check` had no objections to any of these.
    #[test]
    fn probes_where_nothing_can_be_measured_are_refused() {
        let outside = refusal("type = \"point\"\nat = [1.0, 0.0]");
        assert!(
            outside.contains("(1, 0) lies outside the mesh"),
            "{outside}"
        );
        let line = "type = \"line\"\nfrom = [0.0, 0.0]\nto = [0.0, 9.0]\npoints = 3";
        assert!(refusal(line).contains("lies outside the mesh"));
        let in_space = refusal("type = \"point\"\nat = [0.0, 0.0, 0.0]");
        assert!(
            in_space.contains("a point of the body has 2 coordinates, not 3"),
            "{in_space}"
        );
        let free = refusal("type = \"reaction\"\ngroup = \"load\"");
        assert!(
            free.contains("no node of the group `load` is held"),
            "{free}"
        );
        assert_eq!(
            refusal("type = \"reaction\"\ngroup = \"fixed\""),
            "accepted"
        );
    }
}
