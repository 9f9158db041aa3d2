//! Chains at many places of a body: forcing, output and error messages.

use std::f64::consts::TAU;
use std::path::Path;

use myovib_oscillators::{Coherence, coherence_at};
use myovib_scene::run::{RunOptions, compute};
use myovib_scene::{DrivenChain, Error, Scene, vtu};

/// A box under a body force along x. It can only move along x, without strain.
const BOX: &str = r#"
[time]
end = 0.3
[mesh]
type = "box"
size = [0.2, 0.1, 0.1]
cells = [2, 1, 1]
[solid]
bulk_modulus = 1e5
[[material]]
law = "mooney-rivlin"
density = 1e3
c10 = 1e4
fiber = [1.0, 1.0, 0.0]
[[fixed]]
group = "body"
components = ["y", "z"]
[[body_force]]
x = { type = "sine", amplitude = 40.0, frequency = 3.0 }
[integrator]
method = "radau5"
rtol = 1e-8
atol = { u = 1e-11, v = 1e-9, p = 1e-3 }
oscillators = { rtol = 1e-8, atol = 1e-10 }
"#;

/// Returns a chain with one undamped, uncoupled oscillator at each place.
fn single(name: &str, at: &str, component: &str) -> String {
    format!(
        "[[chain]]\nname = \"{name}\"\nat = {at}\ncomponent = {component}\noscillators = 1\n\
         frequency_spread = 0.6366197723675814\nvan_der_pol = 0.0\ncoupling = 0.0\ngain = 30.0\n\
         [[probe]]\nname = \"{name}\"\ntype = \"oscillators\"\nchain = \"{name}\"\ninterval = 0.3\n"
    )
}

fn build(text: &str) -> Scene {
    Scene::build("scene.toml", text, &[], Path::new("")).unwrap()
}

fn refusal(text: &str) -> String {
    match Scene::build("scene.toml", text, &[], Path::new("")) {
        Ok(_) => "accepted".to_owned(),
        Err(error) => error.to_string(),
    }
}

/// Runs a scene in a folder.
fn run(scene: &Scene) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let document = compute(scene, &RunOptions::into_folder(folder.path())).unwrap().document;
    assert_eq!(document["outcome"], "finished");
    folder
}

/// Returns positions and velocities of the chain `name` at the last time, from the probe of that
/// name.
fn states(folder: &Path, name: &str) -> [Vec<f64>; 2] {
    let text = std::fs::read_to_string(folder.join(format!("{name}.csv"))).unwrap();
    let row = text.lines().last().unwrap().split(',').skip(1);
    let row: Vec<f64> = row.map(|number| number.parse().unwrap()).collect();
    let (y, w) = row.split_at(row.len() / 2);
    [y.to_vec(), w.to_vec()]
}

/// Returns y(t) of ÿ + ω² y + γ d u = 0 from rest, for u = A t - B sin Ωt.
fn response(omega: f64, forcing: f64, t: f64) -> f64 {
    let drive = TAU * 3.0;
    let [a, b] = [40.0 / drive, 40.0 / drive.powi(2)];
    let to_ramp = (t - (omega * t).sin() / omega) / omega.powi(2);
    let to_sine =
        ((drive * t).sin() - drive / omega * (omega * t).sin()) / (omega.powi(2) - drive.powi(2));
    -forcing * (a * to_ramp - b * to_sine)
}

