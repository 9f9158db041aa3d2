//! Tests of `myovib table1`, `myovib infsup` and `myovib check`.

use crate::harness::{document, myovib, myovib_in};

/// Checks all eight printed indices and the remark, with gaps of at least three decades, on two meshes in two states
/// each.
#[test]
fn table1_computes_the_papers_indices() {
    let run = myovib(&["table1", "--json"]);
    assert_eq!((run.code, run.stderr.as_str()), (0, ""));
    let found = document(&run.stdout, "table1");
    let rows = found["rows"].as_array().expect("rows");
    let printed: Vec<_> = rows.iter().filter(|row| !row["paper"].is_null()).collect();
    assert_eq!(printed.len(), 9);
    for row in &printed {
        assert_eq!(row["index"], row["paper"], "{row}");
    }
    for row in rows {
        assert!(row["gap_decades"].as_f64().is_some_and(|gap| gap >= 3.0), "{row}");
        let samples = row["samples"].as_array().expect("samples");
        assert_eq!(samples.len(), 4, "two meshes, two states");
    }
    for formulation in ["velocity", "stabilized", "implicit-rate", "displacement"] {
        assert!(rows.iter().any(|row| row["formulation"] == formulation), "{formulation}");
    }
    let limit = found["limit"].as_array().expect("the limit of (29)");
    assert_eq!(limit.last().expect("its end")["index"], 4);
    // (34) with an additional quadratic multiplier is wrong; (33) has μ = 0 up to rounding errors.
    let counterexample = &found["counterexample"];
    assert!(counterexample["error"].as_f64().is_some_and(|error| error > 0.3));
    assert!(counterexample["matching"]["multiplier"].as_f64().is_some_and(|mu| mu < 1e-11));
}

#[test]
fn infsup_distinguishes_stable_and_unstable_spaces_and_draws() {
    let folder = tempfile::tempdir().expect("a folder");
    let run = myovib_in(folder.path(), &["infsup", "--levels", "2", "--plot", "i.svg", "--json"])
        .with_code(0);
    let reported: Vec<&str> = run.stderr.lines().collect();
    assert_eq!(reported.len(), 4, "{}", run.stderr);
    assert_eq!(reported[1], "P2–P1, level 2 of 2: 1244 triangles");
    let found = document(&run.stdout, "infsup");
    let constant = |pair: usize, level: usize| {
        found["pairs"][pair]["levels"][level]["inf_sup"].as_f64().expect("a number")
    };
    // These are the values of the model's specification, to the digits given there.
    for (level, equal_order) in [(0, 0.06), (1, 0.05)] {
        assert!((constant(0, level) - 0.68).abs() < 0.015);
        assert!((constant(1, level) - equal_order).abs() < 5e-3);
    }
    let drawing = std::fs::read_to_string(folder.path().join("i.svg")).expect("the figure");
    assert!(drawing.starts_with("<svg") || drawing.starts_with("<?xml"), "{drawing:.60}");

    let unknown = myovib(&["infsup", "--fixed", "nowhere"]);
    assert_eq!(unknown.code, 2);
    assert!(unknown.stderr.contains("nowhere"), "{}", unknown.stderr);
}

