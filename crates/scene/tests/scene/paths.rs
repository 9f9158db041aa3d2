//! Loading paths of equilibria, load curves of tables, and supports of any size and motion.

use std::fs;
use std::path::Path;

use myovib_model::EndReason;
use myovib_scene::Scene;
use myovib_scene::csv::Table;
use myovib_scene::modes::Modes;
use myovib_scene::response::Response;
use myovib_scene::run::{RunOptions, RunResult, compute};
use myovib_scene::watch::Watcher;

fn build(text: &str, folder: &Path) -> Scene {
    Scene::build("scene.toml", text, &[], folder).unwrap()
}

fn run(text: &str) -> RunResult {
    let out = tempfile::tempdir().unwrap();
    compute(&build(text, Path::new("")), &RunOptions::into_folder(out.path())).unwrap()
}

/// Returns the value of the probe `corner` at the end.
fn at_corner(text: &str, folder: &Path, column: &str) -> f64 {
    let out = tempfile::tempdir().unwrap();
    compute(&build(text, folder), &RunOptions::into_folder(out.path())).unwrap();
    let table = Table::parse(&fs::read_to_string(out.path().join("corner.csv")).unwrap()).unwrap();
    let position = table.names.iter().position(|name| name == column).unwrap();
    table.numbers(table.rows.last().unwrap()).unwrap()[position]
}

fn result(run: &RunResult, probe: &str, column: &str) -> f64 {
    run.document["results"][probe][column].as_f64().unwrap()
}

/// Returns a cube of heart muscle on three symmetry planes, pulled along its fibers by `k` times 10.4 kPa.
fn heart(head: &str, k: &str, formulation: &str, traction: &str, probe: &str) -> String {
    let planes: String = [("left", "x"), ("front", "y"), ("bottom", "z")]
        .iter()
        .map(|(group, axis)| format!("[[fixed]]\ngroup = \"{group}\"\ncomponents = [\"{axis}\"]\n"))
        .collect();
    format!(
        "{head}formulation = \"{formulation}\"\n[mesh]\ntype = \"box\"\nsize = [0.01, 0.01, 0.01]\n\
         cells = [1, 1, 1]\n[[material]]\nlaw = \"holzapfel-ogden\"\ndensity = 1e3\na = 59\nb = 8.023\n\
         a_f = 18472\nb_f = 16.026\na_s = 2481\nb_s = 11.12\na_fs = 216\nb_fs = 11.436\n{k}fiber = [1, 0, 0]\n\
         sheet = [0, 1, 0]\n{planes}[[traction]]\ngroup = \"right\"\nx = {traction}\n\
         [[probe]]\nname = \"corner\"\ntype = \"point\"\nat = [0.01, 0.01, 0.01]\n{probe}"
    )
}

/// Regression: where fibers become slack, the direction of the path jumps. The change over the jump was extrapolated, and
/// the search ended at 0.1 % of the load.
#[test]
fn stretched_strips_with_slack_fibers_reach_their_equilibria() {
    for cells in ["[8, 3, 2]", "[16, 4, 2]"] {
        let strip = |k: &str| {
            format!(
                "analysis = \"static\"\n[mesh]\ntype = \"box\"\nsize = [0.04, 0.01, 0.004]\ncells = {cells}\n\
                 [solid]\nbulk_modulus = 5e6\n[[material]]\nlaw = \"holzapfel-ogden\"\ndensity = 1060.0\na = 6e3\n\
                 b = 1.0\na_f = 2e4\nb_f = 4.0\na_s = 0.0\nb_s = 1.0\na_fs = 0.0\nb_fs = 1.0\n{k}\
                 fiber = [1, 0, 0]\n[[fixed]]\ngroup = \"left\"\n[[fixed]]\ngroup = \"right\"\n\
                 components = [\"y\", \"z\"]\n[[prescribed_displacement]]\ngroup = \"right\"\nx = 4e-3\n\
                 [[probe]]\nname = \"force\"\ntype = \"reaction\"\ngroup = \"right\"\n"
            )
        };
        let [slack, smooth] = ["", "k = 1000\n"].map(|k| {
            let run = run(&strip(k));
            assert_eq!(run.outcome.reason(), None, "{cells} {k}");
            result(&run, "force", "R_x")
        });
        // In the end, all fibers are stretched, far beyond a transition of width 1/k. Newton's iteration ends at
        // increments of 1e-9.
        assert!((slack - smooth).abs() < 1e-8 * smooth, "{cells}: {slack} {smooth}");
    }
}