/// Checks that in a rigid motion, each oscillator has the closed-form response of its frequency and
/// direction at every position.
#[test]
fn oscillators_in_a_rigid_motion_have_the_response_in_closed_form() {
    let inside = "{ from = [-0.05, 0.05, 0.03], to = [0.25, 0.05, 0.03], points = [4, 1, 1] }";
    let chains = [
        ("list", "[[0.0, 0.0, 0.0], [0.13, 0.02, 0.07]]", "\"x\"", 2, 1.0),
        ("grid", inside, "[3.0, 0.0, 4.0]", 2, 0.6),
        ("corners", "{ vertices = \"right\" }", "\"x\"", 4, 1.0),
        ("all", "{ vertices = \"body\" }", "\"fiber\"", 12, 0.5_f64.sqrt()),
        ("cells", "{ elements = \"body\" }", "\"fiber\"", 12, 0.5_f64.sqrt()),
        ("across", "[[0.1, 0.0, 0.0]]", "\"z\"", 1, 0.0),
    ];
    let text = chains.map(|(name, at, component, ..)| single(name, at, component));
    let scene = build(&(BOX.to_owned() + &text.concat()));
    let folder = run(&scene);
    for (chain, (name, _, _, places, along)) in scene.chains.iter().zip(chains) {
        assert_eq!(chain.places.len(), places, "{name}");
        let [y, _] = states(folder.path(), name);
        for (y, omega) in y.iter().zip(&chain.chain.omega) {
            let exact = response(*omega, 30.0 * along, 0.3);
            let size = response(*omega, 30.0, 0.3);
            // The error is at most a hundred times the tolerance, because the errors of about a hundred steps
            // accumulate.
            assert!((y - exact).abs() < 1e-6 * size.abs(), "{name}: {y} {exact}");
        }
        // All places share one seed, and each frequency is unique.
        let mut omega = chain.chain.omega.clone();
        omega.sort_by(f64::total_cmp);
        assert!(omega.windows(2).all(|pair| pair[0] < pair[1]), "{name}");
    }
    assert_eq!(scene.notes(), ["chain `grid`: 2 of the 4 grid points are in the body"]);
}

#[test]
fn a_grid_and_a_list_of_one_point_are_that_point_bit_by_bit() {
    let box_of_one = "{ from = [0.0, 0.02, 0.1], to = [0.1, 0.02, 0.0], points = [1, 1, 1] }";
    let same = [
        ("[0.05, 0.02, 0.05]", "\"x\""),
        ("[[0.05, 0.02, 0.05]]", "\"x\""),
        (box_of_one, "\"x\""),
        ("[[0.05, 0.02, 0.05]]", "[7.0, 0.0, 0.0]"),
    ];
    let tables = same.map(|(at, component)| {
        let folder = run(&build(&(BOX.to_owned() + &single("one", at, component))));
        std::fs::read_to_string(folder.path().join("one.csv")).unwrap()
    });
    assert!(tables[0].lines().count() > 1);
    assert!(tables.iter().all(|table| *table == tables[0]));
}

/// A bending muscle, with an oscillator at each vertex of its belly and in each of its elements.
const MUSCLE: &str = r#"
[time]
end = 0.06
[mesh]
type = "muscle3d"
cells = [10, 2, 2]
[solid]
bulk_modulus = 1e5
[[material]]
group = "muscle"
law = "mooney-rivlin"
density = 1e3
c10 = 1e4
fiber = "fiber"
[[material]]
group = "tendon"
law = "mooney-rivlin"
density = 1e3
c10 = 1e5
[[fixed]]
group = "left"
[[traction]]
group = "right"
y = { type = "step", value = 100.0, rise = 0.03 }
[[chain]]
name = "nodes"
at = { vertices = "muscle" }
component = "fiber"
oscillators = 1
frequency_spread = 3.183098861837907
gain = 4e6
coherence_radius = 0.025
[[chain]]
name = "cells"
at = { elements = "muscle" }
oscillators = 3
frequency_spread = 3.183098861837907
gain = 4e5
coherence_radius = 0.025
[[chain]]
name = "pair"
at = [[0.0, 0.0, 0.0], [0.01, 0.0, 0.0]]
oscillators = 2
frequency_spread = 3.183098861837907
gain = 4e5
[fields]
interval = 0.06
quantities = ["u"]
[[probe]]
name = "nodes"
type = "oscillators"
chain = "nodes"
interval = 0.06
[[probe]]
name = "cells"
type = "oscillators"
chain = "cells"
interval = 0.06
"#;

