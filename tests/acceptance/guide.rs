//! Tests of the guide: console blocks show the output of the program, and scenes on pages are valid.

use std::fs;
use std::path::{Path, PathBuf};

use myovib_scene::run::VERIFY_MARGIN;
use myovib_scene::scene_file;

use crate::harness::myovib_in;
use crate::results::{read_column, read_json, read_table, run_scene};

/// Returns a value from the last row of the table of a probe.
fn last(folder: &Path, probe: &str, name: &str) -> f64 {
    read_column(&folder.join(format!("out/{probe}.csv")), name).pop().expect("a row")
}

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// Returns the pages of the guide, the README and the gallery, with their paths.
fn pages() -> Vec<(PathBuf, String)> {
    let mut paths = vec![root().join("README.md")];
    for folder in ["docs/src", "examples"] {
        let entries = fs::read_dir(root().join(folder)).into_iter().flatten();
        paths.extend(entries.map(|entry| entry.expect("an entry").path()));
    }
    paths.retain(|path| path.extension().is_some_and(|extension| extension == "md"));
    paths.sort();
    let read = |path: PathBuf| {
        let text = fs::read_to_string(&path).expect("a page");
        (path, text)
    };
    paths.into_iter().map(read).collect()
}

/// Returns the fenced code blocks in a language.
fn blocks<'a>(page: &'a str, language: &str) -> Vec<&'a str> {
    let fence = format!("\n```{language}\n");
    let after = page.split(&*fence).skip(1);
    after.map(|rest| rest.split("\n```").next().unwrap_or(rest)).collect()
}

/// Splits a command line at spaces that are not within single or double quotes.
fn words(line: &str) -> Vec<String> {
    let (mut words, mut quote, mut open) = (vec![String::new()], None, false);
    for c in line.chars() {
        match (quote, c) {
            (None, '"' | '\'') => (quote, open) = (Some(c), true),
            (Some(q), c) if c == q => quote = None,
            (None, '#') if words.last().is_some_and(String::is_empty) => break,
            (None, ' ') => {
                if open || words.last().is_some_and(|word| !word.is_empty()) {
                    words.push(String::new());
                }
                open = false;
            }
            (_, c) => words.last_mut().expect("a word").push(c),
        }
    }
    words.retain(|word| !word.is_empty());
    words
}

/// Returns whether lines match a pattern in which `...` matches any number of lines.
fn matches(pattern: &[&str], lines: &[&str]) -> bool {
    match pattern.split_first() {
        None => lines.is_empty(),
        Some((&"...", rest)) => (0..=lines.len()).any(|n| matches(rest, &lines[n..])),
        Some((first, rest)) => lines
            .split_first()
            .is_some_and(|(line, others)| line.trim_end() == *first && matches(rest, others)),
    }
}

/// Copies the scenes, data and meshes that the commands of the gallery use.
fn copy_examples(folder: &Path) {
    for entry in fs::read_dir(root().join("examples")).expect("the gallery") {
        let path = entry.expect("an entry").path();
        if path.extension().is_some_and(|own| own == "toml" || own == "csv" || own == "msh") {
            fs::copy(&path, folder.join(path.file_name().expect("a name"))).expect("a copy");
        }
    }
}

#[test]
fn console_blocks_print_what_the_pages_show() {
    let mut commands = 0;
    for (path, page) in pages() {
        let folder = tempfile::tempdir().expect("a folder");
        copy_examples(folder.path());
        for block in blocks(&page, "console") {
            for step in block.strip_prefix("$ ").expect("a prompt").split("\n$ ") {
                let mut lines = step.lines();
                let arguments = words(lines.next().unwrap_or_default());
                let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
                let (program, arguments) = arguments.split_first().expect("a command");
                assert_eq!(*program, "myovib", "{}", path.display());
                let run = myovib_in(folder.path(), arguments);
                let wanted: Vec<&str> = lines.collect();
                let printed: Vec<&str> = run.stdout.lines().collect();
                let place = format!("{}: {arguments:?}", path.display());
                assert_eq!(run.code, 0, "{place}\n{}", run.stderr);
                assert!(wanted.is_empty() || matches(&wanted, &printed), "{place}\n{}", run.stdout);
                commands += 1;
            }
        }
    }
    assert!(commands >= 6, "{commands} commands");
}