/// Regression: the whole load was tried first, and Newton's method ended at another equilibrium with 14 times the
/// displacement.
#[test]
fn an_equilibrium_is_on_the_path_that_a_slow_motion_takes() {
    let hump = "k = 100\n";
    for (k, parts) in [(hump, &[0.5, 0.8, 0.95][..]), ("", &[0.5, 0.8, 1.0, 1.2])] {
        for part in parts {
            let load = part * 10_359.0;
            let slow = format!("{{ type = \"step\", value = {load}, rise = 1.0 }}");
            let head = "[time]\nend = 1.5\n[solid]\nbulk_modulus = 1e5\nrayleigh_mass = 50\n";
            for formulation in ["displacement", "position"] {
                let motion = heart(
                    head,
                    k,
                    formulation,
                    &slow,
                    "interval = 0.5\n[integrator]\nmethod = \"bdf\"\n",
                );
                let expected = at_corner(&motion, Path::new(""), "u_y");
                let head = "analysis = \"static\"\n[solid]\nbulk_modulus = 1e5\n";
                let still = heart(head, k, formulation, &load.to_string(), "");
                let found = at_corner(&still, Path::new(""), "u_y");
                // The integrator is exact at rest; the vibration has decayed by exp(-25 × 0.5) = 4e-6.
                let error = (found / expected - 1.0).abs();
                assert!(error < 1e-5, "{k}{part} {formulation}: {error:e}");
            }
        }
    }
}

/// Checks an energy with a hump, for which the path has a limit point at 0.976 of the load. A motion snaps to another
/// branch there, so neither formulation reaches the full load.
#[test]
fn a_path_ends_at_its_limit_point() {
    for formulation in ["displacement", "position"] {
        let head = "analysis = \"static\"\n[solid]\nbulk_modulus = 1e5\n";
        let text = heart(head, "k = 100\n", formulation, "10359.0", "");
        let reached = run(&text).document["load_reached"].as_f64().unwrap();
        assert!((0.97..0.98).contains(&reached), "{formulation}: {reached}");
    }
}

/// Regression: the supports were moved while the body remained in place, which inverted elements; a translation by 20
/// lengths failed at 0 % of the load.
#[test]
fn a_body_follows_its_supports_over_any_distance() {
    for (distance, cells) in [1.0, 20.0].into_iter().flat_map(|d| [10, 20, 40].map(|c| (d, c))) {
        let moved = |group: &str| {
            format!(
                "[[prescribed_displacement]]\ngroup = \"{group}\"\nx = {distance}\ny = 0.0\nz = 0.0\n"
            )
        };
        let bar = format!(
            "analysis = \"static\"\n[mesh]\ntype = \"box\"\nsize = [1.0, 0.1, 0.1]\ncells = [{cells}, 1, 1]\n[solid]\n\
             bulk_modulus = 1e8\n[[material]]\nlaw = \"neo-hooke\"\ndensity = 1e3\nshear_modulus = 1e6\n{}{}\
             [[probe]]\nname = \"middle\"\ntype = \"point\"\nat = [0.5, 0.05, 0.05]\n",
            moved("left"),
            moved("right")
        );
        let found = run(&bar);
        // The tolerance covers a few rounding errors of the distance.
        assert!((result(&found, "middle", "u_x") - distance).abs() < 1e-13 * distance);
        assert_eq!(found.document["load_steps"], 1, "{cells} cells, {distance} m");
        assert!(found.document["newton_iterations"].as_u64().unwrap() <= 2);
    }
}

/// Returns a square fixed on its left, with additional tables for displacements or loads.
fn square(rest: &str) -> String {
    format!(
        "[time]\nend = 10.0\n[mesh]\ntype = \"rectangle\"\nwidth = 0.1\nheight = 0.3\ncells = [2, 6]\n[solid]\n\
         bulk_modulus = 1e6\n[[material]]\nlaw = \"neo-hooke\"\ndensity = 1e3\nshear_modulus = 1e5\n{rest}"
    )
}

