//! Whether probes and stops lie where there is something to measure.

use myovib_model::Probe;

use super::Body;
use super::builder::{Builder, Explain};
use crate::error::InputError;
use crate::probe::Objection;
use crate::scene_file::SceneFile;
use crate::scene_file::output::Stop;

impl Builder<'_> {
    /// Refuses probes and stops at points outside the mesh, probes of groups that it does
    /// not have, and of reactions where nothing is held.
    pub(super) fn places(&self, file: &SceneFile, body: &Body) -> Result<(), InputError> {
        for (i, probe) in file.probe.iter().enumerate() {
            let checked = probe.kind.kind().check_place(&body.muscle.solid);
            checked.map_err(|(key, objection)| {
                let error = match objection {
                    Objection::Model(error) => error.explain(),
                    Objection::Input(error) => error,
                };
                self.wrong(&format!("probe[{i}]{key}"), error)
            })?;
        }
        let space = body.muscle.solid.space();
        for (i, stop) in file.stop.iter().enumerate() {
            if let Stop::Displacement { at, .. } = stop {
                self.at(&format!("stop[{i}].at"), Probe::at(space, at))?;
            }
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
        assert!(outside.contains("(1, 0) is outside the mesh"), "{outside}");
        let line = "type = \"line\"\nfrom = [0.0, 0.0]\nto = [0.0, 9.0]\npoints = 3";
        assert!(refusal(line).contains("is outside the mesh"));
        let in_space = refusal("type = \"point\"\nat = [0.0, 0.0, 0.0]");
        assert!(
            in_space.contains("a point of the body has 2 coordinates, not 3"),
            "{in_space}"
        );
        let free = refusal("type = \"reaction\"\ngroup = \"load\"");
        assert!(
            free.contains("nothing of the group `load` is held"),
            "{free}"
        );
        assert_eq!(
            refusal("type = \"reaction\"\ngroup = \"fixed\""),
            "accepted"
        );
    }

    /// Regression: a side of a box beside the one that is held was taken for a support.
    #[test]
    fn a_group_that_shares_an_edge_with_a_support_has_no_reaction() {
        let reaction = |group: &str| {
            let set = [
                "mesh.cells=[2,1,1]".to_owned(),
                format!("probe[1].group={group}"),
            ];
            Scene::built_in("land1", &set).map(|_| ())
        };
        let said = reaction("bottom").unwrap_err().to_string();
        assert!(
            said.contains("nothing of the group `bottom` is held"),
            "{said}"
        );
        reaction("left").expect("the support");
    }
}