/// Examines the body of a built-in 3D scene, given by the name of the scene, with the supports of the scene.
#[test]
fn infsup_measures_the_mesh_of_a_scene() {
    let folder = tempfile::tempdir().expect("a folder");
    let scene = |fixed: &str| {
        format!(
            "analysis = \"static\"\n[mesh]\ntype = \"box\"\nsize = [2.0, 1.0, 1.0]\ncells = [4, 2, 2]\n\
             [solid]\nbulk_modulus = 1e5\n[[material]]\nlaw = \"mooney-rivlin\"\ndensity = 1e3\nc10 = 1e4\n\
             [[fixed]]\ngroup = \"left\"\n[[fixed]]\ngroup = \"right\"\n{fixed}"
        )
    };
    let infsup = |fixed: &str, more: &[&str]| {
        std::fs::write(folder.path().join("box.toml"), scene(fixed)).expect("the scene");
        let words = [&["infsup", "box.toml", "--levels", "1", "--quiet", "--json"], more].concat();
        myovib_in(folder.path(), &words)
    };
    let run = infsup("", &[]);
    assert_eq!((run.code, run.stderr.as_str()), (0, ""));
    let found = document(&run.stdout, "infsup");
    assert_eq!(found["fixed"], serde_json::json!(["left", "right"]));
    let level = |pair: usize| &found["pairs"][pair]["levels"][0];
    assert_eq!(level(0)["tetrahedra"], 6 * 4 * 2 * 2);
    // The body is fixed at its ends, so the pair of spaces has no unconstrained pressure modes.
    assert!(
        level(0)["nullity"] == 0 && level(1)["inf_sup"].as_f64() < level(0)["inf_sup"].as_f64()
    );

    let coarser = infsup("", &["--set", "mesh.cells=[2,1,1]"]);
    let coarser = document(&coarser.stdout, "infsup");
    assert_eq!(coarser["pairs"][0]["levels"][0]["tetrahedra"], 6 * 2);
    let of_mesh = myovib(&["infsup", "--set", "mesh.refine=1"]);
    assert_eq!(of_mesh.code, 2);
    assert!(of_mesh.stderr.contains("--set"), "{}", of_mesh.stderr);

    let partly = infsup("components = [\"x\"]\n", &[]);
    assert_eq!((partly.code, partly.stdout.as_str()), (2, ""));
    assert!(partly.stderr.contains("`right`"), "{}", partly.stderr);
    let named = infsup("components = [\"x\"]\n", &["--fixed", "left"]).with_code(0);
    assert_eq!(document(&named.stdout, "infsup")["fixed"], serde_json::json!(["left"]));
}

#[test]
fn modes_gives_the_muscles_first_ten() {
    let folder = tempfile::tempdir().expect("a folder");
    let run = myovib_in(folder.path(), &["modes", "--svg", "m.svg", "--vtu", "m.vtu", "--json"]);
    assert_eq!((run.code, run.stderr.as_str()), (0, ""));
    let found = document(&run.stdout, "modes");
    for (muscle, kappa) in [(0, serde_json::json!(1e5)), (1, serde_json::json!("inf"))] {
        let muscle = &found["muscles"][muscle];
        assert_eq!(muscle["kappa"], kappa);
        let modes = muscle["modes"].as_array().expect("modes");
        assert_eq!(modes.len(), 10);
        for pair in modes.windows(2) {
            let of = |mode: &serde_json::Value| mode["frequency"].as_f64().expect("stable at rest");
            assert!(0.0 < of(&pair[0]) && of(&pair[0]) <= of(&pair[1]));
        }
    }
    let drawing = std::fs::read_to_string(folder.path().join("m.svg")).expect("the figure");
    assert!(drawing.contains("mode\u{a0}10:"), "{drawing:.4000}");
    let shapes = std::fs::read_to_string(folder.path().join("m.vtu")).expect("the shapes");
    assert!(shapes.contains("\"mode_10\""));
}

/// Checks that the scene of row 1 and the defaults of the command describe the same body.
#[test]
fn modes_of_a_scene_are_those_of_its_body() {
    let modes = |arguments: &[&str]| {
        let run = myovib(&[&["modes"][..], arguments, &["--json"]].concat());
        assert_eq!((run.code, run.stderr.as_str()), (0, ""));
        document(&run.stdout, "modes")["muscles"][0].clone()
    };
    let set = ["--set", "analysis=modes", "--set", "modes.count=3"];
    let scene = modes(&[&["table2-1"][..], &set].concat());
    assert_eq!(scene["modes"].as_array().map(Vec::len), Some(3));
    assert_eq!(scene, modes(&["--beta", "0", "--count", "3"]));

    let rod = myovib(&["modes", "figure3"]);
    assert_eq!((rod.code, rod.stdout.as_str()), (2, ""));
    assert!(rod.stderr.contains("body"), "{}", rod.stderr);
}