/// Regression: the number of iterations grew with the number of cells, because a support that moves by the length of an
/// element inverts it.
#[test]
fn a_bar_is_stretched_in_as_many_iterations_for_any_mesh() {
    let sliding = |group: &str, axis: &str| {
        format!("[[fixed]]\ngroup = \"{group}\"\ncomponents = [\"{axis}\"]\n")
    };
    let planes = [("left", "x"), ("front", "y"), ("bottom", "z")];
    let planes: String = planes.map(|(group, axis)| sliding(group, axis)).concat();
    for cells in [10, 20, 40] {
        let bar = format!(
            "analysis = \"static\"\n[mesh]\ntype = \"box\"\nsize = [1.0, 0.1, 0.1]\ncells = [{cells}, 1, 1]\n[solid]\n\
             bulk_modulus = 1e8\n[[material]]\nlaw = \"neo-hooke\"\ndensity = 1e3\nshear_modulus = 1e6\n{planes}\
             [[prescribed_displacement]]\ngroup = \"right\"\nx = 0.5\n[[probe]]\nname = \"end\"\ntype = \"point\"\n\
             at = [1.0, 0.1, 0.1]\nquantities = [\"u\", \"J\"]\n"
        );
        let found = run(&bar);
        let iterations = found.document["newton_iterations"].as_u64().unwrap();
        assert!(iterations <= 8, "{cells} cells: {iterations} iterations");
        // The transverse stretch of a homogeneous state follows from its change of volume.
        let across = (result(&found, "end", "J") / 1.5).sqrt() - 1.0;
        let error = (result(&found, "end", "u_y") / 0.1 - across).abs();
        assert!(error < 1e-12, "{cells} cells: {error:e}");
    }
}

/// Runs a scene with a square whose sides are displaced by -`factor` x² along x, so that det F is 1 - 2 `factor` x.
fn squeezed(factor: f64, kappa: f64, more: &str) -> RunResult {
    run(&square_squeezed("analysis = \"static\"", &format!("-{factor}"), kappa, more))
}

/// Runs the square in a motion of 1 s, with the factor increasing to 0.51. Elements are inverted once the factor
/// exceeds 1/2.
fn squeezed_in_time(more: &str) -> RunResult {
    let factor = "{ type = \"step\", value = -0.51, rise = 1.0 }";
    run(&square_squeezed("[time]\nend = 1.0", factor, 1e5, more))
}

fn square_squeezed(analysis: &str, factor: &str, kappa: f64, more: &str) -> String {
    let sides: String = ["left", "right", "bottom", "top"]
        .map(|group| {
            format!(
                "[[prescribed_displacement]]\ngroup = \"{group}\"\nx = {factor}\ny = 0.0\nspatial_factor = \"x*x\"\n"
            )
        })
        .concat();
    format!(
        "{analysis}\n[mesh]\ntype = \"rectangle\"\nwidth = 1.0\nheight = 1.0\ncells = [1, 1]\n[solid]\n\
         bulk_modulus = {kappa}\nformulation = \"displacement\"\n{more}[[material]]\nlaw = \"neo-hooke\"\ndensity = 1e3\n\
         shear_modulus = 1e4\n{sides}[[probe]]\nname = \"middle\"\ntype = \"point\"\nat = [0.5, 0.5]\n"
    )
}

/// Regression: a static state with inverted elements counted as "finished", and a det F of 0.13 in an incompressible
/// body was not mentioned.
#[test]
fn inverted_elements_end_a_static_run_and_implausible_volumes_are_noted() {
    let reason = |run: &RunResult| run.outcome.reason();
    let inverted = squeezed(0.51, 1e5, "");
    assert_eq!(reason(&inverted), Some(EndReason::Inverted));
    let allowed = squeezed(0.51, 1e5, "allow_inverted = true\n");
    assert_eq!((reason(&allowed), allowed.notes.len()), (None, 1));
    // In these runs, det F is between 0.4 and 1.
    for (kappa, notes) in [(1.1e6, 1), (0.9e6, 0)] {
        let found = squeezed(0.3, kappa, "");
        assert_eq!((reason(&found), found.notes.len()), (None, notes), "{kappa}");
    }
}

