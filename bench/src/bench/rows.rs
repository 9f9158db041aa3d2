//! Measurements of the rows of Table 2 with three linear solvers.

use anyhow::Context;
use myovib_model::linear::LinearWork;
use myovib_model::{
    LinearSolverKind, MuscleDae, Settings, Statistics, run as run_model, start_at_rest,
};
use myovib_sparse::Ordering;
use serde::Serialize;
use sundials_wrap::VectorArithmetic;

use super::{BenchArgs, fastest, give, goes_on};
use myovib_cli::exit::Exit;
use myovib_cli::machine::Machine;
use myovib_cli::progress::Progress;
use myovib_scene::{Body, Scene};

/// Rows of Table 2 for which the integration reaches the end time if multipliers are excluded from the error test.
const KEYS: [&str; 4] = ["1", "2m", "3m", "31"];

/// Linear solver to be measured.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Solver {
    /// Condensation of the matrix to dense blocks.
    Condensed,
    /// KLU for the full matrix.
    Full,
    /// Defaults of SUNDIALS: KLU with COLAMD and BTF, and serial vectors.
    SundialsDefaults,
}

impl Solver {
    const ALL: [Self; 3] = [Self::Condensed, Self::Full, Self::SundialsDefaults];

    fn name(self) -> &'static str {
        match self {
            Self::Condensed => "condensed",
            Self::Full => "full, AMD",
            Self::SundialsDefaults => "SUNDIALS' defaults",
        }
    }

    fn settings(self, body: &Body) -> Settings {
        let ours = body.settings.clone();
        match self {
            Self::Condensed => ours,
            Self::Full => {
                Settings { linear_solver: LinearSolverKind::Full, ordering: Ordering::Amd, ..ours }
            }
            Self::SundialsDefaults => Settings {
                linear_solver: LinearSolverKind::Full,
                ordering: Ordering::Colamd,
                btf: true,
                vectors: VectorArithmetic::Serial,
                ..ours
            },
        }
    }
}

#[derive(Serialize)]
struct RunJson {
    row: &'static str,
    linear_solver: &'static str,
    cpu_seconds: f64,
    steps: u64,
    residual_evaluations: u64,
    linear_setups: u64,
    outcome: &'static str,
    /// CPU time relative to the condensed solver.
    ratio: f64,
    /// Relative increase of the number of steps compared with the condensed solver.
    more_steps: f64,
    /// Work of the linear solver; counted only for the condensed solver.
    linear_work: Option<LinearWork>,
}

#[derive(Serialize)]
struct Document<'a> {
    machine: Machine,
    t_end: f64,
    repeats: u32,
    runs: &'a [RunJson],
    /// Total CPU time (s) for all rows by solver.
    sums: Vec<(&'static str, f64)>,
}

pub(super) fn run(args: &BenchArgs) -> anyhow::Result<Exit> {
    let t_end = args.t_end.unwrap_or(10.0);
    let progress = Progress::new(args.common.quiet);
    let mut runs = Vec::new();
    for key in KEYS {
        let set = [format!("time.end={t_end:e}")];
        let scene = Scene::built_in(&format!("table2-{key}"), &set)?;
        let body = scene.body.context("the scenes of Table 2 have a body")?;
        let mut first: Option<Statistics> = None;
        for solver in Solver::ALL.into_iter().take_while(|_| goes_on()) {
            progress.show(|| format!("row {key}, {}", solver.name()));
            let (statistics, work) = measure(&body, solver, args.repeats)?;
            let base = first.get_or_insert_with(|| statistics.clone());
            runs.push(RunJson {
                row: key,
                linear_solver: solver.name(),
                cpu_seconds: statistics.cpu_seconds,
                steps: statistics.counts.steps,
                residual_evaluations: statistics.counts.residual_evaluations,
                linear_setups: statistics.counts.linear_setups,
                outcome: statistics.outcome.name(),
                ratio: statistics.cpu_seconds / base.cpu_seconds,
                more_steps: statistics.counts.steps as f64 / base.counts.steps as f64 - 1.0,
                linear_work: (work.solves > 0).then_some(work),
            });
        }
    }
    drop(progress);
    let sum = |solver: Solver| {
        let of_solver = runs.iter().filter(|run| run.linear_solver == solver.name());
        (solver.name(), of_solver.map(|run| run.cpu_seconds).sum())
    };
    let document = Document {
        machine: Machine::found(),
        t_end,
        repeats: args.repeats,
        runs: &runs,
        sums: Solver::ALL.map(sum).into(),
    };
    give(args, &document)
}

/// Runs a row `repeats` times and returns the fastest run.
fn measure(body: &Body, solver: Solver, repeats: u32) -> anyhow::Result<(Statistics, LinearWork)> {
    let settings = solver.settings(body);
    let once = || -> anyhow::Result<_> {
        let dae = MuscleDae::new(body.muscle.clone(), body.formulation)?;
        let mut integrator = start_at_rest(dae, &settings)?;
        let statistics = run_model(integrator.as_mut(), &mut [])?;
        Ok((statistics, integrator.problem().counters().linear))
    };
    fastest(repeats, once, |(statistics, _)| statistics.cpu_seconds)
}
