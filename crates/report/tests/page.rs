//! Tests of the report page as rendered by a browser, and of the escaping of names.
#![allow(clippy::unwrap_used)] // a test may panic

use std::fs;
use std::path::Path;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use myovib_report::page;
use myovib_report::plot::raster::pixels;
use myovib_scene::Scene;
use myovib_scene::csv::Table;
use myovib_scene::run::{RunOptions, compute};
use myovib_scene::vtu;
use serde_json::Value;

/// Returns the report of a built-in scene.
fn report(scene: &str, set: &[&str]) -> String {
    let folder = tempfile::tempdir().unwrap();
    computed(folder.path(), scene, set).1
}

/// Computes a built-in scene in a folder. Returns the scene and its report.
fn computed(folder: &Path, scene: &str, set: &[&str]) -> (Scene, String) {
    let set: Vec<String> = set.iter().map(|&one| one.to_owned()).collect();
    let scene = Scene::built_in(scene, &set).unwrap();
    let result = compute(&scene, &RunOptions::into_folder(folder)).unwrap();
    page::write(folder, &scene, &result).unwrap();
    (scene, fs::read_to_string(folder.join("report.html")).unwrap())
}

/// Returns the table of the probe `origin`.
fn origin(folder: &Path) -> Table {
    Table::parse(&fs::read_to_string(folder.join("origin.csv")).unwrap()).unwrap()
}

/// Returns the figures of a page. They start with a namespace declaration, which nested SVG elements do not have.
fn figures(html: &str) -> Vec<&str> {
    let starts = html.match_indices("<svg xmlns=");
    let figure = |(start, _)| {
        let rest: &str = &html[start..];
        let end = rest.find("</figure>").unwrap();
        rest[..end].trim_end()
    };
    starts.map(figure).collect()
}

/// Returns the data of the interactive parts of a page.
fn data_of(html: &str) -> Value {
    let (_, rest) = html.split_once("id=\"data\">").unwrap();
    serde_json::from_str(rest.split_once("</script>").unwrap().0).unwrap()
}

/// Returns the column with the index `number`, which is stored in single precision.
fn singles(data: &Value, number: &Value) -> Vec<f32> {
    let column = &data["columns"][number.as_u64().unwrap() as usize];
    assert_eq!(column["type"], "f4");
    let bytes = STANDARD.decode(column["data"].as_str().unwrap()).unwrap();
    bytes.as_chunks::<4>().0.iter().map(|single| f32::from_le_bytes(*single)).collect()
}

/// Side length in pixels of the square in which a figure is drawn.
const SIDE: u32 = 700;

/// Returns the figures that look different in a common document than alone.
fn spoiled(figures: &[&str]) -> Vec<usize> {
    let document = |shown: &dyn Fn(usize) -> bool| {
        let placed = figures.iter().enumerate().filter(|(i, _)| shown(*i));
        let placed = placed.map(|(i, figure)| {
            let y = SIDE as usize * i;
            format!("<g transform=\"translate(0 {y})\">{figure}</g>")
        });
        let height = SIDE as usize * figures.len();
        let content: String = placed.collect();
        let svg = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{SIDE}\" height=\"{height}\">{content}</svg>"
        );
        pixels(&svg, SIDE).unwrap()
    };
    let together = document(&|_| true);
    let differs = |i: &usize| {
        let alone = document(&|k| k == *i);
        let square = (SIDE * SIDE) as usize;
        let of = |drawn: &[_]| drawn[i * square..][..square].to_vec();
        let (there, here) = (of(together.pixels()), of(alone.pixels()));
        let ink = here.iter().filter(|pixel| pixel.green() < 240);
        let ink = ink.count();
        assert!(ink > 500, "figure {i} has only {ink} pixels that differ from white");
        there != here
    };
    (0..figures.len()).filter(differs).collect()
}

/// Regression: the first panel of each probe was clipped by the rectangle of another figure.
#[test]
fn figures_of_a_report_are_independent() {
    let motion =
        report("init", &["time.end=0.05", "integrator.method=radau5", "probe[0].interval=1e-3"]);
    let found = figures(&motion);
    assert_eq!(found.len(), 5, "the mesh, its deformation, u_x, u_y and p");
    assert_eq!(spoiled(&found), [0_usize; 0]);
    let modes = report("init", &["analysis=modes", "modes.count=2"]);
    let found = figures(&modes);
    assert_eq!(found.len(), 2, "the mesh, and the modes beside each other");
    assert_eq!(spoiled(&found), [0_usize; 0]);
}

/// Checks that a report of a 2D body shows the final body over its outline at rest.
#[test]
fn a_report_of_a_2d_body_shows_its_deformation() {
    let small = ["time.end=0.05", "integrator.method=radau5"];
    let html = report("init", &[&small[..], &["fields.interval=0.05"]].concat());
    assert!(html.contains("Deformed body at t = 0.05 s"));
    assert_eq!(figures(&html).len(), 5, "the mesh, its deformation, u_x, u_y, p");
    let without = report("init", &[&small[..], &["fields="]].concat());
    assert!(!without.contains("Deformed"), "no fields, no picture");
}

