//! Tests of `myovib figure` for figures with a chain, of `movie` and of `synchronization`.

use std::fs;
use std::path::Path;

use crate::harness::{Run, document, myovib_in};
use crate::results::read_table;

fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).expect("the folder");
    let mut names: Vec<String> = entries
        .map(|entry| entry.expect("an entry").file_name().into_string().expect("UTF-8"))
        .collect();
    names.sort();
    names
}

fn run(arguments: &str) -> (tempfile::TempDir, Run) {
    let folder = tempfile::tempdir().expect("a folder");
    let words: Vec<&str> = arguments.split_whitespace().collect();
    let run = myovib_in(folder.path(), &words);
    (folder, run)
}

/// Runs a command, which must succeed. Returns its folder and its document.
fn computed(arguments: &str) -> (tempfile::TempDir, serde_json::Value) {
    let (folder, run) = run(&format!("{arguments} --json --quiet"));
    let command = arguments.split(' ').next().expect("a command");
    (folder, document(&run.with_code(0).stdout, command))
}

#[test]
fn figure_3_prints_its_numbers() {
    let (folder, run) = run("figure 3 --t-end 4 --json --png --quiet");
    assert_eq!((run.code, run.stderr.as_str()), (0, ""));
    let json = &document(&run.stdout, "figure")["figures"][0];
    assert_eq!(json["number"], 3);
    assert_eq!((&json["generator"], &json["seed"]), (&"matlab".into(), &5489.into()));
    let frequencies = json["frequencies"].as_array().expect("the frequencies");
    assert_eq!(frequencies.len(), 20);
    // The expected value is 16π + 0.05 (2·0.8147… − 1), with the first random number of MATLAB.
    let first = 16.0 * std::f64::consts::PI + 0.05 * (2.0 * 0.814_723_686_393_178_9 - 1.0);
    assert_eq!(frequencies[0].as_f64(), Some(first));
    for quantity in ["psi", "chi", "frequency"] {
        let spread = &json["settled"][quantity];
        let number = |name: &str| spread[name].as_f64().expect(name);
        assert!(number("min") < number("mean") && number("mean") < number("max"));
        assert!(number("std") > 0.0);
    }
    // The window is half of a short run, or 20 s of a long run.
    assert_eq!(json["settled"]["window"], 2.0);
    let statistics = json;
    assert_eq!((&statistics["outcome"], &statistics["unknowns"]), (&"finished".into(), &60.into()));
    assert!(statistics["steps"].as_u64() > Some(100));
    assert_eq!(statistics["rtol"]["chain"], 1e-7);

    assert_eq!(
        names(&folder.path().join("figures")),
        [".lock", "figure3.csv", "figure3.png", "figure3.svg", "manifest.jsonl"]
    );
    let (header, rows) = read_table(&folder.path().join("figures/figure3.csv"));
    assert_eq!((header.len(), header[0].as_str(), header[26].as_str()), (27, "t", "r_20"));
    // Samples are plotted at intervals of 0.01 s, which resolve the ripple of 16 Hz.
    assert_eq!((rows.len(), rows[0][0], rows[400][0]), (401, 0.0, 4.0));
}

#[test]
fn figure_7_runs_muscle_and_chain_as_one_system() {
    let (folder, run) = run("figure 7 --t-end 1 --json --quiet");
    assert_eq!((run.code, run.stderr.as_str()), (0, ""));
    let json = &document(&run.stdout, "figure")["figures"][0];
    // There are 3034 unknowns of (29), and two for each of the five oscillators.
    assert_eq!(
        (&json["unknowns"], &json["oscillators"], &json["frequency_spread"]),
        (&3044.into(), &5.into(), &(0.5 / std::f64::consts::TAU).into())
    );
    assert_eq!((&json["ends"], &json["driven"]), (&"periodic".into(), &"all".into()));
    assert_eq!((&json["body"], &json["load"]), (&"muscle".into(), &"traction".into()));
    assert_eq!(json["point"], serde_json::json!([0.0, 0.0]));
    let tolerances = |block: &str| [&json["rtol"][block], &json["atol"][block]];
    assert_eq!(tolerances("u"), [1e-3, 1e-5]);
    assert_eq!(tolerances("chain"), [1e-7, 1e-10]);
    assert_eq!((&json["max_order"], &json["integrator"]), (&5.into(), &"bdf".into()));
    let (header, rows) = read_table(&folder.path().join("figures/figure7.csv"));
    let chi = header.iter().position(|name| name == "chi_abs").expect("|χ|");
    // At rest, the coherence is undefined and counted as 0. Five oscillators whose frequencies differ slightly separate
    // slowly.
    assert_eq!((rows.len(), rows[0][chi]), (101, 0.0));
    assert!(rows[1..].iter().all(|row| row[chi] > 0.99 && row[chi] <= 1.0));
}

