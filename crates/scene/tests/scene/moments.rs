//! Moments of reactions and contacts about a point, against the moments of the loads.

use std::path::Path;

use myovib_scene::Scene;
use myovib_scene::response::Response;
use myovib_scene::watch::Watcher;
use num_complex::Complex64;

use crate::contact::{last, tables_in};
use crate::friction::block;

/// Point about which moments are computed, m.
const ABOUT: [f64; 3] = [0.1, -0.2, 0.07];
/// Traction along y, and along x (in 2D) or z (in 3D), Pa.
const TRACTION: [f64; 2] = [-400.0, 150.0];

/// Returns arm × force; in 2D, only its third component.
fn cross<T: Copy + std::ops::Mul<f64, Output = T> + std::ops::Sub<Output = T>>(
    arm: &[f64],
    force: &[T],
) -> Vec<T> {
    let of = |i: usize, j: usize| force[j] * arm[i] - force[i] * arm[j];
    match arm.len() {
        2 => vec![of(0, 1)],
        _ => vec![of(1, 2), of(2, 0), of(0, 1)],
    }
}

/// Returns the largest component of a vector.
fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |largest, value| value.abs().max(largest))
}

/// Returns a bar pulled at its right end, with the area of this end and the position of its center.
fn bar(dimension: usize, head: &str, traction: &str) -> (String, f64, Vec<f64>) {
    let (mesh, area, center) = match dimension {
        2 => (
            "type = \"rectangle\"\nwidth = 0.03\nheight = 0.01\ncells = [3, 1]",
            0.01,
            vec![0.03, 0.005],
        ),
        _ => (
            "type = \"box\"\nsize = [0.03, 0.01, 0.01]\ncells = [2, 1, 1]",
            1e-4,
            vec![0.03, 0.005, 0.005],
        ),
    };
    let about = &ABOUT[..dimension];
    let text = format!(
        "{head}[mesh]\n{mesh}\n[solid]\nbulk_modulus = 1e5\n[[material]]\nlaw = \"neo-hooke\"\ndensity = 1e3\n\
         shear_modulus = 3e3\n[[traction]]\ngroup = \"right\"\n{traction}\n\
         [[probe]]\nname = \"held\"\ntype = \"reaction\"\ngroup = \"left\"\nabout = {about:?}\n\
         [[probe]]\nname = \"end\"\ntype = \"average\"\ngroup = \"right\"\nquantities = [\"u\"]\n"
    );
    (text, area, center)
}

const CLAMPED: &str = "[[fixed]]\ngroup = \"left\"\n";

/// Checks the balance of moments on the deformed body for a bar with large bending. The internal forces of symmetric stresses have no
/// moment, so that only the residual of the equilibrium remains: rounding and, in time, less than a hundredth of the integrator's
/// tolerance of 1e-3.
#[test]
fn a_clamp_balances_the_moment_of_the_load() {
    let preloaded =
        format!("[time]\nend = 0.02\n[initial_state]\ntype = \"equilibrium\"\n{CLAMPED}");
    let fixed = format!("analysis = \"static\"\n{CLAMPED}");
    let slow = format!("analysis = \"quasi-static\"\n[time]\nend = 1.0\n{CLAMPED}");
    for (dimension, other) in [(2, 0), (3, 2)] {
        for (head, bound) in [(&fixed, 1e-12), (&slow, 1e-5), (&preloaded, 1e-12)] {
            let function = |value: f64| match head == &slow {
                true => format!("{{ type = \"step\", value = {value}, rise = 1.0 }}"),
                false => value.to_string(),
            };
            let axes = ["x", "y", "z"];
            let [along_y, along_other] = TRACTION.map(function);
            let traction = format!("y = {along_y}\n{} = {along_other}", axes[other]);
            let (text, area, center) = bar(dimension, head, &traction);
            let [held, end] = tables_in(&text, Path::new(""), ["held", "end"]);
            let arm: Vec<f64> = (0..dimension)
                .map(|i| center[i] + last(&end, &format!("u_{}", axes[i])) - ABOUT[i])
                .collect();
            let mut load = vec![0.0; dimension];
            load[1] = area * TRACTION[0];
            load[other] = area * TRACTION[1];
            let moment = cross(&arm, &load);
            let size = largest(&load) * largest(&arm);
            for (i, moment) in moment.iter().enumerate() {
                let axis = if dimension == 2 { 2 } else { i };
                let error = (last(&held, &format!("M_{}", axes[axis])) + moment).abs() / size;
                assert!(error < bound, "{dimension} {head}: {error:e}");
            }
        }
    }
}

