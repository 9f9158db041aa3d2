//! Comparison of separate steps with the integration as one system at tighter tolerances.

use std::ops::Range;

use rand::prelude::*;
use rand_chacha::ChaCha8Rng;

use super::{BLOCK, MUSCLE, ROD, SEPARATE, TOGETHER, compare, rows, run, with_chain};

#[test]
fn separate_steps_agree_with_one_system_at_tighter_tolerances() {
    let folder = tempfile::tempdir().unwrap();
    for (n, gain) in [(1, 1.0), (5, 1e5)] {
        let with = with_chain(MUSCLE, n, gain);
        let together = folder.path().join(format!("together {gain}"));
        let tight = "integrator.oscillators={ rtol = 1e-7, atol = 1e-10 }";
        let set = ["integrator.method=radau9", TOGETHER, tight, "integrator.rtol=1e-8"];
        run(&with, &set, &together);
        for method in ["radau5", "radau9", "bdf"] {
            let method = format!("integrator.method={method}");
            let out = |name: &str| folder.path().join(format!("{name} {method} {gain}"));
            let tolerances = "integrator.oscillators={ rtol = 1e-5, atol = 1e-8 }";
            let set = [&method, SEPARATE, tolerances, "integrator.rtol=1e-6"];
            run(&with, &set, &out("separate"));
            let tables = |name| [&out("separate"), &together].map(|out| rows(out, name));
            let [one, other] = tables("drive");
            let columns: Vec<usize> = (1..one[0].len()).collect();
            let [_, of_u] = compare(&one, &other, &columns);
            let [one, other] = tables("states");
            let positions: Vec<usize> = (1..=n).collect();
            let [size, off] = compare(&one, &other, &positions);
            let [one, other] = tables("order");
            let [largest, of_order] = compare(&one, &other, &[1, 3]);
            // The errors of many steps amount to 20 tolerances of the chain. The tolerance of 1e-6 of the body ensures
            // that the gain times the error of u is smaller.
            let allowed = |size: f64| 20.0 * (1e-5 * size + 1e-8);
            assert!(off < allowed(size), "{method} {gain}: {off:e} of {size:e}");
            let at = format!("{method} {gain}: |u| {of_u:e}, order {of_order:e}");
            assert!(of_order < allowed(largest), "{at}");
        }
    }
}

/// Returns a random load: a step, a growing sine, or a pulse.
fn load(rng: &mut ChaCha8Rng, size: f64) -> String {
    let (start, rise) = (rng.random_range(0.01..0.05), rng.random_range(0.02..0.05));
    let step = |value: f64, start: f64| {
        format!("{{ type = \"step\", value = {value:?}, start = {start:?}, rise = {rise:?} }}")
    };
    let value = size * rng.random_range(0.5..2.0);
    match rng.random_range(0..3) {
        0 => step(value, start),
        1 => format!(
            "{{ type = \"ramped-sine\", amplitude = {value:?}, frequency = {:?}, steepness = 60.0, shift = 4.0 }}",
            rng.random_range(4.0..15.0)
        ),
        _ => {
            let [up, down] = [step(value, start), step(-value, start + 2.0 * rise)];
            format!("{{ type = \"sum\", of = [{up}, {down}] }}")
        }
    }
}

