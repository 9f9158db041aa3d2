//! Periodic state: one table per probe with the values over a period.

use std::ops::{ControlFlow, Range};
use std::time::Instant;

use myovib_dae::Problem;
use myovib_model::coupling::{CoupledDae, CoupledOptions, ErrorTest, start_coupled_from};
use myovib_model::periodic::{PeriodMap, Shooting, multipliers, shoot};
use myovib_model::start::Consistent;
use myovib_model::{
    AcceptedStep, CpuClock, Integrator, Limits, ModelError, MuscleDae, Observer, Outcome, Settings,
    start_from,
};
use serde_json::json;

use super::document;
use super::folder::{request, table_of};
use super::start::{driven_by, driven_by_rod, initial_state, options as chain_options, tolerances};
use super::system::System;
use super::{RunOptions, RunResult};
use crate::csv::CsvWriter;
use crate::periodic::{Column, Harmonics, Periodic};
use crate::probe::Reading;
use crate::scene::absolute_tolerances;
use crate::state::State;
use crate::{Body, Error, InputError, Scene};

/// Tolerance of the integrator relative to the tolerance of the periodic state.
const INTEGRATOR: f64 = 1e-2;

/// Computes the periodic state of a scene.
pub(super) fn compute(scene: &Scene, options: &RunOptions<'_>) -> Result<RunResult, Error> {
    let wanted = scene.file.periodic.clone().unwrap_or_default();
    let own = &scene.file.integrator;
    let rtol = match &scene.body {
        Some(_) if scene.chains.is_empty() => own.rtol,
        Some(_) => own.rtol.max(own.oscillators.rtol),
        None => own.oscillators.rtol,
    };
    let needed = INTEGRATOR * wanted.tolerance;
    let tight = scene.with_scaled_tolerances(f64::min(1.0, needed / rtol));
    let Some(frequency) = scene.frequency else {
        return Err(InputError::new("the scene has no periodic state").into());
    };
    let times = [wanted.start_time, wanted.start_time + 1.0 / frequency];
    let search = Search {
        scene,
        options,
        times,
        frequency,
        rtol: rtol.min(needed),
    };
    match (&tight.body, &tight.rod) {
        (Some(body), _) => {
            let settings = settings(&tight, body, times[1]);
            let mut dae = MuscleDae::new(body.muscle.clone(), body.formulation)?;
            let start = body.initial_values(&mut dae, options.watcher());
            let start = start.map_err(Error::before_any_output)?;
            let y = start.map_or(vec![0.0; dae.n_unknowns()], |[y, _]| y);
            let blocks = dae.layout().blocks().iter().map(|(_, range)| range.clone());
            let blocks: Vec<Range<usize>> = blocks.collect();
            if tight.chains.is_empty() {
                let start = move |dae: MuscleDae, times: [f64; 2], y: &[f64], y_dot: &[f64]| {
                    start_from(dae, &settings, times[0], y, y_dot)
                };
                return search.solve(dae, start, y, blocks);
            }
            let test = ErrorTest::of_muscle(&dae, &settings);
            let options = CoupledOptions::of_muscle(&dae, &settings);
            let dae = CoupledDae::new(dae.clone(), driven_by(&tight, &dae)?);
            search.coupled(&tight, dae, (test, options), y, blocks)
        }
        (None, Some(rod)) => {
            let n = rod.n_unknowns();
            let test = ErrorTest::of_states(n, tolerances(&tight));
            let dae = CoupledDae::new(rod.clone(), driven_by_rod(&tight, rod)?);
            let blocks = vec![0..n / 2, n / 2..n];
            let options = chain_options(&tight);
            search.coupled(&tight, dae, (test, options), vec![0.0; n], blocks)
        }
        (None, None) => {
            let error = InputError::new("a periodic state needs a body or a rod under load");
            Err(error.next("compute the motion of chains alone").into())
        }
    }
}

/// Returns the settings of a body for a motion to the end of the period.
fn settings(scene: &Scene, body: &Body, t_end: f64) -> Settings {
    let wanted = &scene.file.integrator;
    Settings {
        t_end,
        absolute_tolerances: absolute_tolerances(wanted, &body.muscle, t_end, [0.0; 2]),
        ..body.settings.clone()
    }
}

/// Search for a periodic state.
#[derive(Clone, Copy)]
struct Search<'a> {
    scene: &'a Scene,
    options: &'a RunOptions<'a>,
    times: [f64; 2],
    frequency: f64,
    /// Relative tolerance of the integrator.
    rtol: f64,
}

