//! Compresses the chart library (plotly.js from the crate `plotly`) for the pages of reports.

use std::io::Write;
use std::path::Path;
use std::{env, fs, io};

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use flate2::Compression;
use flate2::write::GzEncoder;
use sha2::{Digest, Sha256};

fn main() -> io::Result<()> {
    println!("cargo:rerun-if-changed=build.rs");
    let sources = plotly::Plot::offline_js_sources();
    // The first script is plotly.js. The second script renders formulas, which reports do not use.
    let library = sources
        .split_once('>')
        .and_then(|(_, rest)| rest.split_once("</script>"))
        .map(|(library, _)| library)
        .filter(|library| library.contains("plotly.js v"))
        .ok_or_else(|| io::Error::other("the crate plotly does not contain plotly.js first"))?;
    let mut encoder = GzEncoder::new(Vec::new(), Compression::best());
    encoder.write_all(library.as_bytes())?;
    let folder = env::var_os("OUT_DIR").ok_or_else(|| io::Error::other("OUT_DIR is not set"))?;
    let folder = Path::new(&folder);
    fs::write(folder.join("plotly.js.gz.base64"), STANDARD.encode(encoder.finish()?))?;
    let hash = STANDARD.encode(Sha256::digest(library));
    fs::write(folder.join("plotly.js.sha256"), hash)
}
