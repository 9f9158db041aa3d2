//! `report.html`: an overview of a run in one file without external resources.
//!
//! The page consists of a description of the scene (`overview`), key figures (`figures`), the body (`pictures`), the
//! probes (`probes`) or the modes (`modes`), and an explanation of the results (`interpretation`). All statistics and
//! the scene follow in collapsed sections. The page is readable without JavaScript; with JavaScript, charts replace the
//! pictures of curves.

pub(crate) mod body;
pub(crate) mod data;
mod figures;
pub(crate) mod frame;
mod interpretation;
mod modes;
mod obstacles;
mod overview;
mod pictures;
pub(crate) mod probes;
mod surface;

use std::path::Path;

use serde_json::Value;

use myovib_scene::atomic_file;
use myovib_scene::run::RunResult;
use myovib_scene::{Error, Scene, escape};

use crate::{periodic, response};
use data::PageData;
use frame::framed;

/// Name of the page in the folder of a run.
pub const NAME: &str = "report.html";

/// Writes the report of a run into its folder.
pub fn write(folder: &Path, scene: &Scene, result: &RunResult) -> Result<(), Error> {
    save(folder, scene, result, PageData::default())
}

/// Writes the report of one case of a sweep into its folder. Curves are shown as pictures, because the report of the
/// sweep has the charts.
pub fn write_case(folder: &Path, scene: &Scene, result: &RunResult) -> Result<(), Error> {
    save(folder, scene, result, PageData::with_pictures_only())
}

fn save(folder: &Path, scene: &Scene, result: &RunResult, mut data: PageData) -> Result<(), Error> {
    let title = match scene.file().title.as_str() {
        "" => "A run without a title",
        title => title,
    };
    let document = &result.document;
    let mut html = figures::cards(document);
    html += &figures::outcome(document);
    html += &pictures::body(folder, scene, result.modes.as_ref(), &mut data)?;
    html += &result
        .periodic
        .as_ref()
        .map_or(String::new(), |found| periodic::section(found, is_in_space(document), &mut data));
    html += &match (&result.modes, &result.response) {
        (Some(found), _) => modes::section(scene, found),
        (_, Some(found)) => response::section(found, is_in_space(document), &mut data),
        _ => probes::section(folder, scene, document, &mut data)?,
    };
    html += "<h2>Interpretation</h2>\n";
    html += &interpretation::meaning(document);
    html += &folded("All statistics", &figures::statistics(document));
    let changes: String = scene
        .overrides()
        .iter()
        .map(|change| format!("<p>Changed by <code>--set {}</code></p>\n", escape(change)))
        .collect();
    let text = format!("{changes}<pre>{}</pre>\n", escape(scene.text()));
    html += &folded("The scene", &text);
    let page = framed(title, &overview::sentence(scene, document), &html, &data);
    atomic_file::save(&folder.join(NAME), page)
}

/// Returns whether the body of the run is 3D. Forces and energies of a 2D body are per meter of depth.
fn is_in_space(document: &Value) -> bool {
    document["mesh"]["dimension"] == 3
}

/// Returns a collapsed section.
fn folded(title: &str, content: &str) -> String {
    format!("<details><summary>{title}</summary>\n{content}</details>\n")
}