/// Checks that a report of a 3D body shows its groups and, if fields are written, its deformed surface and a section.
#[test]
fn a_report_of_a_3d_body_shows_surface_and_section() {
    let small = ["time.end=0.05", "mesh.cells=[10,2,2]", "probe=[]", "chain=[]"];
    let with_fields = report("muscle3d", &[&small[..], &["fields.interval=0.05"]].concat());
    for caption in ["Deformed surface at t = 0.05 s", "Section at t = 0.05 s"] {
        assert!(with_fields.contains(caption), "{caption}");
    }
    let found = figures(&with_fields);
    assert_eq!(found.len(), 3, "the body, its deformed surface, the section");
    assert_eq!(spoiled(&found), [0_usize; 0]);
    let other = "fields.quantities=[\"p\"]";
    let without = report("muscle3d", &[&small[..], &["fields.interval=0.05", other]].concat());
    assert_eq!(figures(&without).len(), 1, "no displacement, no picture of it");
    assert!(!without.contains("Deformed surface"));
}

/// Checks that the comparison detects clip rectangles with equal ids.
#[test]
fn figures_with_equal_ids_are_detected() {
    let figure = |x: u32| {
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"200\" height=\"200\">\
             <clipPath id=\"c0\"><rect x=\"{x}\" width=\"100\" height=\"200\"/></clipPath>\
             <path d=\"M0 100H200\" stroke=\"black\" stroke-width=\"20\" clip-path=\"url(#c0)\"/></svg>"
        )
    };
    let (left, right) = (figure(0), figure(100));
    assert_eq!(spoiled(&[&left, &right]).len(), 1);
    assert_eq!(spoiled(&[&left, &left]).len(), 0);
}

/// Checks that control characters in names in a scene do not reach the report.
#[test]
fn a_report_has_no_control_characters_from_names() {
    let name = r#""r\u001b]0;x\u0007\"<b>""#;
    let law = "law = \"neo-hooke\", density = 1e3, shear_modulus = 2e4";
    let materials =
        format!("material=[{{ group = \"muscle\", {law} }}, {{ group = {name}, {law} }}]");
    let region = format!("region=[{{ name = {name}, center = [0.0, 0.0], radii = [0.02, 0.02] }}]");
    let html = report(
        "init",
        &[
            "time.end=0.01",
            "integrator.method=radau5",
            "title=\"a\\u001b[2Jb\\u0007<script>\\u009b\"",
            &region,
            &materials,
        ],
    );
    let is_control = |c: &char| c.is_control() && *c != '\n';
    let controls: Vec<char> = html.chars().filter(is_control).collect();
    assert!(controls.is_empty(), "{controls:?}");
    for shown in
        ["a\\u{1b}[2Jb\\u{7}&lt;script&gt;\\u{9b}", "</span>r\\u{1b}]0;x\\u{7}&quot;&lt;b&gt;</td>"]
    {
        assert!(html.contains(shown), "{shown}");
    }
    let (text, _) = html.split_once("<script").unwrap();
    assert!(!text.contains("\"<b>"));
    let ends = html.matches("</script>").count();
    assert_eq!(ends, 3, "the data, the library and the script of the page");
}

/// Regression: columns of a probe beyond the sixth were omitted without a note.
#[test]
fn columns_that_are_not_shown_are_counted() {
    let quantities = "probe[0].quantities=[\"u\",\"v\",\"p\",\"stress\"]"; // 2 + 2 + 1 + 4 columns
    let html = report("init", &["time.end=0.05", quantities]);
    assert!(html.contains("3 more columns are in <code>origin.csv</code>"));
}

/// Regression: a nested figure was inverted twice in dark mode.
#[test]
fn dark_mode_inverts_a_figure_once() {
    let html = report("init", &["time.end=0.05"]);
    assert!(html.contains("figure>svg,.swatch{filter:invert"));
    assert!(!html.contains("figure svg{"));
}

/// Checks that a report of an equilibrium shows no times and a single value per column.
#[test]
fn a_report_of_an_equilibrium_has_no_times() {
    let html = report("land1", &["mesh.cells=[8,1,1]"]);
    for shown in ["<figcaption>Deformed surface</figcaption>", "value</th></tr>"] {
        assert!(html.contains(shown), "{shown}");
    }
    for of_a_motion in ["at t = ", "0.0000 s", "1 load steps"] {
        assert!(!html.contains(of_a_motion), "{of_a_motion}");
    }
    assert_eq!(spoiled(&figures(&html)), [0_usize; 0]);
}

