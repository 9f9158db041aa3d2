//! How time, memory and fill grow with the mesh.

use std::fs;
use std::sync::Arc;

use cpu_time::ThreadTime;
use myovib_dae::Problem;
use myovib_fem::Mesh;
use myovib_model::linear::{Condensation, Condensed, LinearWork};
use myovib_model::{
    Formulation, LinearSolver, MuscleDae, Settings, ida, paper, run as run_model, start_at_rest,
};
use myovib_sparse::SparseError;
use myovib_sparse::SparseOptions;
use myovib_sparse::klu::{Numeric, Symbolic};
use serde::Serialize;

use super::{BenchArgs, give, goes_on};
use myovib_cli::exit::Exit;
use myovib_cli::machine::Machine;
use myovib_report::table::{Align, Cell, Table, coloured_stdout};

/// The fastest of several calls, CPU seconds.
pub(super) fn fastest_call<E>(
    repeats: u32,
    mut call: impl FnMut() -> Result<(), E>,
) -> Result<f64, E> {
    let mut best = f64::INFINITY;
    for _ in 0..repeats.max(1) {
        let start = ThreadTime::now();
        call()?;
        best = best.min(start.elapsed().as_secs_f64());
    }
    Ok(best)
}

/// One mesh.
#[derive(Debug, Serialize)]
struct Level {
    refinements: u32,
    triangles: usize,
    /// q and λ with the fixed nodes counted.
    unknowns_paper: usize,
    /// Of the system that is factorised.
    condensed: usize,
    residual_ms: f64,
    jacobian_ms: f64,
    factor_ms: f64,
    refactor_ms: f64,
    solve_ms: f64,
    /// Entries of L and U.
    fill: u64,
    /// The same matrix by KLU.
    klu: Klu,
    steps: u64,
    ms_per_step: f64,
    run_cpu_seconds: f64,
    t_reached: f64,
    outcome: &'static str,
    /// Memory of the whole program at its largest until the run was over, MiB.
    peak_mib: Option<f64>,
}

/// What KLU needs for a matrix.
#[derive(Debug, Serialize)]
struct Klu {
    factor_ms: f64,
    refactor_ms: f64,
    solve_ms: f64,
    fill: u64,
}

impl Klu {
    /// Factorises anew, again with the same pivots, and solves.
    fn measure(
        plan: &Condensation,
        values: &[f64],
        options: SparseOptions,
        repeats: u32,
    ) -> Result<Self, SparseError> {
        let symbolic = Symbolic::analyze(plan.pattern(), options)?;
        let factor = fastest_call(repeats, || Numeric::factor(&symbolic, values).map(drop))?;
        let mut numeric = Numeric::factor(&symbolic, values)?;
        let refactor = fastest_call(repeats, || numeric.refactor(values))?;
        let mut x = vec![1.0; plan.n_condensed()];
        let solve = fastest_call(repeats, || {
            x.fill(1.0);
            numeric.solve(&mut x)
        })?;
        let (lower, upper) = numeric.nnz_factors();
        Ok(Self {
            factor_ms: 1e3 * factor,
            refactor_ms: 1e3 * refactor,
            solve_ms: 1e3 * solve,
            fill: (lower + upper) as u64,
        })
    }
}

#[derive(Serialize)]
struct Document<'a> {
    machine: Machine,
    t_end: f64,
    levels: &'a [Level],
}

pub(super) fn run(args: &BenchArgs, mesh: &Mesh) -> anyhow::Result<Exit> {
    let t_end = args.t_end.unwrap_or(0.5);
    let mut mesh = mesh.clone();
    let mut levels = Vec::new();
    for refinements in (0..=args.refinements).take_while(|_| goes_on()) {
        if refinements > 0 {
            mesh = mesh.refined()?;
        }
        levels.push(measure(&mesh, refinements, t_end)?);
    }
    let document = Document {
        machine: Machine::found(),
        t_end,
        levels: &levels,
    };
    give(args, &text(&levels), &document)
}

