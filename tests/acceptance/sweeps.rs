//! Tests of sweeps: cases have stable numbers, they are computed only once, and they are computed again if any input
//! has changed. Further tests cover tables of cases that were computed elsewhere, and job scripts.

use std::fs;
use std::path::Path;
use std::process::Command;

use myovib_scene::builtin;
use serde_json::Value;

use crate::harness::{Run, myovib_in};
use crate::results::read_json;

#[test]
fn cases_of_a_sweep_are_stable_and_can_be_computed_alone() {
    let folder = tempfile::tempdir().unwrap();
    let common = [
        "sweep",
        "table2-1",
        "--quiet",
        "--set",
        "time.end=0.2",
        "--vary",
        "solid.bulk_modulus=1e4,1e5,2e5",
        "--vary",
        "material[0].c10=1e4,2e4",
        "--out",
    ];
    let sweep = |out: &str, more: &[&str]| {
        myovib_in(folder.path(), &[&common[..], &[out], more].concat()).with_code(0);
        let sweep = read_json(&folder.path().join(out).join("sweep.json"));
        sweep["rows"].as_array().unwrap().clone()
    };
    let all = sweep("all", &["--threads", "2"]);
    let alone = sweep("alone", &["--case", "4/6"]);
    assert_eq!(all.len(), 6);
    assert_eq!(all[3]["probes"], alone[3]["probes"]);
    assert_eq!(alone[2]["outcome"], "not computed");
    assert!(all.iter().all(|row| row["outcome"] == "finished"));
}

/// Regression: a sweep waited forever if a record of a case was a pipe.
#[test]
fn a_pipe_in_place_of_a_record_is_not_read() {
    let folder = tempfile::tempdir().unwrap();
    let sweep = || {
        let vary = "traction[0].y=5.0,6.0";
        let words = ["sweep", "cook-static", "--quiet", "--vary", vary, "--out", "sweep"];
        myovib_in(folder.path(), &words)
    };
    assert_eq!(sweep().code, 0);
    let record = folder.path().join("sweep/case-0001.json");
    fs::remove_file(&record).unwrap();
    let made = Command::new("mkfifo").arg(&record).status().unwrap();
    assert!(made.success());
    sweep().with_code(0);
}

/// Regression: an invalid value among valid values resulted in a failed row of a successful sweep, and a job script was
/// written without a check of all values.
#[test]
fn a_wrong_value_of_any_case_is_refused_before_one_is_computed() {
    let folder = tempfile::tempdir().unwrap();
    let vary = "material[0].density=1,2,-3";
    for more in [&[][..], &["--slurm", "jobs.sh"]] {
        let run = myovib_in(
            folder.path(),
            &[&["sweep", "cook-static", "--vary", vary][..], more].concat(),
        );
        assert_eq!(run.code, 2, "{more:?}: {}", run.stderr);
        for printed in ["where: --vary material[0].density=-3", "case: 3: material[0].density=-3"] {
            assert!(run.stderr.contains(printed), "{more:?}: {}", run.stderr);
        }
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0, "{more:?}");
    }
}

#[test]
fn a_sweep_of_a_scene_that_has_changed_is_computed_again() {
    let folder = tempfile::tempdir().unwrap();
    let text = builtin::find("cook-static").unwrap().text;
    let tips = |text: &str| {
        fs::write(folder.path().join("scene.toml"), text).unwrap();
        let arguments = [
            "sweep",
            "scene.toml",
            "--quiet",
            "--vary",
            "solid.bulk_modulus=1_000.0e2",
            "--vary",
            // The second case can slide along the wall, so it is not sufficiently supported.
            "fixed[0].components=[\"x\", \"y\"],[\"x\"]",
        ];
        let run = myovib_in(folder.path(), &arguments).with_code(0);
        assert!(run.stderr.starts_with("note: case 2: "), "{}", run.stderr);
        let table = read_json(&folder.path().join("sweep/sweep.json"));
        assert_eq!(table["rows"][0]["solid.bulk_modulus"], 1e5);
        assert_eq!(table["rows"][1]["fixed[0].components"], "[\"x\"]");
        assert_eq!(table["rows"][1]["outcome"], "failed", "{table}");
        assert_eq!(table["rows"][1]["probes"], serde_json::json!({}), "failed");
        table["rows"][0]["probes"]["tip"][2].as_f64().unwrap()
    };
    let first = tips(text);
    assert_eq!(tips(text), first);
    assert!(tips(&text.replace("y = 6.25 ", "y = 12.5 ")) > 1.2 * first);
}

