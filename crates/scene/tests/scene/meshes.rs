//! Meshes of other versions and units, and groups selected by position and direction or combined from groups.

use std::path::Path;

use myovib_fem::Group;
use myovib_scene::run::{RunOptions, compute};
use myovib_scene::{InputError, Scene};

/// A block of 2 x 1 x 1 m, fixed on the left and pulled on the right.
const BLOCK: &str = "analysis = \"static\"
[mesh]
type = \"box\"
size = [2.0, 1.0, 1.0]
cells = [3, 2, 2]
[solid]
bulk_modulus = 1e5
[[material]]
law = \"neo-hooke\"
density = 1e3
shear_modulus = 1e4
[[fixed]]
group = \"left\"
[[traction]]
group = \"right\"
x = 100.0
[[probe]]
name = \"tip\"
type = \"point\"
at = [2.0, 1.0, 1.0]
";

fn build(text: &str) -> Result<Scene, InputError> {
    Scene::build("scene.toml", text, &[], Path::new(""))
}

/// Returns the displacement u_x of the probe `tip`.
fn tip(text: &str) -> f64 {
    let out = tempfile::tempdir().unwrap();
    let run = compute(&build(text).unwrap(), &RunOptions::into_folder(out.path())).unwrap();
    run.document["results"]["tip"]["u_x"].as_f64().unwrap()
}

/// Replaces the group of the traction by a selected group.
fn pulled_at(group: &str) -> String {
    BLOCK.replace("group = \"right\"", "group = \"end\"") + "[[group]]\nname = \"end\"\n" + group
}

#[test]
fn a_selected_face_is_that_of_the_mesh() {
    let of_mesh = tip(BLOCK);
    for place in [
        "type = \"plane\"\npoint = [2.0, 0.0, 0.0]\nnormal = [-3.0, 0.0, 0.0]\n",
        "type = \"direction\"\ndirection = [1.0, 0.2, 0.0]\n",
        "type = \"half-space\"\npoint = [2.0, 0.0, 0.0]\nnormal = [0.5, 0.0, 0.0]\n",
        "type = \"box\"\nmin = [1.9, -1.0, -1.0]\nmax = [2.1, 2.0, 2.0]\n",
        "type = \"box\"\nmin = [2.0, 0.0, 0.0]\nmax = [2.0, 1.0, 1.0]\n",
        // The corners of the face are 0.7071 m from its center.
        "type = \"sphere\"\ncenter = [2.0, 0.5, 0.5]\nradius = 0.7072\n",
    ] {
        let selected = tip(&pulled_at(place));
        // The loads are summed in another order; the static solution is converged to about 1e-10.
        assert!(
            (selected / of_mesh - 1.0).abs() < 1e-9,
            "{place}: {selected} instead of {of_mesh}"
        );
    }
}

#[test]
fn elements_are_selected() {
    let elements = "[[group]]\nname = \"core\"\nmembers = \"elements\"\ntype = \"sphere\"\n\
                    center = [1.0, 0.5, 0.5]\nradius = 9.0\n";
    let text = BLOCK.replace("density", "group = \"core\"\ndensity") + elements;
    assert_eq!(tip(&text), tip(BLOCK));
}

/// Groups of the sides of the block, which have areas of 1 m² on the left and right, and 2 m² elsewhere. The half-space
/// contains 2/3 of the length.
const ENDS_AND_REST: &str = "[[group]]\nname = \"ends\"\ntype = \"union\"\ngroups = [\"left\", \"right\", \"left\"]
[[group]]\nname = \"rest\"\ntype = \"half-space\"\npoint = [0.6666666666666666, 0.0, 0.0]\nnormal = [1.0, 0.0, 0.0]\n";

#[test]
fn groups_are_combined() {
    let area = |kind: &str, groups: &str| {
        let last = format!("[[group]]\nname = \"end\"\ntype = \"{kind}\"\ngroups = {groups}\n");
        let scene = build(&format!("{BLOCK}{ENDS_AND_REST}{last}")).unwrap();
        let space = scene.body.as_ref().unwrap().muscle.solid.space();
        let quadrature = space.quadrature("end").unwrap();
        quadrature.iter().map(|(_, weight)| weight).sum::<f64>()
    };
    for (expected, kind, groups) in [
        (2.0, "union", "[\"ends\"]"),
        (1.0 + 16.0 / 3.0, "union", "[\"rest\"]"),
        (2.0 + 16.0 / 3.0, "union", "[\"ends\", \"rest\"]"),
        (1.0, "intersection", "[\"rest\", \"ends\"]"),
        (16.0 / 3.0, "difference", "[\"rest\", \"ends\"]"),
        (1.0, "difference", "[\"ends\", \"rest\"]"),
        (1.0 + 8.0 / 3.0, "difference", "[\"rest\", \"front\", \"back\"]"),
    ] {
        let found = area(kind, groups);
        // The tolerance covers the rounding of a sum of about 500 weights.
        assert!((found - expected).abs() < 1e-12, "{kind} {groups}: {found}, not {expected}");
    }
}

