//! Report of a sweep: a table of the cases, plots of the results against the varied values, and the curves of all
//! cases.

use std::collections::BTreeSet;
use std::path::Path;

use myovib_scene::sensitivity::Abscissa;
use myovib_scene::sweep::SweepResult;
use myovib_scene::{Error, atomic_file, escape};
use serde_json::Value;

use crate::fit::axis;
use crate::page;
use crate::page::data::PageData;
use crate::page::frame::{figure, framed};
use crate::page::probes::{MOST_VALUES, Record, axis_of};
use crate::plot::{Axis, Figure, LinePlot, Series};

/// Maximum number of cases whose curves are shown in one chart.
const MOST_CURVES: usize = 24;
/// Maximum number of probe columns that have a chart.
const MOST_CHARTS: usize = 12;

/// Writes the report of a sweep into its folder.
pub fn write(folder: &Path, result: &SweepResult) -> Result<(), Error> {
    let rows = result.document["rows"].as_array();
    let rows = rows.map_or(&[][..], Vec::as_slice);
    let mut data = PageData::default();
    let mut html = cases(result, rows);
    html += &over_values(result, rows, &mut data);
    html += &curves(folder, result, rows, &mut data)?;
    let description = format!("{} cases over {}.", rows.len(), result.keys.join(", "));
    let title = match first_result(folder, rows)["scene"]["title"].as_str() {
        Some(title) => format!("Sweep: {title}"),
        None => "Sweep".to_owned(),
    };
    let page = framed(&title, &description, &html, &data);
    atomic_file::save(&folder.join(page::NAME), page)
}

/// Formats an entry of a row. Numbers have six digits.
fn word(value: &Value) -> String {
    match value {
        Value::Null => String::new(),
        Value::String(word) => word.clone(),
        Value::Number(number) => {
            let rounded = number.as_f64().and_then(|x| format!("{x:.5e}").parse::<f64>().ok());
            let text = format!("{:?}", rounded.unwrap_or(f64::NAN));
            text.trim_end_matches(".0").to_owned()
        }
        other => other.to_string(),
    }
}

/// Returns the table of all cases with links to their reports.
fn cases(result: &SweepResult, rows: &[Value]) -> String {
    let columns: Vec<&str> = result
        .keys
        .iter()
        .chain(&result.results)
        .map(String::as_str)
        .chain(["outcome", "steps", "t_reached", "message"])
        .collect();
    let heads = columns.iter().map(|name| format!("<th class=\"n\">{}</th>", escape(name)));
    let row = |row: &Value| {
        let number = row["case"].as_u64().unwrap_or(0);
        let link = match row["outcome"].as_str() {
            Some("failed" | "not computed") | None => number.to_string(),
            _ => format!("<a href=\"case-{number:04}/{}\">{number}</a>", page::NAME),
        };
        let words = columns.iter().map(|name| escape(&word(&row[*name])));
        let cells = words.map(|word| format!("<td class=\"n\">{word}</td>"));
        format!("<tr><td class=\"n\">{link}</td>{}</tr>\n", cells.collect::<String>())
    };
    format!(
        "<div class=\"wide\"><table><tr><th class=\"n\">case</th>{}</tr>\n{}</table></div>\n",
        heads.collect::<String>(),
        rows.iter().map(row).collect::<String>()
    )
}

/// Returns plots of the results against the first key that has several numerical values. There is one curve for each
/// combination of values of the other keys.
fn over_values(result: &SweepResult, rows: &[Value], data: &mut PageData) -> String {
    let distinct = |key: &&String| {
        let numbers = rows.iter().filter_map(|row| row[*key].as_f64());
        numbers.map(f64::to_bits).collect::<BTreeSet<_>>().len() > 1
    };
    let Some(key) = result.keys.iter().find(distinct) else {
        return String::new();
    };
    let of_others = |row: &Value| {
        let others = result.keys.iter().filter(|other| *other != key);
        let values = others.map(|other| format!("{other} = {}", word(&row[other])));
        values.collect::<Vec<_>>().join(", ")
    };
    let mut names: Vec<String> = Vec::new();
    for name in rows.iter().map(of_others) {
        if !names.contains(&name) {
            names.push(name);
        }
    }
    let is_wide = |x: &[f64]| {
        let (low, high) =
            x.iter().fold((f64::INFINITY, 0.0_f64), |(low, high), &x| (low.min(x), high.max(x)));
        low > 0.0 && high >= 30.0 * low
    };
    let mut figures = String::new();
    for column in result.results.iter().map(String::as_str).chain(["steps"]) {
        let mut all = Vec::new();
        let series = names.iter().map(|name| {
            let own = rows.iter().filter(|row| of_others(row) == *name);
            let points = own.filter_map(|row| Some((row[key].as_f64()?, row[column].as_f64()?)));
            let (x, y): (Vec<f64>, Vec<f64>) = points.unzip();
            all.extend(x.iter().copied());
            Series::curve(name.as_str(), &x, &y).marked()
        });
        let series: Vec<Series> = series.collect();
        // Cases without time steps have no number of steps.
        if all.is_empty() {
            continue;
        }
        let axis = Axis::new(key.replace(['*', '{', '}'], ""), "");
        let plot = LinePlot {
            x: if is_wide(&all) { axis.logarithmic() } else { axis },
            y: Axis::new(column.replace('_', " "), ""),
            series,
            ..LinePlot::default()
        };
        figures += &drawn(column, plot, "key", data);
    }
    format!("<h2>Results</h2>\n<div class=\"beside\">\n{figures}</div>\n")
}

