//! Keys and values that were renamed before the first release. A scene that uses old names gives
//! one error that lists all of them.

use serde_json::Value;

use super::check::{entry, member, without_indices};
use super::source::Source;
use crate::InputError;

/// Old keys and their new names. The paths have no indices; the new name replaces the last part.
const KEYS: &[(&str, &str)] = &[
    ("displacement", "prescribed_displacement"),
    ("bed", "elastic_foundation"),
    ("start", "initial_state"),
    ("solid.kappa", "bulk_modulus"),
    ("solid.alpha", "rayleigh_mass"),
    ("solid.beta", "rayleigh_stiffness"),
    ("material.kappa", "bulk_modulus"),
    ("material.alpha", "rayleigh_mass"),
    ("material.beta", "rayleigh_stiffness"),
    ("material.eta", "viscosity"),
    ("material.stiffness", "stress_scale"),
    ("material.fibre", "fiber"),
    ("material.lambda", "first_lame_parameter"),
    ("material.prony.g", "relative_modulus"),
    ("material.prony.tau", "relaxation_time"),
    ("material.active.unsynchronised", "at_zero_coherence"),
    ("material.active.coherent", "at_full_coherence"),
    ("material.active.radius", "rest_amplitude"),
    ("material.active.force_velocity.a", "curvature"),
    ("region.centre", "center"),
    ("displacement.distribution", "spatial_factor"),
    ("traction.distribution", "spatial_factor"),
    ("body_force.distribution", "spatial_factor"),
    ("rod.alpha", "rayleigh_mass"),
    ("rod.beta", "rayleigh_stiffness"),
    ("rod.reading", "load_type"),
    ("chain.half_width", "frequency_spread"),
    ("chain.reach", "driven"),
    ("chain.neighbourhood", "coherence_radius"),
    ("feedback.unsynchronised", "at_zero_coherence"),
    ("feedback.coherent", "at_full_coherence"),
    ("feedback.radius", "rest_amplitude"),
    ("integrator.suppress", "error_test.exclude"),
    ("integrator.project_every", "projection_interval"),
    ("integrator.atol.displacement", "u"),
    ("integrator.atol.velocity", "v"),
    ("integrator.atol.pressure", "p"),
    ("integrator.atol.multiplier", "p_rate"),
    ("probe.every", "interval"),
    ("fields.every", "interval"),
    ("checkpoint.every", "interval"),
    ("modes.loads_at", "preload_time"),
];

/// Keys whose unit changed as well.
const UNITS: &[(&str, &str)] = &[("chain.half_width", " in Hz: divide rad/s by 2π")];

/// Old values: the keys under their new names, the old value and the new value.
const VALUES: &[(&str, &str, &str)] = &[
    ("initial_state.type", "run", "restart"),
    ("integrator.method", "radau", "radau5"),
    ("integrator.method", "ida", "bdf"),
    ("chain.component", "fibre", "fiber"),
    ("integrator.error_test.exclude", "displacement", "u"),
    ("integrator.error_test.exclude", "velocity", "v"),
    ("integrator.error_test.exclude", "pressure", "p"),
    ("integrator.error_test.exclude", "multiplier", "p_rate"),
];

/// Rejects all old names in one error.
///
/// # Errors
/// Returns an [`InputError`] with the location and the new name of each old name.
pub(super) fn check(source: &Source) -> Result<(), InputError> {
    let mut found = Vec::new();
    collect(source, source.value(), "", &mut found);
    found.sort();
    let names: Vec<String> = found.into_iter().map(|old| old.text).collect();
    if names.is_empty() {
        return Ok(());
    }
    Err(InputError::new("the scene uses names that have been replaced")
        .at(source.name())
        .found(names.join("\n"))
        .next("replace them; `myovib schema --markdown` documents all keys"))
}

/// An old name: its line and the text of the message. Sorted by line; overrides come first.
#[derive(PartialEq, Eq, PartialOrd, Ord)]
struct Old {
    line: Option<usize>,
    text: String,
}

