//! Conversion of options that modify a scene into overrides of the form accepted by `--set`.

use std::path::Path;

use myovib_model::IntegratorKind;
use myovib_scene::InputError;
use serde_json::json;

pub(crate) fn change(key: &str, value: impl std::fmt::Display) -> String {
    format!("{key}={value}")
}

/// Rejects entries of `set` for keys that the command or one of its options sets to another value, because these
/// entries would have no effect. Each entry of `own` is a change that the command makes, with the name of the option
/// that causes it.
pub(crate) fn expect_free(set: &[String], own: &[(String, &str)]) -> Result<(), InputError> {
    let split = |text: &str| {
        let (key, value) = text.split_once('=')?;
        Some((key.trim().to_owned(), value.trim().trim_matches('"').to_owned()))
    };
    let own = own.iter().filter_map(|(change, by)| Some((split(change)?, by)));
    let own: Vec<_> = own.collect();
    let conflict = set.iter().find_map(|text| {
        let (key, value) = split(text)?;
        let (_, by) = own.iter().find(|((name, own), _)| *name == key && *own != value)?;
        Some((text, by))
    });
    match conflict {
        None => Ok(()),
        Some((text, by)) => {
            Err(InputError::new(format!("the value has no effect, because {by} sets this key"))
                .at(format!("--set {text}"))
                .next("remove it"))
        }
    }
}

/// Replaces the mesh with a file.
pub(crate) fn mesh(path: &Path) -> String {
    let path = json!(path.display().to_string());
    change("mesh", format!("{{ type = \"file\", path = {path} }}"))
}

/// Replaces the end time (s).
pub(crate) fn end(t_end: f64) -> String {
    change("time.end", format!("{t_end:e}"))
}

/// Replaces the integrator. For methods other than BDF, settings specific to BDF, which the paper's scenes contain, are
/// removed.
pub(crate) fn integrator(kind: IntegratorKind) -> Vec<String> {
    if kind == IntegratorKind::Bdf {
        return vec![change("integrator.method", "bdf")];
    }
    let mut changes = vec![change("integrator.method", kind.name())];
    // The maximum order and the exclusions from the error test are settings of BDF only.
    for of_bdf in ["max_order", "error_test"] {
        changes.push(change(&format!("integrator.{of_bdf}"), ""));
    }
    changes
}

#[cfg(test)]
mod tests {
    use super::expect_free;

    /// Regression: `response --set analysis=static` was accepted and computed a response.
    #[test]
    fn values_that_a_command_replaces_are_rejected() {
        let own = [
            ("analysis=response".to_owned(), "this command"),
            ("response.frequencies=\"1,2\"".to_owned(), "--frequencies"),
        ];
        for (set, is_free) in [
            ("analysis=static", false),
            ("analysis = \"modes\"", false),
            ("response.frequencies=[1.0]", false),
            ("analysis=\"response\"", true),
            ("response.preload_time=1", true),
        ] {
            assert_eq!(expect_free(&[set.to_owned()], &own).is_ok(), is_free, "{set}");
        }
    }
}
