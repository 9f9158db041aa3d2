//! Scenes in space: an independent program's equilibria, and what is refused with which words.
#![allow(clippy::unwrap_used)] // a test may panic

use std::fs;
use std::path::Path;

use myovib_model::Probe;
use myovib_model::statics::equilibrium;
use myovib_scene::Scene;
use myovib_scene::run::{RunOptions, compute};
use serde_json::Value;

/// A block of twelve tetrahedra, held at its left end.
const BLOCK: &str = r#"
analysis = "static"
[mesh]
type = "box"
size = [2.0, 1.0, 1.0]
cells = [2, 1, 1]
[solid]
kappa = 1e5
[[material]]
law = "mooney-rivlin"
density = 1e3
c10 = 1e4
c01 = 2e2
[[fixed]]
group = "left"
[[traction]]
group = "right"
z = 100.0
[[probe]]
name = "end"
type = "point"
at = [2.0, 0.5, 0.5]
[[probe]]
name = "support"
type = "reaction"
group = "left"
"#;

fn results(scene: &Scene) -> Value {
    let folder = tempfile::tempdir().unwrap();
    let result = compute(scene, &RunOptions::into_folder(folder.path())).unwrap();
    result.document["results"].clone()
}

/// The message for the block with `from` replaced by `to`.
fn refusal(from: &str, to: &str) -> String {
    assert!(BLOCK.contains(from), "{from}");
    let text = BLOCK.replacen(from, to, 1);
    refusal_of(&text, Path::new(""))
}

fn refusal_of(text: &str, folder: &Path) -> String {
    match Scene::build("scene.toml", text, &[], folder) {
        Ok(_) => "accepted".to_owned(),
        Err(error) => error.to_string(),
    }
}

/// Case s12: the values of an independent program on the same mesh, by quadrature of degree 4.
#[test]
fn a_spindle_in_equilibrium_is_that_of_another_program() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../data/meshes");
    for (kappa, u_z, p) in [
        ("1e5", 1.494787223207e-3, -13.39663367314),
        ("inf", 1.385248872204e-3, -13.44158205485),
    ] {
        let text = BLOCK
            .replace(
                "type = \"box\"",
                "type = \"file\"\npath = \"spindle_coarse.msh\"",
            )
            .replace("size = [2.0, 1.0, 1.0]\ncells = [2, 1, 1]", "")
            .replace("kappa = 1e5", &format!("kappa = {kappa}"))
            .replace("group = \"left\"", "group = \"fixed\"")
            .replace("group = \"right\"", "group = \"load\"")
            .replace("at = [2.0, 0.5, 0.5]", "at = [0.0, 0.0, 0.0]");
        let scene = Scene::build("scene.toml", &text, &[], &folder).unwrap();
        let results = results(&scene);
        let end = |name: &str| results["end"][name].as_f64().unwrap();
        // Rules of degree 4 differ among themselves by 2e-9.
        assert!((end("u_z") / u_z - 1.0).abs() < 1e-8, "{results}");
        assert!((end("p") / p - 1.0).abs() < 1e-7, "{results}");
        // The supports hold the load: 100 Pa on the patch, along z alone.
        let support = |name: &str| results["support"][name].as_f64().unwrap();
        let load = support("R_z").abs();
        assert!(
            load > 0.0 && support("R_x").abs() < 1e-8 * load,
            "{results}"
        );
    }
}

#[test]
fn the_supports_of_a_block_carry_its_load() {
    let scene = Scene::build("scene.toml", BLOCK, &[], Path::new("")).unwrap();
    let results = results(&scene);
    let support = |name: &str| results["support"][name].as_f64().unwrap();
    // 100 Pa on 1 m²; the Newton iteration ends at 1e-9 of the displacement.
    assert!((support("R_z") + 100.0).abs() < 1e-6, "{results}");
    assert!(support("R_x").abs() < 1e-6 && support("R_y").abs() < 1e-6);
    assert_eq!(
        results["end"].as_object().unwrap().len(),
        4,
        "u_x, u_y, u_z, p"
    );
}

