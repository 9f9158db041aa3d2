//! Contraction, viscosity, foundations and constants per material. Scenes must agree with the library, and errors must
//! name the key.
#![allow(clippy::unwrap_used)] // a test may panic

mod refusals;

use std::path::Path;
use std::sync::Arc;

use myovib_dae::Problem;
use myovib_fem::material::{ActiveStress, Bestel, ForceLength, ForceVelocity, Tension};
use myovib_fem::{
    AddedStress, DofMap, Fibers, Group, Law, Mesh, Solid, Space, SupportDirection, generate, load,
};
use myovib_model::{
    Activation, Load, Muscle, MuscleDae, Parameters, RobinSupport, Signal, formula,
};
use myovib_scene::Scene;
use myovib_scene::run::{RunOptions, compute};
use serde_json::Value;

/// Scene with all features that a material may add to its law, on an elastic foundation.
const MUSCLE: &str = r#"
[time]
end = 0.02
[mesh]
type = "muscle3d"
cells = [10, 2, 2]
[solid]
bulk_modulus = 1e5
rayleigh_mass = 1.0
[[material]]
group = "muscle"
law = "mooney-rivlin"
density = 1e3
c10 = 1e4
fiber = "fiber"
viscosity = 20.0
active = { type = "given", tension = { type = "step", value = 8e3, rise = 0.05 }, stress = "nominal", force_length = { type = "parabola", optimal = 1.1 }, force_velocity = { v_max = 10.0 } }
[[material]]
group = "tendon"
law = "mooney-rivlin"
density = 1.2e3
c10 = 5e4
fiber = [1.0, 0.0, 0.0]
bulk_modulus = 3e5
rayleigh_mass = 2.0
active = { type = "bestel", contractility = 2e4, rise = 30.0, systole = 0.0, diastole = 0.3 }
[[elastic_foundation]]
group = "left"
stiffness = 1e6
damping = 1e3
[[elastic_foundation]]
group = "surface"
along = "normal"
stiffness = 3e4
damping = 2e2
[[traction]]
group = "right"
x = { type = "step", value = 100.0, rise = 0.01 }
[[probe]]
name = "origin"
type = "point"
at = [0.0, 0.0, 0.0]
quantities = ["u", "tension", "stress"]
[[probe]]
name = "energy"
type = "energy"
interval = 0.001
"#;

fn build(text: &str) -> Scene {
    Scene::build("scene.toml", text, &[], Path::new("")).unwrap()
}

fn members(mesh: &Mesh, name: &str) -> Vec<usize> {
    match mesh.group(name).unwrap() {
        Group::Elements(members) => members.clone(),
        _ => panic!("elements"),
    }
}

/// Builds the same body by calling the library directly.
fn by_hand() -> Muscle {
    let mesh = generate::muscle([10, 2, 2]).unwrap();
    let [muscle, tendon] = ["muscle", "tendon"].map(|name| members(&mesh, name));
    let region: Vec<usize> =
        (0..mesh.n_elements()).map(|element| usize::from(tendon.contains(&element))).collect();
    let space = Space::taylor_hood(&mesh).with_regions(&region).unwrap();
    let space = Arc::new(space);
    let mut fibers = Fibers::new(&mesh);
    fibers.set_nodal(&mesh, &muscle, "fiber", None).unwrap();
    let along = [1.0, 0.0, 0.0];
    fibers.set_constant(&mesh, &tendon, along, None).unwrap();
    let of_region = |own: [f64; 2]| region.iter().map(|r| own[*r]).collect::<Vec<f64>>();
    let laws = of_region([1e4, 5e4]).into_iter();
    let laws = laws.map(|c10| Law::MooneyRivlin { c10, c01: 0.0 });
    let hill = ActiveStress {
        tension: Tension::Nominal,
        force_length: ForceLength::Parabola { optimal: 1.1 },
        force_velocity: Some(ForceVelocity::hill(10.0)),
    };
    let stress = |active, viscosity| AddedStress { active: Some(active), viscosity };
    let stresses = [(muscle, stress(hill, 20.0)), (tendon, stress(ActiveStress::PLAIN, 0.0))];
    let dofs = DofMap::new(&space, &[]).unwrap();
    let densities = of_region([1e3, 1.2e3]);
    let solid = Solid::with_densities(space.clone(), dofs, laws.collect(), &densities)
        .unwrap()
        .with_fibers(fibers)
        .with_added_stresses(&stresses)
        .unwrap();
    let own = [Parameters::new(1.0, 0.0, 1e5).unwrap(), Parameters::new(2.0, 0.0, 3e5).unwrap()];
    let own: Vec<Parameters> = region.iter().map(|r| own[*r]).collect();
    let body = Muscle::graded(solid, &own).unwrap();
    let step = |value, rise| Signal::from(formula::StepFunction { value, start: 0.0, rise });
    let model = Bestel { rise: 30.0, systole: 0.0, diastole: 0.3, ..Bestel::ventricle(2e4) };
    let traction = load::traction(&space, "right", [1.0, 0.0, 0.0]).unwrap();
    Muscle {
        foundations: vec![
            RobinSupport::new(&body.solid, "left", SupportDirection::All, [1e6, 1e3]).unwrap(),
            RobinSupport::new(&body.solid, "surface", SupportDirection::Normal, [3e4, 2e2])
                .unwrap(),
        ],
        activations: vec![(0, Activation::Given(step(8e3, 0.05))), (1, Activation::Bestel(model))],
        loads: vec![Load::new(&traction, step(100.0, 0.01))],
        ..body
    }
}

