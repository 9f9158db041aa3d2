//! Headers of TOML whose brackets are wrong: `[fixed]` in place of `[[fixed]]`, and the reverse.

use serde_json::Value;

/// The header to write for the `value` at `path` where that of one table stands for a list of tables, or the reverse;
/// the schema takes a table or a list of tables, or neither.
pub(super) fn right(
    value: &Value,
    path: &str,
    takes_table: bool,
    takes_tables: bool,
) -> Option<String> {
    let name = without_indices(path);
    match value {
        Value::Object(_) if takes_tables => Some(format!(
            "write [[{name}]] in place of [{name}]: there may be several, each below its header"
        )),
        Value::Array(entries)
            if takes_table && !entries.is_empty() && entries.iter().all(Value::is_object) =>
        {
            Some(format!(
                "write [{name}] in place of [[{name}]]: there is one"
            ))
        }
        _ => None,
    }
}

/// A path as headers have it: `material.prony` of `material[0].prony`.
fn without_indices(path: &str) -> String {
    let parts = path.split('[');
    let parts = parts.map(|part| part.split_once(']').map_or(part, |(_, rest)| rest));
    parts.collect()
}
