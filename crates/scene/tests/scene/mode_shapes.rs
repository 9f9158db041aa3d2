//! Shapes, participation factors and effective masses of modes.

use std::path::Path;

use myovib_scene::modes::Modes;
use myovib_scene::run::{RunOptions, compute};
use myovib_scene::watch::Watcher;
use myovib_scene::{Scene, vtu};

fn scene(mesh: &str, kappa: &str, rest: &str) -> Scene {
    let text = format!(
        "analysis = \"modes\"\n[mesh]\n{mesh}\n[solid]\nbulk_modulus = {kappa}\n[[material]]\nlaw = \"neo-hooke\"\n\
         density = 1e3\nshear_modulus = 1e4\n{rest}"
    );
    Scene::build("scene.toml", &text, &[], Path::new("")).unwrap()
}

const BLOCK: &str = "type = \"rectangle\"\nwidth = 0.2\nheight = 0.1\ncells = [2, 1]";
const CUBE: &str = "type = \"box\"\nsize = [0.2, 0.1, 0.1]\ncells = [1, 1, 1]";

/// Checks sums of effective masses. The modes of a free body represent translations exactly, so these sums equal its mass.
/// In a supported body, the modes represent the displacement w of M w = M r, without the part of the mass that the mass
/// matrix assigns to fixed nodes alone.
#[test]
fn effective_masses_add_up_to_the_mass() {
    for (mesh, mass, axes) in [(BLOCK, 20.0, 2), (CUBE, 2.0, 3)] {
        for kappa in ["1e5", "inf"] {
            let found = Modes::of_scene(&scene(mesh, kappa, ""), Some(200), Watcher::NOBODY);
            let found = &found.unwrap().muscles[0];
            assert!((found.mass / mass - 1.0).abs() < 1e-14);
            for axis in 0..axes {
                let sum: f64 = found.modes.iter().map(|mode| mode.effective_mass[axis]).sum();
                // The tolerance covers rounding errors, amplified by the orthogonalization of a Krylov space.
                assert!((sum / mass - 1.0).abs() < 1e-9, "{kappa} {axis}: {sum}");
            }
            let held = scene(mesh, kappa, "[[fixed]]\ngroup = \"left\"\n");
            let found = Modes::of_scene(&held, Some(200), Watcher::NOBODY).unwrap();
            let modes = &found.muscles[0].modes;
            let sum: f64 = modes.iter().map(|mode| mode.effective_mass[1]).sum();
            assert!(0.5 * mass < sum && sum < mass, "{kappa}: {sum}");
        }
    }
}

/// Checks that the first bending mode of a slender cantilever has an effective mass of 61.31 % of the total mass
/// (Euler–Bernoulli).
#[test]
fn a_cantilever_has_the_effective_mass_of_beam_theory() {
    let root = 1.875_104_068_711_961_f64;
    let sigma = (root.sinh() - root.sin()) / (root.cosh() + root.cos());
    // Mean and mean square of cosh − cos − σ (sinh − sin) are 2σ/β and 1.
    let theory = (2.0 * sigma / root).powi(2);
    assert!((theory - 0.6131).abs() < 1e-4);
    for kappa in ["1e6", "inf"] {
        let [stout, slender] = [20.0, 40.0].map(|slenderness: f64| {
            let mesh = format!(
                "type = \"rectangle\"\nwidth = 1.0\nheight = {}\ncells = [{slenderness}, 1]",
                1.0 / slenderness
            );
            let held = scene(&mesh, kappa, "[[fixed]]\ngroup = \"left\"\n");
            let found = Modes::of_scene(&held, Some(1), Watcher::NOBODY).unwrap();
            let body = &found.muscles[0];
            body.modes[0].effective_mass[1] / body.mass
        });
        // The clamp of a solid shortens the beam by a fraction of its height, an effect of order h/L, which the extrapolation
        // removes. Shear and rotary inertia are of order (h/L)², at most half of it here.
        let limit = 2.0 * slender - stout;
        assert!((limit - theory).abs() < 0.5 / 400.0, "{stout} {slender}");
        assert!((slender - theory).abs() < 0.6 * (stout - theory).abs(), "{stout} {slender}");
    }
}

