//! Equilibria: exact solutions with zero displacement or pressure, a column that buckles, and a published benchmark of
//! a ventricle.

use std::collections::BTreeMap;
use std::f64::consts::{FRAC_PI_2, PI};
use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::AtomicBool;

use myovib_model::ModelError;
use myovib_scene::run::{Existing, RunOptions, RunResult, compute};
use myovib_scene::watch::ProgressSink;
use myovib_scene::{Error, Scene};

fn run(text: &str, folder: &Path) -> RunResult {
    let scene = Scene::build("scene.toml", text, &[], folder).unwrap();
    let out = tempfile::tempdir().unwrap();
    compute(&scene, &RunOptions::into_folder(out.path())).unwrap()
}

fn result(run: &RunResult, probe: &str, column: &str) -> f64 {
    run.document["results"][probe][column].as_f64().unwrap()
}

/// Regression: the iteration did not converge if a displacement or a pressure is zero, because no increment is small
/// relative to zero.
#[test]
fn displacements_and_pressures_that_are_zero_are_found() {
    let confined: String =
        [("left", "x"), ("right", "x"), ("front", "y"), ("back", "y"), ("bottom", "z")]
            .iter()
            .map(|(group, axis)| {
                format!("[[fixed]]\ngroup = \"{group}\"\ncomponents = [\"{axis}\"]\n")
            })
            .collect();
    let box_ = "type = \"box\"\nsize = [1.0, 1.0, 1.0]\ncells = [2, 2, 2]";
    let pressed = format!("{confined}[[pressure]]\ngroup = \"top\"\nvalue = 1e3\n");
    let found = run(&neo_hooke(box_, &pressed), Path::new(""));
    // The tolerance covers about a hundred rounding errors of the pressure, and of its effect on 1e4 Pa.
    assert!((result(&found, "all", "p") - 1e3).abs() < 1e-10);
    assert!(result(&found, "all", "u_z").abs() < 1e-14);

    // The stress in simple shear is P = G (F - F⁻ᵀ) for p = 0.
    let square = "type = \"rectangle\"\nwidth = 1.0\nheight = 1.0\ncells = [2, 2]";
    let sheared = "[[fixed]]\ngroup = \"bottom\"\n[[traction]]\ngroup = \"top\"\nx = 3000.0\ny = -300.0\n\
                   [[traction]]\ngroup = \"right\"\nx = -300.0\ny = 3090.0\n\
                   [[traction]]\ngroup = \"left\"\nx = 300.0\ny = -3090.0\n";
    let found = run(&neo_hooke(square, sheared), Path::new(""));
    assert!((result(&found, "all", "u_x") - 0.15).abs() < 1e-13);
    assert!(result(&found, "all", "p").abs() < 1e-9);
    // The state is homogeneous, so the vertices have the same ratio.
    for ratio in found.document["volume_ratios"].as_array().unwrap() {
        assert!((ratio.as_f64().unwrap() - 1.0).abs() < 1e-13, "{ratio}");
    }
}

/// Regression: the force normal to the plane of shear was up to 110 times the shear force, and motions stopped, because two
/// combinations of pressures did no work on the free nodes.
#[test]
fn pressures_that_too_few_nodes_determine_are_tied() {
    const SHEAR: f64 = 0.1;
    let sides: String = ["left", "right", "front", "back"]
        .iter()
        .map(|group| format!("[[fixed]]\ngroup = \"{group}\"\ncomponents = [\"y\", \"z\"]\n"))
        .collect();
    for (analysis, moved) in
        [("static", "0.1"), ("dynamic", "{ type = \"step\", value = 0.1, rise = 0.05 }")]
    {
        let held = format!(
            "[time]\nend = 0.1\n{sides}[[fixed]]\ngroup = \"bottom\"\n[[prescribed_displacement]]\ngroup = \"top\"\n\
             x = {moved}\ny = 0.0\nz = 0.0\n[[probe]]\nname = \"face\"\ntype = \"reaction\"\ngroup = \"top\"\n"
        );
        let box_ = "type = \"box\"\nsize = [1.0, 1.0, 1.0]\ncells = [1, 1, 1]";
        let text = neo_hooke(box_, &held).replace("\"static\"", &format!("\"{analysis}\""));
        let found = run(&text, Path::new(""));
        if analysis == "static" {
            // The stress in simple shear is P = G (F - F⁻ᵀ) for p = 0, on 1 m². The state is homogeneous; Newton's method
            // converges up to rounding errors.
            let [shear, normal] = ["R_x", "R_z"].map(|column| result(&found, "face", column));
            assert!((shear - 1e4 * SHEAR).abs() < 1e-9 * 1e4, "{shear}");
            assert!(normal.abs() < 1e-9 * 1e4, "{normal}");
        }
        assert_eq!(found.document["outcome"], "finished");
    }
}

