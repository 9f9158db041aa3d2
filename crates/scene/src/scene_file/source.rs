//! Text of a scene as a tree of values with the location of each value.

use std::collections::HashMap;
use std::ops::Range;

use serde_json::{Map, Number, Value};
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::check::{Problem, entry, member};
use crate::InputError;

/// Origin of a value.
#[derive(Debug, Clone)]
enum Place {
    /// Byte ranges of its key, if any, and of the value itself.
    Text { key: Option<Range<usize>>, value: Range<usize> },
    /// Override, as typed.
    Override(String),
}

/// Text of a scene, its values, and their locations.
#[derive(Debug, Clone)]
pub struct Source {
    name: String,
    text: String,
    value: Value,
    places: HashMap<String, Place>,
}

impl Source {
    /// Parses TOML; `name` is the name of the file in messages.
    ///
    /// # Errors
    /// Returns an [`InputError`] with line and column for invalid TOML.
    pub fn parse(name: &str, text: &str) -> Result<Self, InputError> {
        let mut source = Self {
            name: name.to_owned(),
            text: text.to_owned(),
            value: Value::Null,
            places: HashMap::new(),
        };
        let table = DeTable::parse(text).map_err(|e| {
            let error = InputError::new(format!("the scene is not TOML: {}", e.message()));
            error.at(e.span().map_or(name.to_owned(), |span| source.locate(&span)))
        })?;
        source.value = source.table(table.get_ref(), "")?;
        Ok(source)
    }

    /// Returns the name of the file in messages.
    pub(crate) fn name(&self) -> &str {
        &self.name
    }

    /// Returns the line number of the key or list entry at `path`, and a description of its location. Overrides have no
    /// line number.
    pub(super) fn line(&self, path: &str) -> (Option<usize>, String) {
        match self.places.get(path) {
            Some(Place::Text { key, value }) => {
                let start = key.as_ref().unwrap_or(value).start;
                let line = self.text[..start].matches('\n').count() + 1;
                (Some(line), format!("line {line}"))
            }
            Some(Place::Override(text)) => (None, text.clone()),
            None => match path.rfind(['.', '[']) {
                Some(end) => self.line(&path[..end]),
                None => (None, self.name.clone()),
            },
        }
    }

    /// Returns the values: TOML converted to JSON, with `inf` as the text `"inf"`.
    pub fn value(&self) -> &Value {
        &self.value
    }

    pub fn text(&self) -> &str {
        &self.text
    }

    /// Applies an override `key=value`, such as `solid.bulk_modulus=inf` or `material.0.c10=2e4`.
    ///
    /// The value is TOML. Invalid TOML is treated as text, so that names need no quotes, unless it begins like a list,
    /// a table or a quoted string. Without a value, the key is removed and its default applies.
    ///
    /// # Errors
    /// Returns an [`InputError`] if `=` is missing, if a list or table is invalid, or if the path leads through a value
    /// that is neither a table nor a list.
    pub fn assign(&mut self, assignment: &str) -> Result<(), InputError> {
        let place = format!("--set {assignment}");
        let parts = assignment.split_once('=');
        let (path, text) = parts.filter(|(path, _)| !path.trim().is_empty()).ok_or_else(|| {
            InputError::new("an override needs a key and `=`")
                .at(&place)
                .allowed("key=value, as in solid.bulk_modulus=inf")
        })?;
        let value = match (text.trim(), DeValue::parse(text.trim())) {
            ("", _) => Value::Null,
            (_, Ok(value)) => self.convert(value.get_ref(), &|| place.clone())?,
            (text, Err(error)) if text.starts_with(['[', '{', '"']) => {
                let error = InputError::new(format!("the value is not TOML: {}", error.message()));
                return Err(error.at(&place));
            }
            (text, Err(_)) => Value::String(text.to_owned()),
        };
        let mut target = &mut self.value;
        let mut path_so_far = String::new();
        for key in path.trim().split(['.', '[', ']']).filter(|key| !key.is_empty()) {
            let n_entries = target.as_array().map(Vec::len);
            (target, path_so_far) = descend(target, key, &path_so_far).ok_or_else(|| {
                let message = format!("`{path_so_far}` has no entry `{key}`");
                let error = InputError::new(message).at(&place);
                match n_entries {
                    Some(n) => error
                        .allowed(format!("numbers below {n}"))
                        .next(format!("set the whole list `{path_so_far}` to add an entry")),
                    None => error,
                }
            })?;
        }
        *target = value;
        without_null(&mut self.value);
        let below = |path: &String| {
            path.strip_prefix(path_so_far.as_str()).is_some_and(|rest| rest.starts_with(['.', '[']))
        };
        self.places.retain(|path, _| !below(path));
        self.places.insert(path_so_far, Place::Override(place));
        Ok(())
    }

    /// Returns the message about a problem, with file, line, column and the line itself.
    pub(crate) fn report(&self, problem: Problem) -> InputError {
        let place = self.describe(&problem.path, problem.at_key);
        let error = problem.error.at(place);
        match problem.header.filter(|_| self.is_header(&problem.path)) {
            Some(header) => error.next(header),
            None => error,
        }
    }

