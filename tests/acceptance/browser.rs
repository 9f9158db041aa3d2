//! Tests of reports in a headless browser: all interactive parts are drawn without an error, and they respond.
//!
//! The tests need Chromium (Debian: `apt install chromium`). If it is not installed, they print a note and pass.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;

use crate::harness::myovib_in;

/// Script that is added to the head of a page. It collects errors, uses the controls, and stores its findings in an
/// attribute.
const EXPLORE: &str = include_str!("explore.js");

/// Returns the path of the browser, if it is installed.
fn browser() -> Option<PathBuf> {
    let folders = std::env::var_os("PATH").unwrap_or_default();
    let names = ["chromium", "chromium-browser", "google-chrome"];
    let found = std::env::split_paths(&folders)
        .flat_map(|folder| names.map(|name| folder.join(name)))
        .find(|path| path.is_file());
    if found.is_none() {
        eprintln!("skipped: Chromium is not installed");
    }
    found
}

/// Opens a copy of a page and returns the findings of the script.
fn explored(browser: &Path, page: &Path) -> Value {
    let html = fs::read_to_string(page).expect("the report");
    // The script is inserted before the security policy of the page, because the policy does not permit it.
    let (start, rest) = html.split_once("<head>").expect("a head");
    let copy = page.with_extension("explored.html");
    fs::write(&copy, format!("{start}<head><script>{EXPLORE}</script>{rest}")).expect("a file");
    let profile = tempfile::tempdir().expect("a folder");
    let output = Command::new(browser)
        .args([
            "--headless",
            "--no-sandbox",
            "--use-angle=swiftshader",
            "--enable-unsafe-swiftshader",
            "--window-size=1200,6000",
            "--virtual-time-budget=30000",
            "--dump-dom",
        ])
        .arg(format!("--user-data-dir={}", profile.path().display()))
        .arg(format!("file://{}", copy.display()))
        .output()
        .expect("the browser starts");
    let dom = String::from_utf8_lossy(&output.stdout);
    let seen = dom.split_once("data-seen=\"").and_then(|(_, rest)| rest.split_once('"'));
    let (seen, _) = seen.expect("the script of the page ended");
    let seen = seen.replace("&quot;", "\"").replace("&lt;", "<").replace("&gt;", ">");
    serde_json::from_str(&seen.replace("&amp;", "&")).expect("JSON")
}

/// Opens a report and checks that all of its parts started without a problem. Returns `None` if there is no browser.
pub(crate) fn seen_in(page: &Path) -> Option<Value> {
    let seen = explored(&browser()?, page);
    assert_eq!(seen["state"], "ready", "{seen}");
    assert_eq!(seen["problems"], Value::Array(Vec::new()), "{seen}");
    Some(seen)
}

/// Runs `myovib` and opens the report that it writes, if there is a browser.
fn report_of<'a>(words: impl IntoIterator<Item = &'a str>, page: &str) -> Option<Value> {
    browser()?;
    let folder = tempfile::tempdir().expect("a folder");
    myovib_in(folder.path(), &["init"]).with_code(0);
    myovib_in(folder.path(), &words.into_iter().collect::<Vec<_>>()).with_code(0);
    seen_in(&folder.path().join(page))
}