/// A cube between rollers under the nominal stress 13.125 Pa: c10 = c01 = 2.5 Pa gives the stretch 2 and,
/// as the volume stays, the sides 2^(-1/2).
#[test]
fn an_incompressible_cube_is_pulled_to_twice_its_length() {
    let rollers = ["left x", "front y", "bottom z"].map(|words| {
        let (group, component) = words.split_once(' ').unwrap();
        format!("[[fixed]]\ngroup = \"{group}\"\ncomponents = [\"{component}\"]\n")
    });
    let text = BLOCK
        .replace("size = [2.0, 1.0, 1.0]", "size = [1.0, 1.0, 1.0]")
        .replace("kappa = 1e5", "kappa = inf")
        .replace("c10 = 1e4\nc01 = 2e2", "c10 = 2.5\nc01 = 2.5")
        .replace("[[fixed]]\ngroup = \"left\"\n", &rollers.concat())
        .replace("z = 100.0", "x = 13.125")
        .replace("at = [2.0, 0.5, 0.5]", "at = [1.0, 1.0, 1.0]");
    let scene = Scene::build("scene.toml", &text, &[], Path::new("")).unwrap();
    let results = results(&scene);
    let across = 0.5_f64.sqrt() - 1.0;
    for (name, exact) in [("u_x", 1.0), ("u_y", across), ("u_z", across)] {
        let found = results["end"][name].as_f64().unwrap();
        // The state is in the elements' space; the Newton iteration ends at 1e-9 of the displacement.
        assert!((found - exact).abs() < 1e-8, "{name}: {results}");
    }
}

/// A cube of the transverse law between rollers, pulled along its fibres and across: nominal stresses whose
/// stretches λ are closed forms. Along: P = 2 (λ - λ⁻²)(c10 + c01/λ) + T(λ)/λ. Across: the fibre's own stretch is μ,
/// the other side's 1/(λ μ), and both are free.
#[test]
fn an_incompressible_cube_is_pulled_along_and_across_its_fibres() {
    let (c10, c01, c3, c4, c5, straight) = (1e4, 2e2, 500.0, 8.0, 1.2e4, 1.1);
    let law = format!(
        "law = \"transverse-mooney-rivlin\"\ndensity = 1e3\nc10 = {c10}\nc01 = {c01}\nc3 = {c3}\nc4 = {c4}\n\
         c5 = {c5}\nstretch_max = {straight}"
    );
    let crimped = |l: f64| c3 * ((c4 * (l - 1.0)).exp() - 1.0);
    let tension = |l: f64| match l {
        l if l < 1.0 => 0.0,
        l if l < straight => crimped(l),
        l => c5 * (l - straight) + crimped(straight),
    };
    // Differences of Cauchy stresses along two axes, for the third stretch.
    let matrix = |a: f64, b: f64, c: f64| 2.0 * (a * a - b * b) * (c10 + c01 * c * c);
    let along = |l: f64| (matrix(l, l.powf(-0.5), l.powf(-0.5)) + tension(l)) / l;
    // The stretch μ of free fibres under λ across them, by bisection.
    let fibre = |l: f64| {
        let free = |m: f64| matrix(m, 1.0 / (l * m), l) + tension(m);
        let (mut low, mut high) = (0.5, 2.0);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            *(if free(middle) < 0.0 {
                &mut low
            } else {
                &mut high
            }) = middle;
        }
        0.5 * (low + high)
    };
    let across = |l: f64| {
        let m = fibre(l);
        (matrix(l, m, 1.0 / (l * m)) - tension(m)) / l
    };
    let rollers = ["left x", "front y", "bottom z"].map(|words| {
        let (group, component) = words.split_once(' ').unwrap();
        format!("[[fixed]]\ngroup = \"{group}\"\ncomponents = [\"{component}\"]\n")
    });
    let pulled = |direction: &str, stress: f64| {
        let text = BLOCK
            .replace("size = [2.0, 1.0, 1.0]", "size = [1.0, 1.0, 1.0]")
            .replace("kappa = 1e5", "kappa = inf")
            .replace(
                "law = \"mooney-rivlin\"\ndensity = 1e3\nc10 = 1e4\nc01 = 2e2",
                &format!("{law}\nfibre = {direction}"),
            )
            .replace("[[fixed]]\ngroup = \"left\"\n", &rollers.concat())
            .replace("z = 100.0", &format!("x = {stress}"))
            .replace("at = [2.0, 0.5, 0.5]", "at = [1.0, 1.0, 1.0]");
        let scene = Scene::build("scene.toml", &text, &[], Path::new("")).unwrap();
        let results = results(&scene);
        ["u_x", "u_y", "u_z"].map(|name| 1.0 + results["end"][name].as_f64().unwrap())
    };
    // Both ways fibres are shortened, crimped and straight.
    assert!(fibre(1.2) < 1.0 && (1.0..straight).contains(&fibre(0.9)) && fibre(0.75) > straight);
    for l in [0.75_f64, 0.9, 1.05, 1.2] {
        let (side, m) = (l.powf(-0.5), fibre(l));
        for (found, expected) in [
            (pulled("[1, 0, 0]", along(l)), [l, side, side]),
            (pulled("[0, 1, 0]", across(l)), [l, m, 1.0 / (l * m)]),
        ] {
            for (found, expected) in found.iter().zip(expected) {
                // The state is in the elements' space; the Newton iteration ends at 1e-9 of the displacement.
                assert!((found - expected).abs() < 1e-8, "{l}: {found} {expected}");
            }
        }
    }
}