/// Limits the number of words in the guide. A word contains a letter, so rules in tables and signs in formulas do not
/// count. Comments, which readers do not see, and the generated scene reference are not counted.
#[test]
fn the_guide_stays_short() {
    let is_word = |word: &&str| word.contains(char::is_alphabetic);
    let count = |text: &str| text.split_whitespace().filter(is_word).count();
    let visible = |(_, page): (PathBuf, String)| -> usize {
        let after = |part: &str| part.split_once("-->").map_or(0, |(_, text)| count(text));
        let mut parts = page.split("<!--");
        parts.next().map_or(0, count) + parts.map(after).sum::<usize>()
    };
    let is_written = |(path, _): &(PathBuf, String)| !path.ends_with("scene-reference.md");
    let words: usize = pages().into_iter().filter(is_written).map(visible).sum();
    assert!(words <= 16_000, "{words} words");
}

/// Compares the factor that `run --verify` prints with the record shown on the page about accuracy.
#[test]
fn errors_exceed_their_estimates_by_the_printed_factor_at_most() {
    let page = fs::read_to_string(root().join("docs/src/accuracy.md")).expect("the page");
    let (_, name) = page.split_once("<!-- record ").expect("a record");
    let name = name.split_whitespace().next().expect("a name");
    let record = read_json(&root().join("data/bench").join(name));
    let rows = record["table"].as_array().expect("rows");
    let factors = rows.iter().map(|row| row["verify_max"].as_f64().expect("a factor"));
    let largest = factors.fold(0.0, f64::max);
    assert!(largest > 1.0 && largest <= VERIFY_MARGIN, "{largest}");
}

#[test]
fn scenes_in_pages_match_the_schema() {
    let mut scenes = 0;
    for (path, page) in pages() {
        for block in blocks(&page, "toml") {
            if let Err(error) = scene_file::read(&path.display().to_string(), block, &[]) {
                panic!("{error}\n{block}");
            }
            scenes += 1;
        }
    }
    assert!(scenes >= 20, "{scenes} scenes");
}

#[test]
fn examples_give_the_numbers_of_the_gallery() {
    let (shear, width) = (1e4, 0.02);
    // This is the force per unit depth of an incompressible neo-Hookean strip in plane strain.
    let force = |stretch: f64| shear * (stretch - stretch.powi(-3)) * width;
    let crept = (0..9).fold(1.0_f64, |l, _| l - (l - l.powi(-3) - 0.1) / (1.0 + 3.0 * l.powi(-4)));
    let relaxed = 1.0 + 0.5 * f64::exp(-(3.0 - 0.025) / 0.4);
    let cases = [
        // The strain is homogeneous, so the discrete solution is exact. Newton's method has an error of 1e-10.
        ("compression", "plate", "R_y", force(0.8), 1e-9),
        ("contraction", "force", "R_x", 400.0, 1e-9),
        ("rubber", "clamp", "R_x", 1e-4 * ogden(7.16, f64::powf(7.16, -0.5)), 1e-9),
        // The value was computed with elements of a quarter of the size, which change the force by 1.2 %.
        ("indentation", "indenter", "F_y", -98.935, 1.5e-2),
        // The default tolerance is 1e-4. `relaxed` uses the mean time of the stretch.
        ("relaxation", "force", "R_x", force(1.01) * relaxed, 3e-4),
        // The final state satisfies λ − λ⁻³ = 0.1. The strain still has to grow by 2e-5 of its value.
        ("creep", "end", "u_x", 0.1 * (crept - 1.0), 3e-4),
    ];
    for (name, probe, column, exact, tolerance) in cases {
        let folder = tempfile::tempdir().expect("a folder");
        copy_examples(folder.path());
        let run = myovib_in(folder.path(), &["run", &format!("{name}.toml"), "--quiet"]);
        assert_eq!(run.code, 0, "{name}: {}", run.stderr);
        let found = last(folder.path(), probe, column);
        assert!(
            (found - exact).abs() < tolerance * exact.abs(),
            "{name}: {found} instead of {exact}"
        );
    }
}

