//! The built-in muscle in 3D: contraction, vibration and oscillators over two seconds, and the cost of very many
//! oscillators. These are slow tests for release builds.

use std::path::Path;

use myovib_oscillators::{Coherence, Network};
use myovib_scene::Scene;
use myovib_scene::csv::Table;
use myovib_scene::run::{RunOptions, compute};
use serde_json::Value;

const SCENE: &str = include_str!("../../../../data/scenes/muscle3d.toml");

fn build(text: &str) -> Scene {
    Scene::build("scene.toml", text, &[], Path::new("")).unwrap()
}

/// Replaces a part of a scene's text, which must occur once.
fn changed(text: &str, from: &str, to: &str) -> String {
    assert_eq!(text.matches(from).count(), 1, "{from}");
    text.replacen(from, to, 1)
}

/// Returns the document of a run and the rows of the requested probes.
fn run<const N: usize>(scene: &Scene, probes: [&str; N]) -> (Value, [Vec<Vec<f64>>; N]) {
    let folder = tempfile::tempdir().unwrap();
    let options = RunOptions::into_folder(folder.path());
    let document = compute(scene, &options).unwrap().document;
    assert_eq!(document["outcome"], "finished");
    let rows = probes.map(|probe| {
        let path = folder.path().join(format!("{probe}.csv"));
        let table = Table::parse(&std::fs::read_to_string(path).unwrap()).unwrap();
        let rows = table.rows.iter();
        rows.map(|row| table.numbers(row).unwrap()).collect()
    });
    (document, rows)
}

fn largest(values: impl Iterator<Item = f64>) -> f64 {
    values.fold(0.0, |m, x| m.max(x.abs()))
}

/// Half of the step of [`replayed`], s.
const HALF: f64 = 5e-4;

/// Returns the states of `network` driven from rest by the forcing `c`, given every [`HALF`], by
/// the classical Runge–Kutta method of order 4.
fn replayed(network: &Network, c: &[f64]) -> Vec<f64> {
    let rate = |s: &[f64], c: f64| {
        let mut rate = vec![0.0; s.len()];
        // The residual is ṡ minus the rate.
        network.residual(s, &vec![0.0; s.len()], &[c], &mut rate);
        rate.iter_mut().for_each(|r| *r = -*r);
        rate
    };
    let along = |s: &[f64], h: f64, rate: &[f64]| -> Vec<f64> {
        s.iter().zip(rate).map(|(s, r)| s + h * r).collect()
    };
    let h = 2.0 * HALF;
    let mut s = vec![0.0; network.n_states()];
    for c in c.windows(3).step_by(2) {
        let first = rate(&s, c[0]);
        let second = rate(&along(&s, 0.5 * h, &first), c[1]);
        let third = rate(&along(&s, 0.5 * h, &second), c[1]);
        let fourth = rate(&along(&s, h, &third), c[2]);
        for (k, s) in s.iter_mut().enumerate() {
            *s += h / 6.0 * (first[k] + 2.0 * (second[k] + third[k]) + fourth[k]);
        }
    }
    s
}

