//! Notes on sections that have no effect in the chosen analysis. They are allowed, so that one scene can be used for
//! several analyses.

use super::contraction::chains_that_act;
use crate::scene_file::{Analysis, SceneFile};

/// Returns a note on the sections used only by other analyses.
pub(super) fn notes(file: &SceneFile) -> Option<String> {
    let is = |analysis: Analysis| file.analysis == analysis;
    let is_equilibrium = is(Analysis::Static);
    let is_spectral = is(Analysis::Modes) || is(Analysis::Response) || is(Analysis::Periodic);
    let preload = match file.analysis {
        Analysis::Modes => file.modes.as_ref().and_then(|own| own.preload_time),
        _ => file.response.as_ref().and_then(|own| own.preload_time),
    };
    let is_about_rest = (is(Analysis::Modes) || is(Analysis::Response)) && preload.is_none();
    // Other notes cover chains in a response and chains that act on the body.
    let without_chains =
        is_equilibrium || is(Analysis::Modes) && chains_that_act(file).next().is_none();
    let sections = [
        ("[initial_state]", !file.analysis.has_initial_state() && file.initial_state.is_some()),
        ("[[chain]]", without_chains && !file.chain.is_empty()),
        ("[[feedback]]", is_equilibrium && !file.feedback.is_empty()),
        ("[static]", !is_equilibrium && file.loading_path.is_some()),
        ("[[stop]]", is_spectral && !file.stop.is_empty()),
        // Modes always have shapes.
        ("[fields]", is_spectral && !is(Analysis::Modes) && file.fields.is_some()),
        ("[[contact]]", is_about_rest && !file.contact.is_empty()),
    ];
    let sections = sections.into_iter().filter(|(_, given)| *given);
    let mut unused: Vec<String> = sections.map(|(name, _)| name.to_owned()).collect();
    let probes = file.probe.iter().filter(|probe| probe.kind.kind().requires_motion());
    let probes = probes.filter(|_| is_equilibrium);
    unused.extend(probes.map(|probe| format!("probe `{}`", probe.name)));
    (!unused.is_empty()).then(|| format!("not used by this analysis: {}", unused.join(", ")))
}