#[test]
fn what_does_not_fit_the_dimension_is_refused() {
    for (from, to, message) in [
        (
            "at = [2.0, 0.5, 0.5]",
            "at = [2.0, 0.5]",
            "a point of the body has 3 coordinates, not 2",
        ),
        (
            "at = [2.0, 0.5, 0.5]",
            "at = [2.0, 0.5, 1.5]",
            "the point (2, 0.5, 1.5) lies outside the mesh",
        ),
        (
            "type = \"box\"\nsize = [2.0, 1.0, 1.0]\ncells = [2, 1, 1]",
            "type = \"rectangle\"\nwidth = 2.0\nheight = 1.0\ncells = [2, 1]",
            "a plane body has no z component",
        ),
        (
            "group = \"left\"\n[[traction]]",
            "group = \"left\"\n[[region]]\nname = \"disc\"\ncentre = [0.0, 0.0]\nradii = [1.0, 1.0]\n[[traction]]",
            "a region of this mesh needs 3 numbers",
        ),
        (
            "law = \"mooney-rivlin\"",
            "group = \"left\"\nlaw = \"mooney-rivlin\"",
            "the group `left` holds no tetrahedra",
        ),
        (
            "size = [2.0, 1.0, 1.0]",
            "size = [2.0, -1.0, 1.0]",
            "width = -1 must be positive and finite\n   where: scene.toml, line 5, column 8",
        ),
        (
            "c10 = 1e4\nc01 = 2e2",
            "c10 = 0.0",
            "the material has no stiffness: all its moduli are 0\n   where: scene.toml, line 9, column 1",
        ),
        (
            "z = 100.0",
            "",
            "none of its components is given\n   where: scene.toml, line 16, column 1",
        ),
    ] {
        let found = refusal(from, to);
        assert!(found.contains(message), "{to}: {found}");
    }
}