/// Checks a plate that drags a block by friction: the moments of the plate and of the clamp below the block are opposite,
/// up to a hundredth of the integrator's tolerance.
#[test]
fn contact_and_clamp_are_in_equilibrium_of_moments() {
    for (dimension, down) in [(2, "y"), (3, "z")] {
        let about = format!("about = {:?}\n", &ABOUT[..dimension]);
        let contact = format!(
            "{down} = {{ type = \"step\", value = -1e-3, rise = 0.2 }}\n\
             x = {{ type = \"step\", value = 0.01, rise = 1.0 }}\nfriction = 0.3\nslip_velocity = 1e-4"
        );
        let head =
            "analysis = \"quasi-static\"\n[time]\nend = 0.5\n[[fixed]]\ngroup = \"bottom\"\n";
        let text = block(dimension, head, &contact, 1e-4)
            .replace("[[probe]]\n", &format!("[[probe]]\n{about}"))
            + &format!(
                "[[probe]]\nname = \"held\"\ntype = \"reaction\"\ngroup = \"bottom\"\n{about}"
            );
        let [plate, held] = tables_in(&text, Path::new(""), ["plate", "held"]);
        let axes = if dimension == 2 { &["z"][..] } else { &["x", "y", "z"] };
        for axis in axes {
            let [of_plate, of_clamp] =
                [&plate, &held].map(|table| last(table, &format!("M_{axis}")));
            let error = (of_plate + of_clamp).abs() / last(&plate, &format!("F_{down}")).abs();
            assert!(error < 1e-6 * largest(&ABOUT), "{dimension} {axis}: {error:e}");
        }
    }
}

/// Checks the amplitude of the moment about a preload: the load f₀ + f̂ at x + û has the moment x × f̂ + û × f₀. The supports are rollers,
/// and their preload forces move with the body. Overstress has relaxed. Only rounding errors remain.
#[test]
fn moments_of_small_vibrations_balance_about_a_preload() {
    let prony = "prony = [{ relative_modulus = 0.4, relaxation_time = 0.5 }]\n";
    for (dimension, other, relaxation) in [(2, 0, ""), (3, 2, ""), (2, 0, prony), (3, 2, prony)] {
        let axes = ["x", "y", "z"];
        let rollers = "[[fixed]]\ngroup = \"left\"\ncomponents = [\"x\"]\n[[fixed]]\ngroup = \"bottom\"\ncomponents = [\"z\"]\n";
        let rollers = match dimension {
            2 => rollers.replace("\"z\"", "\"y\""),
            _ => format!("{rollers}[[fixed]]\ngroup = \"front\"\ncomponents = [\"y\"]\n"),
        };
        let groups = if dimension == 2 {
            "[\"left\", \"bottom\"]"
        } else {
            "[\"left\", \"bottom\", \"front\"]"
        };
        let union =
            format!("[[group]]\nname = \"supports\"\ntype = \"union\"\ngroups = {groups}\n");
        let head = |analysis: &str| format!("analysis = \"{analysis}\"\n{union}{rollers}");
        let traction = format!(
            "y = {}\n{} = {}\nresponse = {{ y = 3.0 }}",
            TRACTION[0], axes[other], TRACTION[1]
        );
        let text = |analysis: &str| {
            let (text, area, center) = bar(dimension, &head(analysis), &traction);
            let text = text.replace("group = \"left\"\nabout", "group = \"supports\"\nabout");
            let law = "law = \"neo-hooke\"\n";
            (text.replace(law, &format!("{law}{relaxation}")), area, center)
        };
        let (rest, area, center) = text("static");
        let [end] = tables_in(&rest, Path::new(""), ["end"]);
        let response = text("response").0 + "[response]\nfrequencies = [0.0]\npreload_time = 0.0\n";
        let scene = Scene::build("scene.toml", &response, &[], Path::new("")).unwrap();
        let found = Response::of_scene(&scene, Watcher::NOBODY).unwrap();
        let amplitudes = |probe: &str| {
            let curves = found.probes.iter().find(|curves| curves.name == probe).unwrap();
            curves.amplitudes[0].clone()
        };
        let arm: Vec<f64> = (0..dimension)
            .map(|i| center[i] + last(&end, &format!("u_{}", axes[i])) - ABOUT[i])
            .collect();
        let mut preload = vec![0.0; dimension];
        preload[1] = area * TRACTION[0];
        preload[other] = area * TRACTION[1];
        let mut vibration = vec![Complex64::ZERO; dimension];
        vibration[1] = Complex64::from(3.0 * area);
        let turned = cross(&preload, &amplitudes("end"));
        let moment = cross(&arm, &vibration).into_iter().zip(&turned).map(|(m, turned)| m - turned);
        for (i, expected) in moment.enumerate() {
            let found = amplitudes("held")[dimension + i];
            let error = (found + expected).norm() / (3.0 * area * largest(&arm));
            assert!(error < 1e-12, "{dimension} {i} {relaxation}: {error:e}");
        }
    }
}

