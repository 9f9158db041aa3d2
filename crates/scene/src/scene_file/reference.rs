//! Scene reference of the guide, generated from the schema in the order of a scene file.

mod sections;

use std::collections::{BTreeMap, BTreeSet, VecDeque};

use serde_json::Value;

use super::check::written;
use super::schema;
use sections::{parts, sections};

/// Definitions used by many keys: name, type shown in the list of keys, and title. In the reference, these definitions
/// follow the sections.
const SHARED: &[[&str; 3]] = &[
    ["Function", "function", "Functions of time"],
    ["SpatialFactor", "factor", "Spatial factors"],
    ["Direction", "direction", "Directions of fibers and sheets"],
    ["Quantity", "quantity", "Quantities"],
];

fn shared(name: &str) -> Option<&'static [&'static str; 3]> {
    SHARED.iter().find(|[shared, ..]| *shared == name)
}

/// Returns all keys of a scene with meanings, units, ranges, defaults and examples, as Markdown.
pub fn reference() -> String {
    let schema = schema().to_value();
    let mut page = Page {
        schema: &schema,
        text: String::from(
            "# Scene reference\n\nAll keys of a scene, in the usual order of a file. `[name]` occurs once, `[[name]]` may \
             be repeated. Units are SI. **Bold** keys are required. Values are numbers unless a type is given; a \
             vector is a list of 2 or 3 numbers. \
             `myovib schema --markdown` prints this page.\n",
        ),
        open: VecDeque::new(),
        printed: BTreeSet::new(),
        anchors: BTreeMap::new(),
    };
    for example in sections() {
        page.section(example);
    }
    for [name, _, title] in SHARED {
        page.open.push_back((*name, format!("## {title}")));
        page.definitions();
    }
    page.text
}

struct Page<'a> {
    schema: &'a Value,
    text: String,
    /// Definitions still to be printed, with their headings.
    open: VecDeque<(&'a str, String)>,
    printed: BTreeSet<&'a str>,
    /// Anchors of the definitions that have their own heading. A definition gets its heading at its first use.
    anchors: BTreeMap<&'a str, String>,
}

impl<'a> Page<'a> {
    fn section(&mut self, example: &str) {
        let (title, keys) = parts(example);
        self.text += &format!("\n## {title}\n");
        let properties = &self.schema["properties"];
        match keys[..] {
            [key] => {
                let property = &properties[key];
                let entry = references(property).into_iter().next();
                let body = entry.map_or(property, |name| self.definition(name));
                self.printed.extend(entry);
                self.text += &format!("\n{}\n", line(description(body)));
                self.body(body, key);
            }
            _ => {
                self.text.push('\n');
                for key in &keys {
                    self.key(key, &properties[*key], false, key);
                }
            }
        }
        self.text += &format!("\n```toml\n{example}\n```\n");
        self.definitions();
    }

    /// Prints the definitions to which the previous text refers.
    fn definitions(&mut self) {
        while let Some((name, heading)) = self.open.pop_front() {
            if !self.printed.insert(name) {
                continue;
            }
            let definition = self.definition(name);
            let about = line(description(definition));
            self.text += &format!("\n{heading}\n\n{about}\n");
            let path = heading.trim_start_matches(['#', ' ']).replace('`', "");
            self.body(definition, &path);
        }
    }

