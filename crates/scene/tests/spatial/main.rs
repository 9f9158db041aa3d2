//! Scenes in space: an independent program's equilibria, and what is refused with which words.
#![allow(clippy::unwrap_used)] // a test may panic

mod refusals;

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
