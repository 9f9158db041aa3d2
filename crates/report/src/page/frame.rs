//! Frame of a page (head, style, scripts and data), and frames of its figures.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use myovib_scene::escape;
use myovib_scene::versions::Versions;
use sha2::{Digest, Sha256};

use super::data::PageData;

const STYLE: &str = include_str!("style.css");

/// Script of the page.
const SCRIPT: &str = concat!(
    include_str!("script/start.js"),
    include_str!("script/charts.js"),
    include_str!("script/matrix.js"),
    include_str!("script/body.js"),
    include_str!("script/controls.js"),
    include_str!("script/signal.js"),
    include_str!("script/analysis.js"),
    include_str!("script/page.js"),
);

/// Compressed chart library, and the hash by which the security policy of the page allows it.
const LIBRARY: &str = include_str!(concat!(env!("OUT_DIR"), "/plotly.js.gz.base64"));
const LIBRARY_HASH: &str = include_str!(concat!(env!("OUT_DIR"), "/plotly.js.sha256"));

/// Returns a page with a title, a description, a `body` of HTML, its data, and version numbers.
pub(crate) fn framed(title: &str, description: &str, body: &str, data: &PageData) -> String {
    let (title, description) = (escape(title), escape(description));
    let versions = Versions::found();
    let klu = versions.klu_text();
    let Versions { myovib, git, sundials, .. } = &versions;
    let (library, credit) = match data.has_charts() {
        true => (
            format!("<script type=\"text/plain\" id=\"library\">{LIBRARY}</script>\n"),
            ", charts by plotly.js (MIT license)",
        ),
        false => (String::new(), ""),
    };
    let scripts = match data.is_empty() {
        true => String::new(),
        false => format!(
            "<script type=\"application/json\" id=\"data\">{}</script>\n{library}<script>{SCRIPT}</script>\n",
            data.json()
        ),
    };
    format!(
        "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\
         <meta name=\"viewport\" content=\"width=device-width\">\
         <meta http-equiv=\"Content-Security-Policy\" content=\"{}\">\
         <title>{title}</title><style>\n{STYLE}</style></head><body>\n<h1>{title}</h1>\n\
         <p class=\"description\">{description}</p>\n{body}\
         <footer>myovib {myovib} ({git}), SUNDIALS {sundials}, KLU {klu}{credit}</footer>\n{scripts}</body></html>\n",
        policy()
    )
}

/// Returns the security policy of the page. The browser runs only these two scripts and loads nothing from elsewhere.
fn policy() -> String {
    let hash = STANDARD.encode(Sha256::digest(SCRIPT));
    format!(
        "default-src 'none'; img-src data: blob:; style-src 'unsafe-inline'; \
         script-src 'sha256-{hash}' 'sha256-{LIBRARY_HASH}'"
    )
}

/// Returns an HTML figure that contains a picture. An attribute lists the charts that replace the picture if scripts
/// are enabled.
pub(crate) fn figure<'a>(
    caption: &str,
    svg: &str,
    charts: impl IntoIterator<Item = &'a usize>,
) -> String {
    let charts: Vec<String> = charts.into_iter().map(usize::to_string).collect();
    let attribute = match charts.is_empty() {
        true => String::new(),
        false => format!(" data-charts=\"{}\"", charts.join(" ")),
    };
    let caption = match caption {
        "" => String::new(),
        caption => format!("<figcaption>{}</figcaption>", escape(caption)),
    };
    format!("<figure{attribute}>{caption}\n{svg}</figure>\n")
}