    fn definition(&self, name: &str) -> &'a Value {
        &self.schema["$defs"][name]
    }

    /// Prints the keys of an object and its alternatives.
    fn body(&mut self, schema: &'a Value, path: &str) {
        self.object(schema, path);
        self.alternatives(schema, path);
    }

    fn object(&mut self, schema: &'a Value, path: &str) {
        let Some(properties) = schema["properties"].as_object() else {
            return;
        };
        let is_required = |key: &str| {
            let required = schema["required"].as_array();
            required.is_some_and(|all| all.iter().any(|name| name == key))
        };
        let mut keys: Vec<_> =
            properties.iter().filter(|(_, property)| !property["const"].is_string()).collect();
        // The map is sorted by name. Required keys are printed first.
        keys.sort_by_key(|(key, _)| !is_required(key));
        if !keys.is_empty() {
            self.text.push('\n');
        }
        // Keys that differ only in their name, such as x, y and z, share a line.
        let same = |(a, x): &(&String, &Value), (b, y): &(&String, &Value)| {
            x == y && is_required(a) == is_required(b)
        };
        for alike in keys.chunk_by(same) {
            let names: Vec<_> = alike.iter().map(|(key, _)| key.as_str()).collect();
            let (key, property) = alike[0];
            self.key(&names.join("`, `"), property, is_required(key), path);
        }
    }

    /// Prints a key, its type, default and meaning in one line, and named choices below it.
    fn key(&mut self, key: &str, property: &'a Value, required: bool, path: &str) {
        let default = match &property["default"] {
            Value::Null | Value::Object(_) => None,
            value => Some(format!("default `{value}`")),
        };
        let child = format!("{path}.{key}");
        let kind = self.kind(property, &child);
        let meaning = line(description(property));
        // The type is omitted for numbers, which show their default, and for names, which are listed below.
        let kind = Some(kind).filter(|kind| kind != "number" && kind != "name");
        let notes: Vec<_> = kind.into_iter().chain(default).collect();
        let notes = match notes.join(", ") {
            notes if notes.is_empty() => notes,
            notes => format!(" ({notes})"),
        };
        let bold = if required { "**" } else { "" };
        self.text += &format!("- {bold}`{key}`{bold}{notes}: {meaning}\n");
        for name in self.choices_of(property) {
            if self.printed.insert(name) {
                for one in explained(self.definition(name)) {
                    let (name, about) = (&one["const"], line(description(one)));
                    self.text += &format!("  - `{name}`: {about}\n");
                }
            }
        }
    }

    /// Returns the lists of names that a property allows, except for shared lists.
    fn choices_of(&self, property: &'a Value) -> Vec<&'a str> {
        let mut found = Vec::new();
        for name in references(property) {
            let definition = self.definition(name);
            if is_choice(definition) && shared(name).is_none() {
                found.push(name);
            } else if !is_choice(definition) && !is_table(definition) {
                found.extend(self.choices_of(definition));
            }
        }
        found
    }

    /// Prints named choices, or the tables that a tag distinguishes.
    fn alternatives(&mut self, schema: &'a Value, path: &str) {
        let mut lists: Vec<(String, &str)> = Vec::new();
        for one in choices(schema) {
            let tag = one["properties"].as_object().and_then(|properties| {
                let mut keys = properties.iter();
                keys.find_map(|(key, value)| Some((key, value["const"].as_str()?)))
            });
            let about = line(description(one));
            match (tag, one["const"].as_str()) {
                (Some((key, name)), _) => {
                    if !self.text.ends_with('\n') {
                        self.text.push('\n');
                    }
                    self.text += &format!("\n`{key} = \"{name}\"`: {about}\n");
                    let start = self.text.len();
                    self.object(one, path);
                    let list = self.text[start..].to_owned();
                    match lists.iter().find(|(other, _)| *other == list) {
                        Some((_, first)) if list.len() > 100 => {
                            self.text.truncate(start);
                            self.text += &format!("\nKeys as for `{first}`.\n");
                        }
                        _ => lists.push((list, name)),
                    }
                }
                (None, Some(name)) => {
                    self.text += &format!("\n- `\"{name}\"`: {about}");
                }
                (None, None) => self.alternative(one, path),
            }
        }
        if !self.text.ends_with('\n') {
            self.text.push('\n');
        }
    }

    /// Prints an alternative without a name.
    fn alternative(&mut self, one: &'a Value, path: &str) {
        let name = reference_of(one);
        let nested = name.map(|name| self.definition(name));
        match nested.filter(|definition| is_table(definition)) {
            Some(definition) => {
                self.printed.extend(name);
                if definition["properties"].is_object() {
                    let about = line(description(definition));
                    self.text += &format!("\n- table: {about}\n");
                }
                self.body(definition, path);
            }
            None => {
                let (kind, about) = (self.kind(one, path), line(description(one)));
                let about = if about.is_empty() { about } else { format!(": {about}") };
                self.text += &format!("\n- {kind}{about}");
            }
        }
    }

    /// Returns the type of a value with its range, and queues the definition to which it refers for printing.
    fn kind(&mut self, schema: &'a Value, path: &str) -> String {
        if let Some(name) = reference_of(schema) {
            return self.named(name, path);
        }
        let several = schema["anyOf"].as_array().or(schema["oneOf"].as_array());
        if let Some(several) = several {
            let known = several.iter().filter(|one| one["type"] != "null");
            let kinds: Vec<_> = known.map(|one| self.kind(one, path)).collect();
            return kinds.join(" or ");
        }
        if let Some(constant) = schema["const"].as_str() {
            return format!("`\"{constant}\"`");
        }
        match type_name(schema) {
            Some("array") => {
                let entries = self.kind(&schema["items"], path);
                let count = match (schema["minItems"].as_u64(), schema["maxItems"].as_u64()) {
                    (Some(a), Some(b)) if a == b => format!("list of {a}"),
                    (Some(a), Some(b)) => format!("list of {a} to {b}"),
                    _ => "list".to_owned(),
                };
                match (&*count, &*entries) {
                    ("list of 2 to 3", "number") => "vector".to_owned(),
                    (_, "number") => count,
                    (_, "integer ≥1") => {
                        format!("{} integers ≥1", count.trim_start_matches("list of "))
                    }
                    _ => format!("{count}: {entries}"),
                }
            }
            Some("object") => {
                let properties = schema["properties"].as_object().into_iter().flatten();
                let keys: Vec<_> = properties
                    .map(|(key, value)| format!("{key} = {}", self.kind(value, path)))
                    .collect();
                format!("`{{ {} }}`", keys.join(", "))
            }
            name => scalar(name, &range(schema)),
        }
    }

    /// Returns the type of a definition: a short description inline, or a link to its heading.
    fn named(&mut self, name: &'a str, path: &str) -> String {
        let definition = self.definition(name);
        if let Some([_, kind, title]) = shared(name) {
            return format!("[{kind}](#{})", title.to_lowercase().replace(' ', "-"));
        }
        if is_choice(definition) {
            let names: Vec<_> =
                choices(definition).map(|one| format!("`{}`", one["const"])).collect();
            let has_list = explained(definition).next().is_some() && !self.printed.contains(name);
            return if !has_list { names.join(" or ") } else { "name".to_owned() };
        }
        if !is_table(definition) {
            let several: Vec<_> = choices(definition).map(|one| self.kind(one, path)).collect();
            return several.join(" or ");
        }
        self.open.push_back((name, format!("### `{path}`")));
        let anchor = self.anchors.entry(name);
        let anchor = anchor.or_insert_with(|| path.replace('.', ""));
        format!("[table](#{anchor})")
    }
}

