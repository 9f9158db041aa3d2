//! Default settings compared with their alternatives: separate steps of chains, and factors in single precision.

use anyhow::Context;
use myovib_cli::exit::Exit;
use myovib_cli::machine::Machine;
use myovib_dae::Problem;
use myovib_model::MuscleDae;
use myovib_model::linear::{Reduction, Scalar};
use myovib_scene::run::{RunOptions, compute};
use myovib_scene::{InputError, Scene};
use myovib_sparse::{Precision, Prediction, SparseOptions};
use num_complex::Complex64;
use serde::Serialize;

use super::large::{C, Linear, body};
use super::{BenchArgs, fastest, give, goes_on};

/// Title, scene, overrides, and variants of the chains with their overrides.
type Case = (&'static str, &'static str, &'static [&'static str], &'static [Variant]);
type Variant = (&'static str, &'static [&'static str]);

const CHAIN: &str = "chain=[{ name = \"chain\", oscillators = 1000, frequency_spread = 0.1, gain = 1e4, at = [0, 0] }]";
const WITHOUT: Variant = ("without chains", &["chain=", "integrator.chains="]);
const SEPARATE: Variant = ("separate steps", &["integrator.chains=separate"]);
const TOGETHER: Variant = ("one system", &["integrator.chains=together"]);
const ALL: &[Variant] = &[WITHOUT, SEPARATE, TOGETHER];
const CASES: [Case; 4] = [
    ("init to 10 s, 1000 oscillators", "init", &["time.end=10", CHAIN], ALL),
    ("figure7 to 10 s, 5 oscillators", "figure7", &["time.end=10"], ALL),
    ("muscle3d to 0.5 s, 1000 oscillators", "muscle3d", &["time.end=0.5"], ALL),
    (
        "muscle3d to 0.5 s, 100 000 oscillators",
        "muscle3d",
        &["time.end=0.5", "chain[0].oscillators=100000"],
        &[WITHOUT, SEPARATE],
    ),
];

/// Cells along and across the spindles whose matrices are factorized.
const CELLS: [[usize; 2]; 2] = [[30, 6], [40, 10]];

/// The variants of a case.
#[derive(Serialize)]
struct Comparison {
    scene: &'static str,
    runs: Vec<Run>,
}

/// A run of a variant.
#[derive(Serialize)]
struct Run {
    variant: &'static str,
    unknowns: u64,
    steps: u64,
    chain_steps: Option<u64>,
    cpu_seconds: f64,
}

/// Factors of one matrix in single precision, relative to double precision.
#[derive(Serialize)]
struct Factors {
    unknowns: usize,
    matrix: &'static str,
    /// Milliseconds of a factorization in double and in single precision.
    milliseconds: [f64; 2],
    factor: f64,
    /// The first solve after a factorization, which is checked and refined, and a later one.
    checked_solve: f64,
    solve: f64,
    /// Memory of the matrix, its analysis and its factors.
    memory: f64,
}

#[derive(Serialize)]
struct Document {
    machine: Machine,
    profile: &'static str,
    repeats: u32,
    chains: Vec<Comparison>,
    factors: Vec<Factors>,
}

pub(super) fn run(args: &BenchArgs) -> anyhow::Result<Exit> {
    let (mut chains, mut factors) = (Vec::new(), Vec::new());
    for (title, scene, set, variants) in CASES {
        let variants = variants.iter().take_while(|_| goes_on());
        let runs = variants.map(|(variant, own)| measured(variant, scene, &[set, own], args));
        chains.push(Comparison { scene: title, runs: runs.collect::<anyhow::Result<_>>()? });
    }
    for cells in CELLS.into_iter().take_while(|_| goes_on()) {
        factors.extend(compared(cells, args.repeats)?);
    }
    let document = Document {
        machine: Machine::found(),
        profile: if cfg!(debug_assertions) { "dev" } else { "release" },
        repeats: args.repeats,
        chains,
        factors,
    };
    give(args, &document)
}

/// Returns a built-in scene without probes and fields.
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
    let once = || -> anyhow::Result<_> {
        let folder = tempfile::tempdir()?;
        let document = compute(&scene, &RunOptions::into_folder(folder.path()))?.document;
        let seconds = document["cpu_seconds"].as_f64().context("a run has a CPU time")?;
        Ok((document, seconds))
    };
    let (document, cpu_seconds) = fastest(args.repeats, once, |(_, seconds)| *seconds)?;
    let count = |key: &str| document[key].as_u64().context("a run has counts");
    Ok(Run {
        variant,
        unknowns: count("unknowns")?,
        steps: count("steps")?,
        chain_steps: document["chains"]["steps"].as_u64(),
        cpu_seconds,
    })
}

/// Compares the factors of a real and of a complex matrix of a spindle.
fn compared([along, across]: [usize; 2], repeats: u32) -> anyhow::Result<[Factors; 2]> {
    let body = body("muscle3d", &[format!("mesh.cells=[{along}, {across}, {across}]")])?;
    let mut dae = MuscleDae::new(body.muscle, body.formulation)?;
    let n = dae.n_unknowns();
    dae.update_matrices(0.5, &vec![1e-7; n], &vec![1e-6; n])?;
    let real = in_both(&dae, ("real", C), repeats, Reduction::prediction::<f64>)?;
    let c = Complex64::new(C, 0.7 * C);
    Ok([real, in_both(&dae, ("complex", c), repeats, Reduction::prediction::<Complex64>)?])
}

fn in_both<T: Scalar>(
    dae: &MuscleDae,
    (matrix, c): (&'static str, T),
    repeats: u32,
    prediction: fn(&Reduction) -> Option<Prediction>,
) -> anyhow::Result<Factors> {
    let one = |precision| -> anyhow::Result<_> {
        let reduction = Reduction::new(dae, SparseOptions { precision, ..Default::default() })?;
        let bytes = prediction(&reduction).context("no engine is installed")?.bytes;
        let Linear { factor, checked_solve, solve, .. } =
            Linear::measure(dae, &reduction, c, repeats)?;
        Ok([factor, checked_solve, solve, bytes as f64])
    };
    let [double, single] = [one(Precision::Double)?, one(Precision::Mixed)?];
    let ratio = |k: usize| single[k] / double[k];
    Ok(Factors {
        unknowns: dae.muscle().n_unknowns_paper(),
        matrix,
        milliseconds: [1e3 * double[0], 1e3 * single[0]],
        factor: ratio(0),
        checked_solve: ratio(1),
        solve: ratio(2),
        memory: ratio(3),
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