#[test]
fn a_scene_is_the_body_of_the_library() {
    let body = build(MUSCLE).body.unwrap();
    let residual = |muscle: Muscle| {
        let mut dae = MuscleDae::new(muscle, body.formulation).unwrap();
        let n = dae.n_unknowns();
        let wave =
            |size: f64| -> Vec<f64> { (0..n).map(|i| size * (1.3 * i as f64).sin()).collect() };
        let mut residual = vec![0.0; n];
        dae.residual(0.015, &wave(1e-4), &wave(1e-2), &mut residual).unwrap();
        residual
    };
    let [scene, library] = [body.muscle.clone(), by_hand()].map(residual);
    assert!(scene.iter().any(|r| *r != 0.0));
    // Requires bitwise equality. The numbers are not printed because there are thousands.
    assert!(scene == library);
}

/// Returns the document of a run, the columns of its probe `origin` and their last values.
fn run(text: &str) -> (Value, String, Vec<f64>) {
    let folder = tempfile::tempdir().unwrap();
    let options = RunOptions::into_folder(folder.path());
    let document = compute(&build(text), &options).unwrap().document;
    assert_eq!(document["outcome"], "finished");
    let table = std::fs::read_to_string(folder.path().join("origin.csv")).unwrap();
    let columns = table.lines().next().unwrap().to_owned();
    let last = table.lines().last().unwrap().split(',');
    let last = last.map(|word| word.parse().unwrap()).collect();
    (document, columns, last)
}

fn passes(document: &Value) -> [u64; 3] {
    ["residual_passes", "added_passes", "added_tangent_passes"]
        .map(|key| document["work"][key].as_u64().unwrap())
}

/// Counters of optional features. The tests of foundations, relaxation and feedback check that each counter increases
/// when its feature is used.
const EXTRAS: [&str; 8] = [
    "fiber_passes",
    "added_passes",
    "added_tangent_passes",
    "bed_passes",
    "relaxing_passes",
    "relaxing_tangent_passes",
    "relaxing_solve_passes",
    "coherence_passes",
];