/// Returns Ψ and χ of each place of a chain, from its probe.
fn of_places(folder: &Path, chain: &DrivenChain) -> Vec<Coherence> {
    let [y, w] = states(folder, &chain.name);
    coherence_at(chain.places.len(), &chain.chain.omega, &y, &w)
}

/// Returns the coherence of the places within a distance of each place, by a search over all
/// places.
fn neighborhoods(points: &[[f64; 3]], found: &[Coherence], radius: f64) -> Vec<f64> {
    let distance = |a: &[f64; 3], b: &[f64; 3]| -> f64 {
        let squares = a.iter().zip(b).map(|(a, b)| (a - b).powi(2));
        squares.sum::<f64>().sqrt()
    };
    let around = |point: &[f64; 3]| {
        let near = points.iter().zip(found);
        let near: Vec<_> = near
            .filter(|(other, _)| distance(point, other) < radius)
            .map(|(_, of)| of.phase)
            .collect();
        let [re, im] = [0, 1].map(|part| {
            let parts = near.iter().map(|chi| [chi.re, chi.im][part]);
            parts.sum::<f64>() / near.len() as f64
        });
        re.hypot(im)
    };
    points.iter().map(around).collect()
}

fn assert_near(found: &[f64], expected: &[f64], what: &str) {
    assert_eq!(found.len(), expected.len(), "{what}");
    for (a, b) in found.iter().zip(expected) {
        // The tolerance covers sums of up to about a hundred numbers of size 1 in another order.
        assert!((a - b).abs() < 1e-13 * b.abs().max(1.0), "{what}: {a} {b}");
    }
}

/// Regression test: a foreign file with the name of the second list was found after the first field files were written.
#[test]
fn foreign_lists_of_fields_are_found_before_anything_is_written() {
    let scene = build(MUSCLE);
    for list in [vtu::LIST, vtu::PLACES_LIST] {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join(list), "mine").unwrap();
        let refused = compute(&scene, &RunOptions::into_folder(folder.path()));
        assert!(matches!(refused, Err(Error::Input(_))), "{list}");
        let entries = std::fs::read_dir(folder.path()).unwrap();
        let names: Vec<_> = entries.map(|entry| entry.unwrap().file_name()).collect();
        assert_eq!(names, [list]);
    }
}

