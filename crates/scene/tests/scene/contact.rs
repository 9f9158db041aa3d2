//! Contact with rigid obstacles.

use std::fs;
use std::path::Path;

use myovib_scene::Scene;
use myovib_scene::csv::Table;
use myovib_scene::run::{RunOptions, compute};
use myovib_scene::sensitivity::{Unsupported, unsupported};

/// Returns the table of a probe of the scene.
fn table(text: &str, probe: &str) -> Table {
    let out = tempfile::tempdir().unwrap();
    let scene = Scene::build("scene.toml", text, &[], Path::new("")).unwrap();
    let run = compute(&scene, &RunOptions::into_folder(out.path())).unwrap();
    assert_eq!(
        run.document["outcome"], "finished",
        "{}",
        run.document["message"]
    );
    let file = out.path().join(format!("{probe}.csv"));
    Table::parse(&fs::read_to_string(file).unwrap()).unwrap()
}

/// Returns the values of a column.
fn column(table: &Table, name: &str) -> Vec<f64> {
    let position = table.names.iter().position(|own| own == name).unwrap();
    let rows = table.rows.iter();
    rows.map(|row| table.numbers(row).unwrap()[position])
        .collect()
}

/// Returns the last value of a column.
fn last(table: &Table, name: &str) -> f64 {
    *column(table, name).last().unwrap()
}

/// A block of 20 mm by 10 mm on rollers; plates without friction press it.
fn pressed(head: &str, contact: &str) -> String {
    format!(
        "{head}[mesh]\ntype = \"rectangle\"\nwidth = 0.02\nheight = 0.01\ncells = [6, 3]\n\
         [solid]\nbulk_modulus = inf\n[[material]]\nlaw = \"neo-hooke\"\ndensity = 1e3\nshear_modulus = 1e4\n\
         [[fixed]]\ngroup = \"bottom\"\ncomponents = [\"y\"]\n[[fixed]]\ngroup = \"left\"\ncomponents = [\"x\"]\n\
         [[contact]]\ngroup = \"top\"\ntype = \"plane\"\npoint = [0.0, 0.01]\nnormal = [0.0, -2.0]\n{contact}\n\
         [[probe]]\nname = \"plate\"\ntype = \"contact\"\ngroup = \"top\"\n\
         [[probe]]\nname = \"corner\"\ntype = \"point\"\nat = [0.02, 0.01]\n"
    )
}

/// The exact force per depth is ζ (λ − λ⁻³) b for the stretch λ of the block; the plate and the top
/// differ by the penetration. The state is homogeneous, so only the convergence of Newton's method remains.
#[test]
fn a_plate_compresses_a_block_by_the_exact_force() {
    for stiffness in ["", "stiffness = 1e9"] {
        let text = pressed(
            "analysis = \"static\"\n",
            &format!("y = -0.002\n{stiffness}"),
        );
        let (plate, corner) = (table(&text, "plate"), table(&text, "corner"));
        let (top, penetration) = (last(&corner, "u_y"), last(&plate, "penetration"));
        assert!((top - penetration + 0.002).abs() < 1e-12);
        let stretch = 1.0 + top / 0.01;
        let exact = 1e4 * (stretch - stretch.powi(-3)) * 0.02;
        assert!((last(&plate, "F_y") - exact).abs() < 1e-8 * exact.abs());
        assert!((last(&plate, "area") - 0.02).abs() < 1e-12);
        // A hundredth of the facet at a pressure of one shear modulus; here it is 1.2 shear moduli.
        assert!(
            (0.0..1.3e-2 * 0.02 / 6.0).contains(&penetration),
            "{penetration}"
        );
    }
}

