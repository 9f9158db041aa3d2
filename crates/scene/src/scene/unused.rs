//! Notes on sections that have no effect in the chosen analysis. They are allowed, so that one scene can be used for
//! several analyses.

use crate::scene_file::{Analysis, SceneFile};

/// Returns a note on the sections that only other analyses use.
pub(super) fn notes(file: &SceneFile) -> Option<String> {
    let is = |analysis: Analysis| file.analysis == analysis;
    let is_equilibrium = is(Analysis::Static);
    let sections = [
        ("[initial_state]", !file.analysis.has_initial_state() && file.initial_state.is_some()),
        ("[[chain]]", is_equilibrium && !file.chain.is_empty()),
        ("[[feedback]]", is_equilibrium && !file.feedback.is_empty()),
        ("[static]", !is_equilibrium && file.loading_path.is_some()),
        (
            "[[stop]]",
            (is(Analysis::Modes) || is(Analysis::Response) || is(Analysis::Periodic))
                && !file.stop.is_empty(),
        ),
    ];
    let sections = sections.into_iter().filter(|(_, given)| *given);
    let mut unused: Vec<String> = sections.map(|(name, _)| name.to_owned()).collect();
    let probes = file.probe.iter().filter(|probe| probe.kind.kind().requires_motion());
    let probes = probes.filter(|_| is_equilibrium);
    unused.extend(probes.map(|probe| format!("probe `{}`", probe.name)));
    (!unused.is_empty()).then(|| format!("not used by this analysis: {}", unused.join(", ")))
}
