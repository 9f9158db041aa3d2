//! Stiffness that varies in space.

use std::fs;
use std::path::Path;

use myovib_scene::csv::Table;
use myovib_scene::run::{RunOptions, compute};

use crate::common::{FILE, SHEET, mesh, refusal, scene, text, with_data};

/// Returns the last values of the probe `end` of a run.
pub(crate) fn end(text: &str, folder: &Path) -> Vec<f64> {
    let out = tempfile::tempdir().unwrap();
    compute(&scene(text, folder), &RunOptions::into_folder(out.path())).unwrap();
    let table = Table::parse(&fs::read_to_string(out.path().join("end.csv")).unwrap()).unwrap();
    table.numbers(table.rows.last().unwrap()).unwrap()
}

/// Checks a column under shear that moves along x only. With c10(y) = c (1 + b y), the displacement of its top is ∫
/// τ/(2 c10) dy = τ ln(1 + b h)/(2 c b).
#[test]
fn a_column_of_varying_stiffness_is_sheared_as_in_the_closed_form() {
    let column = |law: &str| {
        format!(
            "analysis = \"static\"\n[mesh]\ntype = \"rectangle\"\nwidth = 0.01\nheight = 0.1\n\
             cells = [1, 40]\n[solid]\nbulk_modulus = 1e5\n[[material]]\ndensity = 1e3\n{law}\n\
             spatial_factor = \"1 + 20*y\"\n[[fixed]]\ngroup = \"bottom\"\n\
             [[group]]\nname = \"all\"\ntype = \"box\"\nmembers = \"elements\"\nmin = [-1.0, -1.0]\n\
             max = [1.0, 1.0]\n[[fixed]]\ngroup = \"all\"\ncomponents = [\"y\"]\n\
             [[traction]]\ngroup = \"top\"\nx = 10.0\n\
             [[probe]]\nname = \"end\"\ntype = \"point\"\nat = [0.005, 0.1]\nquantities = [\"u\"]\n"
        )
    };
    let exact = 10.0 * 3.0_f64.ln() / (1e4 * 20.0);
    let nowhere = Path::new("");
    let found = end(&column("law = \"small-strain\"\nshear_modulus = 1e4"), nowhere)[1];
    // The displacement of quadratic elements at a node has an error of order h⁴, with h = 1/40; the stiffness varies
    // from 1 to 3.
    assert!((found / exact - 1.0).abs() < 1e-7, "{found} {exact}");
}

/// Checks that a nodal field that contains the modulus in Pa is equivalent to an expression multiplied by the constant.
#[test]
fn nodal_data_give_the_modulus() {
    let file = with_data(&mesh("muscle.msh"), "c10", |[x, ..]| Some([1e4 * (1.0 + 3.0 * x)]));
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("m.msh"), file).unwrap();
    let body = |c10: &str, factor: &str| {
        format!(
            "analysis = \"static\"\n[mesh]\n{FILE}\n[solid]\nbulk_modulus = 1e5\n[[material]]\n\
             law = \"mooney-rivlin\"\ndensity = 1e3\nc10 = {c10}\n{factor}\n\
             [[fixed]]\ngroup = \"fixed\"\n[[traction]]\ngroup = \"load\"\ny = -100.0\n\
             [[probe]]\nname = \"end\"\ntype = \"point\"\nat = [0.0, 0.02]\nquantities = [\"u\"]\n"
        )
    };
    let of = |c10: &str, factor: &str| end(&body(c10, factor), folder.path());
    let by_field = of("1.0", "spatial_factor = { field = \"c10\" }");
    let by_expression = of("1e4", "spatial_factor = \"1 + 3*x\"");
    let uniform = of("1e4", "");
    // This is the tolerance of the equilibrium.
    for (a, b) in by_field.iter().zip(&by_expression) {
        assert!((a - b).abs() < 1e-9 * by_field[2].abs(), "{by_field:?} {by_expression:?}");
    }
    assert!((uniform[2] / by_field[2] - 1.0).abs() > 1e-2, "{uniform:?}");
    for (factor, place) in [
        ("spatial_factor = \"x - 1\"", "line 11"),
        ("spatial_factor = { field = \"missing\" }", "line 11"),
        (
            "spatial_factor = \"1 + x\"\nprony = [{ relative_modulus = 0.5, relaxation_time = 1.0 }]",
            "line 11",
        ),
    ] {
        let refused = refusal(&body("1e4", factor), folder.path());
        assert!(refused.contains(place), "{factor}: {refused}");
    }
}

#[test]
fn volumes_are_those_of_the_materials() {
    // A sheet of 2 by 1 has cells with a length of 0.5; the group contains the first column.
    let group = "[[group]]\nname = \"part\"\ntype = \"box\"\nmembers = \"elements\"\nmin = [-1.0, -1.0]\n\
                 max = [0.5, 2.0]\n[[material]]\ngroup = \"part\"\nlaw = \"neo-hooke\"\ndensity = 2e3\n\
                 shear_modulus = 1e4\n";
    let scene = scene(&text(SHEET, "left", group), Path::new(""));
    let volumes = scene.body.unwrap().volumes(2);
    assert_eq!(volumes.len(), 2);
    assert!((volumes[0] - 1.5).abs() < 1e-12 && (volumes[1] - 0.5).abs() < 1e-12, "{volumes:?}");
}
