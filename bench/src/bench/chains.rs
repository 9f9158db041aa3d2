//! Compares simulations of the body alone, of body and chains with separate steps, and of body and chains as one system.

use anyhow::Context;
use myovib_cli::exit::Exit;
use myovib_cli::machine::Machine;
use myovib_scene::{InputError, Scene};
use serde::Serialize;

use super::{BenchArgs, fastest_document, give, goes_on};

/// A case: title, scene, overrides, and variants of the chains. Each variant has a name and overrides.
type Case = (&'static str, &'static str, &'static [&'static str], &'static [Variant]);
type Variant = (&'static str, &'static [&'static str]);

const CHAIN: &str = "chain=[{ name = \"chain\", oscillators = 1000, frequency_spread = 0.1, gain = 1e4, at = [0, 0] }]";
const WITHOUT: Variant = ("without chains", &["chain=", "integrator.chains="]);
const SEPARATE: Variant = ("separate steps", &["integrator.chains=separate"]);
const TOGETHER: Variant = ("one system", &["integrator.chains=together"]);
const ALL: &[Variant] = &[WITHOUT, SEPARATE, TOGETHER];
const CASES: [Case; 5] = [
    ("init to 10 s, 1000 oscillators", "init", &["time.end=10", CHAIN], ALL),
    ("figure7 to 50 s, 5 oscillators", "figure7", &[], ALL),
    // `TOGETHER` is excluded, because the tolerance of the chain requires a higher order in one system.
    ("figure7, BDF of order 2", "figure7", &["integrator.max_order=2"], &[WITHOUT, SEPARATE]),
    ("muscle3d to 2 s, 1000 oscillators", "muscle3d", &[], ALL),
    (
        "muscle3d to 2 s, 100 000 oscillators",
        "muscle3d",
        &["chain[0].oscillators=100000"],
        &[WITHOUT, SEPARATE],
    ),
];

/// Comparison of the variants of one case.
#[derive(Serialize)]
struct Comparison {
    scene: &'static str,
    runs: Vec<Run>,
}

/// Run of one variant.
#[derive(Serialize)]
struct Run {
    variant: &'static str,
    unknowns: u64,
    steps: u64,
    chain_steps: Option<u64>,
    cpu_seconds: f64,
}

#[derive(Serialize)]
struct Document {
    machine: Machine,
    profile: &'static str,
    repeats: u32,
    chains: Vec<Comparison>,
}

pub(super) fn run(args: &BenchArgs) -> anyhow::Result<Exit> {
    let mut chains = Vec::new();
    for (title, scene, set, variants) in CASES {
        let variants = variants.iter().take_while(|_| goes_on());
        let runs = variants.map(|(variant, own)| measured(variant, scene, &[set, own], args));
        chains.push(Comparison { scene: title, runs: runs.collect::<anyhow::Result<_>>()? });
    }
    let document = Document {
        machine: Machine::found(),
        profile: if cfg!(debug_assertions) { "dev" } else { "release" },
        repeats: args.repeats,
        chains,
    };
    give(args, &document)
}

/// Returns a built-in scene without its probes and fields.
fn without_outputs(scene: &str, set: &[&[&str]]) -> Result<Scene, InputError> {
    let set = set.iter().copied().flatten().chain(&["probe=", "fields="]);
    let set: Vec<String> = set.map(|&set| set.to_owned()).collect();
    Scene::built_in(scene, &set)
}

fn measured(
    variant: &'static str,
    scene: &str,
    set: &[&[&str]],
    args: &BenchArgs,
) -> anyhow::Result<Run> {
    let scene = without_outputs(scene, set)?;
    let (document, cpu_seconds) = fastest_document(&scene, args.repeats)?;
    let count = |key: &str| document[key].as_u64().context("a run has counts");
    Ok(Run {
        variant,
        unknowns: count("unknowns")?,
        steps: count("steps")?,
        chain_steps: document["chains"]["steps"].as_u64(),
        cpu_seconds,
    })
}

#[cfg(test)]
#[test]
fn only_the_first_variants_lack_chains() {
    for (title, scene, set, variants) in CASES {
        for (variant, own) in variants {
            let built = without_outputs(scene, &[set, own]).unwrap();
            assert_eq!(built.chains.is_empty(), *variant == WITHOUT.0, "{title}, {variant}");
        }
    }
}