/// Checks that two families of integrators compute the same motion.
#[test]
fn figure_3_by_radau_is_figure_3_by_bdf() {
    let settled = |integrator: &str| {
        let (_folder, run) =
            run(&format!("figure 3 --t-end 4 --integrator {integrator} --json --quiet"));
        assert_eq!((run.code, run.stderr.as_str()), (0, ""));
        let json = document(&run.stdout, "figure")["figures"][0].clone();
        assert_eq!(json["integrator"], integrator);
        // Only BDF has a variable order.
        assert_eq!(json["max_order"].is_null(), integrator != "bdf");
        let mean = |name: &str| json["settled"][name]["mean"].as_f64().expect(name);
        [mean("psi"), mean("chi"), mean("frequency")]
    };
    let (bdf, radau) = (settled("bdf"), settled("radau9"));
    for (a, b) in bdf.into_iter().zip(radau) {
        // The tolerance is 1e-7 per step, and the errors of several thousand BDF steps accumulate.
        assert!((a - b).abs() < 1e-4 * b, "{bdf:?} {radau:?}");
    }
}

#[test]
fn synchronization_judges_every_combination() {
    let (folder, json) = computed(
        "synchronization --gamma 1,6000 --frequency 8,7.5 --set chain[0].oscillators=3 --t-end 4",
    );
    let cases = json["cases"].as_array().expect("cases");
    assert_eq!(cases.len(), 4);
    let drives = cases.iter().map(|case| (&case["frequency"], &case["gamma"]));
    let number = |x: f64| serde_json::Value::from(x);
    let expected = [(8.0, 1.0), (8.0, 6000.0), (7.5, 1.0), (7.5, 6000.0)];
    for (found, (frequency, gamma)) in drives.zip(expected) {
        assert_eq!(found, (&number(frequency), &number(gamma)));
    }
    assert_eq!(cases[0]["settled"]["window"], 2.0);
    assert_eq!(
        names(&folder.path().join("synchronization")),
        [".lock", "manifest.jsonl", "synchronization.csv", "synchronization.svg"]
    );
}

#[test]
fn the_muscle_drives_chains_too() {
    let (_folder, json) =
        computed("synchronization --body muscle --gamma 1,10000 --t-end 2 --integrator radau9");
    let cases = json["cases"].as_array().expect("cases");
    assert_eq!(json["point"], serde_json::json!([0.0, 0.0]));
    for case in cases {
        // The paper's chain on the muscle has five oscillators with two states each.
        assert_eq!((&case["body"], &case["unknowns"]), (&"muscle".into(), &10.into()));
        assert_eq!(case["integrator"], "radau9");
    }
    // At a gain of ten thousand, a drive with an amplitude of one millimeter has a visible effect.
    let strength = |k: usize| cases[k]["settled"]["psi"]["mean"].as_f64().expect("|Ψ|");
    assert!((strength(1) - strength(0)).abs() > 1e-3);
}

