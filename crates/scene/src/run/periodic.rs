//! Periodic state: one table per probe with the values over a period.

use std::ops::Range;
use std::time::Instant;

use myovib_model::periodic::{PeriodMap, Shooting, multipliers, shoot};
use myovib_model::start::Consistent;
use myovib_model::{CpuClock, Integrator, Limits, ModelError, Outcome};
use serde_json::json;

use super::continuation::{self, Branch};
use super::document;
use super::folder::{request, table_of};
use super::period::{Extent, Period, Samples, Task};
use super::system::System;
use super::{RunOptions, RunResult};
use crate::csv::CsvWriter;
use crate::periodic::{Column, Harmonics, Periodic};
use crate::probe::Reading;
use crate::state::State;
use crate::{Error, Scene};

/// Computes the periodic state of a scene.
pub(super) fn compute(scene: &Scene, options: &RunOptions<'_>) -> Result<RunResult, Error> {
    let period = Period::of(scene)?;
    let branch = Branch::of(scene)?;
    let search = Search {
        scene,
        options,
        period: &period,
        branch: branch.as_ref(),
    };
    period.run(Some(options.watcher()), search)
}

/// Search for a periodic state.
#[derive(Clone, Copy)]
struct Search<'a> {
    scene: &'a Scene,
    options: &'a RunOptions<'a>,
    period: &'a Period,
    branch: Option<&'a Branch>,
}

impl Task for Search<'_> {
    type Out = RunResult;

    /// Finds the periodic state near the motion from y, and writes the results.
    fn of_system<P: System + Consistent + Clone>(
        self,
        dae: P,
        start: impl FnMut(P, [f64; 2], &[f64], &[f64]) -> Result<Box<dyn Integrator<P>>, ModelError>,
        y: Vec<f64>,
        blocks: Vec<Range<usize>>,
    ) -> Result<RunResult, Error> {
        let (started, cpu) = (Instant::now(), CpuClock::start());
        let Self {
            scene,
            options,
            period,
            branch,
        } = self;
        let wanted = scene.file.periodic.clone().unwrap_or_default();
        let readings = scene.readings()?;
        let request = request(scene, options)?;
        request.check()?;
        let watcher = options.watcher();
        let interrupt = options.interrupt;
        let mut map = PeriodMap::new(dae, start, period.times, &y)?;
        let mut state = map.restrict(&y);
        let mut sizes = vec![0.0; blocks.len()];
        for k in 0..wanted.settling_periods.max(1) {
            let mut extent = Extent {
                blocks: &blocks,
                sizes: vec![0.0; blocks.len()],
                y: vec![0.0; y.len()],
            };
            let mut limits = Limits::new(f64::INFINITY, interrupt);
            let end = map.observed(&state, &mut [&mut extent, &mut limits])?;
            sizes = extent.sizes;
            if k < wanted.settling_periods {
                state = end;
            }
        }
        let scale = |i: usize| {
            let block = blocks.iter().position(|range| range.contains(&i));
            let size = block.map_or(0.0, |block| sizes[block]);
            if size > 0.0 { size } else { 1.0 }
        };
        let shooting = Shooting {
            tolerance: wanted.tolerance,
            map_error: period.rtol,
            ..Shooting::new(map.differential().iter().map(|&i| scale(i)).collect())
        };
        let mut evaluate = |state: &[f64]| {
            let n = map.evaluations();
            watcher
                .progress
                .on_progress(&|| format!("periodic: {n} periods integrated"));
            let mut limits = Limits::new(f64::INFINITY, interrupt);
            map.observed(state, &mut [&mut limits])
        };
        let found = shoot(&mut evaluate, &state, &shooting)?;
        let count = wanted.multipliers;
        let leading = multipliers(&mut evaluate, &found.state, &shooting, count)?;
        let mut samples = Samples::new(&readings, period.times, wanted.samples, y.len());
        map.observed(&found.state, &mut [&mut samples])?;
        let rows = samples.rows;
        let [y, _] = map.consistent(&found.state)?;
        let start = period.times[0] * period.frequency;
        let probes = scene.file.probe.iter().zip(&readings).zip(&rows);
        let probes = probes.map(|((probe, reading), rows)| {
            let columns = reading.names().into_iter().enumerate();
            let column = |(j, name)| {
                let all = rows.iter().take(wanted.samples).map(|row| row[j + 1]);
                Column::new(name, &all.collect::<Vec<f64>>(), start)
            };
            Harmonics {
                name: probe.name.clone(),
                columns: columns.map(column).collect(),
            }
        });
        let curve = branch.map(|branch| branch.follow(scene, options, &shooting, &found.state));
        let radius = leading.spectral_radius();
        let found = Periodic {
            frequency: period.frequency,
            period: 1.0 / period.frequency,
            start_time: period.times[0],
            differential_variables: found.state.len(),
            residual: found.residual,
            newton_iterations: found.iterations,
            integrations: map.evaluations(),
            steps: map.counts().steps,
            spectral_radius: radius,
            is_stable: leading.is_stable(),
            multipliers: leading.values.iter().map(|z| [z.re, z.im]).collect(),
            probes: probes.collect(),
            continuation: curve.transpose()?,
        };
        let folder = request.open().map_err(Error::before_any_output)?;
        for ((probe, reading), rows) in scene.file.probe.iter().zip(&readings).zip(&rows) {
            folder.write(&table_of(&probe.name), table(&**reading, rows))?;
        }
        if let Some(curve) = &found.continuation {
            folder.write(continuation::NAME, continuation::table(curve))?;
        }
        let time = period.times[0];
        if let Some((dae, range)) = map.problem_mut().muscle_at(&y) {
            let state = State::of(dae, time, &y[range]);
            folder.write(State::NAME, state.encode()?)?;
        }
        let mut document = json!({
            "scene": scene.file,
            "analysis": "periodic",
            "outcome": "finished",
            "unknowns": y.len(),
            "rtol": period.rtol,
            "cpu_seconds": cpu.elapsed().as_secs_f64(),
            "wall_seconds": started.elapsed().as_secs_f64(),
        });
        if let Some(body) = &scene.body {
            let of_mesh = json!({ "mesh": document::mesh(&body.muscle) });
            document::extend(&mut document, of_mesh);
        }
        document::extend(&mut document, serde_json::to_value(&found)?);
        document::write(&folder, &document)?;
        Ok(RunResult {
            document,
            outcome: Outcome::Finished,
            notes: Vec::new(),
            modes: None,
            response: None,
            periodic: Some(found),
        })
    }
}

/// Returns the table of a probe.
fn table(reading: &(dyn Reading + 'static), rows: &[Vec<f64>]) -> String {
    let in_memory = "writing to memory does not fail";
    let names = reading.columns("t");
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    let mut csv = CsvWriter::new(Vec::new(), &names).expect(in_memory);
    for row in rows {
        csv.row(row).expect(in_memory);
    }
    String::from_utf8_lossy(csv.sink()).into_owned()
}