/// Checks that only requested features are computed, and that their effect is visible.
#[test]
fn a_scene_without_contraction_skips_its_evaluation() {
    let (document, columns, last) = run(MUSCLE);
    let [all, added, tangents] = passes(&document);
    assert!(all == added && tangents > 0, "{all} {added} {tangents}");
    assert_eq!(document["work"]["bed_passes"], all);
    assert!(columns.starts_with("t,u_x,u_y,u_z,tension,stress_xx,"));
    // The step function s³ (6 s² - 15 s + 10) has this value at s = 0.02/0.05.
    assert!((last[4] / (8e3 * 0.317_44) - 1.0).abs() < 1e-12, "{last:?}");
    // Up to the tolerance, the change of energy equals the work of tension, damping and foundations.
    let energy: Vec<f64> = serde_json::from_value(document["energy"].clone()).unwrap();
    assert!(energy[4].abs() < 1e-3 * energy[2].abs(), "{energy:?}");

    let lines = MUSCLE.lines();
    let plain: Vec<&str> = lines
        .filter(|line| !line.starts_with("active") && !line.starts_with("viscosity"))
        .collect();
    let plain = plain.join("\n");
    let (body, rest) = plain.split_once("[[elastic_foundation]]").unwrap();
    let (_, rest) = rest.split_once("[[traction]]").unwrap();
    let held = format!("{body}[[fixed]]\ngroup = \"left\"\n[[traction]]{rest}");
    let (document, _, last) = run(&held);
    assert!(last[1] > 0.0 && last[4] == 0.0, "{last:?}");
    let work = |document: &Value| EXTRAS.map(|key| document["work"][key].as_u64().unwrap());
    assert!(passes(&document)[0] > 0);
    assert_eq!(work(&document), [0; 8], "{EXTRAS:?}");

    // Only one of the materials has a fiber law, and the counter includes only this material.
    let (isotropic, fibrous) = (
        "law = \"mooney-rivlin\"\ndensity = 1.2e3\nc10 = 5e4",
        "law = \"guccione\"\ndensity = 1.2e3\nc = 1e4\nb_f = 8.0\nb_t = 2.0\nb_fs = 4.0",
    );
    assert!(held.contains(isotropic));
    let (document, ..) = run(&held.replacen(isotropic, fibrous, 1));
    let [fibers, others @ ..] = work(&document);
    assert_eq!((fibers, others), (passes(&document)[0], [0; 7]));
}

/// Returns the scene with Prony terms in both materials.
fn relaxing() -> String {
    let terms = [
        "prony = [{ relative_modulus = 0.5, relaxation_time = 0.01 }, { relative_modulus = 0.2, relaxation_time = 0.5 }]",
        "prony = [{ relative_modulus = 0.3, relaxation_time = 0.05 }]",
    ];
    let muscle = MUSCLE.replacen("viscosity = 20.0", &format!("viscosity = 20.0\n{}", terms[0]), 1);
    muscle.replacen("rayleigh_mass = 2.0", &format!("rayleigh_mass = 2.0\n{}", terms[1]), 1)
}

#[test]
fn stress_relaxes_by_the_prony_terms_of_a_material() {
    let keys = ["relaxing_passes", "relaxing_tangent_passes", "relaxing_solve_passes"];
    let work = |document: &Value| keys.map(|key| document["work"][key].as_u64().unwrap());
    let (document, _, stiffened) = run(&relaxing());
    let [all, _, _] = passes(&document);
    let [forces, tangents, solves] = work(&document);
    assert!(forces == all && tangents > 0 && solves > 0, "{forces} {all} {tangents}");
    let energy: Vec<f64> = serde_json::from_value(document["energy"].clone()).unwrap();
    assert!(energy[4].abs() < 1e-3 * energy[2].abs(), "{energy:?}");
    let (document, _, plain) = run(MUSCLE);
    assert_eq!(work(&document), [0; 3]);
    // The stress of the Prony terms makes the body stiffer, so it moves less.
    assert!(stiffened[1].abs() < plain[1].abs(), "{stiffened:?} {plain:?}");

    // Small-strain laws reject the other additions of materials first.
    let lines: Vec<String> = relaxing().lines().map(str::to_owned).collect();
    let added = |line: &&String| line.starts_with("active") || line.starts_with("viscosity");
    let bare: Vec<&str> = lines.iter().filter(|line| !added(line)).map(|line| &**line).collect();
    let refused = |from: &str, to: &str| {
        let text = bare.join("\n").replacen(from, to, 1);
        let refused = Scene::build("scene.toml", &text, &[], Path::new(""));
        refused.err().map_or_else(String::new, |error| error.to_string())
    };
    for (from, to, messages) in [
        (
            "relaxation_time = 0.01",
            "relaxation_time = -0.01",
            ["material[0].prony[0]", "relaxation_time"],
        ),
        (
            "relative_modulus = 0.2",
            "relative_modulus = -0.2",
            ["material[0].prony[1]", "relative_modulus"],
        ),
        (
            "law = \"mooney-rivlin\"\ndensity = 1.2e3\nc10 = 5e4",
            "law = \"small-strain\"\ndensity = 1.2e3\nshear_modulus = 5e4",
            ["Prony terms", "choose a finite-strain law"],
        ),
    ] {
        let found = refused(from, to);
        for message in messages {
            assert!(found.contains(message), "{from}: {found}");
        }
    }
}