/// Returns the nominal stress (Pa) along `stretch` according to Ogden's incompressible law with the constants for
/// Treloar's rubber. The direction with the stretch `thickness` is free of stress.
fn ogden(stretch: f64, thickness: f64) -> f64 {
    let terms = [(0.63e6, 1.3), (1.2e3, 5.0), (-1e4, -2.0)];
    let stress = |(mu, alpha): (f64, f64)| mu * (stretch.powf(alpha) - thickness.powf(alpha));
    terms.into_iter().map(stress).sum::<f64>() / stretch
}

/// Checks the forces on 1 cm² of the cube in Treloar's three tests, and the deviations of the measurements from the
/// closed-form solutions.
#[test]
fn rubber_has_the_closed_forms_of_the_three_tests() {
    let folder = tempfile::tempdir().expect("a folder");
    copy_examples(folder.path());
    let back = "prescribed_displacement[1].group=back";
    let [uniaxial, shear, biaxial] =
        ["0.0661", "0.0396", "0.0344"].map(|x| format!("prescribed_displacement[0].x={x}"));
    let pulled = "prescribed_displacement[1].y=0.0344";
    // Each entry contains the name of the test, overrides, largest stretch, exponent of the thickness, number of
    // measurements before rubber crystallizes, and deviation stated in the gallery (MPa).
    for (test, sets, largest, exponent, used, printed) in [
        ("uniaxial", &[&*uniaxial][..], 7.61, -0.5, 19, 0.051),
        ("shear", &[&*shear, back], 4.96, -1.0, 13, 0.030),
        ("equibiaxial", &[&*biaxial, back, pulled], 4.44, -2.0, 16, 0.043),
    ] {
        let rows = |file: &str| -> Vec<[f64; 2]> {
            let (_, rows) = read_table(&folder.path().join(file));
            rows.iter().map(|row| [row[0], row[1]]).collect()
        };
        let measured = rows(&format!("rubber-{test}.csv"));
        let loads: Vec<f64> = measured.iter().map(|[load, _]| *load).collect();
        let loads = format!("static={{ loads = {loads:?} }}");
        let out = format!("out-{test}");
        run_scene(folder.path(), "rubber.toml", &out, &[&[&*loads], sets].concat());
        // The first row is the unloaded cube.
        let computed = rows(&format!("{out}/clamp.csv"));
        assert_eq!(computed.len(), measured.len() + 1);
        let mut squares = 0.0;
        for (k, ([_, force], [load, pull])) in computed[1..].iter().zip(&measured).enumerate() {
            let stretch = 1.0 + (largest - 1.0) * load;
            let exact = 1e-4 * ogden(stretch, stretch.powf(exponent));
            // Homogeneous strain is represented exactly. Newton's method has an error of 1e-10.
            assert!((force - exact).abs() < 1e-9 * exact, "{test}: {force} {exact}");
            if k < used {
                squares += (1e-2 * (force - pull)).powi(2);
            }
        }
        let deviation = (squares / used as f64).sqrt();
        assert!((deviation - printed).abs() < 5e-4, "{test}: {deviation} MPa");
    }
}