/// Returns an incompressible body of modulus 1e4 Pa with probes of mean values.
fn neo_hooke(mesh: &str, rest: &str) -> String {
    format!(
        "analysis = \"static\"\n[mesh]\n{mesh}\n[solid]\nbulk_modulus = inf\n[[material]]\nlaw = \"neo-hooke\"\n\
         density = 1e3\nshear_modulus = 1e4\n{rest}[[probe]]\nname = \"all\"\ntype = \"average\"\ngroup = \"body\"\n"
    )
}

/// Sink that stores the progress lines.
#[derive(Default)]
struct Lines(Mutex<Vec<String>>);

impl ProgressSink for Lines {
    fn on_progress(&self, line: &dyn Fn() -> String) {
        self.0.lock().unwrap().push(line());
    }
}

/// Checks that a line is reported before each iteration, for static runs and for motions that start
/// in equilibrium. The last line belongs to the last iteration, under the whole load.
#[test]
fn the_search_for_an_equilibrium_reports_progress() {
    let beam = "type = \"beam\"\nlength = 1.0\nheight = 0.1\ncells = [10, 1]";
    let bent = "[time]\nend = 1e-3\n[[fixed]]\ngroup = \"fixed\"\n[[traction]]\ngroup = \"load\"\ny = 1e3\n";
    let at_rest = neo_hooke(beam, bent);
    let moving =
        at_rest.replace("analysis = \"static\"", "initial_state = { type = \"equilibrium\" }");
    let reported = |text: &str| {
        let scene = Scene::build("scene.toml", text, &[], Path::new("")).unwrap();
        let (out, lines) = (tempfile::tempdir().unwrap(), Lines::default());
        let options = RunOptions { progress: &lines, ..RunOptions::into_folder(out.path()) };
        let found = compute(&scene, &options).unwrap();
        let lines = lines.0.into_inner().unwrap().into_iter();
        let of_search = lines.filter(|line| line.starts_with("equilibrium"));
        (found, of_search.collect::<Vec<_>>())
    };
    let (found, lines) = reported(&at_rest);
    let count = |key: &str| found.document[key].as_u64().unwrap();
    assert!(count("load_steps") > 1);
    assert_eq!(lines.len() as u64, count("newton_iterations"));
    let last = lines.last().unwrap();
    let step = format!("equilibrium: step {}, ", count("load_steps"));
    assert!(last.starts_with(&step), "{last}");
    assert!(last.contains(" 100.0 %"), "{last}");
    let all = format!(", {} in total", count("newton_iterations"));
    assert!(last.ends_with(&all), "{last}");
    assert_eq!(reported(&moving).1, lines);
}

/// Checks a column beyond its buckling loads. Euler's load of a clamped column in plane strain is π² 4G I/(4 L²), here
/// a traction of 3.3 Pa. Further modes buckle at 9 and 25 times this load. The straight column is an equilibrium for
/// all loads.
#[test]
fn a_column_beyond_the_loads_that_buckle_it_is_said_to_be_unstable() {
    let euler = PI * PI / 4.0 * 4e4 * 0.02_f64.powi(2) / 12.0;
    let beam = "type = \"beam\"\nlength = 1.0\nheight = 0.02\ncells = [50, 1]";
    for kappa in ["inf", "1e6"] {
        for (part, printed) in [
            (0.8, None),
            (1.2, Some("small perturbations grow in 1 direction")),
            (10.0, Some("small perturbations grow in 2 independent")),
        ] {
            let load = format!(
                "[[fixed]]\ngroup = \"fixed\"\n[[traction]]\ngroup = \"load\"\nx = {}\n",
                -part * euler
            );
            let text = neo_hooke(beam, &load)
                .replace("bulk_modulus = inf", &format!("bulk_modulus = {kappa}"));
            let notes = run(&text, Path::new("")).notes;
            assert_eq!(notes.len(), usize::from(printed.is_some()), "{part}: {notes:?}");
            assert!(
                notes.iter().zip(printed).all(|(note, printed)| note.contains(printed)),
                "{notes:?}"
            );
            let vibrating = text.replace("\"static\"", "\"modes\"\nmodes = { preload_time = 0.0 }");
            let found = run(&vibrating, Path::new(""));
            assert_eq!(found.notes, notes);
            assert_eq!(found.document["preload_time"], 0.0);
            let first = &found.document["muscles"][0]["modes"][0];
            assert_eq!(first["frequency"].is_null(), printed.is_some(), "{part}");
            assert_eq!(first["omega_squared"].as_f64().unwrap() < 0.0, printed.is_some());
        }
    }
}