/// Checks that Bestel's tension is rejected in a static analysis, where it is 0 and would cause no contraction.
#[test]
fn equilibria_reject_bestels_tension() {
    let text = MUSCLE.replacen("[time]\nend = 0.02", "analysis = \"static\"", 1);
    let (text, _) = text.split_once("[[probe]]\nname = \"energy\"").unwrap();
    let error = Scene::build("scene.toml", text, &[], Path::new("")).unwrap_err();
    let message = error.to_string();
    assert!(message.contains("Bestel"), "{message}");
}

/// Checks that a motion that starts under tension is rejected, because the body would accelerate suddenly.
#[test]
fn a_motion_starts_without_tension() {
    let text = MUSCLE.replacen(
        "tension = { type = \"step\", value = 8e3, rise = 0.05 }",
        "tension = 8e3",
        1,
    );
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let error = compute(&build(&text), &RunOptions::into_folder(&out)).unwrap_err();
    assert!(error.to_string().contains("tension"), "{error}");
    assert!(!out.exists());
}

/// Returns the final displacement of the tip of a block with the given `materials`.
fn contracted(materials: &str) -> [f64; 3] {
    let text = format!(
        r#"
analysis = "static"
[mesh]
type = "box"
size = [0.1, 0.02, 0.02]
cells = [4, 1, 1]
[[group]]
name = "distal"
members = "elements"
type = "half-space"
point = [0.05, 0.0, 0.0]
normal = [1.0, 0.0, 0.0]
[solid]
bulk_modulus = 1e6
{materials}
[[fixed]]
group = "left"
[[probe]]
name = "tip"
type = "point"
at = [0.1, 0.02, 0.02]
quantities = ["u"]
"#
    );
    let folder = tempfile::tempdir().unwrap();
    let scene = build(&text);
    let run = compute(&scene, &RunOptions::into_folder(folder.path().join("out"))).unwrap();
    assert_eq!(run.document["outcome"], "finished");
    let table = std::fs::read_to_string(folder.path().join("out/tip.csv")).unwrap();
    let last = table.lines().last().unwrap();
    let values: Vec<f64> = last.split(',').map(|value| value.parse().unwrap()).collect();
    values[values.len() - 3..].try_into().unwrap()
}

/// Checks that a tension with a spatial factor of 1 or 3 equals the product of tension and factor. Pressures may jump
/// between materials, so both bodies have the same materials.
#[test]
fn a_spatial_factor_scales_the_tension_of_each_element() {
    let material = |group: &str, tension: f64, factor: &str| {
        format!(
            "[[material]]\n{group}\nlaw = \"neo-hooke\"\ndensity = 1e3\nshear_modulus = 2e4\nfiber = [1.0, 0.0, 0.0]\n\
             active = {{ type = \"given\", tension = {tension:?}{factor} }}\n"
        )
    };
    let factor = ", spatial_factor = \"1 + 2*floor(x/0.05)\"";
    let both = |tension: f64, factor: &str| {
        [material("", 1e3, factor), material("group = \"distal\"", tension, factor)].concat()
    };
    let [one, two] = [both(1e3, factor), both(3e3, "")].map(|materials| contracted(&materials));
    assert!(two[0] < -1e-4, "{two:?}");
    for (one, two) in one.iter().zip(two) {
        // Newton's method stops if a correction is at most 1e-10 of the displacement.
        assert!((one - two).abs() < 1e-9 * two.abs(), "{one} {two}");
    }
}