/// Checks row 4 of Table 2 as a scene: before the run, the warning names the index, the variable and a remedy.
#[test]
fn check_warns_of_row_4() {
    let run = myovib(&["check", "table2-4", "--json"]);
    assert_eq!((run.code, run.stderr.as_str()), (0, ""));
    let found = document(&run.stdout, "check");
    let body = &found["body"];
    assert_eq!((&body["index"], &body["computed"]["index"]), (&3.into(), &3.into()));
    let sizes: Vec<_> =
        (0..3).map(|i| body["blocks"][i]["unknowns"].as_u64().expect("a number")).collect();
    assert_eq!(sizes.iter().sum::<u64>(), 2849);
    assert_eq!(body["blocks"][2]["better_excluded"], true);
    assert_eq!(body["drive"], 8.0);
    assert_eq!(body["advised_max_order"], 2);
    assert_eq!(body["warnings"][0]["fields"][0], "p");
    let remedies = body["warnings"][0]["remedies"].to_string();
    assert!(remedies.contains("exclude p"), "{remedies}");

    let text = myovib(&["check", "table2-4-suppressed"]);
    assert!(text.stdout.contains("No objections"), "{}", text.stdout);
    let rod = myovib(&["check", "figure2"]).with_code(0);
    assert!(rod.stdout.starts_with("The scene is valid."));
}

/// Checks that, for a periodic state, `check` tries a period with the same unknowns as the run.
#[test]
fn check_reports_the_cost_of_a_period() {
    let folder = tempfile::tempdir().expect("a folder");
    let scene = "[mesh]\ntype = \"rectangle\"\nwidth = 0.05\nheight = 0.02\ncells = [1, 1]\n[solid]\nbulk_modulus = 1e6\n\
                 rayleigh_mass = 100.0\n[[material]]\nlaw = \"neo-hooke\"\ndensity = 1e3\nshear_modulus = 2e4\n\
                 [[fixed]]\ngroup = \"left\"\n[[traction]]\ngroup = \"right\"\n\
                 y = { type = \"sine\", amplitude = 1.0, frequency = 20.0 }\n\
                 [[probe]]\nname = \"tip\"\ntype = \"point\"\nat = [0.05, 0.01]\ninterval = 0.003125\n";
    std::fs::write(folder.path().join("s.toml"), format!("analysis = \"periodic\"\n{scene}"))
        .unwrap();
    let run = myovib_in(folder.path(), &["check", "s.toml", "--json"]);
    assert_eq!((run.code, run.stderr.as_str()), (0, ""));
    let found = &document(&run.stdout, "check")["periodic"];
    let computed = myovib_in(folder.path(), &["run", "s.toml", "--out", "out", "--json"]);
    let computed = document(&computed.stdout, "run");
    assert_eq!(found["unknowns"], computed["unknowns"], "{computed}");
    assert_eq!(found["part"], 1.0);
    assert!(found["steps"].as_u64() > Some(1) && found["seconds"].as_f64() > Some(0.0), "{found}");
    let text = myovib_in(folder.path(), &["check", "s.toml"]).stdout;
    assert!(text.contains(&format!("unknowns        {}", found["unknowns"])), "{text}");
}

/// Checks that, for a harmonic response, `check` lists the harmonic loads, the loads of the preload, and the cost of
/// all frequencies.
#[test]
fn check_reports_the_cost_of_a_response() {
    let set = ["--set", "traction[0].response={ y = 1.0 }", "--set", "response.frequencies=[1, 2]"];
    let wanted = [&["check", "init", "--json", "--set", "analysis=response"], &set[..]].concat();
    let run = myovib(&wanted).with_code(0);
    let found = &document(&run.stdout, "check")["response"];
    let folder = tempfile::tempdir().expect("a folder");
    let wanted = [&["response", "init", "--json", "--out", "out"], &set[..]].concat();
    let computed = document(&myovib_in(folder.path(), &wanted).stdout, "response");
    assert_eq!(found["unknowns"], computed["unknowns"], "{computed}");
    assert_eq!(found["harmonic"], serde_json::json!(["traction[0]"]));
    assert_eq!(found["preload"], serde_json::json!([]), "about rest");
    let preload = ["--set", "response.preload_time=0.0", "--set", "body_force=[{ y = -9.81 }]"];
    let run = myovib(
        &[&["check", "init", "--json", "--set", "analysis=response"], &set[..], &preload].concat(),
    );
    let about = &document(&run.stdout, "check")["response"];
    assert_eq!(about["harmonic"], found["harmonic"]);
    assert_eq!(about["preload"], serde_json::json!(["traction[0]", "body_force[0]"]));
    let [all, each] =
        ["seconds", "seconds_per_frequency"].map(|key| found[key].as_f64().expect("a time"));
    assert!(each > 0.0 && all == 2.0 * each, "{found}");
}

