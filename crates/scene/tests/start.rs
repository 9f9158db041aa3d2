//! Where motions start: in equilibrium, with a velocity, as another run ended, and later than at the
//! end of a finished run.
#![allow(clippy::unwrap_used)] // a test may panic

use std::path::Path;

use myovib_scene::Scene;
use myovib_scene::csv::Table;
use myovib_scene::run::{Existing, RunOptions, RunResult, compute};

/// A block of two materials under its weight, held on its left.
const BLOCK: &str = r#"
[time]
end = 0.1
[mesh]
type = "rectangle"
width = 0.1
height = 0.04
cells = [6, 3]
[solid]
kappa = 1e5
[[material]]
law = "mooney-rivlin"
density = 1e3
c10 = 1e4
c01 = 1e3
[[fixed]]
group = "left"
[[body_force]]
y = -9.81
[integrator]
method = "radau9"
rtol = 1e-6
[[probe]]
name = "end"
type = "point"
at = [0.1, 0.04]
quantities = ["u", "v", "p"]
every = 0.01
[[probe]]
name = "energy"
type = "energy"
every = 0.01
"#;

const RTOL: f64 = 1e-6;

fn build(text: &str, set: &[&str], folder: &Path) -> Result<Scene, String> {
    let set: Vec<String> = set.iter().map(|&s| s.to_owned()).collect();
    Scene::build("scene.toml", text, &set, folder).map_err(|error| error.to_string())
}

fn run(text: &str, set: &[&str], out: &Path) -> RunResult {
    let scene = build(text, set, out.parent().unwrap()).unwrap();
    compute(&scene, &RunOptions::into_folder(out)).unwrap()
}

fn rows(out: &Path, probe: &str) -> Vec<Vec<f64>> {
    let text = std::fs::read_to_string(out.join(format!("{probe}.csv"))).unwrap();
    let table = Table::parse(&text).unwrap();
    let rows = table.rows.iter();
    rows.map(|row| table.numbers(row).unwrap()).collect()
}

/// The largest difference in each column but the time's, relative to the column's largest value.
fn apart(a: &[Vec<f64>], b: &[Vec<f64>]) -> f64 {
    assert_eq!(a.len(), b.len());
    let columns = 1..a[0].len();
    let apart = columns.map(|k| {
        let size = a.iter().fold(1e-300, |m: f64, row| m.max(row[k].abs()));
        let pairs = a.iter().zip(b);
        pairs.fold(0.0, |m: f64, (a, b)| m.max((a[k] - b[k]).abs())) / size
    });
    apart.fold(0.0, f64::max)
}

/// In equilibrium nothing moves, in any formulation, with κ finite and infinite, by both integrators;
/// and the start is what the static scene computes.
#[test]
fn a_body_that_starts_in_equilibrium_stays_there() {
    let folder = tempfile::tempdir().unwrap();
    let refused = compute(
        &build(BLOCK, &[], folder.path()).unwrap(),
        &RunOptions::into_folder(folder.path().join("refused")),
    );
    let message = refused.unwrap_err().to_string();
    assert!(message.contains("do not start from zero"), "{message}");
    for (i, set) in [
        [
            "solid.kappa=1e5",
            "solid.formulation=position",
            "integrator.method=bdf",
        ],
        [
            "solid.kappa=1e5",
            "solid.formulation=displacement",
            "integrator.method=radau9",
        ],
        [
            "solid.kappa=inf",
            "solid.formulation=position",
            "integrator.method=radau9",
        ],
        [
            "solid.kappa=inf",
            "solid.formulation=velocity",
            "integrator.method=radau13",
        ],
        [
            "solid.kappa=inf",
            "solid.beta=1e-3",
            "integrator.method=radau",
        ],
    ]
    .iter()
    .enumerate()
    {
        let place = |name: &str| folder.path().join(format!("{name}{i}"));
        // Without a pressure there is none to read off.
        let own = [
            "probe[0].quantities=[\"u\"]",
            "start={ type = \"equilibrium\" }",
        ];
        let moving = [&set[..], &own].concat();
        let result = run(BLOCK, &moving, &place("moving"));
        let statics = [&set[..2], &own[..1], &["analysis=static", "probe=[{ name = \"end\", type = \"point\", at = [0.1, 0.04], quantities = [\"u\"], every = 0.01 }]"]].concat();
        run(BLOCK, &statics, &place("static"));
        let (moving, at_rest) = (rows(&place("moving"), "end"), rows(&place("static"), "end"));
        let sag = at_rest[0][2];
        assert!(sag < -1e-3, "{set:?}: {sag}"); // it bends under its weight by millimetres
        for row in &moving {
            // Newton's method of the static solver stops at a smaller error than a step's tolerance.
            let off = (row[2] - sag).abs() / sag.abs();
            assert!(off < RTOL, "{set:?}: {off:e} at t = {}", row[0]);
        }
        assert!(result.document["steps"].as_u64().unwrap() < 60, "{set:?}");
    }
}

