//! Supports that rotate or follow a measured acceleration, and values relative to a group.

use std::fs;
use std::path::Path;

use myovib_scene::Scene;
use myovib_scene::run::{RunOptions, compute};

use crate::contact::{column, tables_in};

/// Returns a scene that rotates both ends of a body, static or in time, with a probe away from the axis.
fn turned(head: &str, mesh: &str, axis: &str, angle: &str, at: &str) -> String {
    let ends = ["left", "right"].map(|group| {
        format!(
            "[[prescribed_displacement]]\ngroup = \"{group}\"\nrotation = {{ angle = {angle}, {axis} }}\n"
        )
    });
    format!(
        "{head}[mesh]\n{mesh}[solid]\nbulk_modulus = 1e5\n[[material]]\nlaw = \"neo-hooke\"\ndensity = 1e3\n\
         shear_modulus = 1e4\n{}[[probe]]\nname = \"middle\"\ntype = \"point\"\nat = {at}\n\
         quantities = [\"u\", \"von-mises\"]\ninterval = 0.1\n",
        ends.concat()
    )
}

/// Rotates `x` about the axis through `point` along the unit vector `e`.
fn rotated(x: [f64; 3], point: [f64; 3], e: [f64; 3], angle: f64) -> [f64; 3] {
    let r = [0, 1, 2].map(|i| x[i] - point[i]);
    let along: f64 = r.iter().zip(e).map(|(r, e)| r * e).sum();
    let cross =
        [0, 1, 2].map(|i| e[(i + 1) % 3] * r[(i + 2) % 3] - e[(i + 2) % 3] * r[(i + 1) % 3]);
    let (sin, cos) = angle.sin_cos();
    [0, 1, 2].map(|i| point[i] + cos * r[i] + sin * cross[i] + (1.0 - cos) * along * e[i])
}

/// Checks that a body whose ends rotate about one axis rotates without stress, under each part of the angle and in
/// time.
#[test]
fn a_rotation_of_all_supports_is_rigid() {
    let loads = "analysis = \"static\"\n[static]\nloads = [0.5, 1.0]\n";
    let slow = "analysis = \"quasi-static\"\n[time]\nend = 1.0\n";
    let smooth = "{ type = \"step\", value = 3.0, rise = 1.0 }";
    let rectangle = "type = \"rectangle\"\nwidth = 0.03\nheight = 0.01\ncells = [3, 1]\n";
    let cuboid = "type = \"box\"\nsize = [0.03, 0.01, 0.01]\ncells = [2, 1, 1]\n";
    let (plane, space) =
        ("point = [0.01, -0.02]", "point = [0.01, -0.02, 0.03], axis = [2.0, -1.0, 2.0]");
    let third = 1.0 / 3.0;
    for (head, mesh, axis, angle, at, e, parts) in [
        (loads, rectangle, plane, "3.0", [0.015, 0.01, 0.0], [0.0, 0.0, 1.0], [0.5, 1.0]),
        (
            loads,
            cuboid,
            space,
            "3.0",
            [0.015, 0.01, 0.01],
            [2.0 * third, -third, 2.0 * third],
            [0.5, 1.0],
        ),
        (slow, rectangle, plane, smooth, [0.015, 0.01, 0.0], [0.0, 0.0, 1.0], [0.5, 1.0]),
    ] {
        let dimension = if mesh == cuboid { 3 } else { 2 };
        let point = [0.01, -0.02, if dimension == 3 { 0.03 } else { 0.0 }];
        let written = format!("{:?}", &at[..dimension]);
        let text = turned(head, mesh, axis, angle, &written);
        let [middle] = tables_in(&text, Path::new(""), ["middle"]);
        let rows = column(&middle, "von_mises").len();
        for (part, row) in parts.into_iter().zip([(rows - 1) / 2, rows - 1]) {
            let to = rotated(at, point, e, 3.0 * part);
            for (i, name) in ["u_x", "u_y", "u_z"].iter().take(dimension).enumerate() {
                let error = column(&middle, name)[row] - (to[i] - at[i]);
                // The bounds are the error of Newton's method and, in time, the tolerance of 1e-3 for displacements of
                // 0.1 m.
                let bound = if head == loads { 1e-10 } else { 1e-4 };
                assert!(error.abs() < bound, "{mesh} {part} {name}: {error:e}");
            }
            let stress = column(&middle, "von_mises")[row];
            assert!(stress < if head == loads { 1e-4 } else { 10.0 }, "{mesh}: {stress:e}");
        }
    }
}

