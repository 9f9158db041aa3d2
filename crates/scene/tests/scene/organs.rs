//! Meshes in the shape of organs, nearly incompressible and incompressible.

use std::f64::consts::PI;
use std::fs;

use crate::contact::{last, tables_in};
use crate::indentation::block;

/// Cells along each axis.
const CELLS: [usize; 3] = [3, 3, 4];

/// A map of the cube [−1, 1]³ to a body.
type Shape = fn([f64; 3]) -> [f64; 3];

/// Maps the cube [−1, 1]³ to a ball. At its edges, faces of an element meet in one plane.
fn ball(p: [f64; 3]) -> [f64; 3] {
    let largest = p.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
    let length = p.iter().map(|x| x * x).sum::<f64>().sqrt();
    // Between the cube and the ball, so that corners are not flat.
    let scale = if length > 0.0 { 0.3 + 0.7 * largest / length } else { 1.0 };
    p.map(|x| scale * x)
}

/// Bodies, held at the lower end and loaded sideways, deflect alike for any compressibility. The relative difference is of
/// the order of the ratio of the moduli, 1e-2.
#[test]
fn organs_deflect_alike_with_large_and_infinite_bulk_modulus() {
    let organs: [(&str, Shape); 6] = [
        ("eye", |p| ball(p).map(|x| 0.012 * x)),
        ("kidney", |p| {
            let [x, y, z] = ball(p);
            let (sin, cos) = (0.9 * z).sin_cos();
            let r = 0.06 + 0.025 * x;
            [r * cos, 0.02 * y, r * sin]
        }),
        ("artery", |[x, y, z]| {
            // Half of a tube with a bifurcation's bulge.
            let (sin, cos) = (0.5 * PI * x).sin_cos();
            let r = (0.003 + 0.0008 * y) * (1.0 + 0.2 * (PI * z).cos());
            [r * sin, r * cos, 0.01 * z]
        }),
        ("cornea", |[x, y, z]| {
            let r = 0.0078 + 0.0003 * (1.2 - x * x) * y;
            let (sin, cos) = (0.7 * x).sin_cos();
            let (s, c) = (0.7 * z).sin_cos();
            [r * sin * c, r * cos * c, r * s]
        }),
        ("liver", |p| {
            let [x, y, z] = ball(p);
            [0.1 * x, 0.04 * y * (1.2 - 0.6 * x), 0.08 * z * (1.1 - 0.3 * x)]
        }),
        ("muscle", |[x, y, z]| {
            // A twisted spindle.
            let (sin, cos) = (0.5 * z).sin_cos();
            let r = 0.02 * (1.3 - z * z);
            [r * (cos * x - sin * y), r * (sin * x + cos * y), 0.08 * z]
        }),
    ];
    for (name, shape) in organs {
        let folder = tempfile::tempdir().unwrap();
        let place =
            move |at: [usize; 3]| shape([0, 1, 2].map(|i| at[i] as f64 / CELLS[i] as f64 - 1.0));
        fs::write(folder.path().join("organ.msh"), block(CELLS, place)).unwrap();
        let [nearly, fully] = ["1e6", "inf"].map(|bulk_modulus| {
            let text = format!(
                "analysis = \"static\"\n[mesh]\ntype = \"file\"\npath = \"organ.msh\"\n[solid]\n\
                 bulk_modulus = {bulk_modulus}\n[[material]]\nlaw = \"neo-hooke\"\ndensity = 1e3\nshear_modulus = 1e4\n\
                 [[fixed]]\ngroup = \"bottom\"\n[[body_force]]\nx = 1.0\n\
                 [[probe]]\nname = \"top\"\ntype = \"average\"\ngroup = \"top\"\n"
            );
            let [top] = tables_in(&text, folder.path(), ["top"]);
            last(&top, "u_x")
        });
        let difference = (nearly / fully - 1.0).abs();
        assert!(fully > 0.0 && difference < 1e-2, "{name}: {fully:e} {difference:e}");
    }
}
