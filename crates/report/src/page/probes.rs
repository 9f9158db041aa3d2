//! Minima, maxima and curves of the probes.

use std::path::Path;

use myovib_scene::csv::read_numbers;
use myovib_scene::probe::ColumnKind;
use myovib_scene::{Error, Scene, escape};
use serde_json::Value;

use super::data::PageData;
use super::frame::figure;
use super::is_in_space;
use crate::plot::{Axis, Figure, LinePlot, Series};

/// Maximum number of columns shown for a probe; the CSV file contains all columns.
const MOST_PANELS: usize = 6;

/// Maximum number of values in all interactive curves of a page, which amounts to about 2.5 MB.
pub(crate) const MOST_VALUES: usize = 400_000;

/// Recorded data of a probe.
pub(crate) struct Record {
    pub(crate) name: String,
    /// Names of the columns. The first column is the time, or the load factor on a loading path.
    pub(crate) columns: Vec<String>,
    pub(crate) rows: Vec<Vec<f64>>,
}

impl Record {
    /// Reads the table of the probe `name`.
    pub(crate) fn read(folder: &Path, name: &str) -> Result<Self, Error> {
        let (columns, rows) = read_numbers(&folder.join(format!("{name}.csv")))?;
        Ok(Self { name: name.to_owned(), columns, rows })
    }

    /// Returns whether each row belongs to a state on a loading path.
    fn is_of_path(&self) -> bool {
        self.columns.first().is_some_and(|first| first == "load")
    }

    fn column(&self, j: usize) -> Vec<f64> {
        self.rows.iter().map(|row| row[j]).collect()
    }

    /// Returns the minimum and the maximum of a column, each with its time.
    fn extremes(&self, j: usize) -> Option<[[f64; 2]; 2]> {
        let points = || self.rows.iter().map(|row| [row[0], row[j]]);
        let finite = || points().filter(|[_, value]| value.is_finite());
        let least = finite().reduce(|a, b| if b[1] < a[1] { b } else { a })?;
        let largest = finite().reduce(|a, b| if b[1] > a[1] { b } else { a })?;
        Some([least, largest])
    }

    /// Returns a figure for each column, and adds every `stride`-th row to `data`; empty for a single row.
    fn figures(&self, in_space: bool, stride: usize, data: &mut PageData) -> String {
        if self.rows.len() < 2 {
            return String::new();
        }
        let t = self.column(0);
        let depth = self.columns.iter().position(|own| own == "displacement");
        let depth = depth.filter(|_| self.is_of_path()).map(|j| self.column(j));
        let thinned =
            |values: &[f64]| -> Vec<f64> { values.iter().copied().step_by(stride).collect() };
        let fewer = thinned(&t);
        let base = depth.as_deref().unwrap_or(&t);
        let mut figures = String::new();
        for (j, column) in self.columns.iter().enumerate().skip(1) {
            let title = format!("{}: {column}", self.name);
            let values = self.column(j);
            let own = Axis::new(label(column), unit(column, in_space));
            let is_displacement = column.starts_with("u_") || column == "displacement";
            let plot = |t: &[f64], base: &[f64], values: &[f64]| {
                let (x, y, series) = match self.is_of_path() {
                    // A force–displacement curve is drawn.
                    true if is_displacement => {
                        let load = Axis::new("load factor", "");
                        (own.clone(), load, Series::curve("", values, t))
                    }
                    true => {
                        let axis = match depth {
                            Some(_) => Axis::new("displacement of the obstacle", "m"),
                            None => Axis::new("load factor", ""),
                        };
                        (axis, own.clone(), Series::curve("", base, values))
                    }
                    false => {
                        let time = Axis::new("*t*", "s");
                        (time, own.clone(), Series::curve("", t, values))
                    }
                };
                LinePlot { x, y, series: vec![series], ..LinePlot::default() }
            };
            let shown = plot(&fewer, &thinned(base), &thinned(&values));
            if !self.is_of_path() {
                data.trace(&title, &shown.y, &fewer, &thinned(&values));
            }
            if j <= MOST_PANELS {
                let link = (!self.is_of_path()).then_some("t");
                let chart = data.chart(&shown, link);
                let svg = Figure::of(&*title, plot(&t, base, &values)).render();
                figures += &figure(&title, &svg, &chart);
            }
        }
        figures
    }

    /// Returns the rows of the table of extrema, which also contain the error of each column.
    fn summary(&self, errors: &Value, in_space: bool) -> String {
        let columns = self.columns.iter().enumerate().skip(1).take(MOST_PANELS);
        let rows = columns.filter_map(|(j, name)| {
            let [least, largest] = self.extremes(j)?;
            let error = errors[&self.name][name]["error"].as_f64();
            let second = if self.is_of_path() { "" } else { " s" };
            if self.rows.len() == 1 {
                return Some(format!(
                    "<tr><td>{}</td><td>{}</td><td>{}</td><td class=\"n\">{:.6e}</td></tr>\n",
                    escape(&self.name),
                    escape(name),
                    unit(name, in_space),
                    least[1],
                ));
            }
            Some(format!(
                "<tr><td>{}</td><td>{}</td><td>{}</td><td class=\"n\">{:.6e}</td>\
                 <td class=\"n\">{:.4}{second}</td><td class=\"n\">{:.6e}</td><td class=\"n\">{:.4}{second}</td>\
                 <td class=\"n\">{}</td></tr>\n",
                escape(&self.name),
                escape(name),
                unit(name, in_space),
                least[1],
                least[0],
                largest[1],
                largest[0],
                error.map_or("–".to_owned(), |error| format!("{error:.1e}")),
            ))
        });
        rows.chain(self.omitted()).collect()
    }

