//! Displacements that vary along their group: patch tests, rotations, and groups with common nodes.

use std::path::Path;

use myovib_model::statics::equilibrium;
use myovib_scene::Scene;

use crate::common::{BLOCK, SHEET, refusal, scene, text};

const SQUARE: &str = "type = \"rectangle\"\nwidth = 1.0\nheight = 1.0\ncells = [4, 3]";
const CUBE: &str = "type = \"box\"\nsize = [1.0, 1.0, 1.0]\ncells = [2, 2, 2]";

/// Coefficients of the affine displacement u_i = a_i (b_i0 + b_i1 x + b_i2 y + b_i3 z).
const AFFINE: [(f64, [f64; 4]); 3] =
    [(0.1, [1.0, 1.0, 2.0, -1.0]), (0.2, [0.0, 1.0, -1.0, 0.5]), (-0.05, [-2.0, 3.0, 1.0, 2.0])];

/// Returns the prescribed values at time t, by component.
fn prescribed(scene: &Scene, t: f64) -> Vec<(usize, f64)> {
    let all = &scene.body.as_ref().unwrap().muscle.prescribed;
    let all = all.iter();
    all.map(|it| (it.component, it.signal.at(t).value)).collect()
}

/// Checks a patch test at finite strains: the same affine field moves all sides, which share edges and corners.
#[test]
fn affine_motion_of_the_boundary_moves_the_inside_by_the_same_field() {
    let sides = ["left", "right", "bottom", "top", "front", "back"];
    for (mesh, dimension) in [(SQUARE, 2), (CUBE, 3)] {
        let table = |side: &&str| {
            let components = AFFINE.iter().zip(["x", "y", "z"]).take(dimension);
            let component = |((size, [c, x, y, z]), axis): (&(f64, [f64; 4]), &str)| {
                let z = if dimension == 3 { format!("+ {z:?}*z") } else { String::new() };
                format!(
                    "[[prescribed_displacement]]\ngroup = \"{side}\"\n{axis} = {size:?}\n\
                     spatial_factor = \"{c:?} + {x:?}*x + {y:?}*y {z}\"\n"
                )
            };
            components.map(component).collect::<String>()
        };
        let tables: String = sides.iter().take(2 * dimension).map(table).collect();
        let scene = scene(&text(mesh, "", &tables), Path::new(""));
        let body = scene.body.as_ref().unwrap();
        let solid = &body.muscle.solid;
        let found = equilibrium(&body.muscle, body.formulation, 0.0).unwrap();
        let mut u = vec![0.0; solid.space().n_components()];
        for (component, value) in prescribed(&scene, 0.0) {
            u[component] = value;
        }
        let free = solid.dofs().free_to_full();
        assert!(free.len() >= 3 * dimension, "an inside that is free");
        for (&component, value) in free.iter().zip(&found.displacement) {
            u[component] = *value;
        }
        for (node, u) in u.chunks_exact(dimension).enumerate() {
            for (u, (size, of)) in u.iter().zip(AFFINE) {
                let place = solid.space().node_point(node).iter();
                let expected = of[1..].iter().zip(place).fold(of[0], |sum, (b, x)| sum + b * x);
                // The field is in the finite element space, so only rounding errors remain after the quadratic
                // convergence of Newton's method.
                assert!((u - size * expected).abs() < 1e-13, "{node}: {u}");
            }
        }
    }
}

/// Checks a face rotated about the x-axis by the angle φ(t): u_y = -z sin φ - y (1 - cos φ), and so
/// on. Here sin φ and 1 - cos φ are two given functions of time.
#[test]
fn displacements_of_one_group_add_up() {
    let sine = "{ type = \"sine\", amplitude = 0.3, frequency = 2.0 }";
    let step = "{ type = \"step\", value = 0.05, rise = 0.5 }";
    let entry = |axis: &str, function: &str, distribution: &str| {
        format!(
            "[[prescribed_displacement]]\ngroup = \"right\"\n{axis} = {function}\n\
             spatial_factor = \"{distribution}\"\n"
        )
    };
    let tables = [
        entry("y", sine, "-z"),
        entry("z", sine, "y"),
        entry("y", step, "-y"),
        entry("z", step, "-z"),
    ];
    let turned = scene(&text(BLOCK, "left", &tables.concat()), Path::new(""));
    let space = turned.body.as_ref().unwrap().muscle.solid.space();
    for t in [0.0, 0.1, 0.3, 1.0] {
        let value = |function: &str| {
            let table = format!("[[prescribed_displacement]]\ngroup = \"right\"\nx = {function}");
            let all = prescribed(&scene(&text(BLOCK, "left", &table), Path::new("")), t);
            all[0].1
        };
        let (sine, step) = (value(sine), value(step));
        let all = prescribed(&turned, t);
        // The face has nine nodes, three with y = 0 and three with z = 0. One node belongs to both sets and is fixed.
        assert_eq!(all.len(), 2 * 8);
        for (component, found) in all {
            let place = space.node_point(component / 3);
            let expected = match component % 3 {
                1 => -place[2] * sine - place[1] * step,
                _ => place[1] * sine - place[2] * step,
            };
            // The tolerance covers two rounding errors of numbers below one.
            assert!((found - expected).abs() < 1e-15, "{found} {expected}");
        }
    }
}

/// Checks that a group may share a fixed corner if the factor is zero there, and that two groups may prescribe the same
/// motion.
#[test]
fn groups_that_share_nodes_must_move_them_alike() {
    let moved = |group: &str, x: &str, distribution: &str| {
        format!(
            "[[prescribed_displacement]]\ngroup = \"{group}\"\nx = {x}\nspatial_factor = \"{distribution}\"\n"
        )
    };
    let right = moved("right", "0.1", "y");
    let two_ways = "the x component at (2.000000, 0.000000)";
    for (held, tables, message) in [
        ("bottom", right.clone(), "accepted"),
        ("bottom", moved("right", "0.1", "y + 1"), two_ways),
        ("left", format!("{right}{}", moved("top", "0.1", "x*y/2")), "accepted"),
        ("left", format!("{right}{}", moved("bottom", "0.2", "y")), "accepted"),
        ("left", format!("{right}{}", moved("bottom", "0.2", "y + x")), two_ways),
        (
            "left",
            format!("{}{}", moved("right", "0.1", "1"), moved("bottom", "0.2", "x/2")),
            two_ways,
        ),
    ] {
        let found = refusal(&text(SHEET, held, &tables), Path::new(""));
        assert!(found.contains(message), "{tables}: {found}");
    }
    let jumps = moved("right", "{ type = \"step\", value = 1.0, rise = 0.0 }", "y");
    // An equilibrium uses the value at one time.
    let found = refusal(&text(SHEET, "bottom", &jumps), Path::new(""));
    assert!(found.contains("accepted"), "{found}");
}