/// Checks that, for an equilibrium, `check` reports the size, the memory and the output files, in agreement with the
/// run.
#[test]
fn check_reports_the_cost_of_an_equilibrium() {
    let folder = tempfile::tempdir().expect("a folder");
    let fields = ["--set", "fields={interval = 1.0, quantities = [\"u\", \"p\"]}"];
    let scene = |command: &str, more: &[&str]| {
        myovib_in(folder.path(), &[&[command, "cook-static"], &fields[..], more].concat())
    };
    let run = scene("check", &["--json"]);
    assert_eq!((run.code, run.stderr.as_str()), (0, ""));
    let checked = document(&run.stdout, "check");
    let found = &checked["equilibrium"];
    // Cook's membrane is 48 wide. Its height decreases from 44 to 16, and it rises by 44.
    assert_eq!(checked["size"]["extents"], serde_json::json!([48.0, 60.0]));
    assert_eq!(checked["size"]["volume"], 48.0 * 30.0);
    assert!(found["linear_displacement"].as_f64() > Some(0.0), "{found}");
    assert!(found["seconds_per_iteration"].as_f64() > Some(0.0), "{found}");
    let computed = scene("run", &["--out", "out", "--json"]);
    let computed = document(&computed.stdout, "run");
    assert_eq!(found["unknowns"], computed["unknowns"]);
    let blocks = [0, 1].map(|i| found["blocks"][i]["unknowns"].as_u64().expect("a number"));
    assert_eq!(Some(blocks.iter().sum()), computed["unknowns"].as_u64());
    assert!(found["factors"]["bytes"].as_u64() > Some(0), "{found}");
    assert_eq!(found["warnings"].as_array().map(Vec::len), Some(0));

    let text = scene("check", &[]).stdout;
    let unknowns = format!("{} unknowns", computed["unknowns"]);
    for words in [
        &unknowns,
        "memory ",
        "fields.pvd: u, p in 1 file",
        "inf–sup",
        "body            48.000 by 60.000 m, 1.440e3 m², ",
        "according to linear elasticity, the load moves the body by up to ",
        "s per iteration",
    ] {
        assert!(text.contains(words), "{words}: {text}");
    }
    for line in text.lines().filter(|line| line.starts_with("writes")) {
        let name = line.split_whitespace().nth(1).expect("a name");
        let file = folder.path().join("out").join(name.trim_end_matches(':'));
        assert!(file.is_file(), "{line}");
    }
}

/// Checks that, for oscillators at points, `check` names the file that the run writes.
#[test]
fn check_names_the_files_of_oscillators() {
    let folder = tempfile::tempdir().expect("a folder");
    let chain = "\n[[chain]]\nname = \"here\"\nat = [[0.0, 0.0], [0.0, 0.005]]\noscillators = 2\n";
    let init = myovib_in(folder.path(), &["init", "-"]).with_code(0);
    let path = folder.path().join("scene.toml");
    std::fs::write(&path, init.stdout + chain).expect("the scene");
    let with = |words: &[&str]| {
        let end = ["scene.toml", "--set", "time.end=0.1", "--set", "fields.interval=0.05"];
        myovib_in(folder.path(), &[words, &end[..]].concat())
    };
    let text = with(&["check"]).stdout;
    let line = "writes          places.pvd: oscillators in 3 files\n";
    assert!(text.contains(line), "{text}");
    with(&["run", "--quiet", "--out", "out"]).with_code(0);
    let list = std::fs::read_to_string(folder.path().join("out/places.pvd")).expect("the list");
    assert_eq!(list.matches("<DataSet").count(), 3);
}

