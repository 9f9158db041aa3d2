//! Cost of features, enabled one after the other on the same mesh.

use myovib_fem::{Law, Mesh};
use myovib_model::{
    Formulation, MuscleDae, Settings, Signal, paper, run as run_model, start_at_rest,
};
use serde::Serialize;

use super::{BenchArgs, fastest, fastest_call, give, goes_on};
use myovib_cli::exit::Exit;
use myovib_cli::machine::Machine;
use myovib_dae::Problem;
use myovib_report::table::{Align, Cell, Table, colored_stdout};

/// A scene with one more feature than the previous one.
struct Scene {
    feature: &'static str,
    formulation: Formulation,
    law: Law,
    kappa: f64,
    beta: f64,
}

fn scenes() -> [Scene; 6] {
    use Formulation::{Displacement, ImplicitRate, Position, Rate};
    use paper::{BETA, KAPPA, LAW, SMALL_STRAIN};
    const INF: f64 = f64::INFINITY;
    let scene =
        |feature, formulation, law, kappa, beta| Scene { feature, formulation, law, kappa, beta };
    [
        scene("small strain, no pressure", Displacement, SMALL_STRAIN, KAPPA, 0.0),
        scene("+ pressure, κ = ∞", Position, SMALL_STRAIN, INF, 0.0),
        scene("+ κ finite", Position, SMALL_STRAIN, KAPPA, 0.0),
        scene("+ Mooney–Rivlin", Position, LAW, KAPPA, 0.0),
        scene("+ β, ṗ of the integrator", ImplicitRate, LAW, KAPPA, BETA),
        scene("+ β, ṗ an unknown", Rate, LAW, KAPPA, BETA),
    ]
}

#[derive(Serialize)]
struct Row {
    feature: &'static str,
    formulation: &'static str,
    unknowns: usize,
    residual_microseconds: f64,
    jacobian_microseconds: f64,
    run_cpu_seconds: f64,
    outcome: &'static str,
    steps: u64,
    residual_passes: u64,
    force_rate_passes: u64,
    tangent_passes: u64,
    rate_tangent_passes: u64,
}

#[derive(Serialize)]
struct Document<'a> {
    machine: Machine,
    t_end: f64,
    features: &'a [Row],
}

/// Calls of a residual; the fastest is reported.
const REPEATS: u32 = 1000;

pub(super) fn run(args: &BenchArgs, mesh: &Mesh) -> anyhow::Result<Exit> {
    let t_end = args.t_end.unwrap_or(1.0);
    let rows = scenes()
        .iter()
        .take_while(|_| goes_on())
        .map(|scene| measure(scene, mesh, t_end, args.repeats))
        .collect::<anyhow::Result<Vec<_>>>()?;
    let document = Document { machine: Machine::found(), t_end, features: &rows };
    give(args, &text(&rows), &document)
}

fn measure(scene: &Scene, mesh: &Mesh, t_end: f64, repeats: u32) -> anyhow::Result<Row> {
    let make = || -> anyhow::Result<MuscleDae> {
        let load = Signal::paper(paper::LOAD_AMPLITUDE);
        let muscle = paper::muscle_with_load(mesh, scene.law, scene.kappa, scene.beta, load)?;
        Ok(MuscleDae::new(muscle, scene.formulation)?)
    };
    let mut dae = make()?;
    let unknowns = dae.n_unknowns();
    let (y, y_dot) = (vec![1e-6; unknowns], vec![1e-5; unknowns]);
    let mut out = vec![0.0; unknowns];
    let residual = fastest_call(REPEATS, || dae.residual(0.5, &y, &y_dot, &mut out))?;
    let mut values = vec![0.0; dae.jacobian_pattern().nnz()];
    let jacobian =
        fastest_call(REPEATS / 10, || dae.jacobian(0.5, &y, &y_dot, 1.0, 1e3, &mut values))?;

    let settings = Settings { t_end, ..Settings::paper(scene.formulation) };
    let once = || {
        let mut integrator = start_at_rest(make()?, &settings)?;
        let statistics = run_model(integrator.as_mut(), &mut [])?;
        Ok((statistics, *integrator.problem().counters()))
    };
    let (statistics, counters) = fastest(repeats, once, |(statistics, _)| statistics.cpu_seconds)?;
    Ok(Row {
        feature: scene.feature,
        formulation: scene.formulation.name(),
        unknowns,
        residual_microseconds: 1e6 * residual,
        jacobian_microseconds: 1e6 * jacobian,
        run_cpu_seconds: statistics.cpu_seconds,
        outcome: statistics.outcome.name(),
        steps: statistics.counts.steps,
        residual_passes: counters.residual_passes,
        force_rate_passes: counters.force_rate_passes,
        tangent_passes: counters.tangent_passes,
        rate_tangent_passes: counters.rate_tangent_passes,
    })
}

fn text(rows: &[Row]) -> String {
    use Align::{Left, Right};
    let mut table = Table::new(&[
        ("feature", Left),
        ("formulation", Left),
        ("unknowns", Right),
        ("residual µs", Right),
        ("Jacobian µs", Right),
        ("run, CPU s", Right),
        ("steps", Right),
        ("element passes", Right),
        ("with Ṗ", Right),
        ("for tangents", Right),
        ("with Ṗ", Right),
        ("outcome", Left),
    ]);
    for row in rows {
        table.row(
            [
                row.feature.to_owned(),
                row.formulation.to_owned(),
                row.unknowns.to_string(),
                format!("{:.1}", row.residual_microseconds),
                format!("{:.1}", row.jacobian_microseconds),
                format!("{:.3}", row.run_cpu_seconds),
                row.steps.to_string(),
                row.residual_passes.to_string(),
                row.force_rate_passes.to_string(),
                row.tangent_passes.to_string(),
                row.rate_tangent_passes.to_string(),
                row.outcome.to_owned(),
            ]
            .map(Cell::from),
        );
    }
    table.render(colored_stdout())
}
