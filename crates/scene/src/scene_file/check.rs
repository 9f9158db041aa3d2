//! Validation of a scene's tree against the JSON Schema of its types.
//!
//! This module supports the subset of JSON Schema that the scene types use: references, closed objects, alternatives
//! distinguished by a tag or by the kind of value, ranges, lengths, and unique entries. The check ends at the first
//! problem.

mod values;

use serde_json::{Map, Value, json};

use crate::InputError;
pub(crate) use values::suggest;
pub(super) use values::written;
use values::{
    describe, expect_moderate, first_sentence, in_range, is_kind, kinds, one_name, right_header,
    unknown_key, with_article, wrong_kind,
};

/// Problem of a value and its location.
#[derive(Debug, Clone)]
pub(crate) struct Problem {
    /// Path of the value, as in `material[0].c10`; empty for the whole scene.
    pub(crate) path: String,
    /// Whether the key is wrong rather than its value.
    pub(crate) at_key: bool,
    /// Error without its location.
    pub(crate) error: InputError,
    /// The correct header, if the value is given under a header.
    pub(crate) header: Option<String>,
}

impl Problem {
    /// Creates a problem with the value at `path`.
    pub(crate) fn new(path: &str, error: InputError) -> Self {
        Self { path: path.to_owned(), at_key: false, error, header: None }
    }
}

/// Checks `value` against `schema`, a complete schema document with its `$defs`.
pub(super) fn check(value: &Value, schema: &Value) -> Result<(), Problem> {
    Checker { definitions: schema.get("$defs") }.value(value, schema, "")
}

pub(super) fn member(path: &str, key: &str) -> String {
    if path.is_empty() { key.to_owned() } else { format!("{path}.{key}") }
}

pub(super) fn entry(path: &str, index: usize) -> String {
    format!("{path}[{index}]")
}

/// Returns a path without indices: `material.c10` for `material[0].c10` and `material.0.c10`.
pub(super) fn without_indices(path: &str) -> String {
    let parts = path.split(['.', '[', ']']);
    let names = parts.filter(|part| !part.is_empty() && part.parse::<usize>().is_err());
    names.collect::<Vec<_>>().join(".")
}

/// Returns the candidate most similar to `word`, if any is similar.
pub(crate) fn nearest<'a>(word: &str, candidates: &[&'a str]) -> Option<&'a str> {
    // The Jaro-Winkler similarity tolerates swapped letters and gives more weight to the beginning.
    // Words with a similarity below 0.75 have little in common.
    candidates
        .iter()
        .map(|candidate| (strsim::jaro_winkler(word, candidate), *candidate))
        .filter(|(likeness, _)| *likeness > 0.75)
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, candidate)| candidate)
}

struct Checker<'s> {
    definitions: Option<&'s Value>,
}

impl<'s> Checker<'s> {
    fn value(&self, value: &Value, schema: &'s Value, path: &str) -> Result<(), Problem> {
        let schema = self.resolve(schema);
        match self.alternatives(schema) {
            Some(alternatives) => self.one_of(value, schema, &alternatives, path),
            None => self.plain(value, &[schema], path),
        }
    }