#[test]
fn edges_are_combined() {
    let text = "analysis = \"static\"\n[mesh]\ntype = \"rectangle\"\nwidth = 2.0\nheight = 1.0\ncells = [4, 2]\n[solid]\n\
                bulk_modulus = inf\n[[material]]\nlaw = \"neo-hooke\"\ndensity = 1.0\nshear_modulus = 1.0\n\
                [[fixed]]\ngroup = \"left\"\n[[group]]\nname = \"right half\"\ntype = \"half-space\"\npoint = [1.0, 0.0]\n\
                normal = [1.0, 0.0]\n[[group]]\nname = \"both\"\ntype = \"union\"\ngroups = [\"left\", \"top\"]\n\
                [[group]]\nname = \"rest\"\ntype = \"difference\"\ngroups = [\"both\", \"right half\"]\n";
    let scene = build(text).unwrap();
    let space = scene.body.as_ref().unwrap().muscle.solid.space();
    for (group, length) in [("right half", 3.0), ("both", 3.0), ("rest", 2.0)] {
        let quadrature = space.quadrature(group).unwrap();
        let found: f64 = quadrature.iter().map(|(_, weight)| weight).sum();
        // The tolerance covers the rounding of a sum of about 30 weights.
        assert!((found - length).abs() < 1e-13, "{group}: {found}");
    }
}

#[test]
fn combined_points_and_elements() {
    let half = |name: &str, members: &str, normal: &str| {
        format!(
            "[[group]]\nname = \"{name}\"\nmembers = \"{members}\"\ntype = \"half-space\"\n\
             point = [0.7, 0.5, 0.0]\nnormal = {normal}\n"
        )
    };
    // Of 4 x 3 x 3 vertices, 2 layers have x >= 0.7, and 2 layers of these have y >= 0.5. Between them are 1 x 1 x 2 cells of 6
    // tetrahedra.
    for (members, expected) in [("points", 12), ("elements", 12)] {
        let groups = half("a", members, "[1.0, 0.0, 0.0]") + &half("b", members, "[0.0, 1.0, 0.0]");
        let both = format!(
            "[[group]]\nname = \"both\"\nmembers = \"{members}\"\ntype = \"intersection\"\n\
             groups = [\"a\", \"b\"]\n"
        );
        let scene = build(&format!("{BLOCK}{groups}{both}")).unwrap();
        let mesh = scene.body.as_ref().unwrap().muscle.solid.space().mesh();
        let found = match mesh.group("both").unwrap() {
            Group::Points(members) | Group::Elements(members) => members.len(),
            _ => panic!("{members}"),
        };
        assert_eq!(found, expected, "{members}");
    }
}

/// Checks that each error shows the line of the scene that contains the mistake.
#[test]
fn invalid_groups_are_located() {
    for (group, line) in [
        ("type = \"plane\"\npoint = [0.0, 0.0]\nnormal = [1.0, 0.0, 0.0]\n", "point = [0.0, 0.0]"),
        (
            "type = \"plane\"\npoint = [0.0, 0.0, 0.0]\nnormal = [0.0, 0.0, 0.0]\n",
            "normal = [0.0, 0.0, 0.0]",
        ),
        ("type = \"sphere\"\ncenter = [9.0, 9.0, 9.0]\nradius = 1.0\n", "[[group]]"),
        (
            "members = \"points\"\ntype = \"direction\"\ndirection = [1.0, 0.0, 0.0]\n",
            "members = \"points\"",
        ),
        ("type = \"half-space\"\npoint = [3.0, 0.0, 0.0]\nnormal = [1.0, 0.0, 0.0]\n", "[[group]]"),
        ("type = \"intersection\"\ngroups = [\"left\", \"right\"]\n", "[[group]]"),
        ("type = \"union\"\ngroups = []\n", "[[group]]"),
        ("type = \"union\"\ngroups = [\"left\", \"rigth\"]\n", "groups = [\"left\", \"rigth\"]"),
        ("type = \"union\"\ngroups = [\"end\"]\n", "groups = [\"end\"]"),
        ("members = \"elements\"\ntype = \"union\"\ngroups = [\"left\"]\n", "groups = [\"left\"]"),
    ] {
        let error = build(&pulled_at(group)).unwrap_err().to_string();
        assert!(error.contains(&format!(" | {line}")), "{error}");
    }
    let taken = "[[group]]\nname = \"left\"\ntype = \"direction\"\ndirection = [1, 0, 0]\n";
    let error = build(&(BLOCK.to_owned() + taken)).unwrap_err().to_string();
    assert!(error.contains(" | name = \"left\""), "{error}");
}

#[test]
fn a_mesh_in_millimeters_is_scaled() {
    let in_mm =
        BLOCK.replace("size = [2.0, 1.0, 1.0]", "size = [2000.0, 1000.0, 1000.0]\nscale = 1e-3");
    // The coordinates differ by rounding errors.
    assert!((tip(&in_mm) / tip(BLOCK) - 1.0).abs() < 1e-9);
}

#[test]
fn files_of_gmsh_in_all_versions_deflect_alike() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../fem/tests/data");
    let deflection = |format: &str| {
        let file = format!("type = \"file\"\npath = \"{folder}/block-{format}.msh\"");
        tip(&BLOCK.replace("type = \"box\"\nsize = [2.0, 1.0, 1.0]\ncells = [3, 2, 2]", &file))
    };
    let ascii = deflection("4.1-ascii");
    for format in ["4.1-binary", "2.2-ascii", "2.2-binary"] {
        // Gmsh rounds coordinates in text to 16 digits.
        assert!((deflection(format) / ascii - 1.0).abs() < 1e-9, "{format}");
    }
}