#[test]
fn a_sweep_detects_changed_files_and_retries_failed_cases() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("t.csv"), "t,f\n0,0\n1,1\n").unwrap();
    let scene = include_str!("../../data/scenes/figure3.toml");
    fs::write(folder.path().join("s.toml"), scene).unwrap();
    let swept = |more: &[&str]| {
        let load = "rod.load={ type = \"table\", file = \"t.csv\", time = \"t\", column = \"f\" }";
        let common = [
            "sweep",
            "s.toml",
            "--quiet",
            "--set",
            "time.end=0.01",
            "--set",
            load,
            "--set",
            "rod.load_type=traction",
            "--vary",
            "rod.rayleigh_mass=0.25",
            "--json",
        ];
        myovib_in(folder.path(), &[&common[..], more].concat())
    };
    let sweep = |more: &[&str]| -> Value {
        let run = swept(more).with_code(0);
        serde_json::from_str(&run.stdout).unwrap()
    };
    let case = folder.path().join("sweep/case-0001.json");
    let written = || fs::metadata(&case).unwrap().modified().unwrap();
    let first = sweep(&[]);
    assert_eq!(first["rows"][0]["outcome"], "finished", "{first}");
    let at_first = written();
    sweep(&[]);
    assert_eq!(written(), at_first, "nothing has changed");
    fs::write(folder.path().join("t.csv"), "t,f\n0,0\n1,2\n").unwrap();
    let second = sweep(&[]);
    assert_ne!(second["rows"][0]["probes"], first["rows"][0]["probes"], "the table has changed");
    let at_second = written();
    sweep(&["--overwrite"]);
    assert_ne!(written(), at_second);
    // A case is not recorded as a result if a file is only temporarily missing.
    fs::remove_file(folder.path().join("t.csv")).unwrap();
    let missing = swept(&[]);
    assert_ne!(missing.code, 0, "{}", missing.stdout);
    fs::write(folder.path().join("t.csv"), "t,f\n0,0\n1,2\n").unwrap();
    assert_eq!(sweep(&[])["rows"][0]["probes"], second["rows"][0]["probes"]);
}

/// Sweeps `scene.toml` over two values of β.
fn sweep(folder: &Path, more: &[&str]) -> Run {
    let common = ["sweep", "scene.toml", "--quiet", "--vary", "solid.rayleigh_stiffness=1e-4,2e-4"];
    myovib_in(folder, &[&common[..], more, &["--json"]].concat())
}

/// Returns the table of the same sweep.
fn swept(folder: &Path, more: &[&str]) -> Value {
    let run = sweep(folder, more).with_code(0);
    serde_json::from_str(&run.stdout).expect("JSON")
}

/// Writes a scene for a short run of the first built-in scene on the mesh `a.msh`.
fn write_scene(folder: &Path) {
    let text = include_str!("../../data/scenes/init.toml")
        .replace("type = \"muscle\"", "type = \"file\"\npath = \"a.msh\"")
        .replace("end = 2.0", "end = 0.02")
        .replace("method = \"radau9\"", "method = \"radau5\"");
    fs::write(folder.join("scene.toml"), text).expect("the scene");
    let mesh = include_str!("../../data/meshes/muscle.msh");
    fs::write(folder.join("a.msh"), mesh).expect("the mesh");
}

