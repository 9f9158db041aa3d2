//! `report.html`: an overview of a run in one file without external resources.
//!
//! The page consists of a description of the scene (`overview`), key figures (`figures`), the body (`pictures`), the
//! probes (`probes`) or the modes (`modes`), an explanation of the results (`interpretation`), and, collapsed, all
//! statistics and the scene.

mod figures;
mod interpretation;
mod modes;
mod overview;
mod pictures;
pub(crate) mod probes;

use std::path::Path;

use serde_json::Value;

use myovib_scene::atomic_file;
use myovib_scene::run::RunResult;
use myovib_scene::versions::Versions;
use myovib_scene::{Error, Scene, escape};

use crate::response;

/// Name of the page in a run folder.
pub const NAME: &str = "report.html";

const STYLE: &str = include_str!("style.css");

/// Writes the report of a run into its folder.
///
/// # Errors
/// If a table of the folder cannot be read or the report cannot be written.
pub fn write(folder: &Path, scene: &Scene, result: &RunResult) -> Result<(), Error> {
    let title = match scene.file.title.as_str() {
        "" => "A run without a title",
        title => title,
    };
    let document = &result.document;
    let mut html = figures::cards(document);
    html += &figures::outcome(document);
    html += &pictures::body(folder, scene)?;
    html += &match (&result.modes, &result.response) {
        (Some(found), _) => modes::section(scene, found),
        (_, Some(found)) => response::section(found, is_in_space(document)),
        _ => probes::section(folder, scene, document)?,
    };
    html += "<h2>Interpretation</h2>\n";
    html += &interpretation::meaning(document);
    html += &folded("All statistics", &figures::statistics(document));
    let text = format!("<pre>{}</pre>\n", escape(scene.text()));
    html += &folded("The scene", &text);
    let page = framed(title, &overview::sentence(scene, document), &html);
    atomic_file::save(&folder.join(NAME), page)
}

/// Returns a page with a title, a description, a `body` of HTML, and version numbers.
pub(crate) fn framed(title: &str, description: &str, body: &str) -> String {
    let (title, description) = (escape(title), escape(description));
    let versions = Versions::found();
    let klu = versions.klu_text();
    let Versions {
        myovib,
        git,
        sundials,
        ..
    } = &versions;
    format!(
        "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\
         <meta name=\"viewport\" content=\"width=device-width\">\
         <title>{title}</title><style>\n{STYLE}</style></head><body>\n<h1>{title}</h1>\n\
         <p class=\"description\">{description}</p>\n{body}\
         <footer>myovib {myovib} ({git}), SUNDIALS {sundials}, KLU {klu}</footer>\n</body></html>\n"
    )
}

/// Returns whether the run's body is 3D; forces and energies of a 2D body are per meter of depth.
fn is_in_space(document: &Value) -> bool {
    document["mesh"]["dimension"] == 3
}

/// Returns a collapsed section.
fn folded(title: &str, content: &str) -> String {
    format!("<details><summary>{title}</summary>\n{content}</details>\n")
}
