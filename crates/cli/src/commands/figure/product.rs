//! What a figure's computation leaves: picture, numbers behind it, findings.

use std::path::Path;

use anyhow::Context;
use serde_json::{Map, Value};

use crate::atomic_file;
use crate::csv::CsvWriter;
use crate::exit::Exit;
use crate::plot::Figure;

/// A figure, ready to be written.
pub(super) struct Product {
    /// Its number in the paper.
    pub(super) number: u8,
    pub(super) figure: Figure,
    /// The numbers behind it.
    pub(super) columns: Vec<&'static str>,
    pub(super) rows: Vec<Vec<f64>>,
    /// Scalars for the text and for JSON.
    pub(super) findings: Vec<(&'static str, Value)>,
    /// The run behind it, for JSON; empty where there is none.
    pub(super) run: Map<String, Value>,
    pub(super) exit: Exit,
}

impl Product {
    /// Writes `figureN.svg` and `figureN.csv`, and gives their paths.
    pub(super) fn write(&self, folder: &Path) -> anyhow::Result<Vec<String>> {
        let svg = self.figure.render();
        let csv = self.csv()?;
        [("svg", svg.into_bytes()), ("csv", csv)]
            .into_iter()
            .map(|(extension, bytes)| {
                let path = folder.join(format!("figure{}.{extension}", self.number));
                let shown = path.display().to_string();
                atomic_file::write(&path, |file| file.write_all(&bytes))
                    .with_context(|| format!("cannot write `{shown}`"))?;
                Ok(shown)
            })
            .collect()
    }

    fn csv(&self) -> anyhow::Result<Vec<u8>> {
        let mut bytes = Vec::new();
        let mut csv = CsvWriter::new(&mut bytes, &self.columns)?;
        for row in &self.rows {
            csv.row(row)?;
        }
        Ok(bytes)
    }

    /// The figure in words.
    pub(super) fn summary(&self, files: &[String]) -> String {
        let mut text = format!("Figure {}: {}\n", self.number, self.figure.title);
        for (name, value) in &self.findings {
            text += &format!("  {name}: {value}\n");
        }
        text + &format!("  {}\n", files.join(", "))
    }
}