/// Regression: `check` did not count the unknowns of chains and tensions, and it printed β as "≤ 0" if κ varied.
#[test]
fn check_counts_the_unknowns_that_the_run_has() {
    let folder = tempfile::tempdir().expect("a folder");
    let chains = "
[[chain]]
name = \"many\"
at = [[0.0, 0.0], [0.0, 0.005]]
oscillators = 3
[[chain]]
name = \"one\"
at = [0.0, 0.0]
oscillators = 2
";
    let init = myovib_in(folder.path(), &["init", "-"]);
    std::fs::write(folder.path().join("scene.toml"), init.stdout + chains).expect("the scene");
    let with = |words: &[&str]| {
        let sets = [
            "time.end=0.02",
            "material[0].fiber=[1.0, 0.0]",
            "material[0].active={ type = \"bestel\", contractility = 1e3 }",
        ];
        let sets = sets.iter().flat_map(|set| ["--set", set]);
        let words = words.iter().copied().chain(sets);
        myovib_in(folder.path(), &words.collect::<Vec<_>>()).with_code(0)
    };
    let check = document(&with(&["check", "scene.toml", "--json"]).stdout, "check");
    let run = document(&with(&["run", "scene.toml", "--quiet", "--json"]).stdout, "run");
    let body = &check["body"];
    assert_eq!(body["unknowns"], run["unknowns"]);
    let of = |key: &str| {
        let parts = body[key].as_array().expect("a list").iter();
        let numbers = parts.map(|part| part["unknowns"].as_u64().expect("a number"));
        numbers.collect::<Vec<u64>>()
    };
    // Each oscillator has a position and a velocity.
    assert_eq!(of("chains"), [12, 4]);
    let total: u64 = of("blocks").iter().chain(&of("chains")).sum();
    assert_eq!(Some(total), run["unknowns"].as_u64());
    assert_eq!(
        body["blocks"].as_array().and_then(|b| Some(b.last()?["field"] == "tension")),
        Some(true)
    );

    let text = with(&["check", "scene.toml"]).stdout;
    for words in [vec!["tension", "1"], vec!["chain", "many", "12"], vec!["chain", "one", "4"]] {
        let is_there = text
            .lines()
            .any(|line| line.split_whitespace().collect::<Vec<_>>().starts_with(&words));
        assert!(is_there, "{words:?}: {text}");
    }
    assert!(text.contains(&format!(": {total} unknowns")), "{text}");
    let graded = myovib(&["check", "muscle3d", "--set", "mesh.cells=[10, 2, 2]"]).stdout;
    assert!(graded.contains("κ ≤ 1e6, β = 0"), "{graded}");
}

/// Regression: `run` rejected scenes with `analysis = "modes"`, although the reference documents this value.
#[test]
fn run_finds_the_modes_of_a_scene_as_modes_does() {
    let folder = tempfile::tempdir().expect("a folder");
    let set = ["--set", "analysis=modes", "--set", "modes.count=3"];
    let with_set = |words: &[&str]| myovib_in(folder.path(), &[words, &set].concat());
    let run = with_set(&["run", "init", "--quiet"]);
    assert_eq!((run.code, run.stderr.as_str()), (0, ""));
    let modes = with_set(&["modes", "init"]).stdout;
    assert_eq!(run.stdout, modes + "\nFull report: out/report.html\n");
    let found = document(&with_set(&["modes", "init", "--json"]).stdout, "modes");

    let read = |name: &str| std::fs::read_to_string(folder.path().join("out").join(name));
    let written = document(&read("run.json").expect("run.json"), "run");
    assert_eq!((&written["analysis"], &written["outcome"]), (&"modes".into(), &"finished".into()));
    for key in ["muscles", "alpha", "beta", "drive", "load"] {
        assert_eq!(written[key], found[key], "{key}");
    }
    let report = read("report.html").expect("the report");
    assert!(report.contains("mode\u{a0}3:"), "the modes are drawn");
    assert!(!report.contains("has index"), "nothing is integrated");
    assert!(read("origin.csv").is_err(), "nothing moves at the probe");
    let table = read("modes.csv").expect("the table");
    let mut rows = table.lines();
    let head = "mode,omega_squared,frequency,damping_ratio,participation_x,participation_y";
    assert_eq!(rows.next(), Some(&*format!("{head},effective_mass_x,effective_mass_y")));
    let frequencies = rows.map(|row| row.split(',').nth(2)?.parse().ok());
    let modes = found["muscles"][0]["modes"].as_array().expect("modes");
    let expected = modes.iter().map(|mode| mode["frequency"].as_f64());
    assert!(frequencies.eq(expected), "{table}");

    with_set(&["run", "init", "--quiet"]).with_code(2);
    for (option, reported) in
        [("--resume", "nothing to continue"), ("--verify", "no time integration error")]
    {
        let refused = with_set(&["run", "init", "--out", "other", option]).with_code(2);
        assert!(refused.stderr.contains(reported), "{}", refused.stderr);
    }
    let rod = myovib_in(folder.path(), &["run", "figure3", "--out", "rod", set[0], set[1]]);
    assert_eq!((rod.code, rod.stdout.as_str()), (2, ""));
    assert!(rod.stderr.contains("body"), "{}", rod.stderr);
    assert!(!folder.path().join("rod").exists());
}