/// ½ m v² with m = 4 kg per metre of depth; the energy is kept as the body swings.
#[test]
fn a_body_may_start_with_a_velocity() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let set = [
        "body_force=[]",
        "start={ type = \"velocity\", value = [0.0, 0.3] }",
    ];
    run(BLOCK, &set, &out);
    let energy = rows(&out, "energy");
    let kinetic = energy[0][1];
    // The column of elements at the support goes from 0.3 m/s to 0: a part of the mass moves less.
    let whole = 0.5 * 4.0 * 0.3_f64.powi(2);
    assert!(
        (0.85 * whole..whole).contains(&kinetic),
        "{kinetic} of {whole}"
    );
    let elastic = energy.iter().fold(0.0, |m: f64, row| m.max(row[2]));
    assert!(elastic > 0.5 * kinetic, "{elastic}"); // it swings
    for row in &energy {
        // Each step errs by the tolerance; some hundred steps.
        assert!(row[5].abs() < 100.0 * RTOL * kinetic, "{row:?}");
    }
}

/// Two runs one after the other are one, within what the tolerance promises; and so is a finished run
/// that is extended.
#[test]
fn a_run_goes_on_from_where_another_ended() {
    let folder = tempfile::tempdir().unwrap();
    let place = |name: &str| folder.path().join(name);
    let swing = "body_force=[]";
    let pushed = "start={ type = \"velocity\", value = [0.0, 0.3] }";
    for kappa in ["solid.kappa=1e5", "solid.kappa=inf"] {
        let named = |name: &str| place(&format!("{name} {kappa}"));
        run(
            BLOCK,
            &[kappa, swing, pushed, "time.end=0.2"],
            &named("whole"),
        );
        let whole = rows(&named("whole"), "end");
        run(BLOCK, &[kappa, swing, pushed], &named("first"));
        let from = format!("start={{ type = \"run\", folder = \"first {kappa}\" }}");
        run(BLOCK, &[kappa, swing, &from], &named("second"));
        let mut second = rows(&named("second"), "end");
        // Errors of single steps add up over two periods, and pressures follow from accelerations.
        let promised = 100.0 * RTOL;
        let off = apart(&whole[10..], &second);
        assert!(off < promised, "{kappa}: {off:e}");
        second.clear();

        let scene = build(
            BLOCK,
            &[kappa, swing, pushed, "time.end=0.2"],
            folder.path(),
        )
        .unwrap();
        let resume = RunOptions {
            existing: Existing::Resume,
            ..RunOptions::into_folder(named("first"))
        };
        compute(&scene, &resume).unwrap();
        let off = apart(&whole, &rows(&named("first"), "end"));
        assert!(off < promised, "{kappa}: {off:e}");
        let again = compute(&scene, &resume).unwrap_err().to_string();
        assert!(again.contains("nothing to go on with"), "{again}");
    }
}

#[test]
fn starts_that_make_no_sense_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let equilibrium = "start={ type = \"equilibrium\" }";
    let statics = ["analysis=static", "probe=[]", "body_force=[{ y = -1.0 }]"];
    run(BLOCK, &statics, &folder.path().join("sag"));
    let from = "start={ type = \"run\", folder = \"sag\" }";
    let refusal = |set: &[&str]| match build(BLOCK, set, folder.path()) {
        Err(message) => message,
        Ok(scene) => {
            let out = RunOptions::into_folder(folder.path().join("out"));
            compute(&scene, &out).unwrap_err().to_string()
        }
    };
    for (set, message) in [
        (
            &[equilibrium, "analysis=static", "probe=[]"][..],
            "only a motion has a start",
        ),
        (
            &["start={ type = \"velocity\", value = [1.0, 2.0, 3.0] }"],
            "for each of the mesh's axes",
        ),
        (
            &["start={ type = \"run\", folder = \"nowhere\" }"],
            "cannot read",
        ),
        (&["start={ type = \"falling\" }"], "falling"),
        (&[from, "mesh.cells=[6, 4]"], "is of another mesh"),
        (
            &[from, "fixed=[{ group = \"right\" }]"],
            "elsewhere at t = 0",
        ),
        (
            &[equilibrium, "parameter=[{ key = \"material[0].c10\" }]"],
            "with parameters starts at rest",
        ),
    ] {
        let found = refusal(set);
        assert!(found.contains(message), "{set:?}: {found}");
    }
    assert!(!folder.path().join("out").exists());
}