impl Search<'_> {
    /// Finds the periodic state of a body with its chains. `blocks` are the ranges of unknowns of the same kind of the body.
    fn coupled<B: super::system::Body + Clone>(
        self,
        scene: &Scene,
        dae: CoupledDae<B>,
        (test, options): (ErrorTest, CoupledOptions),
        y: Vec<f64>,
        mut blocks: Vec<Range<usize>>,
    ) -> Result<RunResult, Error> {
        let test = test.with_oscillators(&dae, tolerances(scene));
        for k in 0..dae.n_networks() {
            let Range { start, end } = dae.range(k);
            let middle = start + dae.oscillators(k).network().n_oscillators();
            blocks.extend([start..middle, middle..end]);
        }
        let y = initial_state(scene, &dae, &y);
        let start = move |dae: CoupledDae<B>, times: [f64; 2], y: &[f64], y_dot: &[f64]| {
            start_coupled_from(dae, test.clone(), options.clone(), times, y, y_dot)
        };
        self.solve(dae, start, y, blocks)
    }

    /// Finds the periodic state near the motion from y, and writes the results.
    fn solve<P: System + Consistent + Clone>(
        self,
        dae: P,
        start: impl FnMut(P, [f64; 2], &[f64], &[f64]) -> Result<Box<dyn Integrator<P>>, ModelError>,
        y: Vec<f64>,
        blocks: Vec<Range<usize>>,
    ) -> Result<RunResult, Error> {
        let (started, cpu) = (Instant::now(), CpuClock::start());
        let Self { scene, options, .. } = self;
        let wanted = scene.file.periodic.clone().unwrap_or_default();
        let readings = scene.readings()?;
        let request = request(scene, options)?;
        request.check()?;
        let watcher = options.watcher();
        let interrupt = options.interrupt;
        let mut map = PeriodMap::new(dae, start, self.times, &y)?;
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
            map_error: self.rtol,
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
        let mut samples = Samples::new(&readings, self.times, wanted.samples, y.len());
        map.observed(&found.state, &mut [&mut samples])?;
        let rows = samples.rows;
        let [y, _] = map.consistent(&found.state)?;
        let start = self.times[0] * self.frequency;
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
        let radius = leading.spectral_radius();
        let found = Periodic {
            frequency: self.frequency,
            period: 1.0 / self.frequency,
            start_time: self.times[0],
            differential_variables: found.state.len(),
            residual: found.residual,
            newton_iterations: found.iterations,
            integrations: map.evaluations(),
            steps: map.counts().steps,
            spectral_radius: radius,
            is_stable: leading.is_stable(),
            multipliers: leading.values.iter().map(|z| [z.re, z.im]).collect(),
            probes: probes.collect(),
        };
        let folder = request.open().map_err(Error::before_any_output)?;
        for ((probe, reading), rows) in scene.file.probe.iter().zip(&readings).zip(&rows) {
            folder.write(&table_of(&probe.name), table(&**reading, rows))?;
        }
        let time = self.times[0];
        if let Some((dae, range)) = map.problem_mut().muscle_at(&y) {
            let state = State::of(dae, time, &y[range]);
            folder.write(State::NAME, serde_json::to_string(&state)?)?;
        }
        let mut document = json!({
            "scene": scene.file,
            "analysis": "periodic",
            "outcome": "finished",
            "unknowns": y.len(),
            "rtol": self.rtol,
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

/// Observer of the largest magnitude in each block of unknowns.
struct Extent<'a> {
    blocks: &'a [Range<usize>],
    sizes: Vec<f64>,
    y: Vec<f64>,
}

impl<P> Observer<P> for Extent<'_> {
    fn accepted(
        &mut self,
        step: &mut AcceptedStep<'_, P>,
    ) -> Result<ControlFlow<Outcome>, ModelError> {
        step.integrator.dense_output(step.to, 0, &mut self.y)?;
        for (size, block) in self.sizes.iter_mut().zip(self.blocks) {
            let values = self.y[block.clone()].iter();
            *size = values.fold(*size, |size, y| size.max(y.abs()));
        }
        Ok(ControlFlow::Continue(()))
    }
}

/// Observer of the probes at equidistant times over the period, both ends included.
struct Samples<'a> {
    readings: &'a [Box<dyn Reading>],
    times: Vec<f64>,
    next: usize,
    /// Rows of each probe: time and values.
    rows: Vec<Vec<Vec<f64>>>,
    y: Vec<f64>,
    y_dot: Vec<f64>,
}

impl<'a> Samples<'a> {
    fn new(
        readings: &'a [Box<dyn Reading>],
        [from, to]: [f64; 2],
        n: usize,
        n_unknowns: usize,
    ) -> Self {
        let time = |i: usize| match i == n {
            true => to,
            false => from + (to - from) * i as f64 / n as f64,
        };
        Self {
            readings,
            times: (0..=n).map(time).collect(),
            next: 0,
            rows: vec![Vec::new(); readings.len()],
            y: vec![0.0; n_unknowns],
            y_dot: vec![0.0; n_unknowns],
        }
    }
}

impl<P: System> Observer<P> for Samples<'_> {
    fn accepted(
        &mut self,
        step: &mut AcceptedStep<'_, P>,
    ) -> Result<ControlFlow<Outcome>, ModelError> {
        while let Some(&t) = self.times.get(self.next).filter(|t| **t <= step.to) {
            self.next += 1;
            let integrator = &mut *step.integrator;
            let inside = t.max(step.from);
            integrator.dense_output(inside, 0, &mut self.y)?;
            integrator.dense_output(inside, 1, &mut self.y_dot)?;
            for (reading, rows) in self.readings.iter().zip(&mut self.rows) {
                let system = integrator.problem_mut();
                let values = reading.values(system, t, &self.y, &self.y_dot)?;
                rows.push(std::iter::once(t).chain(values).collect());
            }
        }
        Ok(ControlFlow::Continue(()))
    }
}
