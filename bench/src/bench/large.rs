//! Measurements of large bodies: CPU time of each part of twenty steps, memory, and growth of the costs with the number
//! of unknowns.

use std::fs;

use anyhow::{Context, ensure};
use cpu_time::ThreadTime;
use myovib_cli::exit::Exit;
use myovib_cli::machine::Machine;
use myovib_dae::Problem;
use myovib_model::linear::{LinearWork, Reduction, Scalar};
use myovib_model::{Advance, Counts, MuscleDae, start_at_rest};
use myovib_scene::{Body, InputError, Scene};
use myovib_sparse::SparseOptions;
use myovib_sparse::resources;
use num_complex::Complex64;
use serde::Serialize;

use super::{BenchArgs, fastest_call, give, goes_on};

/// Number of measured steps.
const STEPS: usize = 20;
/// Number of timed calls of a kernel. The fastest call is reported.
const REPEATS: u32 = 2;
/// Factor of ∂F/∂ẏ (1/s) for steps of about one millisecond, 1.5 / 1 ms.
const C: f64 = 1.5e3;

/// Motion of a body: name, method, scene, overrides, and the time (s) after which steps are measured.
type Motion = (&'static str, &'static str, &'static str, &'static [&'static str], f64);

/// The ventricle starts to contract at 0.16 s, and the spindle is loaded from 0.4 s on.
const MOTIONS: [Motion; 4] = [
    ("ventricle", "bdf", "ventricle", &[], 0.17),
    ("ventricle", "radau5", "ventricle", &[], 0.17),
    ("spindle", "bdf", "muscle3d", SPINDLE, 0.4),
    ("spindle", "radau5", "muscle3d", SPINDLE, 0.4),
];
const SPINDLE: &[&str] = &["mesh.cells=[40, 10, 10]"];
/// Name of the case that measures the growth of costs.
const GROWTH: &str = "growth";
/// Numbers of cells along and across the spindle, in increasing order.
const CELLS: [[usize; 2]; 4] = [[20, 4], [30, 6], [40, 10], [50, 12]];

/// Measurement of twenty steps.
#[derive(Serialize)]
struct Run {
    body: &'static str,
    method: &'static str,
    unknowns_paper: usize,
    /// Start and end time, s.
    t: [f64; 2],
    cpu_seconds: f64,
    parts: Vec<Part>,
    memory: MemoryUse,
}

/// Part of a run, with its number of calls and the time of one call at the end of the run.
#[derive(Serialize)]
struct Part {
    what: &'static str,
    number: u64,
    milliseconds: f64,
    /// Fraction of the CPU time of the run.
    share: f64,
}

/// Memory of the process, MiB.
#[derive(Serialize)]
struct MemoryUse {
    /// Memory in use after allocation of the matrices, plus the memory predicted for their factors.
    predicted: f64,
    /// Peak memory.
    peak: f64,
    /// Relative difference between the peak and the prediction.
    off: f64,
}

/// Measurement of the spindle for one mesh.
#[derive(Serialize)]
struct Level {
    cells: [usize; 2],
    unknowns_paper: usize,
    residual_ms: f64,
    tangents_ms: f64,
    analysis_ms: f64,
    factor_ms: f64,
    solve_ms: f64,
    factor_entries: u64,
    flops: f64,
    factors_mib: f64,
}

#[derive(Serialize)]
struct Document {
    machine: Machine,
    steps: usize,
    runs: Vec<Run>,
    levels: Vec<Level>,
    /// Exponents p of costs proportional to nᵖ for n unknowns, computed from the first and the last level.
    exponents: Vec<(&'static str, f64)>,
}

pub(super) fn run(args: &BenchArgs) -> anyhow::Result<Exit> {
    let motions = MOTIONS.map(|motion| (format!("{}-{}", motion.0, motion.1), motion));
    let names = motions.iter().map(|(name, _)| name.as_str());
    let names: Vec<_> = names.chain([GROWTH]).collect();
    if let Some(unknown) = args.cases.iter().find(|case| !names.contains(&&***case)) {
        let error = InputError::new("unknown case").at("--cases").found(unknown);
        return Err(error.allowed(names.join(", ")).into());
    }
    let wanted = |name: &str| args.cases.is_empty() || args.cases.iter().any(|case| case == name);
    let (mut runs, mut levels) = (Vec::new(), Vec::new());
    for (name, (body, method, scene, set, from)) in &motions {
        if wanted(name) && goes_on() {
            runs.push(twenty_steps([body, method, scene], set, *from)?);
        }
    }
    if wanted(GROWTH) {
        for cells in CELLS.into_iter().take_while(|_| goes_on()) {
            levels.push(level(cells)?);
        }
    }
    let document = Document {
        machine: Machine::found(),
        steps: STEPS,
        exponents: exponents(&levels),
        runs,
        levels,
    };
    give(args, &document)
}

fn body(scene: &str, set: &[String]) -> anyhow::Result<Body> {
    let scene = Scene::built_in(scene, set)?;
    scene.body.context("the scene has a body")
}

fn mib(bytes: Option<usize>) -> anyhow::Result<f64> {
    let bytes = bytes.context("this system does not report the memory in use")?;
    Ok(bytes as f64 / f64::from(1 << 20))
}

fn twenty_steps(
    [name, method, scene]: [&'static str; 3],
    set: &[&str],
    from: f64,
) -> anyhow::Result<Run> {
    let method_set = format!("integrator.method=\"{method}\"");
    let set = set.iter().map(|&set| set.to_owned());
    let set: Vec<String> = set.chain([method_set]).collect();
    let Body { muscle, formulation, settings, .. } = body(scene, &set)?;
    let n_complex = settings.integrator.stages().unwrap_or(1) / 2;
    let mut dae = MuscleDae::new(muscle.clone(), formulation)?;
    let unknowns_paper = muscle.n_unknowns_paper();
    let predicted = predicted_memory(&mut dae, n_complex)?;

    let mut integrator = start_at_rest(dae, &settings)?;
    let mut step = || -> anyhow::Result<_> {
        let advance = integrator.advance()?;
        ensure!(advance == Advance::Stepped, "the run ended: {advance:?}");
        let (counts, work) = (integrator.counts(), *integrator.problem().counters());
        Ok((integrator.time(), counts, work))
    };
    let mut before_steps = step()?;
    while before_steps.0 < from {
        before_steps = step()?;
    }
    let started = ThreadTime::now();
    let mut after_steps = step()?;
    for _ in 1..STEPS {
        after_steps = step()?;
    }
    let cpu_seconds = started.elapsed().as_secs_f64();
    let peak = mib(resources::peak())?;
    let ((begin, counts, work), (t, later, done)) = (before_steps, after_steps);
    let n = integrator.problem().n_unknowns();
    let (mut y, mut y_dot) = (vec![0.0; n], vec![0.0; n]);
    integrator.dense_output(t, 0, &mut y)?;
    integrator.dense_output(t, 1, &mut y_dot)?;
    drop(integrator);

    let mut dae = MuscleDae::new(muscle, formulation)?;
    let one = One::measure(&mut dae, t, &y, &y_dot, n_complex > 0)?;
    let solves = done.linear.solves - work.linear.solves;
    let linear = linear_work(counts, later, solves);
    let [residuals, tangents] =
        [done.residual_passes - work.residual_passes, done.tangent_passes - work.tangent_passes];
    let parts = [
        ("residuals", residuals, one.residual),
        ("tangents", tangents, one.tangents),
        ("real factors", linear[0], one.real.factor),
        ("complex factors", linear[1], one.complex.factor),
        ("real solves", linear[2], one.real.solve),
        ("complex solves", linear[3], one.complex.solve),
    ];
    let part = |(what, number, seconds): (_, u64, f64)| Part {
        what,
        number,
        milliseconds: 1e3 * seconds,
        share: number as f64 * seconds / cpu_seconds,
    };
    Ok(Run {
        body: name,
        method,
        unknowns_paper,
        t: [begin, t],
        cpu_seconds,
        parts: parts.into_iter().map(part).collect(),
        memory: MemoryUse { predicted, peak, off: peak / predicted - 1.0 },
    })
}

/// Resets the peak memory counter, which includes earlier runs, and predicts the memory (MiB) of a run.
fn predicted_memory(dae: &mut MuscleDae, n_complex: usize) -> anyhow::Result<f64> {
    fs::write("/proc/self/clear_refs", "5").context("/proc/self/clear_refs")?;
    // The system counts memory as used only after it is first written.
    let at_rest = vec![0.0; dae.n_unknowns()];
    dae.update_matrices(0.0, &at_rest, &at_rest)?;
    let reduction = Reduction::new(dae, SparseOptions::default())?;
    let needs = reduction.needs(n_complex);
    Ok(mib(resources::in_use())? + mib(needs.map(|needs| needs.bytes))?)
}

/// Returns the numbers of real and complex factorizations and solves between two states of the counters. The
/// counters of BDF do not include solves, so the number of solves is passed as `solves`.
fn linear_work(before: Counts, after: Counts, solves: u64) -> [u64; 4] {
    match (before.radau_work, after.radau_work) {
        (before, Some(after)) => {
            let before = before.unwrap_or_default();
            [
                after.real_factorizations - before.real_factorizations,
                after.complex_factorizations - before.complex_factorizations,
                after.real_solves - before.real_solves,
                after.complex_solves - before.complex_solves,
            ]
        }
        _ => [after.linear_setups - before.linear_setups, 0, solves, 0],
    }
}

/// CPU time (s) of one call of each part.
struct One {
    residual: f64,
    tangents: f64,
    real: Linear,
    complex: Linear,
}

#[derive(Default)]
struct Linear {
    factor: f64,
    solve: f64,
    entries: u64,
}

impl One {
    fn measure(
        dae: &mut MuscleDae,
        t: f64,
        y: &[f64],
        y_dot: &[f64],
        has_complex: bool,
    ) -> anyhow::Result<Self> {
        let mut out = vec![0.0; y.len()];
        let residual = fastest_call(REPEATS, || dae.residual(t, y, y_dot, &mut out))?;
        let tangents = fastest_call(REPEATS, || dae.update_matrices(t, y, y_dot))?;
        let reduction = Reduction::new(dae, SparseOptions::default())?;
        let complex = match has_complex {
            true => Linear::measure(dae, &reduction, Complex64::new(C, 0.7 * C))?,
            false => Linear::default(),
        };
        Ok(Self { residual, tangents, real: Linear::measure(dae, &reduction, C)?, complex })
    }
}

impl Linear {
    fn measure<T: Scalar>(dae: &MuscleDae, reduction: &Reduction, c: T) -> anyhow::Result<Self> {
        let mut matrix = reduction.matrix::<T>();
        let mut work = LinearWork::default();
        let factor =
            fastest_call(REPEATS, || matrix.set_up(c, |m| dae.matrix_values(m), &mut work))?;
        let mut x = vec![T::one(); dae.n_unknowns()];
        // The first solution after a factorization is checked, so only later solves are timed.
        matrix.solve(&mut x, &mut work)?;
        let solve = fastest_call(REPEATS, || {
            x.fill(T::one());
            matrix.solve(&mut x, &mut work)
        })?;
        Ok(Self { factor, solve, entries: work.factor_entries })
    }
}

fn level([along, across]: [usize; 2]) -> anyhow::Result<Level> {
    let cells = format!("mesh.cells=[{along}, {across}, {across}]");
    let Body { muscle, formulation, .. } = body("muscle3d", &[cells])?;
    let unknowns_paper = muscle.n_unknowns_paper();
    let mut dae = MuscleDae::new(muscle, formulation)?;
    let n = dae.n_unknowns();
    let (y, y_dot) = (vec![1e-7; n], vec![1e-6; n]);
    let started = ThreadTime::now();
    let reduction = Reduction::new(&dae, SparseOptions::default())?;
    let analysis = started.elapsed().as_secs_f64();
    let needs = reduction.needs(0).context("no engine is installed")?;
    let one = One::measure(&mut dae, 0.5, &y, &y_dot, false)?;
    Ok(Level {
        cells: [along, across],
        unknowns_paper,
        residual_ms: 1e3 * one.residual,
        tangents_ms: 1e3 * one.tangents,
        analysis_ms: 1e3 * analysis,
        factor_ms: 1e3 * one.real.factor,
        solve_ms: 1e3 * one.real.solve,
        factor_entries: one.real.entries,
        flops: needs.flops,
        factors_mib: mib(Some(needs.bytes))?,
    })
}

fn exponents(levels: &[Level]) -> Vec<(&'static str, f64)> {
    let [first, .., last] = levels else {
        return Vec::new();
    };
    let growth = |value: fn(&Level) -> f64| (value(last) / value(first)).ln();
    let unknowns = growth(|l| l.unknowns_paper as f64);
    let of = |name, value: fn(&Level) -> f64| (name, growth(value) / unknowns);
    vec![
        of("residual", |l| l.residual_ms),
        of("tangents", |l| l.tangents_ms),
        of("analysis", |l| l.analysis_ms),
        of("factor", |l| l.factor_ms),
        of("solve", |l| l.solve_ms),
        of("entries", |l| l.factor_entries as f64),
        of("operations", |l| l.flops),
        of("memory", |l| l.factors_mib),
    ]
}