    /// Returns a table row with the number of columns that are not shown, if any.
    fn omitted(&self) -> Option<String> {
        let number = self.columns.len().saturating_sub(1 + MOST_PANELS);
        (number > 0).then(|| {
            let name = escape(&self.name);
            format!(
                "<tr><td>{name}</td><td colspan=\"7\">{number} more columns are in \
                 <code>{name}.csv</code></td></tr>\n"
            )
        })
    }
}

/// Headings for the columns with extrema, and heading for the column with the value in an equilibrium.
const EXTREMES: &str = "<th class=\"n\">minimum</th><th class=\"n\">at</th><th class=\"n\">maximum</th>\
     <th class=\"n\">at</th><th class=\"n\">error (estimate)</th>";
const VALUE: &str = "<th class=\"n\">value</th>";

/// Explanation of the estimated errors.
const BY_STEPS: &str = "<p>The time integration errors are sums of the error estimates of the steps, not bounds; \
     <code>myovib run … --verify</code> measures them.</p>\n";

/// Placeholder for the spectrum and the damping of a curve; hidden without JavaScript.
const ANALYSIS: &str = "<details hidden><summary>Spectrum and damping of a curve</summary>\n\
     <div data-analysis></div></details>\n";

/// Returns the extrema and the curves of all probes; empty without probes.
pub(super) fn section(
    folder: &Path,
    scene: &Scene,
    document: &Value,
    data: &mut PageData,
) -> Result<String, Error> {
    let probes = scene.file().probe.iter();
    let records = probes.map(|probe| Record::read(folder, &probe.name));
    let records = records.collect::<Result<Vec<Record>, Error>>()?;
    if records.is_empty() {
        return Ok(String::new());
    }
    let in_space = is_in_space(document);
    let (errors, note) = match &document["error_estimate"]["probes"] {
        Value::Null => (&document["error_indicator"], BY_STEPS),
        measured => (measured, ""),
    };
    let any = errors.as_object().is_some_and(|errors| !errors.is_empty());
    let note = if any { note } else { "" };
    let rows = records.iter();
    let rows: String = rows.map(|record| record.summary(errors, in_space)).collect();
    let single = records.iter().all(|record| record.rows.len() == 1);
    let heads = if single { VALUE } else { EXTREMES };
    let values = records.iter().map(|record| record.rows.len() * record.columns.len());
    let stride = values.sum::<usize>().div_ceil(MOST_VALUES).max(1);
    let figures = records.iter();
    let figures: String = figures.map(|record| record.figures(in_space, stride, data)).collect();
    let thinned = match stride {
        1 => String::new(),
        _ => format!(
            "<p class=\"note\">The interactive curves show one row in {stride}; the tables in the folder contain all \
             rows.</p>\n"
        ),
    };
    Ok(format!(
        "<h2>Probes</h2>\n<div class=\"wide\"><table><tr><th>probe</th><th>column</th><th>unit</th>\
         {heads}</tr>\n{rows}</table></div>\n\
         {note}{thinned}<div class=\"beside\">\n{figures}</div>\n{ANALYSIS}"
    ))
}

/// Returns the unit of a column; empty for a ratio or an unknown column.
pub(crate) fn unit(name: &str, in_space: bool) -> &'static str {
    ColumnKind::of(name).map_or("", |kind| kind.unit(in_space))
}

/// Returns the axis of a table column. `is_response` states that the table contains complex amplitudes.
pub(crate) fn axis_of(column: &str, is_response: bool, in_space: bool) -> Axis {
    let (value, part) = match column.rsplit_once('_') {
        Some((value, part)) if is_response => (value, part),
        _ => (column, ""),
    };
    let name = label(value);
    let (name, unit) = match part {
        "phase" => (format!("phase of {name}"), "°"),
        "re" => (format!("Re {name}"), unit(value, in_space)),
        "im" => (format!("Im {name}"), unit(value, in_space)),
        "" => (name, unit(value, in_space)),
        _ => (format!("|{name}|"), unit(value, in_space)),
    };
    Axis::new(name, unit)
}

/// Converts a column name to an axis label, with the component after an underscore as a subscript.
pub(crate) fn label(name: &str) -> String {
    match name.split_once('_') {
        Some((letter, component)) if letter.chars().count() == 1 => {
            format!("*{letter}*_{{{component}}}")
        }
        None if name.chars().count() == 1 => format!("*{name}*"),
        _ => name.replace('_', " "),
    }
}

#[cfg(test)]
mod tests {
    use super::{axis_of, label};

    #[test]
    fn labels_show_components_as_subscripts() {
        let labels = ["u_y", "p", "stress_xx", "J"].map(label);
        assert_eq!(labels, ["*u*_{y}", "*p*", "stress xx", "*J*"]);
    }

    #[test]
    fn columns_of_responses_show_their_part_and_unit() {
        let axes = ["R_x_phase", "R_x_amplitude", "R_x_im"].map(|name| axis_of(name, true, true));
        let found = axes.map(|axis| [axis.quantity, axis.unit]);
        let expected = [["phase of *R*_{x}", "°"], ["|*R*_{x}|", "N"], ["Im *R*_{x}", "N"]];
        assert_eq!(found, expected);
        assert_eq!(axis_of("stress_xx", false, true).unit, "Pa");
    }
}