#[test]
fn fields_have_the_coherence_of_places_and_of_their_neighborhoods() {
    let scene = build(MUSCLE);
    let space = scene.body.as_ref().unwrap().muscle.solid.space();
    let folder = run(&scene);
    let read = |file: &str| std::fs::read_to_string(folder.path().join(file)).unwrap();
    let [nodes, cells, pair] = &scene.chains[..] else { panic!("three chains") };

    // The file contains separate points for both chains outside elements, one chain after the other.
    let places = read("places_00001.vtu");
    assert!(read("places.pvd").contains("places_00001.vtu"));
    let points = vtu::read_field(&places, "points").unwrap();
    let points: Vec<[f64; 3]> = points.as_chunks().0.to_vec();
    let n = nodes.places.len();
    assert_eq!(points.len(), n + pair.places.len());
    // The tolerance covers the rounding of coordinates below 0.1.
    assert_near(points[n..].as_flattened(), &[0.0, 0.0, 0.0, 0.01, 0.0, 0.0], "points");
    let vertices: Vec<[f64; 3]> = space.mesh().points::<3>().to_vec();
    assert!(points[..n].iter().all(|point| vertices.contains(point)));
    let of = |name: &str| vtu::read_field(&places, name).unwrap();
    let found = of_places(folder.path(), nodes);
    let moduli: Vec<f64> = found.iter().map(|place| place.centroid.norm()).collect();
    assert_near(&of("amplitude")[..n], &moduli, "amplitude");
    // A single oscillator is always coherent, so only the coherence of the neighborhood is meaningful.
    assert_near(&of("coherence")[..n], &vec![1.0; n], "coherence");
    let expected = neighborhoods(&points[..n], &found, 0.025);
    assert_near(&of("neighborhood")[..n], &expected, "neighborhood");
    assert!(expected.iter().any(|chi| *chi < 0.9), "{expected:?}");
    assert!(of("neighborhood")[n..].iter().all(|chi| chi.is_nan()));
    assert_eq!(of("u").len(), 3 * points.len());

    // The file contains fields on the elements, in addition to the coherence of each element.
    let fields = read("fields_00001.vtu");
    let of = |name: &str| {
        let field = vtu::read_field(&fields, name).unwrap();
        let own = cells.places.iter().map(|place| field[place.at.element]);
        own.collect::<Vec<f64>>()
    };
    let found = of_places(folder.path(), cells);
    let middles: Vec<[f64; 3]> = cells
        .places
        .iter()
        .map(|place| {
            let corners = space.mesh().corners::<3, 4>(place.at.element);
            [0, 1, 2].map(|axis| corners.iter().map(|corner| corner[axis]).sum::<f64>() / 4.0)
        })
        .collect();
    let coherence: Vec<f64> = found.iter().map(|place| place.phase.norm()).collect();
    assert_near(&of("coherence_cells"), &coherence, "coherence of cells");
    let amplitude: Vec<f64> = found.iter().map(|place| place.centroid.norm()).collect();
    assert_near(&of("amplitude_cells"), &amplitude, "amplitude of cells");
    let expected = neighborhoods(&middles, &found, 0.025);
    assert_near(&of("neighborhood_cells"), &expected, "around cells");
    assert!(vtu::read_field(&fields, "coherence_nodes").is_none());
}

/// Checks places in 2D with directions along the fibers.
#[test]
fn places_in_the_plane_have_two_coordinates() {
    let text = r#"
[time]
end = 0.1
[mesh]
type = "rectangle"
width = 0.2
height = 0.1
cells = [4, 2]
[solid]
bulk_modulus = 1e5
[[material]]
law = "mooney-rivlin"
density = 1e3
c10 = 1e4
fiber = [0.0, 1.0]
[[fixed]]
group = "left"
[[traction]]
group = "right"
y = { type = "step", value = 100.0, rise = 0.05 }
"#;
    let grid = "{ from = [0.0, 0.0], to = [0.2, 0.1], points = [3, 2] }";
    let both = single("fiber", grid, "\"fiber\"") + &single("y", grid, "\"y\"");
    let scene = build(&(text.to_owned() + &both.replace("interval = 0.3", "interval = 0.1")));
    let point = |i: usize| {
        let at = &scene.chains[0].places[i].at;
        let space = scene.body.as_ref().unwrap().muscle.solid.space();
        space.position::<2>(at)
    };
    // The x coordinate varies fastest.
    let expected = [[0.0, 0.0], [0.1, 0.0], [0.2, 0.0], [0.0, 0.1], [0.1, 0.1], [0.2, 0.1]];
    for (i, expected) in expected.into_iter().enumerate() {
        let distance = (point(i)[0] - expected[0]).hypot(point(i)[1] - expected[1]);
        assert!(distance < 1e-12, "{:?}", point(i)); // a thousand times the rounding error of 0.2
    }
    let folder = run(&scene);
    let [along, across] = ["fiber", "y"].map(|name| states(folder.path(), name));
    assert_eq!(along, across);
    // The support does not move.
    assert_eq!((along[0][0], along[0][3]), (0.0, 0.0));
    assert!(along[0][2] != 0.0);
}

