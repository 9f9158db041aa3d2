//! Errors of invalid contractions, which must name the key.

use std::path::Path;

use myovib_scene::Scene;

use crate::MUSCLE;

/// Returns the error for the muscle with `from` replaced by `to`.
fn refusal(from: &str, to: &str) -> String {
    assert!(MUSCLE.contains(from), "{from}");
    let text = MUSCLE.replacen(from, to, 1);
    match Scene::build("scene.toml", &text, &[], Path::new("")) {
        Ok(_) => "accepted".to_owned(),
        Err(error) => error.to_string(),
    }
}

#[test]
fn invalid_contractions_are_rejected_with_their_key() {
    let bestel = "active = { type = \"bestel\", contractility = 2e4";
    for (from, to, messages) in [
        (
            "value = 8e3",
            "value = -8e3",
            ["its tension cannot be negative", "0 Pa or more at all times"],
        ),
        (
            "contractility = 2e4",
            "contractility = -2e4",
            ["contractility` is out of range", "at least 0"],
        ),
        (
            "contractility = 2e4",
            "spatial_factor = \"x\", contractility = 2e4",
            ["spatial_factor", "only a tension of type = \"given\" can have a spatial factor"],
        ),
        ("stress = \"nominal\"", "spatial_factor = \"x - 1\"", ["spatial_factor", "is negative"]),
        ("diastole = 0.3", "diastole = -0.3", ["diastole", "after systole"]),
        (
            bestel,
            "active = { type = \"bestle\", contractility = 2e4",
            ["unknown name", "did you mean `bestel`?"],
        ),
        ("rise = 30.0", "decay = 3.0", ["decay` is out of range", "less than 0"]),
        (
            "fiber = [1.0, 0.0, 0.0]\n",
            "",
            ["active stress needs the direction of the fibers", "give `fiber`"],
        ),
        (
            "[1.0, 0.0, 0.0]\nbulk_modulus",
            "[0.0, 0.0, 0.0]\nbulk_modulus",
            ["a direction cannot be zero", "fiber"],
        ),
        ("fiber = \"fiber\"", "fiber = \"f0\"", ["the mesh has no nodal field `f0`", "fiber"]),
        ("optimal = 1.1", "optimal = 0", ["optimal` is out of range", "greater than 0"]),
        ("v_max = 10.0", "v_max = -1", ["v_max` is out of range", "greater than 0"]),
        ("viscosity = 20.0", "viscosity = -20.0", ["viscosity` is out of range", "at least 0"]),
        (
            "bulk_modulus = 3e5",
            "bulk_modulus = inf",
            ["bulk_modulus = inf combined with a finite value", "`bulk_modulus`"],
        ),
        (
            "bulk_modulus = 3e5",
            "rayleigh_stiffness = 1e-3",
            ["rayleigh_stiffness > 0 combined with 0", "`rayleigh_stiffness`"],
        ),
        (
            "bulk_modulus = 3e5",
            "bulk_modulus = 0",
            ["bulk_modulus` is out of range", "greater than 0"],
        ),
        (
            "rayleigh_mass = 2.0",
            "rayleigh_mass = -1.0",
            ["rayleigh_mass` is out of range", "at least 0"],
        ),
        (
            "law = \"mooney-rivlin\"\ndensity = 1e3\nc10 = 1e4",
            "law = \"small-strain\"\ndensity = 1e3\nshear_modulus = 1e4",
            ["small-strain law", "line 10"],
        ),
        ("group = \"surface\"", "group = \"surfce\"", ["did you mean `surface`?", "surfce"]),
        ("group = \"surface\"", "group = \"muscle\"", ["contains tetrahedra", "group"]),
        ("stiffness = 3e4\ndamping = 2e2", "", ["elastic foundation", "`stiffness`"]),
        ("stiffness = 3e4", "stiffness = -3e4", ["stiffness` is out of range", "at least 0"]),
        ("along = \"normal\"", "along = \"tangent\"", ["unknown name", "all, normal"]),
    ] {
        let found = refusal(from, to);
        for message in messages {
            assert!(found.contains(message), "{to}: {message}: {found}");
        }
    }
}

/// Checks a tension that is negative for a time so short that equidistant samples would miss it: the distances of a
/// table's rows from this time double from row to row.
#[test]
fn a_table_that_pushes_for_a_moment_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let apart = (0..12).map(|k| 1e-6 * f64::from(1 << k));
    let mut rows: Vec<(f64, f64)> = apart
        .flat_map(|apart| [0.01001 - apart, 0.01001 + apart])
        .chain([0.0, 10.0])
        .map(|t| (t, 8e3))
        .chain([(0.01001, -1e3)])
        .collect();
    rows.sort_by(|a, b| a.0.total_cmp(&b.0));
    let rows: String = rows.iter().map(|(t, value)| format!("{t},{value}\n")).collect();
    std::fs::write(folder.path().join("tension.csv"), format!("t,T\n{rows}")).unwrap();
    let text = MUSCLE.replacen(
        "tension = { type = \"step\", value = 8e3, rise = 0.05 }",
        "tension = { type = \"table\", file = \"tension.csv\", column = \"T\" }",
        1,
    );
    let error = Scene::build("scene.toml", &text, &[], folder.path()).unwrap_err();
    let message = error.to_string();
    assert!(message.contains("tension") && message.contains("t = 0.01001"), "{message}");
}

/// Checks that rounding errors at the end of a twitch, where its terms cancel, do not count as a negative tension.
#[test]
fn a_twitch_of_two_steps_is_accepted() {
    let given = "{ type = \"step\", value = 8e3, rise = 0.05 }";
    for value in [1e4, 2e4, 6e4, 1e5 / 3.0] {
        let twitch = format!(
            "{{ type = \"sum\", of = [{{ type = \"step\", value = {value:?}, rise = 0.003 }}, \
             {{ type = \"step\", value = {:?}, start = 0.004, rise = 0.006 }}] }}",
            -value
        );
        assert_eq!(refusal(given, &twitch), "accepted");
    }
}