/// Returns the mesh of a quarter of Land's ventricle: an ellipsoid cut 5 mm above its equatorial plane. `cells`
/// contains the numbers of cells across the wall, from the apex to the base, and around the axis.
fn ventricle(cells: [usize; 3]) -> String {
    let mut numbers = BTreeMap::new();
    let mut points = Vec::new();
    let mut node = |at: [usize; 3]| {
        // The apex is a single point for all angles.
        let at = if at[1] == 0 { [at[0], 0, 0] } else { at };
        *numbers.entry(at).or_insert_with(|| {
            let [t, s, w] = [0, 1, 2].map(|i| at[i] as f64 / cells[i] as f64);
            let (short, long) = (7.0 + 3.0 * t, 17.0 + 3.0 * t);
            let u = -PI + (PI - (5.0 / long).acos()) * s;
            let (out, v) = (short * u.sin(), FRAC_PI_2 * w);
            // Rounding would move nodes off the planes of symmetry.
            let y = if at[2] == 0 { 0.0 } else { v.sin() };
            let x = if at[2] == cells[2] { 0.0 } else { v.cos() };
            points.push([out * x, out * y, long * u.cos()].map(|x| 1e-3 * x));
            points.len()
        })
    };
    let (mut tetrahedra, mut groups) = (Vec::new(), vec![Vec::new(); 4]);
    let orders = [[0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 2, 1], [2, 1, 0], [1, 0, 2]];
    for cell in 0..cells.iter().product() {
        let corner = [cell % cells[0], cell / cells[0] % cells[1], cell / cells[0] / cells[1]];
        for order in orders {
            let mut path = vec![corner];
            for axis in order {
                let mut next = path[path.len() - 1];
                next[axis] += 1;
                path.push(next);
            }
            let nodes: Vec<usize> = path.iter().map(|at| node(*at)).collect();
            if (1..4).any(|i| nodes[..i].contains(&nodes[i])) {
                continue; // flat, at the apex
            }
            for left in 0..4 {
                let face: Vec<usize> = (0..4).filter(|i| *i != left).collect();
                let on = |axis: usize, plane: usize| face.iter().all(|&i| path[i][axis] == plane);
                let sides = [on(0, 0), on(1, cells[1]), on(2, cells[2]), on(2, 0)];
                for (group, _) in groups.iter_mut().zip(sides).filter(|(_, is_on)| *is_on) {
                    group.push(face.iter().map(|&i| nodes[i]).collect());
                }
            }
            tetrahedra.push(nodes);
        }
    }
    groups.push(tetrahedra);
    msh(&points, &groups)
}

/// Formats a mesh in Gmsh's format 4.1: four groups of faces and a group of tetrahedra.
fn msh(points: &[[f64; 3]], groups: &[Vec<Vec<usize>>]) -> String {
    let mut text = "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$PhysicalNames\n5\n".to_owned();
    for (k, name) in ["endo", "base", "x0", "y0", "wall"].iter().enumerate() {
        writeln!(text, "{} {} \"{name}\"", if k < 4 { 2 } else { 3 }, k + 1).unwrap();
    }
    text += "$EndPhysicalNames\n$Entities\n0 0 4 1\n";
    for k in 1..=5 {
        writeln!(text, "{k} -1 -1 -1 1 1 1 1 {k} 0").unwrap();
    }
    let n = points.len();
    writeln!(text, "$EndEntities\n$Nodes\n1 {n} 1 {n}\n3 5 0 {n}").unwrap();
    (1..=n).for_each(|number| writeln!(text, "{number}").unwrap());
    for [x, y, z] in points {
        writeln!(text, "{x:e} {y:e} {z:e}").unwrap();
    }
    let total: usize = groups.iter().map(Vec::len).sum();
    writeln!(text, "$EndNodes\n$Elements\n5 {total} 1 {total}").unwrap();
    let mut number = 0;
    for (k, group) in groups.iter().enumerate() {
        let (dimension, kind) = if k < 4 { (2, 2) } else { (3, 4) };
        writeln!(text, "{dimension} {} {kind} {}", k + 1, group.len()).unwrap();
        for nodes in group {
            number += 1;
            let nodes: Vec<String> = nodes.iter().map(usize::to_string).collect();
            writeln!(text, "{number} {}", nodes.join(" ")).unwrap();
        }
    }
    text + "$EndElements\n"
}