/// Regression: modes and responses about an equilibrium with inverted elements were computed without a warning.
#[test]
fn modes_and_responses_about_inverted_equilibria_are_rejected() {
    let head = |analysis: &str, force: &str| {
        format!(
            "analysis = \"{analysis}\"\n[response]\nfrequencies = [1.0]\npreload_time = 0.0\n[modes]\npreload_time = 0.0\n\
             [[body_force]]\n{force}"
        )
    };
    let found = |factor: &str, more: &str| {
        let scene = |head: &str| build(&square_squeezed(head, factor, 1e5, more), Path::new(""));
        let response = scene(&head("response", "response = { y = 1.0 }"));
        let modes = scene(&head("modes", "y = 0.0"));
        let response = Response::of_scene(&response, Watcher::NOBODY).map(drop);
        [response, Modes::of_scene(&modes, Some(1), Watcher::NOBODY).map(drop)]
    };
    for outcome in found("-0.51", "") {
        let error = outcome.unwrap_err().to_string();
        assert!(error.contains("preload_time") && error.contains("allow_inverted"), "{error}");
    }
    for outcome in found("-0.51", "allow_inverted = true\n").into_iter().chain(found("-0.3", "")) {
        outcome.unwrap();
    }
}

/// Regression: a motion with inverted elements counted as "finished". It ends at the step in which they are observed;
/// until then, its steps do not depend on whether inverted elements are accepted.
#[test]
fn inverted_elements_end_a_motion() {
    let allowed = squeezed_in_time("allow_inverted = true\n");
    assert_eq!((allowed.outcome.reason(), allowed.notes.len()), (None, 1));
    let ended = squeezed_in_time("");
    assert_eq!(ended.outcome.reason(), Some(EndReason::Inverted));
    let number = |run: &RunResult, key: &str| run.document[key].as_f64().unwrap();
    let (t, inverted) =
        (number(&ended, "t_reached"), ended.document["inversion"]["t"].as_f64().unwrap());
    // The step function reaches 1/(2 × 0.51) of its value at t = 0.866.
    assert!(0.866 < inverted && inverted <= t && t < 1.0);
    assert_eq!(allowed.document["inversion"]["t"].as_f64().unwrap(), inverted);
    let steps = |run: &RunResult| run.document["steps"].as_u64().unwrap();
    assert!(steps(&ended) < steps(&allowed));
}

/// Regression: a factor of 1e-17 counted as a motion, and `pi` was unknown.
#[test]
fn factors_are_zero_and_equal_up_to_rounding() {
    let held = "[[fixed]]\ngroup = \"bottom\"\n[[fixed]]\ngroup = \"top\"\n";
    let moved = |factor: &str| {
        format!(
            "{held}[[prescribed_displacement]]\ngroup = \"left\"\nx = 0.01\ny = 0.0\nspatial_factor = \"{factor}\"\n"
        )
    };
    let scene = build(&square(&moved("sin(pi*y/0.3)")), Path::new(""));
    let muscle = &scene.body.as_ref().unwrap().muscle;
    let largest = muscle.prescribed.iter().map(|own| own.signal.at(0.0).value);
    assert!((largest.fold(0.0, f64::max) - 0.01).abs() < 1e-15);
    let text = square(&moved("cos(pi*y/0.3)"));
    assert!(Scene::build("scene.toml", &text, &[], Path::new("")).is_err());
}

/// Regression: a table with a ramp to 1000 followed by a constant value gave 2556 at 5 s, because it was interpolated
/// by a natural spline.
#[test]
fn tables_are_linear_unless_they_say_otherwise() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("load.csv"), "t,p\n0,0\n1,1000\n10,1000\n").unwrap();
    let load = |interpolation: &str| {
        let load = format!(
            "[[fixed]]\ngroup = \"bottom\"\n[[traction]]\ngroup = \"top\"\nx = {{ type = \"table\", file = \"load.csv\", \
             column = \"p\"{interpolation} }}\n"
        );
        let scene = build(&square(&load), folder.path());
        let value = scene.body.as_ref().unwrap().muscle.loads[0].signal().at(5.0).value;
        (value, scene.notes().len())
    };
    assert_eq!(load(""), (1000.0, 0));
    assert_eq!(load(", interpolation = \"linear\""), (1000.0, 0));
    assert_eq!(load(", interpolation = \"pchip\""), (1000.0, 0));
    let (overshot, notes) = load(", interpolation = \"spline\"");
    // The natural spline has the value 1000 + 300/6 (5/9 - (5/9)³) 81.
    let expected = 1000.0 + 50.0 * 81.0 * (5.0 / 9.0 - (5.0_f64 / 9.0).powi(3));
    assert!((overshot - expected).abs() < 1e-9 && notes == 1);
}

