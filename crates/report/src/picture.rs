//! Files of a figure: the picture and its data.

use myovib_scene::csv;
use myovib_scene::result_folder::ResultFolder;

use crate::plot::{Figure, raster};

/// Width of a PNG in pixels, which is 85 mm at 600 dpi.
const PNG_WIDTH: u32 = 2000;

/// Returns the names of the files of the figure `name`, including the PNG if `png` is true.
pub fn names(name: &str, png: bool) -> Vec<String> {
    let png = if png { &["png"][..] } else { &[] };
    let extensions = png.iter().chain(&["svg", "csv"]);
    extensions.map(|extension| format!("{name}.{extension}")).collect()
}

/// Writes `name.svg`, `name.csv` and, if requested, `name.png`. Returns the paths.
pub fn write(
    folder: &ResultFolder,
    name: &str,
    figure: &Figure,
    table: (&[String], &[Vec<f64>]),
    png: bool,
) -> anyhow::Result<Vec<String>> {
    let files = files(name, figure, table, png)?;
    let path = |name: &str| folder.path().join(name).display().to_string();
    files
        .into_iter()
        .map(|(name, bytes)| {
            folder.write(&name, bytes)?;
            Ok(path(&name))
        })
        .collect()
}

/// Returns the names and contents of the files.
fn files(
    name: &str,
    figure: &Figure,
    (columns, rows): (&[String], &[Vec<f64>]),
    png: bool,
) -> anyhow::Result<Vec<(String, Vec<u8>)>> {
    let mut contents = Vec::new();
    if png {
        contents.push(raster::png(&figure.outlined(), PNG_WIDTH)?);
    }
    contents.push(figure.render().into_bytes());
    contents.push(csv::table(columns, rows).into_bytes());
    Ok(names(name, png).into_iter().zip(contents).collect())
}
