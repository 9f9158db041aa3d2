//! Options that stand for changes of a scene: text as `--set` takes it.

use std::path::Path;

use myovib_model::IntegratorKind;
use serde_json::json;

/// `key=value`.
pub(crate) fn change(key: &str, value: impl std::fmt::Display) -> String {
    format!("{key}={value}")
}

/// Another mesh, from a file.
pub(crate) fn mesh(path: &Path) -> String {
    let path = json!(path.display().to_string());
    change("mesh", format!("{{ type = \"file\", path = {path} }}"))
}

/// Another end time, s.
pub(crate) fn end(t_end: f64) -> String {
    change("time.end", format!("{t_end:e}"))
}

/// Another integrator: those of the paper's scenes are settings of BDF.
pub(crate) fn integrator(kind: IntegratorKind) -> Vec<String> {
    if kind == IntegratorKind::Ida {
        return vec![change("integrator.method", "bdf")];
    }
    let mut changes = vec![change("integrator.method", kind.name())];
    // Orders, absolute tolerances and what is left out of the error test are those of BDF.
    for of_bdf in ["max_order", "atol", "suppress"] {
        changes.push(change(&format!("integrator.{of_bdf}"), ""));
    }
    changes
}