/// Compares random scenes with the integration as one system at 100 times tighter tolerances.
fn expect_agreement(seeds: Range<u64>, most: usize, methods: &[&str]) {
    let folder = tempfile::tempdir().unwrap();
    for seed in seeds {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let n = (most as f64).powf(rng.random_range(0.0..1.0)) as usize;
        let gain = 10.0_f64.powf(rng.random_range(0.0..5.0));
        let (body, key, size) = [
            (MUSCLE, "traction[0].y", 100.0),
            (ROD, "rod.load", 1.0),
            (BLOCK, "traction[0].y", 2.0),
        ][seed as usize % 3];
        let with = with_chain(body, n, gain);
        let load = format!("{key}={}", load(&mut rng, size));
        let out = |name: &str| folder.path().join(format!("{name} {seed}"));
        let tight = "integrator.oscillators={ rtol = 1e-7, atol = 1e-10 }";
        let set = [&*load, "time.end=0.4", tight, "integrator.rtol=1e-8", TOGETHER];
        let document = run(&with, &set, &out("together"));
        assert_eq!(document["outcome"], "finished", "seed {seed}");
        for method in methods {
            let case = format!("seed {seed}, {method}, {n} oscillators, gain {gain:.1e}");
            let tolerances = "integrator.oscillators={ rtol = 1e-5, atol = 1e-8 }";
            // With BDF, the errors of u are 10 to 1000 times its tolerance.
            let rtol = match *method {
                "bdf" => "integrator.rtol=1e-7",
                _ => "integrator.rtol=1e-6",
            };
            let method = format!("integrator.method={method}");
            let set = [&*load, "time.end=0.4", tolerances, rtol, &method, SEPARATE];
            run(&with, &set, &out(&method));
            let tables = |name| [out(&method), out("together")].map(|out| rows(&out, name));
            let [one, other] = tables("states");
            // The errors of many steps amount to 20 tolerances.
            let allowed = |size: f64| 20.0 * (1e-5 * size + 1e-8);
            for k in 1..=n {
                let [size, off] = compare(&one, &other, &[k]);
                assert!(off < allowed(size), "{case}: {k} is {off:e} off of {size:e}");
            }
            let [one, other] = tables("order");
            let [size, off] = compare(&one, &other, &[1]);
            assert!(off < allowed(size), "{case}: |Ψ| is {off:e} off of {size:e}");
            for (one, other) in one.iter().zip(&other) {
                // χ has the relative errors of the positions; it is undefined at rest.
                let (off, amplitude) = ((one[3] - other[3]).abs(), other[1]);
                let allowed = allowed(amplitude) / amplitude;
                assert!(
                    amplitude < 1e-8 || off < allowed,
                    "{case}: |χ| is {off:e} off at {}",
                    one[0]
                );
            }
        }
    }
}

#[test]
fn random_scenes_agree_with_one_system_at_tighter_tolerances() {
    expect_agreement(0..3, 10, &["radau9"]);
}

#[test]
#[ignore = "slow"]
fn more_random_scenes_agree_with_one_system_at_tighter_tolerances() {
    expect_agreement(3..27, 1000, &["radau5", "radau9", "bdf"]);
}

/// Checks loads that jump, a preload, moving supports, and chains in all elements.
#[test]
fn scenes_of_other_kinds_agree_with_one_system() {
    let folder = tempfile::tempdir().unwrap();
    let with = with_chain(MUSCLE, 3, 1e4);
    let load = "y = { type = \"step\", value = 100.0, start = 0.02, rise = 0.03 }";
    let sine = "y = { type = \"sine\", amplitude = 50.0, frequency = 8.0, phase = 1.0 }\n\
                [initial_state]\ntype = \"equilibrium\"";
    let fixed = "[[fixed]]\ngroup = \"fixed\"";
    let moved = "[[prescribed_displacement]]\ngroup = \"fixed\"\nx = 0.0\n\
                 y = { type = \"step\", value = 0.005, rise = 0.1 }";
    for (name, from, to, n) in [
        ("jump", "rise = 0.03", "rise = 0.0", 3),
        ("equilibrium", load, sine, 3),
        ("support", fixed, moved, 3),
        ("at a support", "at = [0.0, 0.0]\ngain", "at = [-0.1, 0.0]\ngain", 3),
        ("elements", "at = [0.0, 0.0]\ngain", "at = { elements = \"muscle\" }\ngain", 900),
    ] {
        assert!(with.contains(from), "{name}");
        let scene = with
            .replace(from, to)
            .replace(fixed, if name == "at a support" { moved } else { fixed });
        let tables = ["separate", "together"].map(|chains| {
            let out = folder.path().join(format!("{name} {chains}"));
            let chains = format!("integrator.chains={chains}");
            let tolerances = "integrator.oscillators={ rtol = 1e-6, atol = 1e-9 }";
            run(&scene, &[&chains, "time.end=0.2", "integrator.rtol=1e-7", tolerances], &out);
            rows(&out, "states")
        });
        let columns: Vec<usize> = (1..=n).collect();
        let [size, off] = compare(&tables[0], &tables[1], &columns);
        // Both runs have this tolerance; the tolerance of the body is a tenth of this tolerance.
        assert!(off < 1e-6 * size + 1e-9, "{name}: {off:e} of {size:e}");
        assert!(size > 1e-4, "{name}: {size:e}");
    }
}