/// Returns a figure whose chart is linked to other charts.
fn drawn(caption: &str, plot: LinePlot, link: &str, data: &mut PageData) -> String {
    let chart = data.chart(&plot, Some(link));
    figure(caption, &Figure::of(caption, plot).render(), &chart)
}

/// Returns the curves of the probes. Each chart contains all cases.
fn curves(
    folder: &Path,
    result: &SweepResult,
    rows: &[Value],
    data: &mut PageData,
) -> Result<String, Error> {
    let stride = rows.len().div_ceil(MOST_CURVES).max(1);
    let shown: Vec<&Value> = rows.iter().step_by(stride).collect();
    let names = shown.iter().filter_map(|row| row["probes"].as_object());
    let names: BTreeSet<&String> = names.flat_map(|probes| probes.keys()).collect();
    let mut records = Vec::new();
    for row in &shown {
        let of_case = folder.join(format!("case-{:04}", row["case"].as_u64().unwrap_or(0)));
        let values = result.keys.iter().map(|key| word(&row[key]));
        let case = values.collect::<Vec<_>>().join(", ");
        for name in &names {
            if row["probes"].get(name.as_str()).is_some() {
                records.push((case.clone(), Record::read(&of_case, name)?));
            }
        }
    }
    records.retain(|(_, record)| record.rows.len() > 1);
    let n_values = records.iter().map(|(_, record)| record.rows.len() * record.columns.len());
    let thinning = n_values.sum::<usize>().div_ceil(MOST_VALUES).max(1);
    let mut figures = Vec::new();
    let in_space = first_result(folder, rows)["mesh"]["dimension"] == 3;
    for name in names {
        let own: Vec<_> = records.iter().filter(|(_, record)| record.name == *name).collect();
        let columns = own.first().map_or(&[][..], |(_, record)| &record.columns);
        let abscissa = match columns.first().map(String::as_str) {
            Some("f") => Abscissa::Frequency,
            Some("load") => Abscissa::Load,
            _ => Abscissa::Time,
        };
        for (j, column) in columns.iter().enumerate().skip(1) {
            let series = own.iter().filter(|(_, record)| record.columns.len() > j);
            let series = series.map(|(case, record)| {
                let points = record.rows.iter().step_by(thinning);
                let (t, y): (Vec<f64>, Vec<f64>) = points.map(|row| (row[0], row[j])).unzip();
                Series::curve(case, &t, &y)
            });
            let plot = LinePlot {
                x: axis(abscissa),
                y: axis_of(column, abscissa == Abscissa::Frequency, in_space),
                series: series.collect(),
                ..LinePlot::default()
            };
            if figures.len() < MOST_CHARTS {
                figures.push(drawn(&format!("{name}: {column}"), plot, "t", data));
            }
        }
    }
    if figures.is_empty() {
        return Ok(String::new());
    }
    let mut notes = String::new();
    if stride > 1 {
        notes += &format!(
            "<p class=\"note\">The charts show one case in {stride}; the folders of the cases contain all of \
             them.</p>\n"
        );
    }
    if thinning > 1 {
        notes += &format!(
            "<p class=\"note\">The curves show one row in {thinning}; the tables of the cases contain all rows.</p>\n"
        );
    }
    let legend = result.keys.join(", ");
    Ok(format!(
        "<h2>Curves</h2>\n<p>One curve per case, labeled by {}. Click a curve to highlight its case in all \
         charts.</p>\n{notes}<div class=\"beside\">\n{}</div>\n",
        escape(&legend),
        figures.concat()
    ))
}

/// Returns the result of the first case, or null if it cannot be read.
fn first_result(folder: &Path, rows: &[Value]) -> Value {
    let number = rows.first().and_then(|row| row["case"].as_u64()).unwrap_or(0);
    let text = std::fs::read_to_string(folder.join(format!("case-{number:04}.json")));
    let record: Option<Value> = text.ok().and_then(|text| serde_json::from_str(&text).ok());
    record.map_or(Value::Null, |mut record| record["result"].take())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_six_digits() {
        let words = [
            Value::from(9.999_999_999_999_999e-5),
            Value::from(1e5),
            Value::from(11),
            Value::from(1.142_940_510_2e-5),
            Value::Null,
        ];
        assert_eq!(words.map(|value| word(&value)), ["0.0001", "100000", "11", "1.14294e-5", ""]);
    }
}