#[test]
fn a_run_writes_the_shapes() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let held = scene(BLOCK, "inf", "[[fixed]]\ngroup = \"left\"\n");
    let found = compute(&held, &RunOptions::into_folder(&out)).unwrap().modes.unwrap();
    let (mesh, fields) = vtu::read(&out.join("modes.vtu")).unwrap();
    let modes = &found.muscles[0].modes;
    for (k, mode) in modes.iter().enumerate() {
        let field = fields.iter().find(|field| field.name == format!("mode_{}", k + 1)).unwrap();
        assert_eq!(field.values.len(), 3 * mesh.points.len());
        // There is only one region, so the points are the nodes.
        let written = field.values.chunks(3).flat_map(|vector| &vector[..2]);
        assert!(written.eq(&mode.shape), "mode {}", k + 1);
    }
    assert_eq!(fields.iter().filter(|field| !field.of_cells).count(), modes.len());
    let table = std::fs::read_to_string(out.join("modes.csv")).unwrap();
    let row: Vec<f64> =
        table.lines().nth(1).unwrap().split(',').map(|x| x.parse().unwrap()).collect();
    assert_eq!(&row[4..], [&modes[0].participation[..], &modes[0].effective_mass].concat());
}

/// Regression: a file of the user was found only after the computation, and other results had already been written.
#[test]
fn shapes_of_the_user_are_found_before_anything_is_written() {
    let out = tempfile::tempdir().unwrap();
    std::fs::write(out.path().join("modes.vtu"), "mine").unwrap();
    let held = scene(BLOCK, "inf", "[[fixed]]\ngroup = \"left\"\n");
    assert!(compute(&held, &RunOptions::into_folder(out.path())).is_err());
    let files = std::fs::read_dir(out.path()).unwrap().map(|entry| entry.unwrap().file_name());
    assert_eq!(files.collect::<Vec<_>>(), ["modes.vtu"]);
    assert_eq!(std::fs::read_to_string(out.path().join("modes.vtu")).unwrap(), "mine");
}

/// Checks that fibers that resist only tension have no linear vibrations at rest. Under a preload that stretches them, they
/// have linear vibrations, unless the strain is smaller than in a vibration.
#[test]
fn one_sided_fibers_at_rest_are_noted() {
    let laws = [
        (
            "transverse-mooney-rivlin\"\nc10 = 1e4\nc3 = 1e3\nc4 = 20\nc5 = 1e5\nstretch_max = 1.1",
            true,
        ),
        (
            "transverse-mooney-rivlin\"\nc10 = 1e4\nc3 = 0\nc4 = 20\nc5 = 0\nstretch_max = 1.1",
            false,
        ),
        ("guccione\"\nc = 1e4\nb_f = 8\nb_t = 4\nb_fs = 4", false),
    ];
    for (law, is_one_sided) in laws {
        let text = format!(
            "analysis = \"modes\"\n[mesh]\n{BLOCK}\n[solid]\nbulk_modulus = 1e6\n[[material]]\nlaw = \"{law}\n\
             density = 1e3\nfiber = [1, 0]\n[[fixed]]\ngroup = \"left\"\n\
             [[traction]]\ngroup = \"right\"\nx = {{ type = \"step\", value = 100, rise = 0.1 }}\n"
        );
        for (preload, traction, is_noted) in [
            ("", 100.0, is_one_sided),
            ("[modes]\npreload_time = 1\n", 100.0, false),
            ("[modes]\npreload_time = 1\n", 1e-9, is_one_sided),
        ] {
            let text = format!("{text}{preload}");
            let set = format!("traction[0].x.value={traction:?}");
            let scene = Scene::build("scene.toml", &text, &[set], Path::new("")).unwrap();
            let found = Modes::of_scene(&scene, Some(1), Watcher::NOBODY).unwrap();
            assert_eq!(!found.muscles[0].notes.is_empty(), is_noted, "{law} {preload}");
        }
    }
}

/// Checks the note on an oscillating load, whose value at the time of the preload is part of the preload.
#[test]
fn an_oscillating_preload_is_noted() {
    let notes = |load: &str| {
        let text = format!(
            "analysis = \"modes\"\n[mesh]\n{BLOCK}\n[solid]\nbulk_modulus = 1e6\n[[material]]\nlaw = \"neo-hooke\"\n\
             density = 1e3\nshear_modulus = 1e4\n[[fixed]]\ngroup = \"left\"\n[modes]\npreload_time = 1.01\n\
             [[traction]]\ngroup = \"right\"\nx = {{ {load} }}\n"
        );
        let scene = Scene::build("scene.toml", &text, &[], Path::new("")).unwrap();
        Modes::of_scene(&scene, Some(1), Watcher::NOBODY).unwrap().muscles[0].notes.len()
    };
    assert_eq!(notes("type = \"sine\", amplitude = 10.0, frequency = 25.0"), 1);
    assert_eq!(notes("type = \"step\", value = 10.0, rise = 0.1"), 0);
}