fn description(schema: &Value) -> &str {
    schema["description"].as_str().unwrap_or_default()
}

/// Returns the alternatives of a definition.
fn choices(schema: &Value) -> impl Iterator<Item = &Value> {
    let one_of = schema["oneOf"].as_array().into_iter().flatten();
    let any_of = schema["anyOf"].as_array().into_iter().flatten();
    one_of.chain(any_of)
}

/// Returns the named choices with a description.
fn explained(schema: &Value) -> impl Iterator<Item = &Value> {
    choices(schema).filter(|one| !description(one).is_empty())
}

/// Returns whether a definition is a list of names.
fn is_choice(schema: &Value) -> bool {
    choices(schema).next().is_some() && choices(schema).all(|one| one["const"].is_string())
}

/// Returns whether a definition is a table, or one of several tables, depending on a tag.
fn is_table(schema: &Value) -> bool {
    let is_tagged = |one: &Value| {
        let properties = one["properties"].as_object().into_iter().flatten();
        properties.into_iter().any(|(_, value)| value["const"].is_string())
    };
    schema["properties"].is_object() || choices(schema).any(is_tagged)
}

fn reference_of(schema: &Value) -> Option<&str> {
    schema["$ref"].as_str()?.strip_prefix("#/$defs/")
}

/// Returns the definitions to which a property refers, including references in lists and alternatives.
fn references(schema: &Value) -> Vec<&str> {
    let entries = [&schema["items"]].into_iter().chain(choices(schema));
    let below = entries.filter(|one| one.is_object()).flat_map(references);
    reference_of(schema).into_iter().chain(below).collect()
}

