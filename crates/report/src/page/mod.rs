//! `report.html`: the run at a glance, in one file that needs no network.
//!
//! From above to below: what was asked (`asked`), key figures (`figures`), the body
//! (`pictures`), the probes (`probes`) or the modes (`modes`), what the numbers mean (`words`), and folded away all statistics and the scene.

mod asked;
mod figures;
mod modes;
mod pictures;
pub(crate) mod probes;
mod words;

use std::path::Path;

use serde_json::Value;

use myovib_scene::atomic_file;
use myovib_scene::run::RunResult;
use myovib_scene::versions::Versions;
use myovib_scene::{Error, Scene, escape};

/// The name of the page in a run's folder.
pub const NAME: &str = "report.html";

const STYLE: &str = include_str!("style.css");

/// Writes the report of a run into its folder.
///
/// # Errors
/// When a table of the folder cannot be read, or the report not be written.
pub fn write(folder: &Path, scene: &Scene, result: &RunResult) -> Result<(), Error> {
    let title = match scene.file.title.as_str() {
        "" => "A run without a title",
        title => title,
    };
    let document = &result.document;
    let mut html = figures::cards(document);
    html += &figures::outcome(document);
    html += &pictures::body(folder, scene)?;
    html += &match &result.modes {
        Some(found) => modes::section(scene, found),
        None => probes::section(folder, scene, document)?,
    };
    html += "<h2>What the run means</h2>\n";
    html += &words::meaning(document);
    html += &folded("All statistics", &figures::statistics(document));
    let text = format!("<pre>{}</pre>\n", escape(scene.text()));
    html += &folded("The scene", &text);
    let page = framed(title, &asked::sentence(scene, document), &html);
    atomic_file::save(&folder.join(NAME), page)
}

/// A page with a title, what was `asked`, a `body` of HTML, and the versions below.
pub(crate) fn framed(title: &str, asked: &str, body: &str) -> String {
    let (title, asked) = (escape(title), escape(asked));
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
         <p class=\"asked\">{asked}</p>\n{body}\
         <footer>myovib {myovib} ({git}), SUNDIALS {sundials}, KLU {klu}</footer>\n</body></html>\n"
    )
}

/// Whether the run's body is in space: forces and energies of one in the plane are per metre of depth.
fn is_in_space(document: &Value) -> bool {
    document["mesh"]["dimension"] == 3
}

/// A part that is seen after a click.
fn folded(title: &str, content: &str) -> String {
    format!("<details><summary>{title}</summary>\n{content}</details>\n")
}