#[test]
fn the_report_of_a_run_can_be_explored() {
    let words = "run scene.toml --quiet --set time.end=0.3 --set fields.interval=0.05 --set probe[0].interval=2e-3";
    let Some(seen) = report_of(words.split(' '), "out/report.html") else {
        return;
    };
    // The charts show u_x, u_y and p, and the curve and the spectrum of the analysis.
    assert_eq!(seen["charts"], 5, "{seen}");
    assert_eq!(seen["linked"], true, "the charts share the range of times: {seen}");
    assert_eq!(seen["frames"], 7, "0 to 0.3 s in steps of 0.05 s: {seen}");
    for what in ["slider", "color", "factor", "turned", "played"] {
        assert_eq!(seen["changes"][what], true, "{what}: {seen}");
    }
    assert!(seen["rows"].as_array().is_some_and(|rows| rows.len() >= 2), "{seen}");
    let analyzed = &seen["analyzed"];
    let near = |value: &Value, expected: f64, relative: f64| {
        let value = value.as_f64().expect("a number");
        assert!((value - expected).abs() < relative * expected, "{value}, {expected}");
    };
    // Parabolas through 31 samples per period miss extrema by about (π/31)⁴/24 of the amplitude.
    near(&analyzed["decrement"]["frequency"], 8.0, 1e-5);
    near(&analyzed["decrement"]["ratio"], 0.02, 1e-4);
    // The distance between frequencies is 1/16 of 1/6 Hz, and the width is 0.32 Hz.
    near(&analyzed["width"]["frequency"], 8.0, 2e-3);
    near(&analyzed["width"]["ratio"], 0.02, 0.03);
    assert_eq!(analyzed["width"]["resolved"], true);
    assert_eq!(analyzed["short"]["resolved"], false, "0.8 s cannot resolve 0.32 Hz");
    // The window contains whole periods. Each value results from about 50 operations with rounding errors.
    near(&analyzed["peak"][0], 10.0, 1e-12);
    near(&analyzed["peak"][1], 0.25, 1e-12);
}

#[test]
fn the_report_of_a_3d_body_can_be_turned() {
    let words = "run muscle3d --quiet --set time.end=0.05 --set mesh.cells=[10,2,2] --set probe=[] --set chain=[] --set fields.interval=0.025";
    let Some(seen) = report_of(words.split(' '), "out/report.html") else {
        return;
    };
    assert_eq!(seen["frames"], 3, "{seen}");
    for what in ["slider", "color", "factor", "turned", "played"] {
        assert_eq!(seen["changes"][what], true, "{what}: {seen}");
    }
}

#[test]
fn modes_are_animated() {
    let words = "run scene.toml --quiet --set analysis=modes --set modes.count=3";
    let Some(seen) = report_of(words.split(' '), "out/report.html") else {
        return;
    };
    assert_eq!(seen["frames"], 3, "{seen}");
    for what in ["slider", "turned", "played"] {
        assert_eq!(seen["changes"][what], true, "{what}: {seen}");
    }
}

#[test]
fn the_report_of_a_sweep_has_linked_charts() {
    let words = "sweep scene.toml --quiet --set time.end=0.1 --vary solid.rayleigh_stiffness=1e-4,1e-3 --result top=max(origin.u_y)";
    let Some(seen) = report_of(words.split(' '), "sweep/report.html") else {
        return;
    };
    // The charts show the result and the steps against the key, and u_x, u_y and p against time.
    assert_eq!(seen["charts"], 5, "{seen}");
    assert_eq!(seen["linked"], true, "{seen}");
    assert_eq!(seen["highlighted"], true, "{seen}");
}

/// Checks that no text in a scene becomes a script or an element of the page.
#[test]
fn texts_of_a_scene_are_not_executed() {
    let attack =
        "</script><script>problems.push('ran')</script><img src=x onerror=problems.push('ran')>";
    let title = format!("title=\"{attack}\"");
    let name =
        format!("region=[{{ name = \"{attack}\", center = [0.0, 0.0], radii = [0.02, 0.02] }}]");
    let law = "law = \"neo-hooke\", density = 1e3, shear_modulus = 2e4";
    let materials =
        format!("material=[{{ group = \"muscle\", {law} }}, {{ group = \"{attack}\", {law} }}]");
    let set = [&title, &name, &materials].map(String::as_str);
    let mut words = vec!["run", "scene.toml", "--quiet", "--set", "time.end=0.02"];
    words.extend(set.iter().flat_map(|set| ["--set", set]));
    let Some(seen) = report_of(words, "out/report.html") else {
        return;
    };
    assert_eq!(seen["images"], 0, "{seen}");
}