fn type_name(schema: &Value) -> Option<&str> {
    match &schema["type"] {
        Value::Array(several) => {
            several.iter().find_map(|one| one.as_str().filter(|name| *name != "null"))
        }
        one => one.as_str(),
    }
}

/// Returns a type with its range; a range without a type belongs to a number.
fn scalar(name: Option<&str>, range: &str) -> String {
    let name = match name {
        Some("integer") => "integer",
        Some("string") => "text",
        Some("boolean") => "boolean",
        Some("number") if !range.is_empty() => "",
        Some(other) => other,
        None => "value",
    };
    format!("{name} {range}").trim().to_owned()
}

/// Bounds above this size are not printed: they only detect typing errors or are limits of integer types.
const LARGE: f64 = 1e6;

fn range(schema: &Value) -> String {
    let (low, high) = (schema["minimum"].as_f64(), schema["maximum"].as_f64());
    if let (Some(low), Some(high)) = (low, high)
        && high < LARGE
    {
        return format!("{} to {}", written(low), written(high));
    }
    let bounds =
        [("exclusiveMinimum", ">"), ("minimum", "≥"), ("exclusiveMaximum", "<"), ("maximum", "≤")];
    let ranges = bounds.iter().filter_map(|(key, sign)| {
        let bound = schema[*key].as_f64()?;
        (bound.abs() < LARGE).then(|| format!("{sign}{}", written(bound)))
    });
    ranges.collect::<Vec<_>>().join(", ")
}

fn line(text: &str) -> String {
    text.replace('\n', " ")
}

#[cfg(test)]
mod tests {
    use super::super::read;
    use super::*;

    #[test]
    fn the_guide_contains_the_current_reference() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/src/scene-reference.md");
        let written = std::fs::read_to_string(path).unwrap_or_default();
        assert!(
            written == reference(),
            "regenerate it: myovib schema --markdown > docs/src/scene-reference.md"
        );
    }

    #[test]
    fn every_key_of_the_root_is_in_one_section() {
        let schema = schema().to_value();
        let mut keys: Vec<_> = schema["properties"].as_object().unwrap().keys().collect();
        let mut listed: Vec<_> = sections().flat_map(|example| parts(example).1).collect();
        keys.sort();
        listed.sort();
        assert_eq!(listed, keys);
    }

    #[test]
    fn every_definition_is_printed() {
        let schema = schema().to_value();
        let page = reference();
        for (name, definition) in schema["$defs"].as_object().unwrap() {
            let mut keys = vec![definition];
            keys.extend(choices(definition));
            let properties = keys.iter().filter_map(|one| one["properties"].as_object());
            for key in properties.flat_map(|properties| properties.keys()) {
                let forms = ["`KEY`", "`KEY =", " KEY = "];
                let mut forms = forms.iter().map(|form| form.replace("KEY", key));
                assert!(forms.any(|form| page.contains(&form)), "{name}: {key}");
            }
        }
    }

    #[test]
    fn examples_match_the_schema() {
        for example in sections() {
            if let Err(error) = read(&parts(example).0, example, &[]) {
                panic!("{error}");
            }
        }
    }
}