/// Answers the paper's question in the full window: at the paper's gain, the chain keeps its natural frequency, and a
/// gain of 6000 locks it to the drive.
#[test]
fn a_strong_drive_locks_the_chain_and_the_papers_does_not() {
    let (_folder, json) = computed("synchronization --gamma 1,6000 --t-end 60");
    let [free, driven] = &json["cases"].as_array().expect("cases")[..] else {
        panic!("two cases: {json}");
    };
    let value = |case: &serde_json::Value, name: &str, which: &str| {
        let number = case["settled"][name][which].as_f64();
        number.expect("a number")
    };
    assert_eq!(driven["settled"]["window"], 20.0);
    assert_eq!((&driven["locked"], &free["locked"]), (&true.into(), &false.into()));
    // A locked chain turns by at most a tenth of a turn in 20 s relative to the drive, and has |χ| ≥ 0.9. This is
    // recomputed from the output.
    assert!((value(driven, "frequency", "mean") - 8.0).abs() < 0.005);
    assert!(value(driven, "chi", "min") >= 0.9);
    // The deviation is ten times the limit for a locked chain, that is, full turns instead of fractions of a turn.
    assert!((value(free, "frequency", "mean") - 8.0).abs() > 0.05);
    // The document contains all settings, including defaults.
    for case in [free, driven] {
        for (setting, value) in [
            ("van_der_pol", 2.0.into()),
            ("duffing", 0.0.into()),
            ("coupling", 3.0.into()),
            ("ends", "periodic".into()),
            ("driven", "all".into()),
            ("body", "rod".into()),
            ("point", serde_json::json!([0.05])),
            ("load", "strain".into()),
            ("load_frequency", 8.0.into()),
            ("integrator", "radau9".into()),
            ("linear_solver", "full".into()),
            ("seed", 5489.into()),
        ] {
            let value: serde_json::Value = value;
            assert_eq!(case[setting], value, "{setting}");
        }
    }
}

/// Runs a command that writes a movie with a width of 120 pixels, and checks its number of pictures.
fn assert_movie(arguments: &str, film: &str, frames: usize) {
    let (folder, found) = computed(&format!("{arguments} --width-pixels 120"));
    assert_eq!(found["frames"], frames);
    assert_moves(&folder.path().join(film), frames);
}

/// Checks that a movie has `frames` pictures with a width of 120 pixels, and that consecutive pictures differ.
fn assert_moves(film: &Path, frames: usize) {
    let mut options = gif::DecodeOptions::new();
    options.set_color_output(gif::ColorOutput::RGBA);
    let mut film = options.read_info(fs::File::open(film).expect("the film")).expect("a GIF");
    assert_eq!(film.width(), 120);
    let mut pictures: Vec<Vec<u8>> = Vec::new();
    while let Some(frame) = film.read_next_frame().expect("a picture") {
        pictures.push(frame.buffer.to_vec());
    }
    assert_eq!(pictures.len(), frames);
    let still = pictures.windows(2).filter(|pair| pair[0] == pair[1]).count();
    // At the turning points of the motion, two consecutive pictures may be equal.
    assert!(still <= frames / 10, "{still} of {frames} pictures are as the one before");
}

#[test]
fn movies_are_animations() {
    // The samples are at 0, 0.01, … 0.2 s.
    assert_movie("movie chain --from 0 --to 0.2", "chain.gif", 21);
}

#[test]
fn the_film_of_the_muscle_shows_one_cycle_of_its_load() {
    // The load has a frequency of 8 Hz, and there are 50 frames per period.
    assert_movie("movie muscle --to 0.125 --integrator radau9", "muscle.gif", 50);
}

#[test]
fn the_film_of_the_inclusion_shows_one_cycle_of_its_scenes_load() {
    // The load of this scene has a frequency of 16 Hz, and there are 50 frames per period.
    assert_movie("movie hardening --to 0.0625", "hardening.gif", 50);
}

#[test]
fn the_film_of_the_muscle_in_space_is_made_of_its_scene() {
    // There are 64 frames per second, and the vibration has just started.
    assert_movie("movie muscle3d --to 0.125", "muscle3d.gif", 9);
}

