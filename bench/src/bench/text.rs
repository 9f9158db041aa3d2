//! Formats results as text, with one table for each list or object in the document.

use std::collections::BTreeMap;
use std::slice;

use myovib_report::table::{Align, Cell, Table, colored_stdout};
use serde_json::Value;

/// Row of a table: headings and cells.
type Row<'a> = Vec<(&'a str, &'a Value)>;

pub(super) fn text(document: &Value) -> String {
    let mut text = String::new();
    add_tables(&mut text, "bench", vec![(Row::new(), document)]);
    text
}

/// Adds a table of the objects, followed by a table for each list or object inside them. Each row of an inner table
/// repeats the text entries of the object that contains it.
fn add_tables<'a>(text: &mut String, title: &str, objects: Vec<(Row<'a>, &'a Value)>) {
    let (mut rows, mut inner) = (Vec::new(), BTreeMap::<&str, Vec<_>>::new());
    for (mut row, object) in objects {
        let is_table = |value: &Value| {
            let first = value.as_array().map(|list| list.first());
            value.is_object() || first.is_some_and(|first| first.is_none_or(Value::is_object))
        };
        let entries = || object.as_object().into_iter().flatten();
        row.extend(entries().filter(|entry| !is_table(entry.1)).map(|(k, v)| (k.as_str(), v)));
        row.sort_by_key(|(_, value)| !value.is_string());
        let words: Row<'_> = row.iter().copied().filter(|(_, value)| value.is_string()).collect();
        for (key, value) in entries().filter(|entry| is_table(entry.1)) {
            let list = value.as_array().map_or(slice::from_ref(value), Vec::as_slice);
            inner
                .entry(key.as_str())
                .or_default()
                .extend(list.iter().map(|value| (words.clone(), value)));
        }
        rows.push(row);
    }
    let heads = rows.first().into_iter().flatten().filter(|(head, _)| !inner.contains_key(head));
    let heads: Vec<_> = heads
        .map(|&(head, value)| (head, if value.is_string() { Align::Left } else { Align::Right }))
        .collect();
    let mut table = Table::new(&heads);
    for row in &rows {
        let cell = |(head, _): &(&str, _)| row.iter().find(|(key, _)| key == head);
        table.row(
            heads
                .iter()
                .map(|head| Cell::from(cell(head).map_or("–".into(), |(_, value)| printed(value)))),
        );
    }
    *text += &format!("{title}\n{}\n", table.render(colored_stdout()));
    for (title, objects) in inner {
        add_tables(text, title, objects);
    }
}

fn printed(value: &Value) -> String {
    match value {
        Value::String(text) => text.clone(),
        Value::Number(number) if number.is_f64() => {
            let number = number.as_f64().unwrap_or(f64::NAN);
            match number.abs() {
                0.0 | 0.1..1e6 => format!("{number:.3}"),
                _ => format!("{number:.2e}"),
            }
        }
        Value::Array(list) => list.iter().map(printed).collect::<Vec<_>>().join(", "),
        Value::Null => "–".to_owned(),
        other => other.to_string(),
    }
}
