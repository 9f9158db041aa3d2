//! Wrong brackets in TOML headers: `[fixed]` instead of `[[fixed]]`, or the reverse.

use serde_json::Value;

/// Returns advice on the header of the `value` at `path` if a single table is given instead of a list of tables, or the
/// reverse. According to the schema, the value may be a table, a list of tables, or neither.
pub(super) fn right(
    value: &Value,
    path: &str,
    takes_table: bool,
    takes_tables: bool,
) -> Option<String> {
    let name = without_indices(path);
    match value {
        Value::Object(_) if takes_tables => Some(format!(
            "write [[{name}]] instead of [{name}]: there may be several, each under its own header"
        )),
        Value::Array(entries)
            if takes_table && !entries.is_empty() && entries.iter().all(Value::is_object) =>
        {
            Some(format!("write [{name}] instead of [[{name}]]: a scene has only one"))
        }
        _ => None,
    }
}

/// Returns a path without indices, as it appears in headers: `material.prony` for `material[0].prony`.
fn without_indices(path: &str) -> String {
    let parts = path.split('[');
    let parts = parts.map(|part| part.split_once(']').map_or(part, |(_, rest)| rest));
    parts.collect()
}