/// Checks problem 2 of Land et al. 2015. Another program (FEniCS pulse, its pull request 98) gives an apex displacement
/// of 26.53 mm inside and 28.18 mm outside. With three cells across and 24 along, our values are 26.51 and 28.46. The
/// complete law collapses on meshes of two or more cells across.
#[test]
fn an_inflated_ventricle_is_that_of_the_benchmark() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("ventricle.msh"), ventricle([2, 8, 4])).unwrap();
    let text = "analysis = \"static\"\n[mesh]\ntype = \"file\"\npath = \"ventricle.msh\"\n[solid]\nbulk_modulus = inf\n\
                [[material]]\nlaw = \"isochoric-guccione\"\ndensity = 1e3\nc = 1e4\nb_f = 1.0\nb_t = 1.0\nb_fs = 1.0\n\
                fiber = [1.0, 0.0, 0.0]\n[[fixed]]\ngroup = \"base\"\n[[fixed]]\ngroup = \"x0\"\ncomponents = [\"x\"]\n\
                [[fixed]]\ngroup = \"y0\"\ncomponents = [\"y\"]\n[[pressure]]\ngroup = \"endo\"\nvalue = 1e4\n\
                [[probe]]\nname = \"inside\"\ntype = \"point\"\nat = [0.0, 0.0, -0.017]\n\
                [[probe]]\nname = \"outside\"\ntype = \"point\"\nat = [0.0, 0.0, -0.02]\n";
    let found = run(text, folder.path());
    let apex = |probe: &str, rest: f64| rest - 1e3 * result(&found, probe, "u_z");
    // The mesh error is 0.7 % inside and 0.01 % outside, estimated with the finer mesh; the programs differ by 1 %
    // outside.
    let (inside, outside) = (apex("inside", 17.0), apex("outside", 20.0));
    assert!((inside / 26.53 - 1.0).abs() < 0.01, "{inside}");
    assert!((outside / 28.18 - 1.0).abs() < 0.015, "{outside}");
}

/// Regression: results of an earlier run remained in the folder after a run with `--overwrite` had failed or was
/// interrupted before its first result. After an input error, these results must remain.
#[test]
fn no_results_of_an_earlier_run_stay_beside_a_failure() {
    static INTERRUPTED: AtomicBool = AtomicBool::new(true);
    let part = |analysis: &str, load: f64| {
        format!(
            "analysis = \"{analysis}\"\n[mesh]\ntype = \"rectangle\"\nwidth = 1.0\nheight = 1.0\ncells = [2, 2]\n\
             [solid]\nbulk_modulus = 1e5\n[[material]]\nlaw = \"neo-hooke\"\ndensity = 1e3\nshear_modulus = 1e4\n\
             [[fixed]]\ngroup = \"left\"\n[[traction]]\ngroup = \"right\"\ny = {load:e}\n\
             [[probe]]\nname = \"end\"\ntype = \"average\"\ngroup = \"right\"\n"
        )
    };
    let motion = "[time]\nend = 1e-3\n[initial_state]\ntype = \"equilibrium\"\n";
    for (analysis, keys) in [
        ("static", ""),
        ("static", "[static]\nsteps = 3\n"),
        ("dynamic", motion),
        ("modes", "[modes]\npreload_time = 0.0\n"),
    ] {
        let folder = tempfile::tempdir().unwrap();
        let run = |load: f64, interrupt: Option<&'static AtomicBool>| {
            let text = part(analysis, load) + keys;
            let scene = Scene::build("scene.toml", &text, &[], Path::new("")).unwrap();
            let options = RunOptions {
                existing: Existing::Overwrite,
                interrupt,
                ..RunOptions::into_folder(folder.path())
            };
            compute(&scene, &options)
        };
        let document = folder.path().join("run.json");
        for (load, interrupt) in [(1e15, None), (1.0, Some(&INTERRUPTED))] {
            assert!(run(1.0, None).is_ok() && document.exists(), "{analysis}");
            let error = run(load, interrupt).unwrap_err();
            let is_expected = match interrupt {
                Some(_) => matches!(error, Error::Model(ModelError::Interrupted)),
                None => matches!(error, Error::Model(ModelError::NoEquilibrium { .. })),
            };
            assert!(is_expected, "{analysis}: {error}");
            assert!(!document.exists(), "{analysis} {load}");
        }
    }
}

