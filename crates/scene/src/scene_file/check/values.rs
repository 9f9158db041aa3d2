//! Checks of single values, and the errors of invalid values.

use serde_json::Value;

use super::{Problem, nearest, without_indices};
use crate::InputError;

pub(super) fn one_name(value: &Value, names: &[&str], path: &str) -> Result<(), Problem> {
    let given = value.as_str();
    if given.is_some_and(|name| names.contains(&name)) {
        return Ok(());
    }
    let error = InputError::new(format!("`{path}` has an unknown name"))
        .found(value)
        .allowed(names.join(", "));
    Err(Problem::new(path, suggest(error, given.and_then(|name| nearest(name, names)))))
}

pub(super) fn unknown_key(key: &str, known: &[&str], path_of_key: String, path: &str) -> Problem {
    let place = if path.is_empty() { "a scene".into() } else { format!("`{path}`") };
    let error = InputError::new(format!("{place} has no key `{key}`")).allowed(known.join(", "));
    Problem {
        at_key: true,
        path: path_of_key,
        error: suggest(error, nearest(key, known)),
        header: None,
    }
}

/// Adds the name that was probably intended.
pub(crate) fn suggest(error: InputError, name: Option<&str>) -> InputError {
    match name {
        Some(name) => error.next(format!("did you mean `{name}`?")),
        None => error,
    }
}

/// Rejects excessively large or small numbers. Their products would overflow in matrices, with an error that does not
/// refer to the key. Entries of lists may be small: coordinates of mesh files are often zero up to rounding.
pub(super) fn expect_moderate(x: f64, path: &str) -> Result<(), Problem> {
    const SMALLEST: f64 = 1e-30;
    const LARGEST: f64 = 1e20;
    let may_be_small = x == 0.0 || path.ends_with(']');
    if x.abs() <= LARGEST && (may_be_small || x.abs() >= SMALLEST) {
        return Ok(());
    }
    let error = InputError::new(format!("`{path}` has an implausible value"))
        .found(written(x))
        .allowed(format!("0, or a magnitude from {SMALLEST:e} to {LARGEST:e}"));
    Err(Problem::new(path, error))
}

pub(super) fn in_range(x: f64, schema: &Value, path: &str) -> Result<(), Problem> {
    type Rule = (&'static str, &'static str, fn(f64, f64) -> bool);
    let rules: [Rule; 4] = [
        ("exclusiveMinimum", "greater than", |x, bound| x > bound),
        ("minimum", "at least", |x, bound| x >= bound),
        ("exclusiveMaximum", "less than", |x, bound| x < bound),
        ("maximum", "at most", |x, bound| x <= bound),
    ];
    let bounds: Vec<_> = rules
        .into_iter()
        .filter_map(|(key, words, holds)| Some((schema[key].as_f64()?, words, holds)))
        .collect();
    if bounds.iter().all(|(bound, _, holds)| holds(x, *bound)) {
        return Ok(());
    }
    let words: Vec<String> =
        bounds.iter().map(|(bound, words, _)| format!("{words} {}", written(*bound))).collect();
    let error = InputError::new(format!("`{path}` is out of range"))
        .found(written(x))
        .allowed(describe(words.join(" and "), schema));
    Err(Problem::new(path, error))
}

/// Formats a number; small and large numbers have an exponent.
pub(in crate::scene_file) fn written(x: f64) -> String {
    match x.abs() {
        size if size > 0.0 && !(1e-4..1e16).contains(&size) => format!("{x:e}"),
        _ => x.to_string(),
    }
}

pub(super) fn wrong_kind(value: &Value, expected: &str, schema: &Value, path: &str) -> Problem {
    let (problem, found) = match value.as_str() {
        // The user writes `inf`, which JSON cannot contain.
        Some("inf") => ("must be finite", "inf".to_owned()),
        _ => {
            ("has a value of the wrong type", format!("{}: {value}", with_article(kind_of(value))))
        }
    };
    let error = InputError::new(format!("`{path}` {problem}"))
        .found(found)
        .allowed(describe(expected.to_owned(), schema));
    Problem::new(path, error)
}

/// Returns advice on the header of the `value` at `path` if a single table is given instead of a list of tables, or the
/// reverse. According to the schema, the value may be a table, a list of tables, or neither.
pub(super) fn right_header(
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

/// Returns the allowed values with the meaning of the key, which states its unit.
pub(super) fn describe(allowed: String, schema: &Value) -> String {
    match schema["description"].as_str() {
        Some(text) => format!("{allowed} ({})", first_sentence(text)),
        None => allowed,
    }
}

pub(super) fn first_sentence(text: &str) -> String {
    let text = text.replace('\n', " ");
    let end = text.find(". ").unwrap_or(text.len());
    text[..end].trim_end_matches('.').to_owned()
}

/// Returns the kinds named in a schema, except for null.
pub(super) fn kinds(schema: &Value) -> impl Iterator<Item = &str> {
    let one = schema["type"].as_str();
    let several = schema["type"].as_array().into_iter().flatten().filter_map(Value::as_str);
    one.into_iter().chain(several).filter(|kind| *kind != "null")
}

pub(super) fn is_kind(value: &Value, kind: &str) -> bool {
    kind_of(value) == kind || (kind == "number" && value.is_number())
}

fn kind_of(value: &Value) -> &'static str {
    match value {
        Value::Null => "null",
        Value::Bool(_) => "boolean",
        Value::Number(number) if number.is_f64() => "number",
        Value::Number(_) => "integer",
        Value::String(_) => "string",
        Value::Array(_) => "array",
        Value::Object(_) => "object",
    }
}

/// Returns the TOML word for a kind of JSON value.
pub(super) fn with_article(kind: &str) -> &'static str {
    match kind {
        "boolean" => "true or false",
        "number" => "a number",
        "integer" => "a whole number",
        "string" => "a text",
        "array" => "a list",
        "object" => "a table",
        _ => "nothing",
    }
}