    fn resolve(&self, mut schema: &'s Value) -> &'s Value {
        while let Some(name) = schema["$ref"].as_str().and_then(|r| r.strip_prefix("#/$defs/")) {
            schema = self
                .definitions
                .and_then(|definitions| definitions.get(name))
                .expect("references lead to definitions of the same document");
        }
        schema
    }

    /// Returns the alternatives of a schema, except for null, which TOML does not have.
    fn alternatives(&self, schema: &'s Value) -> Option<Vec<&'s Value>> {
        let all = schema.get("oneOf").or_else(|| schema.get("anyOf"))?.as_array()?;
        Some(all.iter().filter(|one| one["type"] != "null").map(|one| self.resolve(one)).collect())
    }

    /// Checks a value against the intended alternative, which is identified by the tag of a table, by the list of
    /// names, or by kind (number, text, table, list). An error then concerns this alternative only.
    fn one_of(
        &self,
        value: &Value,
        base: &'s Value,
        alternatives: &[&'s Value],
        path: &str,
    ) -> Result<(), Problem> {
        if let [only] = alternatives {
            return self.value(value, only, path);
        }
        if let (Some(tag), Some(object)) = (common_tag(alternatives), value.as_object()) {
            let branch = choose_by_tag(object, tag, alternatives, path)?;
            expect_own_keys(object, tag, [base, branch], alternatives, path)?;
            return self.plain(value, &[base, branch], path);
        }
        if value.is_string() && alternatives.iter().all(|one| one["const"].is_string()) {
            let names: Vec<&str> =
                alternatives.iter().filter_map(|a| a["const"].as_str()).collect();
            return one_name(value, &names, path);
        }
        let fitting: Vec<&Value> =
            alternatives.iter().copied().filter(|one| self.accepts_kind(one, value)).collect();
        // Alternative tables are distinguished by a key, and alternative lists by their first entry.
        let alike = fitting.iter().find(|one| self.resembles(one, value));
        if let (None, [_, _, ..], Some(object)) = (alike, &fitting[..], value.as_object())
            && let Some(key) = object.keys().next()
        {
            let known = fitting.iter().filter_map(|one| one["properties"].as_object());
            let known: Vec<&str> = known.flat_map(Map::keys).map(String::as_str).collect();
            return Err(unknown_key(key, &known, member(path, key), path));
        }
        match alike.or(fitting.first()) {
            Some(one) => self.value(value, one, path),
            None => {
                let choice = alternatives.iter().find(|one| self.is_choice(one));
                if let (true, Some(choice)) = (value.is_string(), choice) {
                    return self.value(value, choice, path);
                }
                let mut kinds: Vec<String> = Vec::new();
                for kind in alternatives.iter().map(|one| self.kind_name(one)) {
                    if !kinds.contains(&kind) {
                        kinds.push(kind);
                    }
                }
                Err(self.wrong_kind(value, &kinds.join(" or "), base, path))
            }
        }
    }

    /// Returns whether the value has the kind (number, text, table, list) that the schema
    /// describes.
    fn accepts_kind(&self, schema: &'s Value, value: &Value) -> bool {
        match self.alternatives(schema) {
            Some(alternatives) => alternatives.iter().any(|one| self.accepts_kind(one, value)),
            None => match schema.get("const") {
                Some(constant) => value == constant,
                None => kinds(schema).any(|kind| is_kind(value, kind)),
            },
        }
    }

    /// Returns whether the schema is a choice of names.
    fn is_choice(&self, schema: &'s Value) -> bool {
        let names = self.alternatives(schema);
        names.is_some_and(|names| names.iter().all(|one| one["const"].is_string()))
    }

    /// Returns whether a table has a key from the schema, or whether the first entry of a list has the right kind.
    fn resembles(&self, schema: &'s Value, value: &Value) -> bool {
        match value {
            Value::Object(object) => {
                object.keys().any(|key| schema["properties"].get(key).is_some())
            }
            Value::Array(entries) => entries
                .first()
                .is_none_or(|first| self.accepts_kind(self.resolve(&schema["items"]), first)),
            _ => true,
        }
    }

    fn kind_name(&self, schema: &'s Value) -> String {
        if let Some(constant) = schema.get("const") {
            return constant.to_string();
        }
        let first = self.alternatives(schema).and_then(|all| all.first().copied());
        let kind = kinds(first.unwrap_or(schema)).next().map_or("a value", with_article);
        kind.to_owned()
    }

    /// Checks a value without alternatives. An object may be described by several schemas together.
    fn plain(&self, value: &Value, schemas: &[&'s Value], path: &str) -> Result<(), Problem> {
        let schema = schemas[0];
        if let Some(names) = schema["enum"].as_array() {
            let names: Vec<&str> = names.iter().filter_map(Value::as_str).collect();
            return one_name(value, &names, path);
        }
        if let Some(constant) = schema["const"].as_str() {
            return one_name(value, &[constant], path);
        }
        let has_kind = schemas.len() == 1 && kinds(schema).next().is_some();
        if has_kind && !kinds(schema).any(|kind| is_kind(value, kind)) {
            return Err(self.wrong_kind(value, &self.kind_name(schema), schema, path));
        }
        match value {
            Value::Number(number) => {
                let x = number.as_f64().unwrap_or(f64::NAN);
                in_range(x, schema, path)?;
                expect_moderate(x, path)
            }
            Value::Array(entries) => self.list(entries, schema, path),
            Value::Object(object) => self.object(object, schemas, path),
            _ => Ok(()),
        }
    }

    fn wrong_kind(&self, value: &Value, expected: &str, schema: &'s Value, path: &str) -> Problem {
        let takes_table = |schema: &'s Value| self.accepts_kind(self.resolve(schema), &json!({}));
        let takes_tables = schema.get("items").is_some_and(takes_table);
        Problem {
            header: right_header(value, path, takes_table(schema), takes_tables),
            ..wrong_kind(value, expected, schema, path)
        }
    }

    fn list(&self, entries: &[Value], schema: &'s Value, path: &str) -> Result<(), Problem> {
        let length = |key: &str| schema[key].as_u64().map(|n| n as usize);
        let (least, most) = (length("minItems"), length("maxItems"));
        if least.is_some_and(|n| entries.len() < n) || most.is_some_and(|n| entries.len() > n) {
            let allowed = match (least, most) {
                (Some(least), Some(most)) if least == most => format!("{least} entries"),
                (Some(least), None) => format!("at least {least}"),
                (least, most) => {
                    format!("{} to {} entries", least.unwrap_or(0), most.unwrap_or(usize::MAX))
                }
            };
            let error = InputError::new(format!("the list `{path}` has the wrong length"))
                .found(format!("{} entries", entries.len()))
                .allowed(describe(allowed, schema));
            return Err(Problem::new(path, error));
        }
        let again =
            |&i: &usize| schema["uniqueItems"] == true && entries[..i].contains(&entries[i]);
        if let Some(i) = (1..entries.len()).find(again) {
            let error = InputError::new(format!("{} is in the list `{path}` twice", entries[i]))
                .next("list it once");
            return Err(Problem::new(&entry(path, i), error));
        }
        entries
            .iter()
            .enumerate()
            .try_for_each(|(i, one)| self.value(one, &schema["items"], &entry(path, i)))
    }

    fn object(
        &self,
        object: &Map<String, Value>,
        schemas: &[&'s Value],
        path: &str,
    ) -> Result<(), Problem> {
        let properties = |key: &str| schemas.iter().find_map(|s| s["properties"].get(key));
        let known: Vec<&str> = schemas
            .iter()
            .filter_map(|schema| schema["properties"].as_object())
            .flat_map(|properties| properties.keys().map(String::as_str))
            .collect();
        for (key, value) in object {
            let path_of_key = member(path, key);
            match properties(key) {
                Some(schema) => self.value(value, schema, &path_of_key)?,
                None => return Err(unknown_key(key, &known, path_of_key, path)),
            }
        }
        let required = schemas.iter().filter_map(|s| s["required"].as_array()).flatten();
        match required.filter_map(Value::as_str).find(|key| !object.contains_key(*key)) {
            Some(key) => {
                let place = if path.is_empty() { "the scene".into() } else { format!("`{path}`") };
                let mut error = InputError::new(format!("{place} needs `{key}`"));
                if let Some(text) = properties(key).and_then(|s| s["description"].as_str()) {
                    error = error.next(format!("give `{key}`: {}", first_sentence(text)));
                }
                Err(Problem::new(path, error))
            }
            None => Ok(()),
        }
    }
}

/// Returns the key whose constant distinguishes the alternatives, if all are objects with such a
/// key.
fn common_tag<'s>(alternatives: &[&'s Value]) -> Option<&'s str> {
    let tag_of = |one: &'s Value| {
        let mut properties = one["properties"].as_object()?.iter();
        properties.find(|(_, schema)| schema["const"].is_string()).map(|(key, _)| key.as_str())
    };
    let tag = tag_of(alternatives.first()?)?;
    alternatives.iter().all(|one| tag_of(one) == Some(tag)).then_some(tag)
}

/// Rejects a key that belongs to an alternative other than the chosen `branch`.
fn expect_own_keys(
    object: &Map<String, Value>,
    tag: &str,
    [base, branch]: [&Value; 2],
    alternatives: &[&Value],
    path: &str,
) -> Result<(), Problem> {
    let has = |one: &Value, key: &str| !one["properties"][key].is_null();
    for key in object.keys() {
        if has(base, key) || has(branch, key) {
            continue;
        }
        let others = alternatives.iter().filter(|one| has(one, key));
        let others = others.filter_map(|one| one["properties"][tag]["const"].as_str());
        let others: Vec<&str> = others.collect();
        if !others.is_empty() {
            let own = branch["properties"].as_object().into_iter().flatten();
            let own = own.map(|(key, _)| key.as_str()).filter(|key| *key != tag);
            let (chosen, own) = (&object[tag], own.collect::<Vec<_>>().join(", "));
            let error =
                InputError::new(format!("`{path}` with `{tag} = {chosen}` has no key `{key}`"))
                    .allowed(own)
                    .next(format!("`{tag}` with this key: {}", others.join(", ")));
            return Err(Problem { at_key: true, ..Problem::new(&member(path, key), error) });
        }
    }
    Ok(())
}

fn choose_by_tag<'s>(
    object: &Map<String, Value>,
    tag: &str,
    alternatives: &[&'s Value],
    path: &str,
) -> Result<&'s Value, Problem> {
    let name_of = |one: &'s Value| one["properties"][tag]["const"].as_str().unwrap_or_default();
    let names: Vec<&str> = alternatives.iter().map(|one| name_of(one)).collect();
    let Some(given) = object.get(tag) else {
        let error = InputError::new(format!("`{path}` needs `{tag}`")).allowed(names.join(", "));
        return Err(Problem::new(path, error));
    };
    one_name(given, &names, &member(path, tag))?;
    let chosen = alternatives.iter().find(|one| Some(name_of(one)) == given.as_str());
    Ok(chosen.expect("the name is one of the alternatives'"))
}