/// Issue 15, E4: `check` warned of a gross mismatch of units, but `run` did not.
#[test]
fn run_repeats_the_warnings_of_check_once() {
    let folder = tempfile::tempdir().expect("a folder");
    let in_mm = [
        "mesh={ type = \"beam\", length = 200.0, height = 40.0, cells = [10, 2] }",
        "material[0].group=body",
        "probe[0].at=[100.0, 0.0]",
        "time.end=1e-3",
    ];
    // This value would be correct in g/cm³.
    let light = ["material[0].density=1.1", "time.end=1e-3"];
    let light_modes = ["material[0].density=1.1", "analysis=modes"];
    let of = |text: &str| -> Vec<String> {
        let lines = text.lines().filter(|line| line.starts_with("warning: "));
        lines.map(str::to_owned).collect()
    };
    for (sets, n_warnings, reported) in [
        // The frequency of the load is above the modes of the body, and the body is long.
        (&in_mm[..], 2, ["200.000 m long", "mesh.scale = 1e-3"]),
        (&light, 1, ["material[0]", "shear waves"]),
        (&light_modes, 1, ["material[0]", "shear waves"]),
    ] {
        let mut set = vec!["init"];
        set.extend(sets.iter().flat_map(|set| ["--set", set]));
        let check = myovib_in(folder.path(), &[&["check"][..], &set].concat());
        let run = [&["run"][..], &set, &["--quiet", "--overwrite"]].concat();
        let run = myovib_in(folder.path(), &run).with_code(0);
        let warned = of(&run.stderr);
        assert_eq!(warned, of(&check.stdout), "{}", check.stdout);
        assert_eq!(warned.len(), n_warnings, "{}", run.stderr);
        for reported in reported {
            assert!(warned.concat().contains(reported), "{warned:?}");
        }
    }
    // A load frequency of 1e19 Hz is printed with few digits.
    let load = "traction[0].y={ type = \"sine\", amplitude = 1.0, frequency = 1e19 }";
    let fast = ["run", "init", "--quiet", "--out", "fast", "--set", "integrator.max_steps=1"];
    let run = myovib_in(folder.path(), &[&fast[..], &["--set", load]].concat());
    let warned = of(&run.stderr);
    assert!(warned[0].contains("1.000e19 Hz"), "{warned:?}");
    // For row 4 of Table 2, `check` warns of the index.
    let end = ["--quiet", "--set", "time.end=1e-3", "--out", "row4"];
    let run = myovib_in(folder.path(), &[&["run", "table2-4"][..], &end].concat());
    let check = myovib(&["check", "table2-4"]);
    assert_eq!(of(&run.stderr), of(&check.stdout));
    let end = ["--quiet", "--set", "time.end=0.6", "--out", "right"];
    let right = myovib_in(folder.path(), &[&["run", "init"][..], &end].concat());
    assert_eq!((right.code, right.stderr.as_str()), (0, ""));
}
