//! Force–displacement curves: given load factors, and limit points passed by arc length.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use myovib_model::EndReason;
use myovib_scene::Scene;
use myovib_scene::csv::Table;
use myovib_scene::run::{RunOptions, RunResult, compute};

use crate::lattice::Lattice;

/// Runs a scene and returns the columns of its probe `probe`.
fn run(text: &str, folder: &Path, probe: &str) -> (RunResult, BTreeMap<String, Vec<f64>>) {
    let scene = Scene::build("scene.toml", text, &[], folder).unwrap();
    let out = tempfile::tempdir().unwrap();
    let found = compute(&scene, &RunOptions::into_folder(out.path())).unwrap();
    let csv = fs::read_to_string(out.path().join(format!("{probe}.csv"))).unwrap();
    let table = Table::parse(&csv).unwrap();
    let rows: Vec<Vec<f64>> = table.rows.iter().map(|row| table.numbers(row).unwrap()).collect();
    let names = table.names.iter().enumerate();
    let columns = names.map(|(j, name)| (name.clone(), rows.iter().map(|row| row[j]).collect()));
    (found, columns.collect())
}

/// Half the number of cells of the arch along its length and across its thickness.
const CELLS: [usize; 2] = [32, 2];

/// Returns a circular arch with a span of 100 mm, a rise of 15 mm and a thickness of 4 mm. It is clamped at both ends
/// and loaded over 4 mm at its crown.
fn arch() -> String {
    let mut lattice = Lattice::new(2, |[i, j]: [usize; 2]| {
        let (s, h, t) = (0.05_f64, 0.015, 0.004);
        let radius = (s * s + h * h) / (2.0 * h);
        let (whole, crown) = ((s / radius).asin(), 0.002 / radius);
        // The two cells next to the middle cover the loaded strip.
        let n = 2 * CELLS[0] as i64;
        let i = i as i64 - n;
        let angle = match i.abs() {
            ..=2 => crown * i as f64 / 2.0,
            _ => {
                let part = (i.abs() - 2) as f64 / (n - 2) as f64;
                (crown + (whole - crown) * part).copysign(i as f64)
            }
        };
        let r = radius + t * (j as f64 / (2 * CELLS[1]) as f64 - 0.5);
        [r * angle.sin(), r * angle.cos() + h - radius, 0.0]
    });
    let [nx, ny] = [2 * CELLS[0], CELLS[1]];
    let (mut ends, mut crown, mut triangles) = (Vec::new(), Vec::new(), Vec::new());
    for (i, j) in (0..nx).flat_map(|i| (0..ny).map(move |j| (i, j))) {
        let [a, b, c, d] = [[0, 0], [2, 0], [2, 2], [0, 2]].map(|[x, y]| [2 * i + x, 2 * j + y]);
        // The triangles are symmetric about the crown.
        let halves = match i < nx / 2 {
            true => [[a, b, c], [a, c, d]],
            false => [[a, b, d], [b, c, d]],
        };
        triangles.extend(halves.map(|corners| lattice.simplex(&corners)));
        if i == 0 {
            ends.push(lattice.simplex(&[a, d]));
        }
        if i == nx - 1 {
            ends.push(lattice.simplex(&[b, c]));
        }
        if j == ny - 1 && (nx / 2 - 1..=nx / 2).contains(&i) {
            crown.push(lattice.simplex(&[c, d]));
        }
    }
    lattice.msh(&[("ends", ends), ("crown", crown), ("arch", triangles)])
}

/// Runs the arch under a load at its crown, with the given loading path.
fn loaded_arch(path: &str, load: &str, probe: &str) -> (RunResult, BTreeMap<String, Vec<f64>>) {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("arch.msh"), arch()).unwrap();
    let text = format!(
        "analysis = \"static\"\n[static]\n{path}\n[mesh]\ntype = \"file\"\npath = \"arch.msh\"\n[solid]\n\
         bulk_modulus = inf\n[[material]]\nlaw = \"neo-hooke\"\nshear_modulus = 1e5\ndensity = 1e3\n[[fixed]]\n\
         group = \"ends\"\n{load}[[probe]]\nname = \"crown\"\n{probe}group = \"crown\"\n"
    );
    run(&text, folder.path(), "crown")
}

