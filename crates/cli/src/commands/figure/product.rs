//! Output of a figure: picture, data and findings.

use serde_json::Value;

use crate::exit::Exit;
use myovib_report::picture;
use myovib_report::plot::Figure;
use myovib_scene::result_folder::ResultFolder;

/// Figure with its data, before it is written.
pub(super) struct Product {
    /// Number of the figure in the paper.
    pub(super) number: u8,
    pub(super) figure: Figure,
    /// Plotted data.
    pub(super) columns: Vec<String>,
    pub(super) rows: Vec<Vec<f64>>,
    /// Scalar results for the text and for JSON.
    pub(super) findings: Vec<(&'static str, Value)>,
    /// Data of the run from which the figure is drawn, for the JSON document; empty for figures without a run.
    pub(super) run: Value,
    pub(super) exit: Exit,
}

impl Product {
    /// Writes `figureN.svg`, `figureN.csv` and, if `png` is true, `figureN.png`. Returns the paths.
    pub(super) fn write(&self, folder: &ResultFolder, png: bool) -> anyhow::Result<Vec<String>> {
        let name = name(self.number);
        picture::write(folder, &name, &self.figure, (&self.columns, &self.rows), png)
    }

    /// Formats the findings and files as text.
    pub(super) fn summary(&self, files: &[String]) -> String {
        let mut text = format!("Figure {}: {}\n", self.number, self.figure.title);
        for (name, value) in &self.findings {
            describe(name, value, 2, &mut text);
        }
        text + &format!("  {}\n", files.join(", "))
    }
}

/// Returns the base name of a figure's files.
pub(super) fn name(number: u8) -> String {
    format!("figure{number}")
}

/// Formats a finding on a separate line; the values of one group share a line.
fn describe(name: &str, value: &Value, indent: usize, text: &mut String) {
    match value {
        Value::Object(parts) if parts.values().all(Value::is_number) => {
            let parts: Vec<String> =
                parts.iter().map(|(name, value)| format!("{name} {}", number(value))).collect();
            *text += &format!("{:indent$}{name}: {}\n", "", parts.join(", "));
        }
        Value::Object(parts) => {
            *text += &format!("{:indent$}{name}\n", "");
            for (name, value) in parts {
                describe(name, value, indent + 2, text);
            }
        }
        value => *text += &format!("{:indent$}{name}: {}\n", "", number(value)),
    }
}

/// Rounds a non-integer number to five digits for the text. The JSON document contains all digits.
fn number(value: &Value) -> String {
    match value.as_f64() {
        Some(x) if x != x.round() => {
            let decimals = 4 - x.abs().log10().floor() as i32;
            if (0..=7).contains(&decimals) {
                format!("{x:.*}", decimals.unsigned_abs() as usize)
            } else {
                format!("{x:.4e}")
            }
        }
        _ => value.to_string(),
    }
}
