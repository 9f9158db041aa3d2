//! Elastic bar behind a cylinder, bent by its weight: the structural tests CSM1 to CSM3 of Turek
//! and Hron (2006, "Proposal for numerical benchmarking of fluid-structure interaction", LNCSE 53),
//! with the St. Venant–Kirchhoff law.

use std::f64::consts::PI;

use myovib_scene::Scene;
use myovib_scene::csv::Table;
use myovib_scene::run::{RunOptions, compute};
use serde_json::Value;

const BAR: &str = r#"
analysis = "static"
[mesh]
type = "file"
path = "bar.msh"
[solid]
bulk_modulus = 1e6
formulation = "displacement"
[[material]]
law = "st-venant-kirchhoff"
density = 1e3
first_lame_parameter = 2e6
shear_modulus = 5e5
[[fixed]]
group = "left"
[[body_force]]
y = -2.0
[[probe]]
name = "end"
type = "point"
at = [0.6, 0.2]
quantities = ["u"]
"#;

/// Returns the vertices and midpoints of `n` intervals of [0, 1]. `graded` maps the vertices.
fn places(n: usize, graded: impl Fn(f64) -> f64) -> Vec<f64> {
    let vertex = |k: usize| graded(k as f64 / n as f64);
    let at = |i: usize| 0.5 * (vertex(i / 2) + vertex(i.div_ceil(2)));
    (0..=2 * n).map(at).collect()
}

/// Returns the mesh of the bar from the cylinder's arc, with center (0.2, 0.2) and radius 0.05, to
/// x = 0.6. The bar is 0.02 high. Each cell has two triangles of second order, whose nodes are on
/// the arc. Cells are smaller near the support, because stresses are infinite at its corners.
fn mesh([columns, rows]: [usize; 2]) -> String {
    let along = places(columns, |s| s * s);
    let across = places(rows, |s| 0.5 - 0.5 * (PI * s).cos());
    let (n, m) = (along.len(), across.len());
    let tag = |[i, j]: [usize; 2]| 1 + i + n * j;
    let place = |node: usize| {
        let up = 0.02 * (across[node / n] - 0.5);
        let arc = 0.2 + (0.05_f64.powi(2) - up * up).sqrt();
        let left = 1.0 - along[node % n];
        format!("{} {} 0\n", 0.6 - left * (0.6 - arc), 0.2 + up)
    };
    let places: String = (0..n * m).map(place).collect();
    let tags: String = (1..=n * m).map(|tag| format!("{tag}\n")).collect();
    let element = |number: usize, nodes: &[[usize; 2]]| {
        let nodes = nodes.iter().map(|&node| format!(" {}", tag(node)));
        format!("{number}{}\n", nodes.collect::<String>())
    };
    let line = |row: usize| [0, 2, 1].map(|j| [0, 2 * row + j]);
    let lines: String = (0..rows).map(|row| element(1 + row, &line(row))).collect();
    // The vertices are followed by the midpoints of the edges 01, 12 and 20.
    let halves = [
        [[0, 0], [2, 0], [2, 2], [1, 0], [2, 1], [1, 1]],
        [[0, 0], [2, 2], [0, 2], [1, 1], [1, 2], [0, 1]],
    ];
    let triangle = |half: usize| {
        let (column, row) = (half / 2 % columns, half / 2 / columns);
        let nodes = halves[half % 2].map(|[i, j]| [2 * column + i, 2 * row + j]);
        element(1 + rows + half, &nodes)
    };
    let n_triangles = 2 * columns * rows;
    let triangles: String = (0..n_triangles).map(triangle).collect();
    format!(
        "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n\
         $PhysicalNames\n2\n1 1 \"left\"\n2 2 \"body\"\n$EndPhysicalNames\n\
         $Entities\n0 1 1 0\n1 0 0 0 1 1 1 1 1 0\n1 0 0 0 1 1 1 1 2 0\n$EndEntities\n\
         $Nodes\n1 {0} 1 {0}\n2 1 0 {0}\n{tags}{places}$EndNodes\n\
         $Elements\n2 {1} 1 {1}\n1 1 8 {rows}\n{lines}2 1 9 {n_triangles}\n{triangles}$EndElements\n",
        n * m,
        rows + n_triangles
    )
}

