//! Bodies of two materials: pressures at their interface.

use std::path::Path;

use myovib_model::statics::equilibrium;
use myovib_scene::Scene;

/// Strip of two materials side by side, stretched along their interface and free to become narrower.
const STRIP: &str = r#"
analysis = "static"
[mesh]
type = "rectangle"
width = 2.0
height = 1.0
cells = [4, 2]
[[region]]
name = "soft"
center = [0.0, 0.5]
radii = [1.0, 1e3]
[solid]
bulk_modulus = inf
formulation = "position"
[[material]]
group = "body"
law = "mooney-rivlin"
density = 1e3
c10 = 2e5
c01 = 0.0
[[material]]
group = "soft"
law = "mooney-rivlin"
density = 1e3
c10 = 1e4
c01 = 0.0
[[fixed]]
group = "left"
components = ["x"]
[[fixed]]
group = "bottom"
components = ["y"]
[[prescribed_displacement]]
group = "top"
y = 0.25
"#;

/// Checks that each material has a different pressure, so that its sides are free of stress: F = diag(1/λ, λ), σ_x = 2
/// c10 (1/λ² − I1/3) − p = 0. A continuous pressure cannot represent this.
#[test]
fn pressures_jump_where_only_the_law_changes() {
    let scene = Scene::build("strip.toml", STRIP, &[], Path::new("")).unwrap();
    let body = scene.body.as_ref().unwrap();
    let solid = &body.muscle.solid;
    let space = solid.space();
    // Three vertices of the interface have two pressures.
    assert_eq!(space.n_pressures(), space.mesh().coordinates().len() / 2 + 3);
    let found = equilibrium(&body.muscle, body.formulation, 0.0).unwrap();
    let stretch: f64 = 1.25;
    let (narrow, wide) = (stretch.powi(-2), stretch.powi(2));
    let pressure = |c10: f64| 2.0 * c10 * (narrow - (narrow + wide + 1.0) / 3.0);
    for element in 0..space.n_elements() {
        let corners = space.mesh().corners::<2, 3>(element);
        let x = corners.iter().map(|corner| corner[0]).sum::<f64>() / 3.0;
        let expected = pressure(if x < 1.0 { 1e4 } else { 2e5 });
        for &own in space.element_pressures(element) {
            let error = found.pressure[own] / expected - 1.0;
            // The exact solution is in the space; the error comes from the tolerance of the
            // equilibrium.
            assert!(error.abs() < 1e-6, "{element}: {error:e}");
        }
    }
    for (&free, u) in solid.dofs().free_to_full().iter().zip(&found.displacement) {
        let point = space.node_point(free / 2);
        let expected = match free % 2 {
            0 => (1.0 / stretch - 1.0) * point[0],
            _ => (stretch - 1.0) * point[1],
        };
        assert!((u - expected).abs() < 1e-7, "{free}: {u} {expected}");
    }
}

/// Two stacked cubes of one law and two κ, supported at their sides.
const STACK: &str = r#"
analysis = "static"
[mesh]
type = "box"
size = [1.0, 1.0, 2.0]
cells = [2, 2, 2]
[[region]]
name = "upper"
center = [0.5, 0.5, 2.0]
radii = [1e3, 1e3, 1.0]
[solid]
bulk_modulus = 1e5
formulation = "position"
[[material]]
group = "body"
law = "small-strain"
density = 1e3
shear_modulus = 1e4
[[material]]
group = "upper"
law = "small-strain"
density = 1e3
shear_modulus = 1e4
bulk_modulus = 4e5
[[fixed]]
group = "left"
components = ["x"]
[[fixed]]
group = "right"
components = ["x"]
[[fixed]]
group = "front"
components = ["y"]
[[fixed]]
group = "back"
components = ["y"]
[[fixed]]
group = "bottom"
components = ["z"]
[[prescribed_displacement]]
group = "top"
z = -0.01
"#;