/// Checks the built-in scene over two seconds, without field output: by integrating the oscillators alone, by its
/// energy balance, and by a run with a tenth of its tolerances.
#[test]
#[ignore = "about twelve minutes of CPU"]
fn the_muscle_in_space_contracts_and_vibrates_for_two_seconds() {
    let (scene, _) = SCENE.split_once("[fields]").unwrap();
    let probes = format!(
        "{scene}\n[[probe]]\nname = \"drive\"\ntype = \"point\"\nat = [0.0, 0.0, 0.0]\nquantities = [\"u\"]\ninterval = {HALF}\n\
         [[probe]]\nname = \"states\"\ntype = \"oscillators\"\nchain = \"middle\"\ninterval = 2.0\n\
         [[probe]]\nname = \"energy\"\ntype = \"energy\"\n"
    );
    let scene = build(&probes);
    let (document, [origin, coherence, drive, states]) =
        run(&scene, ["origin", "coherence", "drive", "states"]);
    println!("{} steps, {} CPU s", document["steps"], document["cpu_seconds"]);
    assert_eq!(document["unknowns"], 21_529);
    assert_eq!(document["t_reached"], 2.0);

    // The change of energy equals the work of load, tension and damping within the rtol of the scene.
    let energy: Vec<f64> = serde_json::from_value(document["energy"].clone()).unwrap();
    let [.., work, _, imbalance] = energy[..] else { panic!("five energies: {energy:?}") };
    println!("energies {energy:?} J");
    assert!(work > 0.1 && imbalance.abs() < 1e-3 * work, "{energy:?}");

    // The oscillators alone, driven by the recorded displacement, agree within their rtol.
    let chain = &scene.chains[0];
    let n = chain.chain.omega.len();
    assert_eq!(n, 1000);
    let network = chain.chain.network().unwrap();
    let c = drive.iter().map(|row| chain.drive.forcing(row[3]));
    let alone = replayed(&network, &c.collect::<Vec<f64>>());
    let together = &states.last().unwrap()[1..];
    let size = largest(alone.iter().copied());
    let apart = largest(alone.iter().zip(together).map(|(a, b)| a - b));
    println!("oscillators: {apart:e} of {size:e} apart");
    assert!(apart < 1e-3 * size, "{apart:e} of {size:e}");
    let (y, w) = alone.split_at(n);
    let expected = Coherence::new(&chain.chain.omega, y, w);
    // These are |Ψ| and |χ| at the end, when the vibration has locked the oscillators.
    let [_, strength, _, coherent] = coherence.last().unwrap()[..] else { panic!("{coherence:?}") };
    assert!((strength / expected.centroid.norm() - 1.0).abs() < 1e-3);
    assert!((coherent - expected.phase.norm()).abs() < 1e-3);
    assert!(coherent > 0.9, "{coherent}");

    // This scene has tolerances that are ten times tighter.
    let tight = changed(&probes, "\nrtol = 1e-3", "\nrtol = 1e-4");
    let tight = changed(&tight, "{ rtol = 1e-3, atol = 1e-5 }", "{ rtol = 1e-4, atol = 1e-6 }");
    let tight =
        changed(&tight, "{ u = 1e-6, v = 1e-4, p = 10.0 }", "{ u = 1e-7, v = 1e-5, p = 1.0 }");
    let (more, [tighter, tighter_coherence]) = run(&build(&tight), ["origin", "coherence"]);
    println!("tighter: {} steps, {} CPU s", more["steps"], more["cpu_seconds"]);
    assert!(more["steps"].as_u64() > document["steps"].as_u64());
    // Displacements (relative to the largest displacement, along z), the pressure, and |Ψ| agree within the rtol of the
    // scene, relative to their maximum.
    let displacement = largest(tighter.iter().map(|row| row[3]));
    let pressure = largest(tighter.iter().map(|row| row[4]));
    let strength = largest(tighter_coherence.iter().map(|row| row[1]));
    assert!(displacement > 1e-2, "{displacement}");
    for (rows, tighter, column, size) in [
        (&origin, &tighter, 1, displacement),
        (&origin, &tighter, 2, displacement),
        (&origin, &tighter, 3, displacement),
        (&origin, &tighter, 4, pressure),
        (&coherence, &tighter_coherence, 1, strength),
    ] {
        assert_eq!((rows.len(), tighter.len()), (201, 201));
        let apart = rows.iter().zip(tighter);
        let error = largest(apart.map(|(a, b)| a[column] - b[column])) / size;
        println!("own error in time, column {column}: {error:.1e}");
        assert!(error < 1e-3, "{column}: {error:e}");
    }
}

/// Work of a run.
struct Cost {
    steps: u64,
    unknowns: u64,
    factor_entries: u64,
    /// Numbers of factorizations, solves, residuals, and passes over the elements for tangents.
    counts: [u64; 4],
    cpu_seconds: f64,
}