/// Returns the document of the run on this mesh, and the rows of the point A at the end.
fn run(cells: [usize; 2], text: &str) -> (Value, Vec<Vec<f64>>) {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("bar.msh"), mesh(cells)).unwrap();
    let scene = Scene::build("scene.toml", text, &[], folder.path()).unwrap();
    let out = folder.path().join("out");
    let document = compute(&scene, &RunOptions::into_folder(&out)).unwrap().document;
    assert_eq!(document["outcome"], "finished");
    let table = Table::parse(&std::fs::read_to_string(out.join("end.csv")).unwrap()).unwrap();
    let rows = table.rows.iter().map(|row| table.numbers(row).unwrap());
    (document, rows.collect())
}

/// Checks CSM1, and CSM2 with four times the stiffness.
#[test]
fn the_weight_of_a_bar_bends_it_as_published() {
    let stiff = BAR
        .replace("first_lame_parameter = 2e6", "first_lame_parameter = 8e6")
        .replace("shear_modulus = 5e5", "shear_modulus = 2e6");
    // The tolerance is half of the last published digit. With a straight support, the deviation would be much larger:
    // at the ends of the arc, the bar is 1 mm longer, which changes the deflection by up to 1 %.
    for (text, expected, half_digits) in [
        (BAR, [-7.187e-3, -66.10e-3], [0.5e-6, 5e-6]),
        (&stiff, [-0.4690e-3, -16.97e-3], [0.5e-7, 5e-6]),
    ] {
        let (document, _) = run([64, 10], text);
        let found = ["u_x", "u_y"].map(|name| document["results"]["end"][name].as_f64().unwrap());
        for ((found, expected), allowed) in found.iter().zip(expected).zip(half_digits) {
            assert!((found - expected).abs() < allowed, "{found} {expected}");
        }
    }
}

/// Checks the pressure output of a law without a separate pressure: it is the negative mean stress, as for all laws
/// that separate isochoric and volumetric parts.
#[test]
fn the_pressure_of_a_law_without_one_is_the_mean_of_its_stress() {
    let text = BAR
        .replace("at = [0.6, 0.2]", "at = [0.3, 0.192]")
        .replace("[\"u\"]", "[\"p\", \"stress\"]");
    let (document, _) = run([16, 2], &text);
    let of = |name: &str| document["results"]["end"][name].as_f64().unwrap();
    let sum = of("stress_xx") + of("stress_yy") + of("stress_zz");
    // For a beam, 12 M y/h³ = 2.2e4 Pa with M = ρ g h L²/2, L = 0.3 m from the end and y = 8 mm
    // below the middle. With ν = 0.4, the mean is 1.4/3 of this stress.
    let bending = 12.0 * 0.5 * 40.0 * 0.3_f64.powi(2) * 0.008 / 0.02_f64.powi(3);
    let mean = 1.4 / 3.0 * bending;
    assert!(of("p") > 0.5 * mean && of("p") < 2.0 * mean, "{} {mean}", of("p"));
    assert!((of("p") + sum / 3.0).abs() < 8.0 * f64::EPSILON * sum.abs());
}

/// Checks CSM3, in which the bar is released from rest and swings without damping. The published mean and amplitude are
/// -63.607e-3 and 65.160e-3 with 1.0995 Hz for steps of 0.005 s. For steps of 0.02 s and a coarser mesh they are
/// -64.271e-3 and 64.595e-3 with 1.0956 Hz. The test compares the smallest u_y and the frequency. The largest u_y, 0 at
/// first, depends on the phase of faster modes.
#[test]
fn a_bar_let_go_swings_as_published() {
    let moving = BAR.replace(
        "analysis = \"static\"",
        "initial_state = { type = \"velocity\", value = [0.0, 0.0] }\n[time]\nend = 3.3\n\
         [integrator]\nmethod = \"radau9\"\nrtol = 1e-4",
    ) + "interval = 0.001\n";
    let (_, rows) = run([16, 4], &moving);
    // These are the minima of the first and of the fourth period.
    let least = [0, 3].map(|period| {
        let from = f64::from(period) / 1.0995;
        let of_period = rows.iter().filter(|row| (from..from + 0.6).contains(&row[0]));
        of_period.min_by(|a, b| a[2].total_cmp(&b[2])).unwrap()
    });
    let frequency = 3.0 / (least[1][0] - least[0][0]);
    // The tolerance of one percent is the difference between the published means.
    for (found, published) in [
        (least[0][2], -63.607e-3 - 65.160e-3),
        (least[1][2], -63.607e-3 - 65.160e-3),
        (frequency, 1.0995),
    ] {
        assert!((found / published - 1.0).abs() < 0.01, "{found} {published}");
    }
}
