//! Planes of symmetry in any direction.

use std::fs;

use crate::contact::{last, tables_in};
use crate::lattice::Lattice;

/// Number of cells across the wall, and along an arc of 30°.
const CELLS: usize = 3;

/// Returns a 2D arc of a tube, of `wedges` times 30°, with radii of 10 and 20 mm. The meshes of neighboring wedges are
/// mirror images.
fn arc(wedges: usize) -> String {
    let mut lattice = Lattice::new(2, |[i, j]: [usize; 2]| {
        let [radius, angle] = [i, j].map(|i| i as f64 / (2 * CELLS) as f64);
        let (radius, angle) = (0.01 * (1.0 + radius), (30.0 * angle).to_radians());
        [radius * angle.cos(), radius * angle.sin(), 0.0]
    });
    let (mut inside, mut start, mut end, mut triangles) = (vec![], vec![], vec![], vec![]);
    let last = wedges * CELLS - 1;
    for (i, j) in (0..CELLS).flat_map(|i| (0..=last).map(move |j| (i, j))) {
        let [a, b, c, d] = [[0, 0], [2, 0], [2, 2], [0, 2]].map(|[x, y]| [2 * i + x, 2 * j + y]);
        let halves = match (j / CELLS) % 2 {
            0 => [[a, b, c], [a, c, d]],
            _ => [[a, b, d], [b, c, d]],
        };
        triangles.extend(halves.map(|corners| lattice.simplex(&corners)));
        for (group, is_own, side) in [
            (&mut inside, i == 0, [d, a]),
            (&mut start, j == 0, [a, b]),
            (&mut end, j == last, [c, d]),
        ] {
            if is_own {
                group.push(lattice.simplex(&side));
            }
        }
    }
    lattice.msh(&[("inside", inside), ("start", start), ("end", end), ("tube", triangles)])
}

/// Returns the displacement of the inner wall under internal pressure; `end` holds the second plane of symmetry.
fn expansion(wedges: usize, end: &str) -> f64 {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("tube.msh"), arc(wedges)).unwrap();
    let text = format!(
        "analysis = \"static\"\n[mesh]\ntype = \"file\"\npath = \"tube.msh\"\n[solid]\nbulk_modulus = inf\n\
         [[material]]\nlaw = \"neo-hooke\"\ndensity = 1e3\nshear_modulus = 1e4\n\
         [[pressure]]\ngroup = \"inside\"\nvalue = 3e3\n\
         [[fixed]]\ngroup = \"start\"\ncomponents = [\"y\"]\n{end}\n\
         [[probe]]\nname = \"inside\"\ntype = \"point\"\nat = [0.01, 0.0]\n"
    );
    let [table] = tables_in(&text, folder.path(), ["inside"]);
    last(&table, "u_x")
}

/// Compares a wedge with a quarter of the tube, which consists of three wedges, so that the oblique plane is the only
/// difference. This plane moves by σ/k with the stress σ normal to it, which moves a wedge of 30° by up to σ/(k sin
/// 30°) outward. On average, σ is the pressure, because the wall is as thick as the inner radius; at the inner wall, it
/// is below three times the pressure.
#[test]
fn a_stiff_foundation_normal_to_an_oblique_plane_is_a_plane_of_symmetry() {
    let exact = expansion(3, "[[fixed]]\ngroup = \"end\"\ncomponents = [\"x\"]");
    let errors = [1e9, 1e10, 1e11].map(|stiffness| {
        let end = format!(
            "[[elastic_foundation]]\ngroup = \"end\"\nalong = \"normal\"\nstiffness = {stiffness:e}"
        );
        let error = expansion(1, &end) / exact - 1.0;
        assert!(error.abs() < 3.0 * 3e3 / (0.5 * stiffness) / exact, "{stiffness:e}: {error:e}");
        error
    });
    // The error is proportional to 1/k; its square is below 1 %.
    for pair in errors.windows(2) {
        assert!((pair[0] / pair[1] / 10.0 - 1.0).abs() < 0.01, "{errors:?}");
    }
}