/// Checks a body that rotates by a full turn, far from the axis. Each step rotates it by 0.2 rad, the limit for displacement
/// gradients.
#[test]
fn a_full_turn_takes_steps_of_its_angle() {
    let rectangle = "type = \"rectangle\"\nwidth = 0.03\nheight = 0.01\ncells = [3, 1]\n";
    let head = "analysis = \"static\"\n";
    let text =
        turned(head, rectangle, "point = [0.01, -0.2]", "6.283185307179586", "[0.015, 0.01]");
    let scene = Scene::build("scene.toml", &text, &[], Path::new("")).unwrap();
    let out = tempfile::tempdir().unwrap();
    let run = compute(&scene, &RunOptions::into_folder(out.path())).unwrap();
    assert_eq!(run.document["outcome"], "finished");
    let steps = run.document["load_steps"].as_u64().unwrap();
    assert_eq!(steps, (std::f64::consts::TAU / 0.2).ceil() as u64);
}

/// Checks rotations along an arc-length path, and rotations with inertia, whose forces vanish at the end.
#[test]
fn a_rotation_by_arc_length_and_with_inertia_reaches_its_angle() {
    let rectangle = "type = \"rectangle\"\nwidth = 0.03\nheight = 0.01\ncells = [3, 1]\n";
    let arc = "analysis = \"static\"\n[static]\nmethod = \"arc-length\"\n";
    let smooth = "{ type = \"step\", value = 0.5, rise = 1.0 }";
    let (at, point) = ([0.015, 0.01, 0.0], [0.01, -0.02, 0.0]);
    // The tolerances cover the rounding of displacements of 0.01 m, and the tolerance of the integrator.
    let motion = "[time]\nend = 2.0\n[integrator]\nrtol = 1e-4\n";
    for (head, angle, bound) in [(arc, "0.5", 1e-14), (motion, smooth, 1e-4 * 0.01)] {
        let text = turned(head, rectangle, "point = [0.01, -0.02]", angle, "[0.015, 0.01]");
        let [middle] = tables_in(&text, Path::new(""), ["middle"]);
        let to = rotated(at, point, [0.0, 0.0, 1.0], 0.5);
        for (i, name) in ["u_x", "u_y"].iter().enumerate() {
            let error = column(&middle, name).last().unwrap() - (to[i] - at[i]);
            assert!(error.abs() < bound, "{head} {name}: {error:e}");
        }
    }
}

/// Checks that an axis with rounding errors is compatible with fixed components, because it moves nodes along itself only
/// by rounding errors.
#[test]
fn an_axis_to_rounding_agrees_with_fixed_components() {
    let cuboid = "type = \"box\"\nsize = [0.03, 0.01, 0.01]\ncells = [2, 1, 1]\n";
    let axis = "point = [0.0, 0.0, 0.0], axis = [6.1e-17, 0.0, 1.0]";
    let text = turned("analysis = \"static\"\n", cuboid, axis, "1.0", "[0.0, 0.0, 0.0]")
        + "[[fixed]]\ngroup = \"left\"\ncomponents = [\"z\"]\n";
    Scene::build("scene.toml", &text, &[], Path::new("")).unwrap();
}

/// Checks that an axis that is incompatible with the mesh gives an error with its line.
#[test]
fn axes_of_rotations_are_checked() {
    let head = "analysis = \"static\"\n";
    let rectangle = "type = \"rectangle\"\nwidth = 0.03\nheight = 0.01\ncells = [3, 1]\n";
    let cuboid = "type = \"box\"\nsize = [0.03, 0.01, 0.01]\ncells = [2, 1, 1]\n";
    for (mesh, axis, at) in [
        (rectangle, "point = [0.0, 0.0], axis = [0.0, 0.0, 1.0]", "[0.0, 0.0]"),
        (rectangle, "point = [0.0, 0.0, 0.0]", "[0.0, 0.0]"),
        (cuboid, "point = [0.0, 0.0, 0.0]", "[0.0, 0.0, 0.0]"),
        (cuboid, "point = [0.0, 0.0, 0.0], axis = [0.0, 0.0, 0.0]", "[0.0, 0.0, 0.0]"),
    ] {
        let text = turned(head, mesh, axis, "1.0", at);
        let error = Scene::build("scene.toml", &text, &[], Path::new("")).unwrap_err();
        assert!(error.to_string().contains(" | rotation"), "{error}");
    }
}