/// Checks movies of stored fields in 2D and in 3D, and the errors for runs from which no movie can be made.
#[test]
fn the_fields_of_a_run_become_a_movie() {
    let folder = tempfile::tempdir().expect("a folder");
    let run = |words: &str| {
        let words: Vec<&str> = words.split_whitespace().collect();
        myovib_in(folder.path(), &[&words[..], &["--quiet"]].concat())
    };
    let plane = "init --set time.end=0.5 --set fields.interval=0.05 --out plane";
    let space = "muscle3d --set time.end=0.1 --set mesh.cells=[10,2,2] --set probe=[] --set chain=[] \
                 --set fields.interval=0.02 --out space";
    for (scene, movie, file, frames) in [
        (plane, "plane --factor 40 --from 0.2", "plane.gif", 7),
        (space, "space --field von_mises", "space.gif", 6),
    ] {
        run(&format!("run {scene}")).with_code(0);
        run(&format!("movie {movie} --width-pixels 120")).with_code(0);
        assert_moves(&folder.path().join(file), frames);
    }
    let cycle = "run init --set analysis=response --set traction[0].response.y=1.0 --set response.frequencies=[2,8] \
                 --set response.fields=[2,8] --out cycle";
    run(cycle).with_code(0);
    run("movie cycle --frequency 7 --factor 40 --field p --width-pixels 120").with_code(0);
    assert_moves(&folder.path().join("cycle.gif"), 25);
    run("run init --set analysis=modes --out modes").with_code(0);
    run("movie modes --frequency 10 --width-pixels 120").with_code(0);
    assert_moves(&folder.path().join("modes.gif"), 25);
    run("run init --set time.end=0.02 --set fields= --out without").with_code(0);
    for (movie, place) in [
        ("without", "without"),
        ("plane --from 3 --out a.gif", "--from, --to"),
        ("plane --field nothing --out a.gif", "--field"),
        ("plane --factor nan --out a.gif", "--factor"),
        ("plane --frequency 1 --out a.gif", "--frequency"),
        ("cycle --frequency nan --out a.gif", "--frequency"),
        ("cycle --from 1 --out a.gif", "--from"),
        ("modes --to 1 --out a.gif", "--to"),
        ("modes --field p --out a.gif", "--field"),
        ("plane --set time.end=2 --out a.gif", "--set"),
        ("chain --factor 2", "--factor"),
        ("no-such-folder", "no-such-folder"),
    ] {
        let refused = run(&format!("movie {movie}"));
        assert_eq!(refused.code, 2, "{movie}: {}", refused.stderr);
        assert!(refused.stderr.contains(place), "{movie}: {}", refused.stderr);
    }
    assert!(!folder.path().join("a.gif").exists());
}

#[test]
fn bad_input_is_code_2_with_its_reason_and_nothing_is_written() {
    for (arguments, reason) in [
        ("figure 3 --set chain[0].oscillators=0", "chain[0].oscillators"),
        ("figure 3 --set chain[0].frequency_spread=-0.1", "frequency_spread"),
        ("figure 3 --set chain[0].generator=rand48", "matlab, chacha8"),
        ("figure 3 --set chain[0].at=0.2", "x = 0.2 must be on the rod"),
        ("figure 3 --set chain[0].at=[0.01,0.02]", "chain[0].at"),
        ("figure 7 --set chain[0].at=[1.0,1.0]", "the point (1, 1) is outside the mesh"),
        ("figure 3 --set chain[0].gain=inf", "gain"),
        ("figure 3 --set chain[0].seed=-1", "-1"),
        ("figure 3 --set chain[0].ends=closed", "periodic, open"),
        ("figure 3 --t-end 0", "--t-end"),
        ("figure 8", "2..=7"),
        ("figure 4 --mesh no-such.msh", "no-such.msh"),
        ("movie chain --from 3 --to 1", "no duration"),
        ("movie hardening --mesh muscle.msh", "--mesh"),
        ("movie muscle3d --from 1", "--from"),
        ("movie muscle --from 1", "--from"),
        ("movie chain --mesh muscle.msh", "--mesh"),
        ("movie muscle --set chain[0].gain=2", "`chain` has no entry `0`"),
        ("figure 4 --integrator radau5", "--integrator"),
        ("figure 3 --mesh muscle.msh", "--mesh"),
        ("figure 3 --integrator rk4", "unknown integrator `rk4`"),
        ("synchronization --t-end 0.01", "--t-end"),
        ("synchronization --mesh muscle.msh", "--body muscle"),
        ("synchronization --body muscle --set chain[0].at=0.05", "chain[0].at"),
        ("synchronization --frequency 0", "--frequency"),
        ("synchronization --set chain[0].oscillators=0", "chain[0].oscillators"),
    ] {
        let (folder, run) = run(arguments);
        assert_eq!((run.code, run.stdout.as_str()), (2, ""), "{arguments}");
        assert!(run.stderr.starts_with("error: "), "{arguments}: {}", run.stderr);
        assert!(run.stderr.contains(reason), "{arguments}: {}", run.stderr);
        assert_eq!(names(folder.path()), [""; 0], "{arguments}");
    }
}