/// Regression: the displacement of an equilibrium had to be smooth in time, and a neo-hooke law appeared as
/// mooney-rivlin in the document.
#[test]
fn an_equilibrium_takes_its_displacements_at_one_time() {
    let text = "analysis = \"static\"\n[time]\nend = 0.25\n[mesh]\ntype = \"rectangle\"\nwidth = 0.1\nheight = 0.1\ncells = [1, 1]\n\
                [solid]\nbulk_modulus = 1e5\n[[material]]\nlaw = \"neo-hooke\"\ndensity = 1e3\nshear_modulus = 1e4\n\
                [[fixed]]\ngroup = \"left\"\n[[prescribed_displacement]]\ngroup = \"right\"\n\
                x = { type = \"ramp\", value = 0.02, end = 1.0 }\ny = { type = \"step\", value = 0.01, rise = 0 }\n\
                [[probe]]\nname = \"end\"\ntype = \"average\"\ngroup = \"right\"\n";
    let found = run(text, Path::new(""));
    for (column, expected) in [("u_x", 0.005), ("u_y", 0.01)] {
        // The tolerance covers the rounding errors of a mean.
        assert!((result(&found, "end", column) - expected).abs() < 1e-15);
    }
    let material = &found.document["scene"]["material"][0];
    assert_eq!(material["law"], "neo-hooke");
    assert_eq!(material["shear_modulus"], 1e4);
}

/// Supports that move at the time of an equilibrium have no velocity in this equilibrium. Regression: the reaction
/// contained the viscous stress. The bar has the stress G (λ² − 1/λ) of an incompressible body.
#[test]
fn viscosity_has_no_effect_on_equilibria() {
    const G: f64 = 1e4;
    let stretched = |viscosity: f64| {
        let bar: String = [("left", "x"), ("front", "y"), ("bottom", "z")]
            .iter()
            .map(|(group, axis)| {
                format!("[[fixed]]\ngroup = \"{group}\"\ncomponents = [\"{axis}\"]\n")
            })
            .collect();
        let text = format!(
            "analysis = \"static\"\n[time]\nend = 1.0\n[mesh]\ntype = \"box\"\nsize = [1.0, 1.0, 1.0]\ncells = [1, 1, 1]\n\
             [solid]\nbulk_modulus = inf\n[[material]]\nlaw = \"neo-hooke\"\ndensity = 1e3\nshear_modulus = {G}\n\
             viscosity = {viscosity}\n{bar}[[prescribed_displacement]]\ngroup = \"right\"\n\
             x = {{ type = \"ramp\", value = 0.1, end = 2.0 }}\n\
             [[probe]]\nname = \"end\"\ntype = \"reaction\"\ngroup = \"right\"\n\
             [[probe]]\nname = \"inside\"\ntype = \"point\"\nat = [0.9, 0.5, 0.5]\nquantities = [\"v\", \"stress\"]\n"
        );
        let found = run(&text, Path::new(""));
        [("end", "R_x"), ("inside", "v_x"), ("inside", "stress_xx")]
            .map(|(probe, column)| result(&found, probe, column))
    };
    let stretch = 1.05_f64;
    let stress = G * (stretch * stretch - 1.0 / stretch);
    for viscosity in [0.0, 1e4] {
        let [force, velocity, found] = stretched(viscosity);
        // The tolerance is ten times the last relative increment of Newton's method, 1e-9.
        assert!((force * stretch / stress - 1.0).abs() < 1e-8, "{viscosity}: {force:e}");
        assert!((found / stress - 1.0).abs() < 1e-8, "{viscosity}: {found:e}");
        assert_eq!(velocity, 0.0);
    }
}