/// Finds the constants that fit Treloar's three tests best, starting from Ogden's constants.
#[test]
#[ignore = "slow"]
fn rubber_is_fitted_better_than_by_the_published_constants() {
    let folder = tempfile::tempdir().expect("a folder");
    copy_examples(folder.path());
    let mut scene = fs::read_to_string(folder.path().join("rubber.toml")).expect("a scene");
    // These are the constants stated in the gallery, each with half of its last digit.
    let constants = [
        ("mu_1", 0.470e6, 0.0005e6),
        ("alpha_1", 1.57, 0.005),
        ("mu_2", 310.0, 5.0),
        ("alpha_2", 5.63, 0.005),
        ("mu_3", -0.0098e6, 0.00005e6),
        ("alpha_3", -2.05, 0.005),
    ];
    for (name, ..) in constants {
        scene += &format!("[[parameter]]\nkey = \"material[0].{name}\"\n");
    }
    let noise = 4.0;
    scene += &format!(
        "[[output]]\nname = \"pull\"\nprobe = \"clamp\"\ncolumn = \"R_x\"\nnoise = {noise:?}\n"
    );
    fs::write(folder.path().join("all.toml"), scene).expect("a scene");
    let tension = fs::read_to_string(folder.path().join("rubber-uniaxial.csv")).expect("a table");
    // The data consists of the header and the rows before rubber crystallizes.
    let tension: Vec<&str> = tension.lines().take(20).collect();
    fs::write(folder.path().join("tension.csv"), tension.join("\n")).expect("a table");
    let [x, y] = ["x", "y"]
        .map(|axis| format!("prescribed_displacement[{}].{axis}", usize::from(axis == "y")));
    let back = "prescribed_displacement[1].group=back";
    let data = [
        format!("tension.csv {x}=0.0661"),
        format!("rubber-shear.csv {x}=0.0396 {back}"),
        format!("rubber-equibiaxial.csv {x}=0.0344 {back} {y}=0.0344"),
    ];
    let mut arguments = vec!["fit", "all.toml", "--quiet"];
    arguments.extend(data.iter().flat_map(|data| ["--data", data]));
    myovib_in(folder.path(), &arguments).with_code(0);
    let fit = read_json(&folder.path().join("fit/fit.json"));
    let n = fit["residuals"].as_array().expect("residuals").len();
    assert_eq!(n, 19 + 13 + 16);
    let deviation =
        1e-2 * noise * (2.0 * fit["cost"].as_f64().expect("a number") / n as f64).sqrt();
    // The gallery states this deviation (MPa).
    assert!((deviation - 0.026).abs() < 5e-4, "{deviation} MPa");
    for ((name, value, half), found) in
        constants.iter().zip(fit["parameters"].as_array().expect("parameters"))
    {
        let found = found["value"].as_f64().expect("a number");
        assert!((found - value).abs() < *half, "{name}: {found}");
    }
}

/// Checks the peak of the shaken strip and, without viscosity and Prony terms, its first natural frequency.
#[test]
fn the_shaken_muscle_has_the_resonance_of_the_gallery() {
    let folder = tempfile::tempdir().expect("a folder");
    copy_examples(folder.path());
    let peak = |sets: &[&str]| {
        let sets = sets.iter().flat_map(|set| ["--set", set]);
        let arguments: Vec<&str> = ["response", "shaker.toml", "--quiet", "--overwrite", "--json"]
            .into_iter()
            .chain(sets)
            .collect();
        let run = myovib_in(folder.path(), &arguments).with_code(0);
        let found: serde_json::Value = serde_json::from_str(&run.stdout).expect("a document");
        let peaks = found["peaks"].as_array().expect("peaks").iter();
        let mut of_middle =
            peaks.filter(|peak| peak["probe"] == "middle" && peak["column"] == "u_y");
        let first = of_middle.next().expect("a peak");
        first["frequency"].as_f64().expect("a number")
    };
    let found = peak(&[]);
    // The tolerance corresponds to the printed digits.
    assert!((found - 17.274).abs() < 5e-4, "{found}");
    let light = peak(&["material[0].viscosity=0.1", "material[0].prony="]);
    // The frequency of the mode is 16.953 Hz. A damping ratio of 1e-4 shifts a peak by the square of this ratio.
    assert!((light - 16.953).abs() < 2e-3, "{light}");
}