    /// Returns whether the key at `path` is in a header, a line that begins with a bracket.
    fn is_header(&self, path: &str) -> bool {
        let Some(Place::Text { key: Some(key), .. }) = self.places.get(path) else {
            return false;
        };
        let line = self.text[..key.start].lines().next_back();
        line.is_some_and(|line| line.trim_start().starts_with('['))
    }

    /// Returns the location of `path`, or of the innermost value that contains it.
    fn describe(&self, path: &str, at_key: bool) -> String {
        let mut around = path;
        loop {
            match self.places.get(around) {
                Some(Place::Override(text)) => return text.clone(),
                Some(Place::Text { key, value }) => {
                    let range = if at_key { key.as_ref().unwrap_or(value) } else { value };
                    return self.locate(range);
                }
                None => match around.rfind(['.', '[']) {
                    Some(end) => around = &around[..end],
                    None => return self.name.clone(),
                },
            }
        }
    }

    /// Returns file, line and column of a range, and the line with the range underlined.
    fn locate(&self, range: &Range<usize>) -> String {
        let start = range.start.min(self.text.len());
        let line_start = self.text[..start].rfind('\n').map_or(0, |i| i + 1);
        let line = self.text[line_start..].lines().next().unwrap_or_default();
        let number = self.text[..line_start].matches('\n').count() + 1;
        let before = &self.text[line_start..start];
        // Tabs in the line are preserved, and repeated before the marks.
        let indent: String = before.chars().map(|c| if c == '\t' { c } else { ' ' }).collect();
        let end = range.end.clamp(start, line_start + line.len());
        let marks = self.text[start..end].chars().count().max(1);
        format!(
            "{}, line {number}, column {}\n{number:>4} | {line}\n     | {}{}",
            self.name,
            before.chars().count() + 1,
            indent,
            "^".repeat(marks)
        )
    }

    fn table(&mut self, table: &DeTable<'_>, path: &str) -> Result<Value, InputError> {
        let mut object = Map::new();
        for (key, value) in table {
            let path = member(path, key.get_ref());
            let converted = self.spanned(value, Some(key.span()), &path)?;
            object.insert(key.get_ref().to_string(), converted);
        }
        Ok(Value::Object(object))
    }

    fn spanned(
        &mut self,
        value: &Spanned<DeValue<'_>>,
        key: Option<Range<usize>>,
        path: &str,
    ) -> Result<Value, InputError> {
        self.places.insert(path.to_owned(), Place::Text { key, value: value.span() });
        match value.get_ref() {
            DeValue::Table(table) => self.table(table, path),
            DeValue::Array(entries) => entries
                .iter()
                .enumerate()
                .map(|(i, value)| self.spanned(value, None, &entry(path, i)))
                .collect(),
            scalar => self.convert(scalar, &|| self.locate(&value.span())),
        }
    }

    /// Converts a value whose parts have no locations. `place` returns the location of the value. It counts lines and
    /// is therefore called only for messages.
    fn convert(
        &self,
        value: &DeValue<'_>,
        place: &dyn Fn() -> String,
    ) -> Result<Value, InputError> {
        let fail = |message: &str, found: &str| InputError::new(message).at(place()).found(found);
        Ok(match value {
            DeValue::String(text) => Value::String(text.to_string()),
            DeValue::Boolean(flag) => Value::Bool(*flag),
            DeValue::Integer(integer) => i64::from_str_radix(integer.as_str(), integer.radix())
                .map(|n| Value::Number(n.into()))
                .map_err(|_| fail("this whole number is too large", integer.as_str()))?,
            DeValue::Float(float) => match float.as_str().parse::<f64>() {
                Ok(f64::INFINITY) if float.as_str().ends_with("inf") => {
                    Value::String("inf".to_owned())
                }
                Ok(x) => Number::from_f64(x)
                    .map(Value::Number)
                    .ok_or_else(|| fail("this is not a finite number", float.as_str()))?,
                Err(_) => return Err(fail("this number cannot be read", float.as_str())),
            },
            DeValue::Datetime(_) => return Err(fail("dates are not allowed in a scene", "a date")),
            DeValue::Array(entries) => entries
                .iter()
                .map(|one| self.convert(one.get_ref(), place))
                .collect::<Result<_, _>>()?,
            DeValue::Table(table) => Value::Object(
                table
                    .iter()
                    .map(|(key, one)| {
                        Ok((key.get_ref().to_string(), self.convert(one.get_ref(), place)?))
                    })
                    .collect::<Result<_, InputError>>()?,
            ),
        })
    }
}

/// Removes members without a value.
fn without_null(value: &mut Value) {
    match value {
        Value::Object(object) => {
            object.retain(|_, member| !member.is_null());
            object.values_mut().for_each(without_null);
        }
        Value::Array(entries) => entries.iter_mut().for_each(without_null),
        _ => {}
    }
}

/// Returns the member or entry `key` of `value` with its path. A missing member is created; a missing list is not.
fn descend<'v>(value: &'v mut Value, key: &str, path: &str) -> Option<(&'v mut Value, String)> {
    match value {
        Value::Array(entries) => {
            let index: usize = key.parse().ok()?;
            Some((entries.get_mut(index)?, entry(path, index)))
        }
        Value::Object(_) if key.parse::<usize>().is_ok() => None,
        Value::Object(object) => {
            let made = object.entry(key).or_insert_with(|| Value::Object(Map::new()));
            Some((made, member(path, key)))
        }
        _ => None,
    }
}