/// Checks snap-through with a prescribed displacement of the crown. Another program (FElupe, biquadratic
/// quadrilaterals) gives a peak of 6.019 N/m and a valley of 3.212 N/m.
#[test]
fn a_shallow_arch_has_the_published_peak_and_valley() {
    let moved = "[[prescribed_displacement]]\ngroup = \"crown\"\ny = -0.03\n";
    let (found, curve) = loaded_arch("steps = 40", moved, "type = \"reaction\"\n");
    assert_eq!(found.document["path"].as_array().unwrap().len(), 41);
    let force: Vec<f64> = curve["R_y"].iter().map(|force| -force).collect();
    let peak = force[..20].iter().copied().fold(0.0, f64::max);
    let valley = force[10..].iter().copied().fold(peak, f64::min);
    // The tolerance of half a percent covers the mesh error and the distance of a row from the extremum.
    assert!((peak / 6.019 - 1.0).abs() < 5e-3, "{peak}");
    assert!((valley / 3.212 - 1.0).abs() < 5e-3, "{valley}");
}

/// Checks that loads below the limit load found by arc length are reached, and loads above it are not.
#[test]
fn a_shallow_arch_snaps_through_under_its_load() {
    let load = |factor: f64| format!("[[traction]]\ngroup = \"crown\"\ny = {}\n", -2e3 * factor);
    let average = "type = \"average\"\nquantities = [\"u\"]\n";
    let arc = "method = \"arc-length\"\nsteps = 40";
    let (found, curve) = loaded_arch(arc, &load(1.0), average);
    assert_eq!(found.document["load_reached"], 1.0);
    let points = found.document["critical_points"].as_array().unwrap().iter();
    let points: Vec<_> = points
        .map(|point| (point["type"].as_str().unwrap(), point["loads"][0].as_f64().unwrap()))
        .collect();
    let [("limit", peak), ("limit", valley)] = points[..] else {
        panic!("{points:?}");
    };
    assert!(valley < peak);
    for extremum in [peak, valley] {
        assert!(curve["load"].contains(&extremum));
    }
    let states = found.document["path"].as_array().unwrap();
    let unstable = states.iter().filter(|state| state["instabilities"] == 1);
    let between = curve["u_y"].windows(2).zip(curve["load"].windows(2));
    let falling = between.filter(|(_, load)| load[1] < load[0]).count();
    // The states between the two limit points are unstable.
    assert_eq!(unstable.count(), falling - 1);
    for (part, reached) in [(0.999, true), (1.001, false)] {
        let (found, _) = loaded_arch("steps = 1", &load(part * peak), average);
        let end = found.document["load_reached"].as_f64().unwrap();
        assert_eq!(end == 1.0, reached, "{part}: {end}");
    }
}

/// Regression: an arc-length path that ended early counted as finished.
#[test]
fn a_path_by_arc_length_with_too_few_steps_is_not_finished() {
    let load = "[[traction]]\ngroup = \"crown\"\ny = -2e3\n";
    let average = "type = \"average\"\nquantities = [\"u\"]\n";
    let (found, curve) = loaded_arch("method = \"arc-length\"\nsteps = 3", load, average);
    assert_eq!(found.outcome.reason(), Some(EndReason::MaxSteps));
    let last = curve["load"].last().unwrap();
    assert!(*last < 1.0);
    assert_eq!(found.document["load_reached"], *last);
}

