//! TOML headers with wrong brackets: `[fixed]` instead of `[[fixed]]`, and the reverse.

use serde_json::Value;

/// Returns advice on the header of the `value` at `path` if a single table is given for a list of
/// tables, or the reverse. The schema may accept a table, a list of tables, or neither.
pub(super) fn right(
    value: &Value,
    path: &str,
    takes_table: bool,
    takes_tables: bool,
) -> Option<String> {
    let name = without_indices(path);
    match value {
        Value::Object(_) if takes_tables => Some(format!(
            "write [[{name}]] instead of [{name}]: there may be several, each below its header"
        )),
        Value::Array(entries)
            if takes_table && !entries.is_empty() && entries.iter().all(Value::is_object) =>
        {
            Some(format!(
                "write [{name}] instead of [[{name}]]: there is one"
            ))
        }
        _ => None,
    }
}

/// Returns a path as in headers: `material.prony` for `material[0].prony`.
fn without_indices(path: &str) -> String {
    let parts = path.split('[');
    let parts = parts.map(|part| part.split_once(']').map_or(part, |(_, rest)| rest));
    parts.collect()
}