/// Checks that the acceleration of a support is linear between the rows of its table, and that its displacement is the integral,
/// both up to rounding errors. Values relative to the support are differences.
#[test]
fn a_support_follows_a_measured_acceleration() {
    let folder = tempfile::tempdir().unwrap();
    let rows = [(-0.01, -3.0), (0.01, 3.0), (0.02, -1.0), (0.05, 0.5)];
    let table = rows.map(|(t, a)| format!("{t},{a}\n")).concat();
    fs::write(folder.path().join("a.csv"), format!("t,a\n{table}")).unwrap();
    let probe = |name: &str, rest: &str| {
        format!(
            "[[probe]]\nname = \"{name}\"\ninterval = 0.01\nquantities = [\"u\", \"a\"]\n{rest}"
        )
    };
    let tip = "type = \"point\"\nat = [0.03, 0.01]\n";
    let text = format!(
        "[time]\nend = 0.05\n[mesh]\ntype = \"rectangle\"\nwidth = 0.03\nheight = 0.01\ncells = [3, 1]\n[solid]\n\
         bulk_modulus = 1e5\n[[material]]\nlaw = \"neo-hooke\"\ndensity = 1e3\nshear_modulus = 1e4\n\
         [[prescribed_displacement]]\ngroup = \"left\"\nx = 0.0\n\
         y = {{ type = \"table\", file = \"a.csv\", column = \"a\", acceleration = true }}\n{}{}{}",
        probe("support", "type = \"average\"\ngroup = \"left\"\n"),
        probe("tip", tip),
        probe("relative", &format!("{tip}relative_to = \"left\"\n")),
    ) + &probe("end", "type = \"average\"\ngroup = \"right\"\n")
        + &probe("end_relative", "type = \"average\"\ngroup = \"right\"\nrelative_to = \"left\"\n");
    let [support, tip, relative, end, end_relative] =
        tables_in(&text, folder.path(), ["support", "tip", "relative", "end", "end_relative"]);
    // A load cannot be given by an acceleration.
    let load = text.replace(
        "[[prescribed_displacement]]\ngroup = \"left\"\nx = 0.0\n",
        "[[fixed]]\ngroup = \"left\"\n[[traction]]\ngroup = \"right\"\n",
    );
    let error = Scene::build("scene.toml", &load, &[], folder.path()).unwrap_err();
    assert!(error.to_string().contains("acceleration"), "{error}");
    // The integration starts at t = 0, where the acceleration is 0. It uses the trapezoidal rule and exact integrals of
    // straight lines.
    let exact = |t: f64| {
        let rows = [(0.0, 0.0), (0.01, 3.0), (0.02, -1.0), (0.05, 0.5)];
        let (mut u, mut v, mut own) = (0.0, 0.0, 0.0);
        for pair in rows.windows(2) {
            let [(t0, a0), (t1, a1)] = [pair[0], pair[1]];
            let h = t.min(t1) - t0;
            if h > 0.0 {
                own = a0 + (a1 - a0) * h / (t1 - t0);
                u += h * v + h * h * (2.0 * a0 + own) / 6.0;
                v += 0.5 * h * (a0 + own);
            }
        }
        [u, own]
    };
    let times = column(&support, "t");
    assert_eq!(times.len(), 6);
    for (k, t) in times.into_iter().enumerate() {
        for (name, exact) in ["u_y", "a_y"].into_iter().zip(exact(t)) {
            let [support, tip, relative, end, end_relative] =
                [&support, &tip, &relative, &end, &end_relative]
                    .map(|table| column(table, name)[k]);
            assert!((end - support - end_relative).abs() < 1e-12 * (1.0 + end.abs()), "{t} {name}");
            assert!((support - exact).abs() < 1e-12 * (1.0 + exact.abs()), "{t} {name}: {support}");
            assert!((tip - support - relative).abs() < 1e-12 * (1.0 + tip.abs()), "{t} {name}");
        }
    }
}