/// Returns the stretch at which a block of neo-Hooke's law between smooth plates buckles in plane strain. `a` is π/2 times the
/// ratio of its thickness to its length. The condition is due to Biot (Mechanics of Incremental Deformations, 1965).
fn buckling_stretch(a: f64) -> f64 {
    let is_stable = |square: f64| {
        (1.0 + square * square).powi(2) * (a / square).tanh() > 4.0 * square * a.tanh()
    };
    let (mut low, mut high) = (0.3, 1.0 - 1e-3);
    assert!(is_stable(high) != is_stable(low));
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        match is_stable(middle) == is_stable(low) {
            true => low = middle,
            false => high = middle,
        }
    }
    low.sqrt()
}

/// Checks that the path of homogeneous states meets the branch of bent states. The bifurcation load is exact up to the mesh error,
/// which is below 0.2 %.
#[test]
fn a_block_between_plates_buckles_at_the_published_stretch() {
    for thickness in [0.02, 0.04] {
        let stretch = buckling_stretch(std::f64::consts::FRAC_PI_2 * thickness / 0.1);
        let text = format!(
            "analysis = \"static\"\n[static]\nloads = [0.5, 0.998, 1.002, 1.01]\n[mesh]\ntype = \"rectangle\"\nwidth = {thickness}\n\
             height = 0.1\ncells = [4, 16]\n[solid]\nbulk_modulus = inf\n[[material]]\nlaw = \"neo-hooke\"\ndensity = 1e3\n\
             shear_modulus = 1e4\n[[group]]\nname = \"corner\"\nmembers = \"points\"\ntype = \"sphere\"\ncenter = [0.0, 0.0]\n\
             radius = 1e-9\n[[fixed]]\ngroup = \"corner\"\ncomponents = [\"x\"]\n[[fixed]]\ngroup = \"bottom\"\ncomponents = [\"y\"]\n\
             [[prescribed_displacement]]\ngroup = \"top\"\ny = {}\n[[probe]]\nname = \"force\"\ntype = \"reaction\"\ngroup = \"top\"\n",
            0.1 * (stretch - 1.0)
        );
        let (found, curve) = run(&text, Path::new(""), "force");
        let points = found.document["critical_points"].as_array().unwrap();
        assert_eq!(points.len(), 1, "{points:?}");
        assert_eq!(points[0]["type"], "bifurcation");
        assert_eq!(points[0]["loads"], serde_json::json!([0.998, 1.002]));
        for (load, force) in curve["load"].iter().zip(&curve["R_y"]) {
            let length = 1.0 + load * (stretch - 1.0);
            let exact = 1e4 * thickness * (length - length.powi(-3));
            // Newton's method converges up to rounding errors.
            assert!((force - exact).abs() < 1e-10, "{load}: {force} {exact}");
        }
    }
}

/// Number of cells along an edge of the octant.
const SIDE: usize = 3;

/// Returns an eighth of a hollow sphere with radii of 10 and 11 mm.
fn sphere() -> String {
    let mut lattice = Lattice::new(3, |[i, j, k]: [usize; 3]| {
        let n = 2 * SIDE;
        let direction = [i, j, n - i - j].map(|part| part as f64);
        let length = direction.iter().map(|x| x * x).sum::<f64>().sqrt();
        direction.map(|x| (0.01 + 0.001 * k as f64 / 2.0) * x / length)
    });
    let mut groups: [Vec<Vec<usize>>; 4] = Default::default();
    let mut tetrahedra = Vec::new();
    let n = 2 * SIDE;
    for (i, j) in (0..SIDE).flat_map(|i| (0..SIDE - i).map(move |j| (2 * i, 2 * j))) {
        let mut triangles = vec![[[i, j], [i + 2, j], [i, j + 2]]];
        if i + j + 4 <= n {
            triangles.push([[i + 2, j], [i + 2, j + 2], [i, j + 2]]);
        }
        for mut triangle in triangles {
            triangle.sort_unstable();
            let bottom = triangle.map(|[i, j]| [i, j, 0]);
            let top = triangle.map(|[i, j]| [i, j, 2]);
            for first in 0..3 {
                let corners = [&bottom[..=first], &top[first..]].concat();
                tetrahedra.push(lattice.simplex(&corners));
            }
            groups[3].push(lattice.simplex(&bottom));
            for side in [[0, 1], [0, 2], [1, 2]] {
                let of = |axis: usize| {
                    side.iter().all(|&c| {
                        let [i, j] = triangle[c];
                        [i, j, n - i - j][axis] == 0
                    })
                };
                for axis in (0..3).filter(|&axis| of(axis)) {
                    let [a, b] = side;
                    groups[axis].push(lattice.simplex(&[bottom[a], bottom[b], top[b]]));
                    groups[axis].push(lattice.simplex(&[bottom[a], top[a], top[b]]));
                }
            }
        }
    }
    let [x, y, z, inner] = groups;
    lattice.msh(&[("x0", x), ("y0", y), ("z0", z), ("inner", inner), ("wall", tetrahedra)])
}