/// Checks the folds of the curve. Curves with half the step size have the same folds within 1e-6.
#[test]
fn the_hardening_strip_jumps_where_the_gallery_says() {
    let folder = tempfile::tempdir().expect("a folder");
    copy_examples(folder.path());
    myovib_in(folder.path(), &["run", "periodic.toml", "--quiet"]).with_code(0);
    let (_, rows) = read_table(&folder.path().join("out/continuation.csv"));
    let (folds, others): (Vec<_>, Vec<_>) = rows.into_iter().partition(|row| row[2] == 1.0);
    assert_eq!(folds.len(), 2);
    // The tolerance corresponds to the printed digits.
    for (fold, frequency) in folds.iter().zip([19.17, 18.59]) {
        assert!((fold[0] - frequency).abs() < 5e-3, "{fold:?}");
    }
    assert!(others.iter().any(|row| row[4] == 0.0), "no unstable state");
}

/// Checks the published moduli, which were computed from these constants and rounded to 0.1 Pa, 1e-4 of their value.
#[test]
fn the_springpot_of_the_gallery_is_the_published_one() {
    let folder = tempfile::tempdir().expect("a folder");
    copy_examples(folder.path());
    let arguments = ["fit", "elastography.toml", "--data", "elastography.csv", "--quiet", "--json"];
    let run = myovib_in(folder.path(), &arguments).with_code(0);
    let found: serde_json::Value = serde_json::from_str(&run.stdout).expect("a document");
    for (j, published) in [2680.0, 0.253].into_iter().enumerate() {
        let value = found["parameters"][j]["value"].as_f64().expect("a number");
        assert!((value / published - 1.0).abs() < 1e-3, "{value}");
    }
}

/// Checks that the strip, after its release, converges to the equilibrium under its weight alone.
#[test]
fn the_preloaded_strip_settles_in_equilibrium() {
    let folder = tempfile::tempdir().expect("a folder");
    copy_examples(folder.path());
    let settled = |sets: &[&str]| {
        let sets = sets.iter().flat_map(|set| ["--set", set]);
        let arguments: Vec<&str> =
            ["run", "preload.toml", "--quiet", "--overwrite"].into_iter().chain(sets).collect();
        myovib_in(folder.path(), &arguments).with_code(0);
        last(folder.path(), "end", "u_y")
    };
    let (moved, rests) = (settled(&[]), settled(&["analysis=static", "initial_state="]));
    // The tolerance of the motion is 1e-4. The vibration has decayed to 1e-5 of its amplitude.
    assert!((moved - rests).abs() < 3e-4 * rests.abs(), "{moved} {rests}");
    assert!(rests < -5e-4, "{rests}");
}

/// Compares the motion with a run of order 13 in small steps and in a different formulation.
#[test]
fn the_vibrating_muscle_follows_the_reference_solution() {
    let folder = tempfile::tempdir().expect("a folder");
    copy_examples(folder.path());
    myovib_in(folder.path(), &["run", "vibration.toml", "--quiet"]).with_code(0);
    let reference = read_json(&root().join("data/references/muscle_undamped.json"));
    let values: Vec<f64> = serde_json::from_value(reference["u_y"].clone()).expect("numbers");
    let largest = values.iter().fold(0.0_f64, |m, u| m.max(u.abs()));
    let (found, expected) = (last(folder.path(), "origin", "u_y"), values[values.len() - 1]);
    // The tolerance of the run is 1e-4. A margin is added for the accumulation of errors over 18 steps.
    assert!((found - expected).abs() < 3e-4 * largest, "{found} instead of {expected}");
}

