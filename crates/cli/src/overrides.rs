//! Options that change a scene, converted to overrides as for `--set`.

use std::path::Path;

use myovib_model::IntegratorKind;
use serde_json::json;

pub(crate) fn change(key: &str, value: impl std::fmt::Display) -> String {
    format!("{key}={value}")
}

/// Replaces the mesh by a file.
pub(crate) fn mesh(path: &Path) -> String {
    let path = json!(path.display().to_string());
    change("mesh", format!("{{ type = \"file\", path = {path} }}"))
}

/// Replaces the end time, s.
pub(crate) fn end(t_end: f64) -> String {
    change("time.end", format!("{t_end:e}"))
}

/// Replaces the integrator. Settings specific to BDF, as in the paper's scenes, are removed for
/// other methods.
pub(crate) fn integrator(kind: IntegratorKind) -> Vec<String> {
    if kind == IntegratorKind::Bdf {
        return vec![change("integrator.method", "bdf")];
    }
    let mut changes = vec![change("integrator.method", kind.name())];
    // Order and exclusions from the error test are settings of BDF.
    for of_bdf in ["max_order", "error_test"] {
        changes.push(change(&format!("integrator.{of_bdf}"), ""));
    }
    changes
}