/// Returns the work of a run whose error test does not limit the steps.
fn cost(text: &str) -> Cost {
    let (document, []) = run(&build(text), []);
    assert_eq!(document["error_test_failures"], 0);
    assert_eq!(document["step_solve_failures"], 0);
    let linear = &document["work"]["linear"];
    let counts = [
        &linear["factorizations"],
        &linear["solves"],
        &document["residual_evaluations"],
        &document["work"]["tangent_passes"],
    ];
    let cost = Cost {
        steps: document["steps"].as_u64().unwrap(),
        unknowns: document["unknowns"].as_u64().unwrap(),
        factor_entries: linear["factor_entries"].as_u64().unwrap(),
        counts: counts.map(|count| count.as_u64().unwrap()),
        cpu_seconds: document["cpu_seconds"].as_f64().unwrap(),
    };
    println!(
        "{} unknowns: {} steps, {:?} factorizations, solves, residuals, tangents; {} entries of factors; {:.1} CPU s",
        cost.unknowns, cost.steps, cost.counts, cost.factor_entries, cost.cpu_seconds
    );
    cost
}

/// Checks the cost of 66 oscillators in each element of the belly, 101 376 in total. They are
/// driven by the muscle, and in a second case contract their elements. With a fixed step size, the
/// work on the body is at most twice the work without oscillators, in counts. The counts exclude
/// the cost of the oscillators in each operation. CPU times, which depend on the machine, are
/// printed.
#[test]
#[ignore = "a minute of CPU"]
fn very_many_oscillators_at_most_double_the_work_on_the_body() {
    let (scene, _) = SCENE.split_once("[fields]").unwrap();
    let scene = changed(scene, "end = 2.0", "end = 0.05");
    // The body moves from the start, but slowly enough for steps of half a millisecond.
    let vibration = "{ type = \"ramped-sine\", amplitude = 500.0, steepness = 20.0 }";
    let push = "{ type = \"step\", value = 500.0, rise = 0.1 }";
    let scene = changed(&scene, vibration, push);
    let scene = changed(&scene, "start = 1.0, rise = 0.4", "rise = 0.1");
    let steps = "rtol = 1e-3\ninitial_step = 5e-4\nmax_step = 5e-4\n";
    let scene = changed(&scene, "rtol = 1e-3\n", steps);
    // Only the steps are measured, so there is one checkpoint at the end instead of the default ten.
    let scene = changed(&scene, "[time]", "[checkpoint]\ninterval = 0.05\n\n[time]");

    let (before, chain) = scene.split_once("[[chain]]").unwrap();
    let (_, after) = chain.split_once("[integrator]").unwrap();
    let after = changed(after, "oscillators = { rtol = 1e-3, atol = 1e-5 }\n", "");
    let (after, _) = after.split_once("[[probe]]\nname = \"coherence\"").unwrap();
    let tissue = cost(&format!("{before}[integrator]{after}"));
    assert_eq!((tissue.steps, tissue.unknowns), (100, 19_529));

    let one_way = changed(
        &scene,
        "oscillators = 1000\nat = [0.0, 0.0, 0.0]",
        "oscillators = 66\nat = { elements = \"muscle\" }",
    );
    let given = scene.lines().find(|line| line.starts_with("active")).unwrap();
    let following =
        "active = { type = \"coherence\", chain = \"middle\", at_full_coherence = 2e4 }";
    let two_way = changed(&one_way, given, following);
    // One-way coupling adds nothing to the factorized matrix; two-way coupling adds a coherence for
    // each element.
    for (text, most_entries) in [(one_way, 1), (two_way, 2)] {
        let with = cost(&text);
        assert_eq!((with.steps, with.unknowns), (100, 19_529 + 2 * 101_376));
        assert!(with.factor_entries <= most_entries * tissue.factor_entries);
        for (with, alone) in with.counts.iter().zip(tissue.counts) {
            assert!(*with <= 2 * alone, "{with} for {alone}");
        }
        println!("CPU ratio {:.2}", with.cpu_seconds / tissue.cpu_seconds);
    }
}