/// Checks that the data of the interactive parts are the numbers in the tables and fields, up to the stored precision.
#[test]
fn a_report_has_the_numbers_of_the_run() {
    let folder = tempfile::tempdir().unwrap();
    let set = ["time.end=0.05", "integrator.method=radau5", "fields.interval=0.025"];
    let (scene, html) = computed(folder.path(), "init", &set);
    let data = data_of(&html);

    let table = origin(folder.path());
    let last = table.numbers(table.rows.last().unwrap()).unwrap();
    for (j, value) in last.iter().enumerate().skip(1) {
        let series = &data["charts"][j - 1]["series"][0];
        let stored = singles(&data, &series["y"]);
        assert_eq!(stored.len(), table.rows.len());
        assert_eq!(stored[stored.len() - 1], *value as f32);
    }

    let body = &data["bodies"][0];
    assert_eq!(body["labels"], serde_json::json!(["t = 0 s", "t = 0.025 s", "t = 0.05 s"]));
    let space = scene.body.as_ref().unwrap().muscle.solid.space();
    let triangles = STANDARD.decode(body["triangles"].as_str().unwrap()).unwrap();
    // Each element has four triangles of three indices with four bytes.
    assert_eq!(triangles.len(), space.n_elements() * 4 * 3 * 4);
    let (_, file) = vtu::files(folder.path()).unwrap().pop().unwrap();
    let (_, fields) = vtu::read(&file).unwrap();
    for (k, field) in fields.iter().filter(|field| !field.of_cells).enumerate() {
        let described = &body["fields"][k];
        assert_eq!(described["name"], *field.name);
        let width = field.components.len();
        for c in 0..width {
            let [low, high] =
                ["lowest", "highest"].map(|end| described["ranges"][c][end].as_f64().unwrap());
            let levels = STANDARD.decode(described["frames"][2][c].as_str().unwrap()).unwrap();
            let step = (high - low) / 65534.0;
            let errors = levels.as_chunks::<2>().0.iter().enumerate().map(|(point, &level)| {
                let value = low + step * f64::from(u16::from_le_bytes(level));
                (value - field.values[width * point + c]).abs()
            });
            // The tolerance is half a level, plus the rounding errors of three operations on each side.
            let largest = errors.fold(0.0, f64::max);
            let rounding = 6.0 * f64::EPSILON * high.abs().max(low.abs());
            assert!(largest <= 0.5 * step + rounding, "{} {c}: {largest}", field.name);
        }
    }
}

/// Checks that each value of a response has a Bode plot, with linked frequencies, and a Nyquist plot.
#[test]
fn a_response_has_bode_and_nyquist_plots_of_its_table() {
    let folder = tempfile::tempdir().unwrap();
    let set = [
        "analysis=response",
        "response.frequencies=[2, 5, 8]",
        "traction[0].response={ y = 1.0 }",
        "probe[0].quantities=[\"u\"]",
    ];
    let (_, html) = computed(folder.path(), "init", &set);
    let data = data_of(&html);
    let table = origin(folder.path());
    let rows: Vec<Vec<f64>> = table.rows.iter().map(|row| table.numbers(row).unwrap()).collect();
    let charts = data["charts"].as_array().unwrap();
    assert_eq!(charts.len(), 3 * 2);
    for (component, charts) in charts.chunks(3).enumerate() {
        // The columns of the table are the frequency and, for each component, the real part, imaginary part, amplitude
        // and phase.
        for (chart, part) in charts.iter().zip([2, 3, 1]) {
            let column = 1 + 4 * component + part;
            let expected: Vec<f32> = rows.iter().map(|row| row[column] as f32).collect();
            assert_eq!(singles(&data, &chart["series"][0]["y"]), expected, "{}", chart["y"]);
        }
        let units = charts.iter().map(|chart| [&chart["x"]["unit"], &chart["y"]["unit"]]);
        let units: Vec<_> = units.collect();
        assert_eq!(units, [["Hz", "m"], ["Hz", "°"], ["m", "m"]]);
        let links: Vec<&Value> = charts.iter().map(|chart| &chart["link"]).collect();
        assert_eq!(links, [&Value::from("f"), &Value::from("f"), &Value::Null]);
    }
    assert_eq!(spoiled(&figures(&html)), [0_usize; 0]);
}

/// Checks that a page without curves does not contain the chart library.
#[test]
fn pages_without_curves_are_small() {
    let html = report("init", &["analysis=modes", "modes.count=2"]);
    assert!(!html.contains("id=\"library\""));
    assert!(html.contains("\"oscillates\":true"));
    assert!(html.len() < 1_000_000, "{}", html.len());
}

/// Regression: obstacles, springs and point forces were missing, and a neo-hooke law was shown as mooney-rivlin.
#[test]
fn a_report_lists_what_acts_on_the_body() {
    let material = "material=[{ group = \"body\", law = \"neo-hooke\", density = 1e3, shear_modulus = 12345.0 }]";
    let contact = "contact=[{ group = \"load\", type = \"plane\", point = [60.0, 0.0], normal = [-1.0, 0.0] }]";
    let spring = "spring=[{ at = [48.0, 60.0], stiffness = 54321.0 }]";
    let force = "point_force=[{ at = [48.0, 60.0], x = 0.0625 }]";
    let html = report("cook-static", &[material, contact, spring, force]);
    for listed in [
        "<td>neo-hooke</td>",
        "shear_modulus = 12345",
        "<td>contact</td>",
        "normal = [-1, 0]",
        "<td>spring</td>",
        "stiffness = 54321",
        "<td>point force</td>",
        "0.0625",
    ] {
        assert!(html.contains(listed), "{listed}");
    }
}