/// Regression: a support that moves at t = 0 was accepted without damping, and rejected with damping because of its
/// "load".
#[test]
fn a_support_that_moves_at_the_start_is_rejected() {
    let rehearsed = |alpha: f64, eta: f64, motion: &str, folder: &Path| {
        let text = square(&format!(
            "viscosity = {eta}\n[[fixed]]\ngroup = \"bottom\"\n[[prescribed_displacement]]\ngroup = \"top\"\nx = {motion}\ny = 0.0\n"
        ));
        let text = text
            .replace("bulk_modulus = 1e6", &format!("bulk_modulus = 1e6\nrayleigh_mass = {alpha}"))
            .replace("end = 10.0", "end = 0.02");
        let out = tempfile::tempdir().unwrap();
        compute(&build(&text, folder), &RunOptions::into_folder(out.path()))
            .map(|_| ())
            .map_err(|error| error.to_string())
    };
    let folder = tempfile::tempdir().unwrap();
    let moving = "{ type = \"sine\", amplitude = 1e-3, frequency = 1.0 }";
    for alpha in [0.0, 1.0] {
        let message = rehearsed(alpha, 0.0, moving, folder.path()).unwrap_err();
        assert!(message.contains(" x "), "{message}");
    }
    // The spline's slope at t = 0 is not exactly zero.
    let row = |i: i32| {
        let late = f64::from((i - 20).max(0));
        format!("{},{}\n", 1e-3 * f64::from(i), 1e-6 * late * late)
    };
    let rows: String = (0..=40).map(row).collect();
    fs::write(folder.path().join("m.csv"), format!("t,x\n{rows}")).unwrap();
    let measured =
        "{ type = \"table\", file = \"m.csv\", column = \"x\", interpolation = \"spline\" }";
    rehearsed(1.0, 10.0, measured, folder.path()).unwrap();
}

/// A cube of five tetrahedra. It is fixed at three sides, so that all nodes of the tetrahedron at its first corner are
/// fixed.
const CUBE: &str = "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$PhysicalNames\n2\n2 1 \"wall\"\n3 2 \"gel\"\n\
    $EndPhysicalNames\n$Entities\n0 0 1 1\n1 0 0 0 1 1 1 1 1 0\n1 0 0 0 1 1 1 1 2 0\n$EndEntities\n$Nodes\n1 8 1 8\n\
    3 1 0 8\n1\n2\n3\n4\n5\n6\n7\n8\n0 0 0\n1 0 0\n0 1 0\n1 1 0\n0 0 1\n1 0 1\n0 1 1\n1 1 1\n$EndNodes\n$Elements\n\
    2 11 1 11\n2 1 2 6\n1 1 3 2\n2 4 2 3\n3 1 2 5\n4 6 5 2\n5 1 5 3\n6 7 3 5\n3 1 4 5\n7 1 2 3 5\n8 4 3 2 8\n\
    9 6 2 5 8\n10 7 5 3 8\n11 2 3 5 8\n$EndElements\n";

/// Regression: the scene failed with "column 84 of the pattern is empty" for bulk_modulus = inf.
#[test]
fn a_corner_held_in_all_nodes_has_its_neighbors_pressure() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("gel.msh"), CUBE).unwrap();
    let text = |head: &str, load: &str| {
        format!(
            "{head}\n[mesh]\ntype = \"file\"\npath = \"gel.msh\"\n[solid]\nbulk_modulus = inf\n[[material]]\nlaw = \"neo-hooke\"\n\
             density = 1e3\nshear_modulus = 1e4\n[[body_force]]\nx = {load}\n[[fixed]]\ngroup = \"wall\"\n\
             [[probe]]\nname = \"corner\"\ntype = \"point\"\nat = [0, 0, 0]\n"
        )
    };
    let (still, moving) = (
        text("analysis = \"static\"", "1.0"),
        text("[time]\nend = 0.01", "{ type = \"step\", value = 1.0, rise = 0.01 }")
            .replace("at = [0, 0, 0]", "at = [0, 0, 0]\ninterval = 0.01"),
    );
    for text in [still, moving] {
        let scene = build(&text, folder.path());
        assert_eq!(scene.notes().len(), 1, "{:?}", scene.notes());
        assert!(at_corner(&text, folder.path(), "p").is_finite());
    }
}
