//! Rows and table of a sweep.

use std::collections::BTreeMap;
use std::path::Path;

use myovib_model::EndReason;
use serde_json::{Number, Value, json};

use super::Sweep;
use super::grid::{Axis, Case};
use super::results::{COLUMNS, ResultColumn};
use crate::csv::{self, Table};
use crate::inputs;

impl Sweep<'_> {
    /// Returns the row of a case. The varied values are stored as text.
    pub(super) fn row(&self, axes: &[Axis], case: &Case) -> Value {
        let mut row = serde_json::Map::new();
        row.insert("case".to_owned(), json!(case.number + 1));
        for (axis, set) in axes.iter().zip(&case.set) {
            let value = set.split_once('=').map_or("", |(_, value)| value);
            row.insert(axis.key.clone(), json!(value));
        }
        let folder = self.folder(case);
        let result = match self.record(case) {
            Some(record) => record.result,
            None => json!({ "outcome": "not computed" }),
        };
        // The folder may contain tables of another scene, mesh or program. A valid result contains its scene.
        let is_of_this = !result["scene"].is_null();
        // Values of a run that stopped early are not results of the case.
        let is_whole = is_complete(&result);
        for column in COLUMNS {
            row.insert(column.to_owned(), result[column].clone());
        }
        for column in &self.results {
            let value = (is_of_this && is_whole).then(|| column.value(&folder)).flatten();
            row.insert(column.name.clone(), json!(value));
        }
        row.insert("message".to_owned(), result["message"].clone());
        let probes = last_rows(&folder, &result["scene"]["probe"]);
        row.insert("probes".to_owned(), json!(probes));
        Value::Object(row)
    }
}

/// Returns whether a run reached its end or a stop condition of the scene.
pub(super) fn is_complete(result: &Value) -> bool {
    result["outcome"] == "finished" || result["reason"] == EndReason::Event.name()
}

/// Returns the reason why a case did not finish, if the case was attempted.
pub(super) fn stopped(row: &Value) -> Option<String> {
    if is_complete(row) {
        return None;
    }
    let is_stopped = ["stopped", "failed"].iter().any(|how| row["outcome"] == *how);
    let why = row["message"].as_str().or(row["outcome"].as_str());
    is_stopped.then(|| format!("case {}: {}", row["case"], why.unwrap_or_default()))
}

/// Parses a TOML number. Returns `None` for infinity, which JSON cannot represent.
fn number(word: &str) -> Option<Number> {
    let table: toml::Table = format!("x={word}").parse().ok()?;
    match table["x"] {
        toml::Value::Integer(number) => Some(number.into()),
        toml::Value::Float(number) => Number::from_f64(number),
        _ => None,
    }
}

/// Returns the row with varied values converted from text to numbers where possible.
pub(super) fn numbered(axes: &[Axis], mut row: Value) -> Value {
    for axis in axes {
        let word = row[&axis.key].as_str().unwrap_or_default();
        if let Some(number) = number(word) {
            row[&axis.key] = Value::Number(number);
        }
    }
    row
}

/// Returns the last row of each probe of a run. Probes with unreadable tables are excluded.
fn last_rows(folder: &Path, probes: &Value) -> BTreeMap<String, Vec<f64>> {
    let names = probes.as_array().into_iter().flatten();
    names
        .filter_map(|probe| {
            let name = probe["name"].as_str()?;
            let text = inputs::text(&folder.join(format!("{name}.csv"))).ok()?;
            let table = Table::parse(&text).ok()?;
            let values = table.numbers(table.rows.last()?)?;
            Some((name.to_owned(), values))
        })
        .collect()
}

pub(super) fn table(axes: &[Axis], results: &[ResultColumn], rows: &[Value]) -> String {
    let keys = axes.iter().map(|axis| axis.key.as_str());
    let results = results.iter().map(|column| column.name.as_str());
    let names = std::iter::once("case").chain(keys).chain(results);
    let names: Vec<&str> = names.chain(COLUMNS).collect();
    let mut text = csv::line(&names);
    for row in rows {
        let words: Vec<String> = names
            .iter()
            .map(|name| match &row[*name] {
                Value::String(word) => word.clone(),
                Value::Null => String::new(),
                other => other.to_string(),
            })
            .collect();
        text += &csv::line(&words);
    }
    text
}