#[test]
fn a_sweep_sees_a_changed_mesh() {
    let folder = tempfile::tempdir().unwrap();
    write_scene(folder.path());
    let result = ["--result", "top=max(origin.u_y)"];
    let case = folder.path().join("sweep/case-0001.json");
    let written = || fs::metadata(&case).unwrap().modified().unwrap();
    let first = swept(folder.path(), &result);
    assert_eq!(first["rows"][0]["outcome"], "finished", "{first}");
    let at_first = written();
    let mesh = fs::read_to_string(folder.path().join("a.msh")).unwrap();
    // The file is written again with the same content.
    fs::write(folder.path().join("a.msh"), &mesh).unwrap();
    assert_eq!(swept(folder.path(), &result), first);
    assert_eq!(written(), at_first, "the content is the same");
    let moved = mesh.replacen("\n0.1 0.012 0\n", "\n0.1 0.0125 0\n", 1);
    assert_ne!(mesh, moved);
    fs::write(folder.path().join("a.msh"), moved).unwrap();
    // Results on the other mesh are not accepted as results on this mesh, even if nothing is computed.
    let table = fs::read_to_string(folder.path().join("sweep/sweep.json")).unwrap();
    let collect = [&["--collect"][..], &result].concat();
    let collected = sweep(folder.path(), &collect);
    assert_eq!(collected.code, 2);
    let printed = &collected.stderr;
    assert!(printed.contains("case"), "{printed}");
    let kept = fs::read_to_string(folder.path().join("sweep/sweep.json")).unwrap();
    assert_eq!(kept, table, "nothing is written");
    swept(folder.path(), &["--case", "2/2"]);
    let collected = swept(folder.path(), &collect);
    assert_eq!(collected["rows"][0]["outcome"], "not computed");
    for of_old in [&collected["rows"][0]["probes"]["origin"], &collected["rows"][0]["top"]] {
        assert!(of_old.is_null(), "{collected}");
    }
    let second = swept(folder.path(), &result);
    assert_ne!(written(), at_first);
    assert_ne!(second["rows"][0]["probes"], first["rows"][0]["probes"]);
}

#[test]
fn a_sweep_sees_another_program() {
    let folder = tempfile::tempdir().unwrap();
    write_scene(folder.path());
    let first = swept(folder.path(), &[]);
    let case = folder.path().join("sweep/case-0001.json");
    let mut record = read_json(&case);
    record["program"] = "0.0.9 of last year".into();
    record["result"]["steps"] = 1.into();
    fs::write(&case, record.to_string()).unwrap();
    let second = swept(folder.path(), &[]);
    assert_eq!(second["rows"][0]["steps"], first["rows"][0]["steps"]);
    assert_ne!(fs::read_to_string(&case).unwrap(), record.to_string());
}

#[test]
fn collect_gathers_results_without_computing() {
    let folder = tempfile::tempdir().unwrap();
    write_scene(folder.path());
    let result = ["--result", "top=max(origin.u_y)"];
    let part = swept(folder.path(), &[&["--case", "2/2"][..], &result].concat());
    let collected = swept(folder.path(), &[&["--collect"][..], &result].concat());
    assert_eq!(collected["rows"], part["rows"]);
    assert_eq!(collected["rows"][0]["outcome"], "not computed");
    assert!(collected["rows"][0]["top"].is_null());
    assert_eq!(collected["rows"][1]["outcome"], "finished");
    assert!(collected["rows"][1]["top"].as_f64().is_some_and(|top| top > 0.0));
    assert!(!folder.path().join("sweep/case-0001").exists(), "nothing is computed");
    let table = fs::read_to_string(folder.path().join("sweep/sweep.csv")).unwrap();
    let lines: Vec<&str> = table.lines().collect();
    assert!(lines[0].starts_with("case,solid.rayleigh_stiffness,top,outcome,"), "{table}");
    assert!(lines[1].starts_with("1,1e-4,,not computed,"), "{table}");
    assert!(lines[2].starts_with("2,2e-4,"), "{table}");
    assert!(lines[2].contains(",finished,"), "{table}");
}