/// Returns the exact inner pressure of the sphere with a shear modulus of 1e5 Pa when its inner radius is stretched by
/// `stretch`.
fn pressure(stretch: f64) -> f64 {
    // For neo-Hooke's law the integral over the wall is elementary.
    let outer = ((1.331 - 1.0 + stretch.powi(3)) / 1.331).cbrt();
    let part = |l: f64| 2.0 / l + 0.5 / l.powi(4);
    1e5 * (part(outer) - part(stretch))
}

/// Checks the limit pressure of a hollow sphere, and the branch beyond it.
#[test]
fn a_sphere_is_inflated_beyond_its_limit_pressure() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("sphere.msh"), sphere()).unwrap();
    let planes: String = ["x", "y", "z"]
        .map(|axis| format!("[[fixed]]\ngroup = \"{axis}0\"\ncomponents = [\"{axis}\"]\n"))
        .concat();
    let text = format!(
        "analysis = \"static\"\n[static]\nmethod = \"arc-length\"\n[mesh]\ntype = \"file\"\npath = \"sphere.msh\"\n[solid]\n\
         bulk_modulus = inf\n[[material]]\nlaw = \"neo-hooke\"\nshear_modulus = 1e5\ndensity = 1e3\n{planes}\
         [[pressure]]\ngroup = \"inner\"\nvalue = 2e4\n[[probe]]\nname = \"pole\"\ntype = \"point\"\nat = [0.0, 0.0, 0.01]\n\
         quantities = [\"u\"]\n[[stop]]\ntype = \"displacement\"\nat = [0.0, 0.0, 0.01]\nabove = 0.02\n"
    );
    let (found, curve) = run(&text, folder.path(), "pole");
    let limit = (40..200).map(|i| pressure(1.0 + 0.005 * f64::from(i))).fold(0.0, f64::max);
    let points = found.document["critical_points"].as_array().unwrap();
    assert_eq!(points.len(), 1);
    let load = points[0]["loads"][0].as_f64().unwrap();
    assert!((2e4 * load / limit - 1.0).abs() < 1e-3, "{load}");
    let states = curve["load"].iter().zip(&curve["u_z"]);
    let beyond: Vec<_> = states.filter(|(_, u)| **u > 0.005).collect();
    assert!(beyond.len() > 5);
    for (load, u) in beyond {
        let expected = pressure(1.0 + u / 0.01);
        // The tolerance covers the mesh error, as above.
        assert!((2e4 * load / expected - 1.0).abs() < 1e-3, "{u}: {load}");
    }
    assert_eq!(found.outcome.reason(), Some(EndReason::Event));
}

