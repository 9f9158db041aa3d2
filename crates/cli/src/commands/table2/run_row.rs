//! Runs rows of the table, several at a time.

use std::fs::File;
use std::path::PathBuf;

use anyhow::Context;
use myovib_dae::Problem;
use myovib_fem::Mesh;
use myovib_model::advice::Advice;
use myovib_model::linear::LinearWork;
use myovib_model::{
    IntegratorKind, Limits, MuscleDae, Observer, Probe, SampleTimes, Sampler, Settings, Statistics,
    paper, run, start_at_rest,
};

use super::Table2Args;
use super::rows::{Convention, Row};
use crate::interrupt;
use crate::progress::Progress;
use myovib_scene::csv::CsvWriter;
use myovib_scene::parallel;
use myovib_scene::scene_file::integrator::MaxOrder;
use myovib_scene::statistics::DRIFT_SAMPLES;
use myovib_scene::watch::Watch;

/// A row with what its run came to.
pub(super) struct RowResult {
    pub(super) row: &'static Row,
    pub(super) settings: Settings,
    /// Why the maximum order was chosen, if it was not given.
    pub(super) max_order_reason: Option<String>,
    pub(super) index: u8,
    pub(super) statistics: Statistics,
    pub(super) linear_work: LinearWork,
    pub(super) unknowns: usize,
    pub(super) unknowns_paper: usize,
    /// The largest drift over the samples and the end; 0 for a formulation without pressure.
    pub(super) constraint_drift: f64,
}

impl RowResult {
    /// The highest order BDF was allowed, or that of Radau IIA.
    pub(super) fn order(&self) -> u8 {
        let Settings {
            integrator,
            max_order,
            ..
        } = self.settings;
        integrator.order().unwrap_or(max_order)
    }

    /// The convention of the error test; Radau IIA follows none.
    pub(super) fn convention(&self) -> Convention {
        match self.settings.integrator {
            IntegratorKind::Ida => self.row.convention,
            _ => Convention::Variant,
        }
    }
}

/// Runs `rows` on as many threads as there are, in the order of the table.
pub(super) fn run_all(
    rows: &[&'static Row],
    mesh: &Mesh,
    args: &Table2Args,
) -> anyhow::Result<Vec<RowResult>> {
    let progress = Progress::new(args.common.quiet);
    parallel::map(rows, args.common.n_threads(), |row| {
        run_row(row, mesh, args, &progress).with_context(|| format!("row {} of Table 2", row.key))
    })
    .into_iter()
    .collect()
}

/// The settings of a row, changed as the options say.
pub(in crate::commands) fn settings(row: &Row, args: &Table2Args) -> Settings {
    let paper = Settings::paper(row.formulation).with_integrator(args.integrator);
    // Radau IIA would be less accurate by a smaller relative tolerance alone.
    let mut absolute_tolerances = match args.integrator {
        IntegratorKind::Ida => paper.absolute_tolerances,
        _ => {
            let in_proportion = paper.clone().with_relative_tolerance(args.rtol);
            in_proportion.absolute_tolerances
        }
    };
    if let Some(velocity) = args.atol_velocity {
        absolute_tolerances.velocity = velocity;
    }
    Settings {
        t_end: args.t_end,
        relative_tolerance: args.rtol,
        absolute_tolerances,
        suppressed: args.suppress.fields(row, args.integrator),
        multiplier_weights: args.multiplier_weights,
        project_every: args.project_every,
        max_order: match args.max_order {
            Some(MaxOrder::Fixed(order)) => order,
            Some(MaxOrder::Auto) | None => row.max_order,
        },
        linear_solver: args.linear_solver,
        ..paper
    }
}

fn run_row(
    row: &'static Row,
    mesh: &Mesh,
    args: &Table2Args,
    progress: &Progress,
) -> anyhow::Result<RowResult> {
    let muscle = paper::muscle(mesh, row.kappa, row.beta)?;
    let index = row.formulation.index(&muscle.parameters);
    let unknowns_paper = muscle.n_unknowns_paper();
    let origin = Probe::at(muscle.solid.space(), [0.0, 0.0])?;
    let mut settings = settings(row, args);
    let max_order_reason = (args.max_order == Some(MaxOrder::Auto)).then(|| {
        let advice = Advice::new(&muscle, row.formulation, &settings);
        settings.max_order = advice.max_order();
        advice.max_order_reason()
    });

    let dae = MuscleDae::new(muscle, row.formulation)?;
    let unknowns = dae.n_unknowns();
    let mut integrator = start_at_rest(dae, &settings)?;

    let mut largest_drift = 0.0_f64;
    let mut drift = Sampler::new(
        SampleTimes::new(settings.t_end / DRIFT_SAMPLES, settings.t_end),
        unknowns,
        |dae: &mut MuscleDae, t, y: &[f64]| {
            largest_drift = largest_drift.max(dae.constraint_drift(t, y)?);
            Ok(())
        },
    );
    let mut watch = Watch::new(format!("row {}", row.key), settings.t_end, progress);
    let mut limits = Limits::new(f64::INFINITY, Some(interrupt::flag()));
    let mut probe = args
        .probe
        .map(|_| open_probe(args))
        .transpose()?
        .map(|mut csv| {
            Sampler::new(
                SampleTimes::new(args.every, settings.t_end),
                unknowns,
                move |dae: &mut MuscleDae, t, y: &[f64]| {
                    let value = dae.read(&origin, t, y);
                    let [u_x, u_y, _] = value.displacement;
                    Ok(csv.row(&[t, u_x, u_y, value.pressure])?)
                },
            )
        });
    let mut observers: Vec<&mut dyn Observer<MuscleDae>> =
        vec![&mut drift, &mut watch, &mut limits];
    if let Some(probe) = &mut probe {
        observers.push(probe);
    }
    let statistics = run(integrator.as_mut(), &mut observers)?;
    drop((drift, probe));
    Ok(RowResult {
        row,
        settings,
        max_order_reason,
        index,
        statistics,
        linear_work: integrator.problem().counters().linear,
        unknowns,
        unknowns_paper,
        constraint_drift: largest_drift,
    })
}

fn open_probe(args: &Table2Args) -> anyhow::Result<CsvWriter<File>> {
    let path: &PathBuf = args.csv.as_ref().context("--probe needs --csv")?;
    let file = File::create(path).with_context(|| format!("cannot write `{}`", path.display()))?;
    Ok(CsvWriter::new(file, &["t", "u_x", "u_y", "p"])?)
}