/// Runs the script in the same way as Slurm does, one task after the other.
#[cfg(unix)]
#[test]
fn the_job_script_for_slurm_computes_all_cases_and_explains_how_to_collect_them() {
    let folder = tempfile::tempdir().unwrap();
    write_scene(folder.path());
    // A shell would split these words.
    let words = [
        "sweep",
        "scene.toml",
        "--vary",
        "solid.rayleigh_stiffness=1e-4,2e-4,3e-4",
        "--set",
        "title=it's $HOME; a title",
        "--result",
        "top=max(origin.u_y) * 2",
        "--out",
        "my cases",
        "--slurm",
        "jobs.sh",
        "--per-task",
        "2",
    ];
    let run = myovib_in(folder.path(), &words).with_code(0);
    assert_eq!(run.stdout, "3 cases in 2 tasks. Submit them: sbatch jobs.sh\n");
    assert!(!folder.path().join("my cases").exists(), "nothing is computed");
    let script = fs::read_to_string(folder.path().join("jobs.sh")).unwrap();
    for line in [
        "#!/bin/bash",
        "#SBATCH --array=1-2",
        "#SBATCH --cpus-per-task=1",
        "first=$(( (SLURM_ARRAY_TASK_ID - 1) * 2 + 1 ))",
        "if (( last > 3 )); then last=3; fi",
    ] {
        assert!(script.lines().any(|l| l == line), "{line}: {script}");
    }
    for task in ["1", "2"] {
        let task = Command::new("bash")
            .arg("jobs.sh")
            .current_dir(folder.path())
            .env("SLURM_ARRAY_TASK_ID", task)
            .output()
            .unwrap();
        let stderr = String::from_utf8_lossy(&task.stderr);
        assert!(task.status.success(), "{stderr}");
    }
    let collected = Command::new("bash")
        .args(["jobs.sh", "--collect"])
        .current_dir(folder.path())
        .output()
        .unwrap();
    assert!(collected.status.success());
    let table = read_json(&folder.path().join("my cases/sweep.json"));
    for row in table["rows"].as_array().unwrap() {
        assert_eq!(row["outcome"], "finished", "{table}");
        assert!(row["top"].as_f64().is_some_and(|top| top > 0.0), "{table}");
    }
    let case = fs::read_to_string(folder.path().join("my cases/case-0003/run.json")).unwrap();
    assert!(case.contains("it's $HOME; a title"), "{case}");
}

#[test]
fn a_sweep_of_modes_has_columns_of_frequencies() {
    let folder = tempfile::tempdir().unwrap();
    let set = ["--set", "analysis=modes", "--set", "modes.count=2"];
    let sweep = [
        "sweep",
        "init",
        "--quiet",
        "--vary",
        "solid.bulk_modulus=1e4,1e5",
        "--result",
        "first=min(modes.frequency)",
        "--result",
        "second=min(modes.frequency, 2)",
        "--json",
    ];
    let run = myovib_in(folder.path(), &[&sweep[..], &set].concat()).with_code(0);
    let table: Value = serde_json::from_str(&run.stdout).unwrap();
    for (row, kappa) in [(0, "solid.bulk_modulus=1e4"), (1, "solid.bulk_modulus=1e5")] {
        let modes = ["modes", "init", "--json", "--set", kappa];
        let run = myovib_in(folder.path(), &[&modes[..], &set].concat());
        let found: Value = serde_json::from_str(&run.stdout).unwrap();
        let row = &table["rows"][row];
        assert_eq!(row["outcome"], "finished", "{table}");
        for (name, n) in [("first", 0), ("second", 1)] {
            assert_eq!(row[name], found["muscles"][0]["modes"][n]["frequency"]);
            assert!(row[name].is_number());
        }
    }
}

