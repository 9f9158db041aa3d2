//! Periodic state: one table per probe with the values over a period.

use std::ops::Range;
use std::time::Instant;

use myovib_model::periodic::{Multipliers, PeriodMap, PeriodicState, Shooting, multipliers, shoot};
use myovib_model::start::Consistent;
use myovib_model::{CpuClock, EndReason, Integrator, Limits, ModelError, Outcome};
use serde_json::json;

use super::continuation::{self, Branch};
use super::document;
use super::folder::{request, table_of};
use super::options::{RunOptions, RunResult};
use super::period::{Extent, Period, Samples, Task};
use crate::csv::CsvWriter;
use crate::periodic::{Column, Harmonics, Periodic};
use crate::probe::Reading;
use crate::scene_file::periodic::Periodic as Wanted;
use crate::state::State;
use crate::system::System;
use crate::{Error, Scene};

/// Factor by which a deviation from an unstable state grows before the motion counts as having left the state.
const DEPARTURE: f64 = 1e6;
/// Maximum number of periods until then.
const MOST_PERIODS: f64 = 500.0;

/// Computes the periodic state of a scene.
pub(super) fn compute(scene: &Scene, options: &RunOptions<'_>) -> Result<RunResult, Error> {
    let period = Period::of(scene)?;
    let branch = Branch::of(scene)?;
    let search = Search { scene, options, period: &period, branch: branch.as_ref() };
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

/// A periodic state with its stability.
struct Found {
    shooting: Shooting,
    periodic: PeriodicState,
    leading: Multipliers,
}

impl Search<'_> {
    fn wanted(&self) -> Wanted {
        self.scene.file.periodic.clone().unwrap_or_default()
    }

    /// Integrates `periods` periods from `state`, which becomes the state at their end, and finds the periodic state near it.
    fn find<P, S>(
        &self,
        map: &mut PeriodMap<P, S>,
        state: &mut Vec<f64>,
        periods: usize,
        blocks: &[Range<usize>],
    ) -> Result<Found, ModelError>
    where
        P: System + Consistent + Clone,
        S: FnMut(P, [f64; 2], &[f64], &[f64]) -> Result<Box<dyn Integrator<P>>, ModelError>,
    {
        let interrupt = self.options.interrupt;
        let mut sizes = Vec::new();
        for k in 0..periods.max(1) {
            let mut extent =
                Extent { blocks, sizes: vec![0.0; blocks.len()], y: vec![0.0; map.n_unknowns()] };
            let mut limits = Limits::new(f64::INFINITY, interrupt);
            let end = map.observed(state, &mut [&mut extent, &mut limits])?;
            sizes = extent.sizes;
            if k < periods {
                *state = end;
            }
        }
        let scale = |i: &usize| {
            let block = blocks.iter().position(|range| range.contains(i));
            let size = block.map_or(0.0, |block| sizes[block]);
            if size > 0.0 { size } else { 1.0 }
        };
        let wanted = self.wanted();
        let shooting = Shooting {
            tolerance: wanted.tolerance,
            map_error: self.period.rtol,
            ..Shooting::new(map.differential().iter().map(scale).collect())
        };
        let watcher = self.options.watcher();
        let mut evaluate = |state: &[f64]| {
            let n = map.evaluations();
            watcher.progress.on_progress(&|| format!("periodic: {n} periods integrated"));
            let mut limits = Limits::new(f64::INFINITY, interrupt);
            map.observed(state, &mut [&mut limits])
        };
        let periodic = shoot(&mut evaluate, state, &shooting)?;
        let count = wanted.multipliers;
        let leading = multipliers(&mut evaluate, &periodic.state, &shooting, count)?;
        Ok(Found { shooting, periodic, leading })
    }

    /// Finds the periodic state to which the motion from `state` settles, or an unstable state with a note.
    fn find_settled<P, S>(
        &self,
        map: &mut PeriodMap<P, S>,
        mut state: Vec<f64>,
        blocks: &[Range<usize>],
    ) -> Result<(Found, Option<String>), ModelError>
    where
        P: System + Consistent + Clone,
        S: FnMut(P, [f64; 2], &[f64], &[f64]) -> Result<Box<dyn Integrator<P>>, ModelError>,
    {
        let first = self.find(map, &mut state, self.wanted().settling_periods, blocks)?;
        if first.leading.is_stable() != Some(false) {
            return Ok((first, None));
        }
        // The motion from rest leaves the unstable state.
        let growth = first.leading.spectral_radius().ln();
        let periods = (DEPARTURE.ln() / growth).min(MOST_PERIODS).ceil() as usize;
        match self.find(map, &mut state, periods, blocks) {
            Ok(settled) if settled.leading.is_stable() != Some(false) => Ok((settled, None)),
            Ok(_) | Err(ModelError::NoPeriodicState { .. } | ModelError::PeriodStopped { .. }) => {
                let note = format!(
                    "the periodic state is unstable: the motion leaves it, and {periods} periods later it does not repeat \
                     (chains, for example, may not follow the loads); `myovib run` computes this motion"
                );
                Ok((first, Some(note)))
            }
            Err(error) => Err(error),
        }
    }
}

