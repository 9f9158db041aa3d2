//! A figure's files: the picture, and the numbers behind it.

use std::path::Path;

use anyhow::Context;

use crate::plot::{Figure, raster};
use myovib_scene::atomic_file;
use myovib_scene::csv::CsvWriter;

/// Pixels in a row of a PNG: 85 mm at 600 dpi.
const PNG_WIDTH: u32 = 2000;

/// Writes `name.svg`, `name.csv` and, if asked, `name.png` to `folder`, which is made if there is
/// none, and gives their paths.
///
/// # Errors
/// When a file cannot be written.
pub fn write(
    folder: &Path,
    name: &str,
    figure: &Figure,
    (columns, rows): (&[String], &[Vec<f64>]),
    png: bool,
) -> anyhow::Result<Vec<String>> {
    std::fs::create_dir_all(folder)
        .with_context(|| format!("cannot make the folder `{}`", folder.display()))?;
    let mut files = Vec::new();
    if png {
        files.push(("png", raster::png(&figure.outlined(), PNG_WIDTH)?));
    }
    files.push(("svg", figure.render().into_bytes()));
    files.push(("csv", table(columns, rows)?));
    files
        .into_iter()
        .map(|(extension, bytes)| {
            let path = folder.join(format!("{name}.{extension}"));
            atomic_file::save(&path, bytes)?;
            Ok(path.display().to_string())
        })
        .collect()
}

fn table(columns: &[String], rows: &[Vec<f64>]) -> anyhow::Result<Vec<u8>> {
    let names: Vec<&str> = columns.iter().map(String::as_str).collect();
    let mut bytes = Vec::new();
    let mut csv = CsvWriter::new(&mut bytes, &names)?;
    for row in rows {
        csv.row(row)?;
    }
    Ok(bytes)
}