/// Checks that the amplitudes of moments about two points differ by the moment of the force, M_A − M_B = (B − A) × F, at
/// frequencies other than 0 and with damping, where all amplitudes are complex. Only rounding errors remain.
#[test]
fn moments_of_vibrations_about_two_points_differ_by_the_force() {
    let other = [0.05, 0.3, -0.4];
    for dimension in [2, 3] {
        let (text, ..) = bar(
            dimension,
            &format!("analysis = \"response\"\n{CLAMPED}"),
            &format!("y = {}\nresponse = {{ y = 3.0 }}", TRACTION[0]),
        );
        let second = format!(
            "[[probe]]\nname = \"other\"\ntype = \"reaction\"\ngroup = \"left\"\nabout = {:?}\n\
             [response]\nfrequencies = [3.0, 40.0]\npreload_time = 0.0\n",
            &other[..dimension]
        );
        let text = text.replace("[solid]\n", "[solid]\nrayleigh_mass = 20.0\n") + &second;
        let scene = Scene::build("scene.toml", &text, &[], Path::new("")).unwrap();
        let found = Response::of_scene(&scene, Watcher::NOBODY).unwrap();
        let of = |name: &str| found.probes.iter().find(|curves| curves.name == name).unwrap();
        let apart: Vec<f64> = (0..dimension).map(|i| other[i] - ABOUT[i]).collect();
        for (held, other) in of("held").amplitudes.iter().zip(&of("other").amplitudes) {
            let (force, moments) = held.split_at(dimension);
            assert!(force.iter().any(|f| f.im.abs() > 1e-3 * f.norm()), "{dimension}");
            let size = force.iter().fold(0.0_f64, |most, f| most.max(f.norm()));
            let moved = cross(&apart, force);
            for ((own, other), moved) in moments.iter().zip(&other[dimension..]).zip(moved) {
                let error = (own - other - moved).norm() / (size * largest(&apart));
                assert!(error < 1e-12, "{dimension}: {error:e}");
            }
        }
    }
}

#[test]
fn a_point_with_the_wrong_number_of_coordinates_is_rejected() {
    let (text, ..) = bar(2, &format!("analysis = \"static\"\n{CLAMPED}"), "y = 1.0");
    let text = text.replace("-0.2]", "-0.2, 0.0]");
    let error = Scene::build("scene.toml", &text, &[], Path::new("")).unwrap_err();
    assert!(error.to_string().contains(" | about = "), "{error}");
}
