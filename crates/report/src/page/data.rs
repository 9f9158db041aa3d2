//! Numbers for the interactive parts of a page, stored as JSON in an element that is not executed.

use std::collections::HashMap;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use serde_json::{Value, json};

use crate::plot::{Axis, Color, LinePlot, Scale, text};

/// Numbers and descriptions for charts, curves and bodies.
#[derive(Debug, Default)]
pub(crate) struct PageData {
    columns: Vec<Value>,
    /// Index of each stored column of values. Columns are looked up by content, because charts share their time
    /// columns.
    known: HashMap<String, usize>,
    charts: Vec<Value>,
    traces: Vec<Value>,
    bodies: Vec<Value>,
    pictures_only: bool,
}

impl PageData {
    /// Creates the data of a page without charts. The chart library would account for most of the size of such a page.
    pub(crate) fn with_pictures_only() -> Self {
        Self { pictures_only: true, ..Self::default() }
    }

    /// Adds a chart and returns its index. Returns `None` on a page without charts. Charts with the same `link` share
    /// the range of x.
    pub(crate) fn chart(&mut self, plot: &LinePlot, link: Option<&str>) -> Option<usize> {
        if self.pictures_only {
            return None;
        }
        let series = plot.series.iter().map(|series| {
            let [x, y] = [0, 1].map(|axis| series.points.iter().map(move |point| point[axis]));
            json!({
                "name": text::html(&series.name),
                "x": self.doubles(x),
                "y": self.singles(y),
                "lines": series.joined,
                "marks": series.marked,
            })
        });
        let series: Vec<Value> = series.collect();
        self.charts.push(json!({
            "title": text::html(&plot.title),
            "x": axis(&plot.x),
            "y": axis(&plot.y),
            "series": series,
            "link": link,
        }));
        Some(self.charts.len() - 1)
    }

    /// Adds a recorded curve that can be analyzed.
    pub(crate) fn trace(&mut self, name: &str, y_axis: &Axis, t: &[f64], y: &[f64]) {
        if self.pictures_only {
            return;
        }
        let trace = json!({
            "name": myovib_scene::plain(name),
            "label": text::html(&y_axis.quantity),
            "unit": text::html(&y_axis.unit),
            "t": self.doubles(t.iter().copied()),
            "y": self.singles(y.iter().copied()),
        });
        self.traces.push(trace);
    }

    /// Adds a body and returns its index.
    pub(crate) fn body(&mut self, document: Value) -> usize {
        self.bodies.push(document);
        self.bodies.len() - 1
    }

    /// Returns whether the page has a chart, which requires the chart library.
    pub(crate) fn has_charts(&self) -> bool {
        !self.charts.is_empty()
    }

    /// Returns whether the page has no interactive parts.
    pub(crate) fn is_empty(&self) -> bool {
        self.charts.is_empty() && self.bodies.is_empty()
    }

    /// Returns the data as JSON text. The text contains no `<`, so that text from a scene cannot end the element or
    /// start a comment.
    pub(crate) fn json(&self) -> String {
        let colors = (0..Color::N_SERIES).map(|i| Color::of_series(i).to_string());
        let document = json!({
            "columns": self.columns,
            "charts": self.charts,
            "traces": self.traces,
            "bodies": self.bodies,
            "colors": colors.collect::<Vec<_>>(),
        });
        document.to_string().replace('<', "\\u003c")
    }

    fn doubles(&mut self, values: impl Iterator<Item = f64>) -> usize {
        self.column("f8", values.flat_map(f64::to_le_bytes).collect())
    }

    /// Adds numbers in single precision; seven digits are sufficient for charts.
    fn singles(&mut self, values: impl Iterator<Item = f64>) -> usize {
        let bytes = values.flat_map(|value| (value as f32).to_le_bytes());
        self.column("f4", bytes.collect())
    }

    fn column(&mut self, kind: &str, bytes: Vec<u8>) -> usize {
        let content = STANDARD.encode(bytes);
        let next = self.columns.len();
        *self.known.entry(format!("{kind}{content}")).or_insert_with(|| {
            self.columns.push(json!({ "type": kind, "data": content }));
            next
        })
    }
}

fn axis(axis: &Axis) -> Value {
    json!({
        "label": text::html(&axis.quantity),
        "unit": text::html(&axis.unit),
        "log": axis.scale == Scale::Logarithmic,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plot::Series;

    /// Checks that a name cannot end the element, start a comment, or change the direction of the text.
    #[test]
    fn names_cannot_leave_the_data() {
        let name = "a</script><!--\u{202e}\"'\u{2028}&";
        let mut data = PageData::default();
        let plot = LinePlot {
            title: name.to_owned(),
            series: vec![Series::curve(name, &[0.0, 1.0], &[2.0, 3.0])],
            ..LinePlot::default()
        };
        data.chart(&plot, None);
        data.trace(name, &Axis::new(name, name), &[0.0, 1.0], &[2.0, 3.0]);
        let text = data.json();
        assert!(!text.contains(['<', '\u{202e}', '\u{2028}']), "{text}");
        let read: Value = serde_json::from_str(&text).unwrap();
        let expected = "a</script><!--\\u{202e}\"'\\u{2028}&";
        assert_eq!(read["traces"][0]["name"], expected);
    }

    #[test]
    fn equal_columns_are_stored_once() {
        let mut data = PageData::default();
        for y in [[2.0, 3.0], [2.0, 4.0]] {
            data.trace("", &Axis::default(), &[0.0, 1.0], &y);
        }
        assert_eq!(data.columns.len(), 3, "one column of times, two of values");
    }
}
