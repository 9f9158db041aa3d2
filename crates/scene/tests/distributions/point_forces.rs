//! Forces and springs on points.

use std::path::Path;

use crate::common::{BLOCK, SHEET, assert_close, moments, refusal, scene, text};
use crate::materials::end;

/// Checks that Σ F_j is the force and that Σ x_i F_j is the force times the position, because shape functions
/// interpolate x.
#[test]
fn point_forces_have_their_resultant_and_moments() {
    let force = [3.0, -2.0, 5.0];
    for (mesh, at) in [(SHEET, &[1.3, 0.45][..]), (SHEET, &[2.0, 1.0]), (BLOCK, &[1.3, 0.45, 0.7])]
    {
        let axes = ["x", "y", "z"].into_iter().zip(force).take(at.len());
        let components: String = axes.map(|(axis, f)| format!("{axis} = {f:?}\n")).collect();
        let table = format!("[[point_force]]\nat = {at:?}\n{components}");
        let (moments, resultant) = moments(&scene(&text(mesh, "left", &table), Path::new("")), 0.0);
        for j in 0..at.len() {
            assert_close(resultant[j], force[j], 5.0);
            for (i, x) in at.iter().enumerate() {
                assert_close(moments[i][j], x * force[j], 10.0);
            }
        }
    }
}

/// Checks reciprocity (Maxwell and Betti): the displacement at B under a force at A equals the displacement at A under
/// the same force at B.
#[test]
fn point_forces_are_reciprocal() {
    let places = ["[1.3, 0.45]", "[0.6, 0.9]"];
    let displacement = |at: &str, read: &str| {
        let tables = format!(
            "[[point_force]]\nat = {at}\ny = 2.0\n\
             [[probe]]\nname = \"end\"\ntype = \"point\"\nat = {read}\nquantities = [\"u\"]\n"
        );
        let text = text(SHEET, "left", &tables).replace(
            "law = \"mooney-rivlin\"\ndensity = 1e3\nc10 = 1e4\nc01 = 2e2",
            "law = \"small-strain\"\ndensity = 1e3\nshear_modulus = 1e4",
        );
        end(&text, Path::new(""))[2]
    };
    let (one, other) = (displacement(places[0], places[1]), displacement(places[1], places[0]));
    // The tolerance covers the rounding errors of a linear solution.
    assert!(one > 0.0 && (one - other).abs() < 1e-10 * one, "{one} {other}");
}

#[test]
fn point_forces_outside_the_mesh_are_refused() {
    let at = |at: &str| {
        let table = format!("[[point_force]]\nat = {at}\nx = 1.0");
        refusal(&text(SHEET, "left", &table), Path::new(""))
    };
    assert_eq!(at("[1.0, 0.5]"), "accepted");
    for wrong in ["[5.0, 0.5]", "[1.0, 0.5, 0.0]"] {
        assert_ne!(at(wrong), "accepted", "{wrong}");
    }
}

/// Checks a body supported by springs at two corners and moved by a force: the reaction of the springs balances
/// the force. The springs are much softer than the body, so that its displacement is F/(2 k) along both axes.
#[test]
fn springs_hold_a_body() {
    let springs = |direction: &str| {
        [[0.0, 0.0], [0.0, 1.0]]
            .map(|at| format!("[[spring]]\nat = {at:?}\nstiffness = 1e-3\n{direction}\n"))
    };
    let pull = "[[point_force]]\nat = [0.0, 0.5]\nx = 2e-5\n\
         [[probe]]\nname = \"end\"\ntype = \"point\"\nat = [1.0, 0.5]\nquantities = [\"u\"]\n";
    let found = end(&text(SHEET, "", &format!("{}{pull}", springs("").concat())), Path::new(""));
    // The strain is about 1e-3 N/m² divided by 1e4 Pa.
    assert!((found[1] - 1e-2).abs() < 1e-6 * 1e-2, "{found:?}");
    assert!(found[2].abs() < 1e-6 * 1e-2, "{found:?}");
    // Springs along y do not support the body along x.
    let along =
        text(SHEET, "left", &format!("{}{pull}", springs("direction = [0.0, 2.0]").concat()));
    assert!(end(&along, Path::new(""))[1] < 1e-6);
    for wrong in ["[[spring]]\nat = [0.5, 0.5]", "[[spring]]\nat = [9.0, 0.5]\nstiffness = 1.0"] {
        assert_ne!(refusal(&text(SHEET, "left", wrong), Path::new("")), "accepted", "{wrong}");
    }
}