/// Regression: fields of paths had the number of the state as time.
#[test]
fn stored_fields_have_the_load_factor_as_time_if_it_grows() {
    let times = |path: &str| -> Vec<f64> {
        let text = format!(
            "{}[static]\n{path}\n[fields]\ninterval = 1.0\n",
            crate::contact::pressed("analysis = \"static\"\n", "y = -0.001")
        );
        let scene = Scene::build("scene.toml", &text, &[], Path::new("")).unwrap();
        let out = tempfile::tempdir().unwrap();
        compute(&scene, &RunOptions::into_folder(out.path())).unwrap();
        let list = fs::read_to_string(out.path().join("fields.pvd")).unwrap();
        let times = list.split("timestep=\"").skip(1).map(|rest| rest.split_once('"').unwrap().0);
        times.map(|time| time.parse().unwrap()).collect()
    };
    assert_eq!(times("loads = [0.25, 0.5, 1.0]"), [0.0, 0.25, 0.5, 1.0]);
    // Times are rounded to thirteen digits.
    assert_eq!(times("steps = 10")[1..4], [0.1, 0.2, 0.3]);
    // Load factors that recur would hide states.
    assert_eq!(times("loads = [0.5, 1.0, 0.5]"), [0.0, 1.0, 2.0, 3.0]);
}

/// Checks a block that is stretched homogeneously, with the energy ζ/2 (λ² + λ⁻² − 2) per area.
#[test]
fn every_state_has_its_elastic_energy() {
    let moved = "[[prescribed_displacement]]\ngroup = \"top\"\ny = -0.002\n";
    let text = crate::contact::pressed("analysis = \"static\"\n", "");
    let (head, rest) = text.split_once("[[contact]]").unwrap();
    let (_, probes) = rest.split_once("group = \"top\"\n[[probe]]").unwrap();
    let text = format!(
        "{head}{moved}[static]\nsteps = 4\n[[probe]]\nname = \"energy\"\ntype = \"energy\"\n[[probe]]{probes}"
    );
    let (_, curve) = run(&text, Path::new(""), "energy");
    assert_eq!(curve["load"], [0.0, 0.25, 0.5, 0.75, 1.0]);
    for (load, found) in curve["load"].iter().zip(&curve["elastic"]) {
        let square = (1.0 - 0.2 * load).powi(2);
        let exact = 0.02 * 0.01 * 0.5e4 * (square + 1.0 / square - 2.0);
        // Newton's method converges up to rounding errors.
        assert!((found - exact).abs() < 1e-12 * curve["elastic"][4], "{load}: {found} {exact}");
    }
}

/// Regression: after trial states beyond the limit of Gent's law, whose matrices are not finite, all later matrices were
/// factorized with pivoting. The stability was unknown then, and a search took six times as long.
#[test]
fn trials_beyond_the_limit_of_a_law_do_not_affect_later_states() {
    let block = |end: f64| {
        let text = format!(
            "analysis = \"static\"\n[static]\nsteps = 5\n[mesh]\ntype = \"box\"\nsize = [0.1, 0.02, 0.02]\n\
             cells = [5, 2, 2]\n[solid]\nbulk_modulus = 1e6\n[[material]]\nlaw = \"gent\"\nshear_modulus = 1e4\n\
             limit = 1.0\ndensity = 1e3\n[[fixed]]\ngroup = \"left\"\n[[prescribed_displacement]]\n\
             group = \"right\"\nx = {end}\n[[probe]]\nname = \"end\"\ntype = \"reaction\"\ngroup = \"right\"\n"
        );
        run(&text, Path::new(""), "end").0.document
    };
    let finished = block(0.1);
    let states = finished["path"].as_array().unwrap();
    assert_eq!((&finished["outcome"], states.len()), (&"finished".into(), 6));
    assert!(states.iter().all(|state| state["instabilities"].is_u64()), "{states:?}");
    let stopped = block(0.3);
    let message = stopped["message"].as_str().unwrap();
    assert!(stopped["reason"] == "no_equilibrium" && message.contains("`gent`"), "{message}");
}