/// Checks that a restart uses the state that the motion of `preload.toml` computes first.
#[test]
fn a_restart_continues_from_the_stored_equilibrium() {
    let folder = tempfile::tempdir().expect("a folder");
    copy_examples(folder.path());
    let run = |arguments: &[&str]| {
        myovib_in(folder.path(), &[&["run", "--quiet"], arguments].concat()).with_code(0);
    };
    let loads_at_zero = ["--set", "analysis=static", "--set", "time=", "--set", "initial_state="];
    run(&[&["preload.toml", "--out", "hanging"], &loads_at_zero[..]].concat());
    run(&["restart.toml"]);
    let restarted = last(folder.path(), "end", "u_y");
    run(&["preload.toml", "--overwrite"]);
    // Both runs start from the solution of the same Newton iteration, but their absolute tolerances differ. In the
    // guide's random scenes, the time integration error of displacements at the default tolerance is at most 2e-5.
    let direct = last(folder.path(), "end", "u_y");
    assert!((restarted - direct).abs() < 2e-5 * direct.abs(), "{restarted} {direct}");
}

#[test]
fn the_fit_finds_the_stiffness_behind_the_measured_force() {
    let folder = tempfile::tempdir().expect("a folder");
    copy_examples(folder.path());
    let fit = ["fit", "fit.toml", "--data", "fit.csv", "--json", "--quiet", "--out", "fitted"];
    let fit = myovib_in(folder.path(), &fit).with_code(0);
    let document = crate::harness::document(&fit.stdout, "fit");
    let c10 = document["parameters"][0]["value"].as_f64().expect("a number");
    // The inertia adds 3e-5 of the force.
    assert!((c10 - 5e3).abs() < 1e-4 * 5e3, "{c10}");

    let run = ["sensitivity", "fit.toml", "--quiet", "--out", "out"];
    myovib_in(folder.path(), &run).with_code(0);
    let slope = last(folder.path(), "sensitivity", "d force/d material[0].c10");
    assert!((slope + 0.046125).abs() < 1e-4 * 0.046125, "{slope}");
}

/// Checks a fit to the indentation, tension and relaxation of one tissue. The seed of the noise is fixed.
#[test]
fn three_tests_of_the_tissue_determine_its_constants() {
    let folder = tempfile::tempdir().expect("a folder");
    copy_examples(folder.path());
    let fit = [
        "fit",
        "tissue.toml",
        "--data",
        "tissue-relaxation.csv",
        "--data",
        "tissue-tension.csv analysis=static",
        "--data",
        "tissue-indentation.csv analysis=static prescribed_displacement[0].x.value=0 contact[0].y=-0.004",
        "--json",
        "--quiet",
    ];
    let fit = myovib_in(folder.path(), &fit).with_code(0);
    let document = crate::harness::document(&fit.stdout, "fit");
    let number = |value: &serde_json::Value| value.as_f64().expect("a number");
    // The data were computed with these constants.
    for (j, exact) in [1e4, 0.5, 0.4, 5e-6].into_iter().enumerate() {
        let found = &document["parameters"][j];
        let [low, high] = [0, 1].map(|side| number(&found["interval"][side]));
        assert!(low < exact && exact < high, "{low} {exact} {high}");
    }
    let deviation = number(&document["deviation"]);
    // With 60 measurements, the deviation is within 1 ± 4/√(2·56).
    assert!((deviation - 1.0).abs() < 0.38, "{deviation}");
}

#[test]
fn pictures_of_pages_are_well_formed() {
    let mut pictures = 0;
    for folder in ["docs/src/pictures", "docs/src/stability", "examples"] {
        for entry in fs::read_dir(root().join(folder)).expect("a folder") {
            let path = entry.expect("an entry").path();
            if path.extension().is_some_and(|extension| extension == "svg") {
                let text = fs::read_to_string(&path).expect("a picture");
                let parsed = roxmltree::Document::parse(&text);
                assert!(parsed.is_ok(), "{}: {parsed:?}", path.display());
                pictures += 1;
            }
        }
    }
    assert!(pictures >= 12, "{pictures} pictures");
}