#[test]
fn invalid_places_and_directions_are_rejected() {
    let feedback = "[[feedback]]\nchain = \"nodes\"\nat_zero_coherence = 1.5\n[fields]";
    for (from, to, messages) in [
        ("vertices = \"muscle\"", "vertices = \"muscles\"", ["no group `muscles`", "muscle"]),
        ("vertices = \"muscle\"", "vertexes = \"muscle\"", ["has no key `vertexes`", "`vertices`"]),
        (
            "{ vertices = \"muscle\" }",
            "{ from = [1.0, 0.0, 0.0], to = [2.0, 0.0, 0.0], points = [3, 1, 1] }",
            ["no grid point is in the body", "3 points"],
        ),
        (
            "{ vertices = \"muscle\" }",
            "{ from = [0.0, 0.0], to = [0.1, 0.0], points = [3, 1] }",
            ["one number for each axis", "2 numbers"],
        ),
        (
            "{ vertices = \"muscle\" }",
            "{ from = [0.0, 0.0, 0.0], to = [0.1, 0.0, 0.0], points = [1000, 1000, 1000] }",
            ["too many points", "1000000000"],
        ),
        (
            "{ vertices = \"muscle\" }",
            "{ from = [0.0, 0.0, 0.0], to = [0.1, 0.0, 0.0], points = [0, 1, 1] }",
            ["points[0]", "at least 1"],
        ),
        (
            "[[0.0, 0.0, 0.0], [0.01, 0.0, 0.0]]",
            "[[0.0, 0.0, 0.0], [0.01, 7.0, 0.0]]",
            ["(0.01, 7, 0) is outside the mesh", "[0.01, 7.0, 0.0]"],
        ),
        (
            "[[0.0, 0.0, 0.0], [0.01, 0.0, 0.0]]",
            "[[0.0, 0.0, 0.0], [0.01, 0.0]]",
            ["3 coordinates, not 2", "at"],
        ),
        (
            "component = \"fiber\"",
            "component = \"fibers\"",
            ["unknown name", "did you mean `fiber`"],
        ),
        (
            "component = \"fiber\"",
            "component = [0.0, 0.0, 0.0]",
            ["a direction cannot be zero", "component"],
        ),
        ("component = \"fiber\"", "component = [1.0, 0.0]", ["three components", "component"]),
        ("component = \"fiber\"", "component = [1e200, 0.0, 1e200]", ["implausible", "component"]),
        ("fiber = \"fiber\"", "", ["no fibers at", "give `fiber`"]),
        (
            "at = { elements = \"muscle\" }",
            "at = [[0.0, 0.0, 0.0], [0.09, 0.0, 0.0]]\ncomponent = \"fiber\"",
            ["has no fibers", "0.09"],
        ),
        (
            "coherence_radius = 0.025",
            "coherence_radius = 0.0",
            ["coherence_radius", "greater than 0"],
        ),
        (
            "[fields]\ninterval = 0.06\nquantities = [\"u\"]",
            "",
            ["and [fields]", "coherence_radius"],
        ),
        (
            "at = { elements = \"muscle\" }",
            "at = [0.0, 0.0, 0.0]",
            ["at several positions", "coherence_radius"],
        ),
        ("[fields]", feedback, ["`nodes` at several points", "elements = \"group\""]),
    ] {
        assert!(MUSCLE.contains(from), "{from}");
        let found = refusal(&MUSCLE.replacen(from, to, 1));
        for message in messages {
            assert!(found.contains(message), "{to}: {found}");
        }
    }
    // The region contains all elements of the group.
    let region =
        "[[region]]\nname = \"all\"\ncenter = [0.0, 0.0, 0.0]\nradii = [9.0, 9.0, 9.0]\n[solid]";
    let text = BOX.replacen("group = \"body\"", "group = \"left\"", 1);
    let text =
        text.replacen("[solid]", region, 1) + &single("v", "{ vertices = \"body\" }", "\"x\"");
    let found = refusal(&text);
    assert!(found.contains("`body`"), "{found}");
}