/// Regression: it was refused by the pattern of its matrix, with the number of an unknown.
#[test]
fn an_incompressible_body_that_is_held_everywhere_is_refused() {
    let text = BLOCK
        .replace("kappa = 1e5", "kappa = inf")
        .replace("[[fixed]]\ngroup = \"left\"", "[[fixed]]\ngroup = \"body\"");
    let found = refusal_of(&text, Path::new(""));
    let expected =
        "every node is held: no displacement answers the pressures\n   where: scene.toml";
    assert!(found.contains(expected), "{found}");
}

#[test]
fn a_table_is_refused_with_the_number_of_its_row() {
    let folder = tempfile::tempdir().unwrap();
    let load = "z = { type = \"table\", file = \"load.csv\", column = \"force\" }";
    let text = BLOCK.replace("z = 100.0", load);
    for (rows, message) in [
        (
            "0,1\n0.5,nan\n1,2\n",
            "row 2 under the header is not made of finite numbers",
        ),
        (
            "0,1\n0.5,2\n0.5,3\n",
            "row 3 under the header is not later than the one before it",
        ),
    ] {
        std::fs::write(folder.path().join("load.csv"), format!("t,force\n{rows}")).unwrap();
        let found = refusal_of(&text, folder.path());
        assert!(found.starts_with(message), "{found}");
    }
}

#[test]
fn directions_of_fibres_are_asked_for_and_checked() {
    const LAW: &str = "law = \"mooney-rivlin\"\ndensity = 1e3\nc10 = 1e4\nc01 = 2e2";
    let guccione = |directions: &str| {
        let law = "law = \"guccione\"\ndensity = 1e3\nc = 2e3\nb_f = 8.0\nb_t = 2.0\nb_fs = 4.0";
        refusal(LAW, &format!("{law}\n{directions}"))
    };
    assert_eq!(guccione("fibre = [1, 0, 0]"), "accepted");
    for (directions, message) in [
        ("", "the law guccione needs the direction of its fibres"),
        ("fibre = [0, 0, 0]", "a direction cannot be zero"),
        (
            "fibre = [1, 0]",
            "a direction in space has three components",
        ),
        ("fibre = \"f0\"", "the mesh has no nodal field `f0`"),
        ("sheet = [0, 1, 0]", "needs the direction of its fibres"),
        (
            "fibre = [1, 0, 0]\nsheet = [-2, 0, 0]",
            "the sheets run along the fibres",
        ),
        (
            "fibre = [1, 0, 0]\nsheet = \"s0\"",
            "`fibre` and `sheet` are of different kinds",
        ),
    ] {
        let found = guccione(directions);
        assert!(found.contains(message), "{directions}: {found}");
    }
    let heart = "law = \"holzapfel-ogden\"\ndensity = 1e3\na = 59\nb = 8.023\na_f = 18472\n\
                 b_f = 16.026\na_s = 2481\nb_s = 11.12\na_fs = 216\nb_fs = 11.436\nfibre = [1, 0, 0]";
    let without = refusal(LAW, heart);
    assert!(
        without.contains("needs the direction of its sheets"),
        "{without}"
    );
    let step = format!("{heart}\nsheet = [0, 1, 0]\nk = inf");
    assert_eq!(refusal(LAW, &step), "accepted");
    let text = BLOCK.replace(LAW, &step);
    let scene = Scene::build("scene.toml", &text, &[], Path::new("")).unwrap();
    let echo = serde_json::to_value(&scene.file).unwrap();
    assert_eq!(echo["material"][0]["k"], "inf");
}