/// Checks the uniaxial strain e in each of two cubes under the same stress (κ + 4G/3) e, with p = -κ e.
#[test]
fn pressures_jump_in_space_where_only_kappa_changes() {
    let scene = Scene::build("stack.toml", STACK, &[], Path::new("")).unwrap();
    let body = scene.body.as_ref().unwrap();
    let space = body.muscle.solid.space();
    // There are three layers of nine vertices, and the middle layer counts twice.
    assert_eq!(space.n_pressures(), 27 + 9);
    let found = equilibrium(&body.muscle, body.formulation, 0.0).unwrap();
    let (kappas, shear) = ([1e5, 4e5], 1e4);
    let moduli = kappas.map(|kappa| kappa + 4.0 / 3.0 * shear);
    let stress = -0.01 / (1.0 / moduli[0] + 1.0 / moduli[1]);
    for element in 0..space.n_elements() {
        let corners = space.mesh().corners::<3, 4>(element);
        let z = corners.iter().map(|corner| corner[2]).sum::<f64>() / 4.0;
        let own = usize::from(z > 1.0);
        let expected = -kappas[own] * stress / moduli[own];
        for &pressure in space.element_pressures(element) {
            let error = found.pressure[pressure] / expected - 1.0;
            // The exact solution is in the space, so only the rounding errors of a linear system of 1e2 to 1e3 unknowns
            // remain.
            assert!(error.abs() < 1e-11, "{element}: {error:e}");
        }
    }
}

/// Checks scenes with one material, including the scenes of Table 2.
#[test]
fn one_material_has_one_pressure_at_a_vertex() {
    for name in ["table2-1", "table2-2", "table2-3", "table2-3m", "table2-4", "table2-31", "land1"]
    {
        let scene = Scene::load(Path::new(name), &[]).unwrap();
        let solid = scene.body.unwrap().muscle.solid;
        let mesh = solid.space().mesh();
        let vertices = mesh.coordinates().len() / mesh.dimension();
        assert_eq!(solid.space().n_pressures(), vertices, "{name}");
    }
}

/// Checks that a material without a group covers the remaining elements, even if it is listed first, and that a note
/// names it if no elements remain.
#[test]
fn a_material_without_group_covers_the_rest() {
    let build = |text: &str| Scene::build("strip.toml", text, &[], Path::new(""));
    let laws = |scene: Scene| scene.body.unwrap().muscle.solid.laws().to_vec();
    let rest = STRIP.replacen("group = \"body\"\nlaw", "law", 1);
    assert_eq!(laws(build(&rest).unwrap()), laws(build(STRIP).unwrap()));
    let unused =
        format!("{STRIP}[[material]]\nlaw = \"neo-hooke\"\ndensity = 1e3\nshear_modulus = 1e4\n");
    let notes = build(&unused).unwrap().notes();
    assert!(notes.iter().any(|note| note.starts_with("material[2]")), "{notes:?}");
    let two =
        format!("{unused}[[material]]\nlaw = \"neo-hooke\"\ndensity = 1e3\nshear_modulus = 1e4\n");
    assert!(build(&two).is_err());
    let overlapping = STRIP.replacen("group = \"body\"", "group = \"soft\"", 1);
    let error = build(&overlapping).unwrap_err().to_string();
    assert!(error.contains("line 21"), "{error}");
}

/// Regression: errors about inconsistent constants did not contain a line.
#[test]
fn constants_of_laws_that_do_not_fit_together_are_located() {
    let weights = |i| format!("b_{i} = {}.0\n", if i == 5 { 9 } else { 1 });
    let weights: String = (1..=9).map(weights).collect();
    for (constants, line) in [
        ("law = \"mooney-rivlin\"\nc10 = 1e3\nc01 = -1100.0\n", "c01 = -1100.0"),
        ("law = \"ogden\"\nmu_1 = 1e3\nalpha_1 = 0.0\n", "alpha_1 = 0.0"),
        ("law = \"ogden\"\nalpha_1 = 2.0\nmu_1 = -1e3\n", "mu_1 = -1e3"),
        (&format!("law = \"fung\"\nc = 1e3\n{weights}"), "b_5 = 9.0"),
    ] {
        let text = format!("[[material]]\ndensity = 1e3\n{constants}");
        let error = Scene::build("scene.toml", &text, &[], Path::new("")).unwrap_err().to_string();
        assert!(error.contains(&format!(" | {line}")), "{error}");
    }
}