impl Task for Search<'_> {
    type Out = RunResult;

    /// Finds the periodic state near the motion that starts at y, and writes the results.
    fn of_system<P: System + Consistent + Clone>(
        self,
        dae: P,
        start: impl FnMut(P, [f64; 2], &[f64], &[f64]) -> Result<Box<dyn Integrator<P>>, ModelError>,
        y: Vec<f64>,
        blocks: Vec<Range<usize>>,
    ) -> Result<RunResult, Error> {
        let (started, cpu) = (Instant::now(), CpuClock::start());
        let Self { scene, options, period, branch } = self;
        let readings = scene.readings()?;
        let request = request(scene, options)?;
        request.check()?;
        let mut map = PeriodMap::new(dae, start, period.times, &y)?;
        let state = map.restrict(&y);
        let (found, note) = self.find_settled(&mut map, state, &blocks)?;
        let n = self.wanted().samples;
        let mut samples = Samples::new(&readings, period.times, n, y.len());
        map.observed(&found.periodic.state, &mut [&mut samples])?;
        let rows = samples.rows;
        let [y, _] = map.consistent(&found.periodic.state)?;
        let curve = branch
            .map(|branch| branch.follow(scene, options, &found.shooting, &found.periodic.state));
        let (curve, outcome) = curve.transpose()?.unzip();
        let outcome = outcome.unwrap_or(Outcome::Finished);
        let found = Periodic {
            frequency: period.frequency,
            period: 1.0 / period.frequency,
            start_time: period.times[0],
            differential_variables: found.periodic.state.len(),
            residual: found.periodic.residual,
            newton_iterations: found.periodic.iterations,
            integrations: map.evaluations(),
            steps: map.counts().steps,
            spectral_radius: found.leading.spectral_radius(),
            is_stable: found.leading.is_stable(),
            multipliers: found.leading.values.iter().map(|z| [z.re, z.im]).collect(),
            probes: harmonics(scene, period, &readings, &rows),
            continuation: curve,
        };
        let folder = request.open().map_err(Error::before_any_output)?;
        for ((probe, reading), rows) in scene.file.probe.iter().zip(&readings).zip(&rows) {
            folder.write(&table_of(&probe.name), table(&**reading, rows))?;
        }
        if let Some(curve) = &found.continuation {
            folder.write(continuation::NAME, continuation::table(curve))?;
        }
        if let Some((dae, range)) = map.problem_mut().muscle_at(&y) {
            let state = State::of(dae, period.times[0], &y[range]);
            folder.write(State::NAME, state.encode()?)?;
        }
        let mut document = json!({
            "scene": scene.file,
            "analysis": "periodic",
            "outcome": outcome.name(),
            "reason": outcome.reason().map(EndReason::name),
            "message": outcome.message(),
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
            outcome,
            notes: note.into_iter().collect(),
            modes: None,
            response: None,
            periodic: Some(found),
        })
    }
}

/// Returns the harmonics of all probes; the last row is the end of the period.
fn harmonics(
    scene: &Scene,
    period: &Period,
    readings: &[Box<dyn Reading>],
    rows: &[Vec<Vec<f64>>],
) -> Vec<Harmonics> {
    let start = period.times[0] * period.frequency;
    let probes = scene.file.probe.iter().zip(readings).zip(rows);
    let probes = probes.map(|((probe, reading), rows)| {
        let columns = reading.names().into_iter().enumerate();
        let column = |(j, name)| {
            let all = rows[..rows.len() - 1].iter().map(|row| row[j + 1]);
            Column::new(name, &all.collect::<Vec<f64>>(), start)
        };
        Harmonics { name: probe.name.clone(), columns: columns.map(column).collect() }
    });
    probes.collect()
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