/// Two tetrahedra on one face, with fibres at their vertices; `line` of the file becomes `to`.
fn mesh_file(line: &str, to: &str) -> String {
    let text = "\
$MeshFormat\n4.1 0 8\n$EndMeshFormat\n\
$PhysicalNames\n2\n2 1 \"left\"\n3 2 \"body\"\n$EndPhysicalNames\n\
$Entities\n0 0 1 1\n1 0 0 0 1 1 1 1 1 0\n1 0 0 0 1 1 1 1 2 0\n$EndEntities\n\
$Nodes\n1 5 1 5\n3 1 0 5\n1\n2\n3\n4\n5\n\
0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 1 1\n$EndNodes\n\
$Elements\n2 3 1 3\n2 1 2 1\n1 1 2 3\n3 1 4 2\n2 1 2 3 4\n3 2 3 4 5\n$EndElements\n\
$NodeData\n1\n\"f0\"\n1\n0\n3\n0\n3\n5\n1 1 0 0\n2 1 0 0\n3 1 0 0\n4 1 0 0\n5 1 0 0\n$EndNodeData\n";
    assert!(text.contains(line), "{line}");
    text.replacen(line, to, 1)
}

#[test]
fn mesh_files_that_are_wrong_in_space_are_refused_with_their_place() {
    let text = BLOCK
        .replace("type = \"box\"", "type = \"file\"\npath = \"own.msh\"")
        .replace("size = [2.0, 1.0, 1.0]\ncells = [2, 1, 1]", "")
        .replace("law = \"mooney", "fibre = \"f0\"\nlaw = \"mooney")
        .replace("group = \"right\"", "group = \"left\"")
        .replace("at = [2.0, 0.5, 0.5]", "at = [0.1, 0.1, 0.1]");
    let folder = tempfile::tempdir().unwrap();
    let found = |line: &str, to: &str| {
        fs::write(folder.path().join("own.msh"), mesh_file(line, to)).unwrap();
        refusal_of(&text, folder.path())
    };
    assert_eq!(found("", ""), "accepted");
    for (line, to, message) in [
        // The field lacks a node, is zero at one, or has another number of components.
        (
            "3\n5\n1 1 0 0\n",
            "3\n4\n",
            "`f0` is missing or no number at the vertex [0.0, 0.0, 0.0]",
        ),
        (
            "4 1 0 0\n",
            "4 0 0 0\n",
            "`f0` is zero at the vertex [0.0, 0.0, 1.0]",
        ),
        (
            "4 1 0 0\n",
            "4 nan 0 0\n",
            "no number at the vertex [0.0, 0.0, 1.0]",
        ),
        ("\"f0\"", "\"f1\"", "the mesh has no nodal field `f0`"),
        // A triangle that is no face of a tetrahedron.
        (
            "1 1 2 3\n",
            "1 1 2 5\n",
            "is a triangle that is no face of a tetrahedron",
        ),
        // Four vertices in a plane, and two tetrahedra on the same side of their face.
        (
            "1 1 1\n$EndNodes",
            "0 0.5 0.5\n$EndNodes",
            "it is degenerate",
        ),
        (
            "1 1 1\n$EndNodes",
            "0.1 0.1 0.1\n$EndNodes",
            "lie on the same side of the face they share",
        ),
    ] {
        let message_found = found(line, to);
        assert!(message_found.contains(message), "{to}: {message_found}");
    }
}

/// Mirrored tetrahedra are turned round, with a word.
#[test]
fn inverted_tetrahedra_are_turned_with_a_note() {
    let folder = tempfile::tempdir().unwrap();
    let text = BLOCK
        .replace("type = \"box\"", "type = \"file\"\npath = \"own.msh\"")
        .replace("size = [2.0, 1.0, 1.0]\ncells = [2, 1, 1]", "")
        .replace("group = \"right\"", "group = \"left\"")
        .replace("at = [2.0, 0.5, 0.5]", "at = [0.1, 0.1, 0.1]");
    fs::write(
        folder.path().join("own.msh"),
        mesh_file("2 1 2 3 4\n", "2 2 1 3 4\n"),
    )
    .unwrap();
    let scene = Scene::build("scene.toml", &text, &[], folder.path()).unwrap();
    let notes = scene.notes();
    assert!(
        notes.iter().any(|note| note.contains("turned")),
        "{notes:?}"
    );
}