/// Hertz: a rigid cylinder of radius R presses on an incompressible half-space with the largest pressure
/// √(4 G F/(π R)). The block is 20 half-widths of the contact high and wide, which changes the pressure by the square of their
/// ratio; the mesh has six facets across the contact.
#[test]
fn a_cylinder_presses_like_hertz() {
    let (modulus, radius, stiffness) = (1e4, 0.05, 1e9);
    let text = format!(
        "analysis = \"static\"\n[mesh]\ntype = \"rectangle\"\nwidth = 0.1\nheight = 0.1\ncells = [60, 60]\n\
         [solid]\nbulk_modulus = inf\n[[material]]\nlaw = \"small-strain\"\ndensity = 1e3\nshear_modulus = {modulus}\n\
         [[fixed]]\ngroup = \"bottom\"\n[[fixed]]\ngroup = \"left\"\ncomponents = [\"x\"]\n\
         [[contact]]\ngroup = \"top\"\ntype = \"sphere\"\ncenter = [0.0, {}]\nradius = {radius}\nstiffness = {stiffness}\ny = -0.0008\n\
         [[probe]]\nname = \"indenter\"\ntype = \"contact\"\ngroup = \"top\"\n",
        0.1 + radius
    );
    let indenter = table(&text, "indenter");
    // The model is one half.
    let force = -2.0 * last(&indenter, "F_y");
    let half_width = (force * radius / (std::f64::consts::PI * modulus)).sqrt();
    let exact = 2.0 * force / (std::f64::consts::PI * half_width);
    let smoothing = 1e-3 * 0.1 / 60.0;
    let largest = stiffness * (last(&indenter, "penetration") - 0.5 * smoothing);
    assert!((last(&indenter, "area") / half_width - 1.0).abs() < 0.15);
    assert!((largest / exact - 1.0).abs() < 0.02, "{largest} {exact}");
}

/// A block that falls on a plate and bounces keeps its energy: kinetic and elastic energy change by the work of
/// the plate, which is zero when the block has left.
#[test]
fn a_block_that_bounces_keeps_its_energy() {
    let text = "[time]\nend = 0.06\n[initial_state]\ntype = \"velocity\"\nvalue = [0.0, -0.3]\n\
         [mesh]\ntype = \"rectangle\"\nwidth = 0.02\nheight = 0.02\ncells = [4, 4]\n\
         [solid]\nbulk_modulus = 1e5\n[[material]]\nlaw = \"neo-hooke\"\ndensity = 1e3\nshear_modulus = 1e4\n\
         [[contact]]\ngroup = \"bottom\"\ntype = \"plane\"\npoint = [0.0, -0.001]\nnormal = [0.0, 1.0]\n\
         [[probe]]\nname = \"energy\"\ntype = \"energy\"\ninterval = 0.001\n\
         [[probe]]\nname = \"plate\"\ntype = \"contact\"\ngroup = \"bottom\"\ninterval = 0.001\n\
         [integrator]\nmethod = \"radau9\"\nrtol = 1e-5\n";
    let (energy, plate) = (table(text, "energy"), table(text, "plate"));
    let force = column(&plate, "F_y");
    let largest = force.iter().fold(0.0_f64, |m, f| m.max(*f));
    assert!(largest > 10.0 && force[0] == 0.0 && *force.last().unwrap() == 0.0);
    let kinetic = column(&energy, "kinetic")[0];
    // The tolerance for displacements and velocities, times the number of oscillations in contact.
    let imbalance = last(&energy, "imbalance").abs();
    assert!(imbalance < 1e-3 * kinetic, "{imbalance} {kinetic}");
    let total = last(&energy, "kinetic") + last(&energy, "elastic");
    assert!(
        (total - kinetic).abs() < 1e-3 * kinetic,
        "{total} {kinetic}"
    );
}

/// Regression: the default stiffness followed a parameter in the reading of the contact force, but not in the equations, and
/// the derivative of the force was twice the difference quotient.
#[test]
fn sensitivities_need_a_given_contact_stiffness() {
    let scene = |contact: &str| {
        let text = pressed("[time]\nend = 1.0\n", contact);
        Scene::build("scene.toml", &text, &[], Path::new("")).unwrap()
    };
    let (feature, key) = unsupported(&scene("")).unwrap();
    assert_eq!(
        (feature, &*key),
        (Unsupported::ContactStiffness, "contact[0]")
    );
    assert!(unsupported(&scene("stiffness = 1e8")).is_none());
}

/// Checks that a contact that is incompatible with the mesh gives one error, with its key.
#[test]
fn obstacles_that_do_not_fit_are_rejected() {
    let text = pressed("[time]\nend = 1.0\n", "");
    for (set, key) in [
        ("contact[0].normal=[0.0,0.0]", "contact[0].normal"),
        ("contact[0].point=[0.0,0.0,1.0]", "contact[0].point"),
        ("contact[0].z=1.0", "contact[0].z"),
        ("contact[0].group=\"nowhere\"", "contact[0].group"),
        ("contact[0].stiffness=-1.0", "contact[0].stiffness"),
        ("probe[0].group=\"left\"", "probe[0].group"),
    ] {
        let error =
            Scene::build("scene.toml", &text, &[set.to_owned()], Path::new("")).unwrap_err();
        assert!(error.to_string().contains(key), "{set}: {error}");
    }
}