impl Old {
    fn new(source: &Source, path: &str, text: &str) -> Self {
        let (line, place) = source.line(path);
        let text = format!("{place}: {text}");
        Self { line, text }
    }
}

fn collect(source: &Source, value: &Value, path: &str, found: &mut Vec<Old>) {
    match value {
        Value::Object(members) => {
            for (key, value) in members {
                let path = member(path, key);
                let bare = without_indices(&path);
                if let Some((_, new)) = KEYS.iter().find(|(old, _)| *old == bare) {
                    let unit = UNITS.iter().find(|(old, _)| *old == bare);
                    let unit = unit.map_or("", |(_, unit)| unit);
                    let text = format!("`{bare}` is now `{new}`{unit}");
                    found.push(Old::new(source, &path, &text));
                }
                collect(source, value, &path, found);
            }
        }
        Value::Array(entries) => {
            let numbered = entries.iter().enumerate();
            for (i, value) in numbered.filter(|(_, value)| !value.is_number()) {
                collect(source, value, &entry(path, i), found);
            }
        }
        Value::String(text) => {
            let bare = renamed(&without_indices(path));
            let mut values = VALUES.iter();
            if let Some((.., new)) = values.find(|(key, old, _)| *key == bare && old == text) {
                let text = format!("\"{text}\" is now \"{new}\"");
                found.push(Old::new(source, path, &text));
            }
            let key = without_indices(text);
            let new = renamed(&key);
            if bare == "parameter.key" && new != key {
                let text = format!("the key \"{text}\" is now \"{new}\"");
                found.push(Old::new(source, path, &text));
            }
        }
        _ => {}
    }
}

/// Returns the path with each key replaced by its new name.
fn renamed(bare: &str) -> String {
    let mut old = String::new();
    let mut new = String::new();
    for key in bare.split('.') {
        old = member(&old, key);
        let name = KEYS.iter().find(|(path, _)| *path == old);
        new = member(&new, name.map_or(key, |(_, name)| name));
    }
    new
}

#[cfg(test)]
mod tests {
    use super::super::{read, schema};
    use super::*;

    /// Checks that one error names each old key with its line.
    #[test]
    fn an_old_scene_gives_one_error_with_all_old_names() {
        let text = "[solid]\nkappa = 1e5\nbeta = 1e-4\n[[bed]]\ngroup = \"top\"\n[start]\ntype = \"run\"\n\
                    [integrator]\nmethod = \"radau\"\nsuppress = [\"pressure\"]\n\
                    [[chain]]\nhalf_width = 0.5\n[[parameter]]\nkey = \"material.0.eta\"\n";
        let sets = ["fields.every=0.1".to_owned()];
        let error = read("old.toml", text, &sets).unwrap_err().to_string();
        let lines: Vec<&str> = error.lines().map(str::trim).collect();
        for (line, names) in [
            (2, "`solid.kappa` is now `bulk_modulus`"),
            (3, "`solid.beta` is now `rayleigh_stiffness`"),
            (4, "`bed` is now `elastic_foundation`"),
            (6, "`start` is now `initial_state`"),
            (7, "\"run\" is now \"restart\""),
            (9, "\"radau\" is now \"radau5\""),
            (10, "`integrator.suppress` is now `error_test.exclude`"),
            (10, "\"pressure\" is now \"p\""),
            (12, "`chain.half_width` is now `frequency_spread` in Hz"),
            (14, "the key \"material.0.eta\" is now \"material.viscosity\""),
        ] {
            let expected = format!("line {line}: {names}");
            assert!(lines.iter().any(|line| line.starts_with(&expected)), "{expected}: {error}");
        }
        let set = "--set fields.every=0.1: `fields.every` is now `interval`";
        assert!(error.contains(set), "{error}");
    }

    /// Checks that no old key is a key of the schema, and that all new keys are.
    #[test]
    fn the_table_leads_from_unknown_to_known_keys() {
        let text = schema().to_value().to_string();
        for (old, new) in KEYS {
            assert_ne!(renamed(old), *old);
            let last = new.rsplit('.').next().unwrap();
            assert!(text.contains(&format!("\"{last}\":")), "{new}");
        }
    }
}