/// Case s10 on half as many cells as the scene has along the beam: another P2–P1 program has
/// 3.141 mm with twenty cells along.
#[test]
fn a_beam_of_fibres_bends_as_in_another_program() {
    let set = ["mesh.cells=[20,2,2]".to_owned()];
    let scene = Scene::built_in("land1", &set).unwrap();
    let results = results(&scene);
    let u_z = results["tip"]["u_z"].as_f64().unwrap();
    // Its value has four digits.
    assert!((u_z - 3.141e-3).abs() < 1e-6, "{results}");
}

/// Acceptance of case s10: 3.17 ± 0.02 mm on the scene's own mesh, 20 465 unknowns: forty
/// cells along the beam.
#[test]
fn land1_is_within_the_codes_of_the_benchmark() {
    let scene = Scene::built_in("land1", &[]).unwrap();
    let results = results(&scene);
    let u_z = results["tip"]["u_z"].as_f64().unwrap();
    assert!((u_z - 3.17e-3).abs() < 2e-5, "{results}");
    // Another P2–P1 program on as many cells, in four digits.
    assert!((u_z - 3.159e-3).abs() < 1e-6, "{results}");
}

/// A cantilever of the muscle's material under a dead load at its end; `cells` along and across.
fn cantilever(mesh: &str, supports: &str) -> [f64; 2] {
    let text = format!(
        r#"
analysis = "static"
[mesh]
{mesh}
[solid]
kappa = 1e5
[[material]]
law = "mooney-rivlin"
density = 1e3
c10 = 1e4
c01 = 2e2
[[fixed]]
group = "left"
{supports}
[[traction]]
group = "right"
y = -400.0
"#
    );
    let scene = Scene::build("scene.toml", &text, &[], Path::new("")).unwrap();
    let body = scene.body.as_ref().unwrap();
    let found = equilibrium(&body.muscle, body.formulation, 0.0).unwrap();
    let space = body.muscle.solid.space();
    let mut u = vec![0.0; space.n_components()];
    body.muscle.solid.dofs().expand(&found.displacement, &mut u);
    let end = [4.0, 0.5, 0.15];
    let probe = Probe::at(space, &end[..space.dimension()]).unwrap();
    let vector = probe.vector(&u);
    [vector[0], vector[1]]
}

/// Between two planes without friction a thick plate is in plane strain.
#[test]
fn a_body_between_frictionless_planes_tends_to_plane_strain() {
    let in_plane = |n: u32| {
        let mesh = format!(
            "type = \"rectangle\"\nwidth = 4.0\nheight = 1.0\ncells = [{}, {n}]",
            4 * n
        );
        cantilever(&mesh, "")
    };
    let rollers = "[[fixed]]\ngroup = \"bottom\"\ncomponents = [\"z\"]\n\
                   [[fixed]]\ngroup = \"top\"\ncomponents = [\"z\"]";
    let between = |n: u32| {
        let cells = format!("cells = [{}, {n}, 1]", 4 * n);
        cantilever(
            &format!("type = \"box\"\nsize = [4.0, 1.0, 0.3]\n{cells}"),
            rollers,
        )
    };
    let limit = in_plane(8);
    assert!(limit[1] < -0.3, "a large deflection: {limit:?}");
    let error = |[x, y]: [f64; 2]| (x - limit[0]).hypot(y - limit[1]) / limit[0].hypot(limit[1]);
    let errors = [1, 2, 4].map(|n| error(between(n)));
    // Across, one layer of cells holds what does not depend on z: what is left is the error along and up, at
    // most that of the plane on the same grids.
    let plane = [1, 2, 4].map(|n| error(in_plane(n)));
    for (k, (space, plane)) in errors.iter().zip(plane).enumerate() {
        assert!(*space < plane, "{k}: {errors:?} {plane}");
    }
    assert!(
        errors[1] < 0.5 * errors[0] && errors[2] < 0.5 * errors[1],
        "{errors:?}"
    );
}
