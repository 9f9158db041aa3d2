//! The scene reference of the guide, from the schema.

use serde_json::Value;

use super::check::written;
use super::schema;

/// All keys of a scene with their meaning, units, ranges and defaults, as Markdown.
pub fn reference() -> String {
    let schema = schema().to_value();
    let mut text = String::from(
        "# Scene reference\n\nMade from the types by `myovib schema --markdown`. Units are SI. A key may be \
         left out unless it says *required*.\n",
    );
    text += &object(&schema);
    let definitions = schema["$defs"].as_object().into_iter().flatten();
    for (name, definition) in definitions {
        text += &format!("\n## {name}\n\n{}\n", description(definition));
        text += &object(definition);
        text += &alternatives(definition);
    }
    text
}

fn description(schema: &Value) -> &str {
    schema["description"].as_str().unwrap_or_default()
}

/// The keys of an object, a line each.
fn object(schema: &Value) -> String {
    let Some(properties) = schema["properties"].as_object() else {
        return String::new();
    };
    let required = |key: &str| {
        schema["required"]
            .as_array()
            .is_some_and(|all| all.iter().any(|name| name == key))
    };
    let mut text = String::new();
    for (key, property) in properties {
        if property["const"].is_string() {
            continue;
        }
        if text.is_empty() {
            text.push('\n');
        }
        let presence = match &property["default"] {
            Value::Null if required(key) => ", *required*".to_owned(),
            Value::Null | Value::Object(_) => String::new(),
            value => format!(", default `{value}`"),
        };
        let (kind, meaning) = (kind(property), line(description(property)));
        text += &format!("- `{key}` ({kind}{presence}): {meaning}\n");
    }
    text
}

/// The alternatives of a definition: names of a choice, or the tables told apart by a tag.
fn alternatives(schema: &Value) -> String {
    let both = schema["oneOf"]
        .as_array()
        .into_iter()
        .chain(schema["anyOf"].as_array());
    let mut text = String::new();
    for one in both.flatten() {
        let tag = one["properties"].as_object().and_then(|properties| {
            properties
                .iter()
                .find_map(|(key, value)| Some((key, value["const"].as_str()?)))
        });
        match (tag, one["const"].as_str()) {
            (Some((key, name)), _) => {
                text += &format!("\n**`{key} = \"{name}\"`**: {}\n", description(one));
                text += &object(one);
            }
            (None, Some(name)) => text += &format!("\n- `\"{name}\"`: {}", line(description(one))),
            (None, None) => text += &format!("\n- {}", kind(one)),
        }
    }
    text.trim_end_matches(' ').to_owned() + "\n"
}

/// The kind of a value with its range.
fn kind(schema: &Value) -> String {
    if let Some(name) = schema["$ref"]
        .as_str()
        .and_then(|r| r.strip_prefix("#/$defs/"))
    {
        return format!("[{name}](#{})", name.to_lowercase());
    }
    let choices = schema["anyOf"].as_array().or(schema["oneOf"].as_array());
    if let Some(choices) = choices {
        let known = choices.iter().filter(|one| one["type"] != "null");
        return known.map(kind).collect::<Vec<_>>().join(" or ");
    }
    if let Some(constant) = schema["const"].as_str() {
        return format!("`\"{constant}\"`");
    }
    let name = match &schema["type"] {
        Value::Array(several) => several
            .iter()
            .find_map(|one| one.as_str().filter(|n| *n != "null")),
        one => one.as_str(),
    };
    let word = match name {
        Some("array") => {
            let entries = kind(&schema["items"]);
            return match (schema["minItems"].as_u64(), schema["maxItems"].as_u64()) {
                (Some(a), Some(b)) if a == b => format!("list of {a}: {entries}"),
                (Some(a), Some(b)) => format!("list of {a} to {b}: {entries}"),
                _ => format!("list: {entries}"),
            };
        }
        Some("object") => {
            let properties = schema["properties"].as_object().into_iter().flatten();
            let keys = properties.map(|(key, value)| format!("{key} = {}", kind(value)));
            return format!("`{{ {} }}`", keys.collect::<Vec<_>>().join(", "));
        }
        Some("integer") => "whole number",
        Some("string") => "text",
        Some("boolean") => "true or false",
        Some(other) => other,
        None => "value",
    };
    let bounds = [
        ("exclusiveMinimum", ">"),
        ("minimum", "≥"),
        ("exclusiveMaximum", "<"),
        ("maximum", "≤"),
    ];
    let ranges = bounds.iter().filter_map(|(key, sign)| {
        let bound = schema[*key].as_f64()?;
        // The widths of integer types are no ranges of physics.
        (bound.abs() < 4e9).then(|| format!(" {sign} {}", written(bound)))
    });
    word.to_owned() + &ranges.collect::<Vec<_>>().join(",")
}

fn line(text: &str) -> String {
    text.replace('\n', " ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_guide_has_the_present_reference() {
        let path = concat!(
            env!("CARGO_MANIFEST_DIR"),
            "/../../docs/src/scene-reference.md"
        );
        let written = std::fs::read_to_string(path).unwrap_or_default();
        assert!(
            written == reference(),
            "write it anew: myovib schema --markdown > docs/src/scene-reference.md"
        );
    }
}