fn measure(mesh: &Mesh, refinements: u32, t_end: f64) -> anyhow::Result<Level> {
    let formulation = Formulation::Position;
    let settings = Settings {
        t_end,
        linear_solver: LinearSolver::Condensed,
        ..Settings::paper(formulation)
    };
    let muscle = paper::muscle(mesh, paper::KAPPA, 0.0)?;
    let unknowns_paper = muscle.n_unknowns_paper();
    let mut dae = MuscleDae::new(muscle, formulation)?;
    let n = dae.n_unknowns();
    let (y, y_dot) = (vec![1e-7; n], vec![1e-6; n]);
    let mut out = vec![0.0; n];
    let repeats = 10.max(200 >> (2 * refinements));
    let residual = fastest_call(repeats, || dae.residual(0.5, &y, &y_dot, &mut out))?;

    let plan = Arc::new(Condensation::new(&dae));
    let elimination = plan.elimination(ida::options(&dae, &settings).sparse)?;
    let mut matrix = Condensed::<f64>::new(Arc::clone(&plan), Arc::new(elimination));
    let mut work = LinearWork::default();
    // A first evaluation of a state without meaning would cost what one with it does.
    let jacobian = fastest_call(5.max(repeats / 10), || dae.update_matrices(0.5, &y, &y_dot))?;
    let mut set_up = |work: &mut LinearWork| {
        let start = ThreadTime::now();
        let done = matrix.set_up(1e3, |m| dae.matrix_values(m), work);
        done.map(|()| start.elapsed().as_secs_f64())
    };
    let factor = set_up(&mut work)?;
    let refactor = (0..3.max(repeats / 10))
        .map(|_| set_up(&mut work))
        .collect::<Result<Vec<_>, _>>()?
        .into_iter()
        .fold(f64::INFINITY, f64::min);
    let mut x = out.clone();
    matrix.solve(&mut x, &mut work)?;
    let solve = fastest_call(repeats, || {
        x.copy_from_slice(&out);
        matrix.solve(&mut x, &mut work)
    })?;
    let options = ida::options(&dae, &settings).sparse;
    let values = matrix.values().to_vec();
    drop(matrix);

    let mut integrator = start_at_rest(dae, &settings)?;
    let statistics = run_model(integrator.as_mut(), &mut [])?;
    drop(integrator);
    // KLU last: the run's memory is not to hold its factors.
    let peak_mib = peak_mib();
    let repeats = 3.max(repeats / 20);
    let klu = Klu::measure(&plan, &values, options, repeats)?;
    Ok(Level {
        refinements,
        triangles: mesh.n_elements(),
        unknowns_paper,
        condensed: plan.n_condensed(),
        residual_ms: 1e3 * residual,
        jacobian_ms: 1e3 * jacobian,
        factor_ms: 1e3 * factor,
        refactor_ms: 1e3 * refactor,
        solve_ms: 1e3 * solve,
        fill: work.factor_entries,
        klu,
        steps: statistics.counts.steps,
        ms_per_step: 1e3 * statistics.cpu_seconds / statistics.counts.steps as f64,
        run_cpu_seconds: statistics.cpu_seconds,
        t_reached: statistics.t_reached,
        outcome: statistics.outcome.name(),
        peak_mib,
    })
}

/// The largest resident memory of this process so far, where the system tells it.
fn peak_mib() -> Option<f64> {
    let text = fs::read_to_string("/proc/self/status").ok()?;
    let line = text.lines().find(|line| line.starts_with("VmHWM:"))?;
    let kib: f64 = line.split_whitespace().nth(1)?.parse().ok()?;
    Some(kib / 1024.0)
}

/// The exponent p of value ∝ unknowns^p from one mesh to the next.
fn exponent(levels: &[Level], i: usize, value: impl Fn(&Level) -> f64) -> String {
    if i == 0 {
        return String::new();
    }
    let ratio = |f: &dyn Fn(&Level) -> f64| (f(&levels[i]) / f(&levels[i - 1])).ln();
    let p = ratio(&value) / ratio(&|level| level.condensed as f64);
    format!(" ({p:.2})")
}

fn text(levels: &[Level]) -> String {
    use Align::Right;
    let mut table = Table::new(&[
        ("refined", Right),
        ("triangles", Right),
        ("q and λ", Right),
        ("condensed", Right),
        ("residual ms", Right),
        ("tangents ms", Right),
        ("factor ms", Right),
        ("refactor ms", Right),
        ("solve ms", Right),
        ("fill", Right),
        ("KLU: factor", Right),
        ("refactor", Right),
        ("solve", Right),
        ("fill", Right),
        ("steps", Right),
        ("ms per step", Right),
        ("run, CPU s", Right),
        ("peak MiB", Right),
    ]);
    for (i, level) in levels.iter().enumerate() {
        let timed =
            |value: fn(&Level) -> f64| format!("{:.3}{}", value(level), exponent(levels, i, value));
        table.row(
            [
                level.refinements.to_string(),
                level.triangles.to_string(),
                level.unknowns_paper.to_string(),
                level.condensed.to_string(),
                timed(|l| l.residual_ms),
                timed(|l| l.jacobian_ms),
                timed(|l| l.factor_ms),
                timed(|l| l.refactor_ms),
                timed(|l| l.solve_ms),
                format!("{}{}", level.fill, exponent(levels, i, |l| l.fill as f64)),
                format!("{:.3}", level.klu.factor_ms),
                format!("{:.3}", level.klu.refactor_ms),
                format!("{:.3}", level.klu.solve_ms),
                level.klu.fill.to_string(),
                level.steps.to_string(),
                timed(|l| l.ms_per_step),
                format!("{:.2}", level.run_cpu_seconds),
                level.peak_mib.map_or("–".into(), |mib| format!("{mib:.0}")),
            ]
            .map(Cell::from),
        );
    }
    let mut text = table.render(coloured_stdout());
    text.push_str("\nIn brackets: the exponent of growth with the size of the condensed system.\n");
    text
}