/// Regression: a key that was varied twice, and a result with the name of a key, led to columns with wrong values. A
/// column that no probe has was empty without an error.
#[test]
fn columns_of_a_sweep_are_unique_and_known() {
    let folder = tempfile::tempdir().unwrap();
    for (more, printed) in [
        (&["--vary", "solid.rayleigh_stiffness=1e-4"][..], "already varied"),
        (&["--vary", "=1,2"], "a key is missing"),
        (&["--vary", "time.end=1e-2..inf:3"], "finite numbers"),
        (&["--result", "solid.rayleigh_stiffness=max(origin.u_y)"], "already used"),
        (&["--result", "case=max(origin.u_y)"], "already used"),
        (&["--result", "top=max(origin.u_z)"], "t, u_x, u_y, p"),
        (&["--result", "top=max(orign.u_y)"], "unknown probe `orign`"),
    ] {
        let common = ["sweep", "init", "--vary", "solid.rayleigh_stiffness=1e-4,2e-4"];
        let run = myovib_in(folder.path(), &[&common[..], more].concat());
        assert_eq!(run.code, 2, "{more:?}: {}", run.stderr);
        assert!(run.stderr.contains(printed), "{more:?}: {}", run.stderr);
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0, "{more:?}");
    }
}

/// Regression: a run that ended by its stop condition was reported as failed, and its results were empty.
#[test]
fn a_condition_that_ends_a_case_is_not_a_failure() {
    let folder = tempfile::tempdir().unwrap();
    write_scene(folder.path());
    let stop = "stop=[{ type = \"displacement\", at = [0.0, 0.0], above = 1e-9 }]";
    let run = sweep(folder.path(), &["--set", stop, "--result", "top=max(origin.u_y)"]);
    assert_eq!((run.code, run.stderr.as_str()), (0, ""));
    let table: Value = serde_json::from_str(&run.stdout).unwrap();
    for row in table["rows"].as_array().unwrap() {
        assert_eq!(row["outcome"], "stopped", "{row}");
        assert_eq!(row["reason"], "event", "{row}");
        assert!(row["top"].as_f64().is_some(), "{row}");
        assert!(row["t_reached"].as_f64().unwrap() < 0.02, "{row}");
    }
}

/// Regression: a deleted table resulted in an empty cell.
#[test]
fn a_case_whose_table_is_gone_is_computed_again() {
    let folder = tempfile::tempdir().unwrap();
    write_scene(folder.path());
    let result = ["--result", "top=max(origin.u_y)"];
    let first = swept(folder.path(), &result);
    fs::remove_file(folder.path().join("sweep/case-0001/origin.csv")).unwrap();
    assert_eq!(swept(folder.path(), &result)["rows"][0]["top"], first["rows"][0]["top"]);
    assert!(first["rows"][0]["top"].as_f64().is_some());
}

/// Regression: the second of two processes recorded a failed case.
#[test]
fn two_processes_that_compute_one_sweep_wait_for_each_other() {
    let folder = tempfile::tempdir().unwrap();
    write_scene(folder.path());
    let start = || {
        Command::new(crate::harness::PROGRAM)
            .args([
                "sweep",
                "scene.toml",
                "--quiet",
                "--vary",
                "solid.rayleigh_stiffness=1e-4,2e-4",
            ])
            .current_dir(folder.path())
            .stdout(std::process::Stdio::null())
            .spawn()
            .unwrap()
    };
    for mut process in [start(), start()] {
        assert!(process.wait().unwrap().success());
    }
    let table = swept(folder.path(), &["--collect"]);
    for row in table["rows"].as_array().unwrap() {
        assert_eq!(row["outcome"], "finished", "{row}");
    }
}
