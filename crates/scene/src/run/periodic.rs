//! Analysis of a periodic state. It writes one table per probe with the values over one period.

use std::ops::Range;

use myovib_model::coupling::{Oscillators, Recorder, Recording, Source};
use myovib_model::periodic::{Multipliers, PeriodMap, PeriodicState, Shooting, StartInterval};
use myovib_model::radau::FIXED_STEP_ERROR;
use myovib_model::start::Consistent;
use myovib_model::{Limits, ModelError, Observer, Outcome, support};
use serde_json::json;

use super::continuation::{self, Branch};
use super::document::{self, Clocks};
use super::folder::{request, table_of};
use super::options::{RunOptions, RunResult};
use super::period::{Extent, Period, Samples, Task};
use super::refinement::Refinement;
use crate::csv;
use crate::json::extend;
use crate::periodic::{Column, Harmonics, Periodic};
use crate::probe::Reading;
use crate::result_folder::FolderRequest;
use crate::scene_file::periodic::Periodic as PeriodicSettings;
use crate::state::State;
use crate::system::System;
use crate::{Error, Scene};

/// Factor by which a deviation from an unstable state must grow before the motion counts as having left this state.
const DEPARTURE: f64 = 1e6;
/// Maximum number of periods integrated until the motion has left an unstable state.
const MOST_PERIODS: f64 = 500.0;
/// Numbers of additional periods to integrate before each successive search if harmonic balance finds no starting
/// state.
const SETTLING_PERIODS: [usize; 3] = [3, 9, 36];

/// Computes the periodic state of a scene.
///
/// # Errors
/// Returns the errors of the search. If no periodic state exists because the body can move freely, the error describes
/// the free motions.
pub(super) fn compute(scene: &Scene, options: &RunOptions<'_>) -> Result<RunResult, Error> {
    search(scene, options).map_err(|error| {
        let is_missing = matches!(error, Error::Model(ModelError::NoPeriodicState { .. }));
        let body = scene.body.as_ref().filter(|_| is_missing);
        let free = body.and_then(|body| support::free_parts(&body.muscle));
        free.map_or(error, |free| ModelError::NotHeld(free).into())
    })
}

fn search(scene: &Scene, options: &RunOptions<'_>) -> Result<RunResult, Error> {
    let clocks = Clocks::start();
    let period = Period::of(scene)?;
    let branch = Branch::of(scene)?;
    let table = branch.as_ref().map(|_| continuation::NAME);
    let request = request(scene, options, table.as_slice())?;
    request.check()?;
    let settling_periods = scene.file.periodic.as_ref().and_then(|own| own.settling_periods);
    let balanced = match settling_periods {
        None => period.balanced(options.watcher())?,
        Some(_) => None,
    };
    let balanced = balanced.as_deref();
    let mut search = Search { scene, options, period: &period, balanced };
    // The chains do not act on the muscle, so the periodic state of the muscle is found first.
    let mut parts = None;
    if let Some((muscle, driven)) = period.of_muscle()? {
        let body = muscle.run(Some(options.watcher()), Find { search, driven: &driven })?;
        search.balanced = None;
        let find = Find { search, driven: &[] };
        let chains = period.of_chains(&driven, body.motions.clone(), find)?;
        parts = Some([body, chains]);
    }
    let write = Write { search, request, branch: branch.as_ref(), parts, clocks };
    period.run(Some(options.watcher()), write)
}

#[derive(Clone, Copy)]
struct Search<'a> {
    scene: &'a Scene,
    options: &'a RunOptions<'a>,
    period: &'a Period,
    /// Unknowns of the body at the start of the period, computed by harmonic balance.
    balanced: Option<&'a [f64]>,
}

/// Periodic state and its stability.
struct Found {
    shooting: Shooting,
    periodic: PeriodicState,
    leading: Multipliers,
}

impl Search<'_> {
    fn settings(&self) -> PeriodicSettings {
        self.scene.file.periodic.clone().unwrap_or_default()
    }
}

/// Search for a periodic state of a system. The unknowns in each of the `blocks` are of the same kind.
struct Finder<'a, P, S> {
    search: Search<'a>,
    map: &'a mut PeriodMap<P, S>,
    blocks: &'a [Range<usize>],
}

impl<P: System + Consistent + Clone, S: StartInterval<P>> Finder<'_, P, S> {
    /// Advances `state` by `periods` periods, and then finds the periodic state near it.
    fn find(&mut self, state: &mut Vec<f64>, periods: usize) -> Result<Found, ModelError> {
        let Search { options, period, .. } = self.search;
        let (map, blocks) = (&mut *self.map, self.blocks);
        let settings = self.search.settings();
        let (mut sizes, mut end, mut n_steps) = (Vec::new(), Vec::new(), 0);
        for k in 0..=periods {
            let mut extent =
                Extent { blocks, sizes: vec![0.0; blocks.len()], y: vec![0.0; map.n_unknowns()] };
            let mut limits = Limits::new(f64::INFINITY, options.interrupt);
            if k > 0 {
                *state = end;
            }
            let before = map.counts().steps;
            end = map.observed(state, &mut [&mut extent, &mut limits])?;
            n_steps = map.counts().steps - before;
            sizes = extent.sizes;
        }
        let scale = |i: &usize| {
            let block = blocks.iter().position(|range| range.contains(i));
            let size = block.map_or(0.0, |block| sizes[block]);
            if size > 0.0 { size } else { 1.0 }
        };
        let shooting = Shooting {
            tolerance: settings.tolerance,
            map_error: period.rtol,
            ..Shooting::new(map.differential().iter().map(scale).collect())
        };
        let mut refinement = Refinement {
            fixed: Shooting {
                map_error: FIXED_STEP_ERROR * period.rtol,
                is_one_sided: true,
                ..shooting.clone()
            },
            smallest: shooting.residual(state, &end),
            adaptive: shooting,
            map,
            watcher: options.watcher(),
            rtol: period.rtol,
            n_steps,
            doublings: 0,
        };
        let periodic = refinement.state(state, &end)?;
        let leading = refinement.multipliers(&periodic.state, settings.multipliers)?;
        Ok(Found { shooting: refinement.adaptive, periodic, leading })
    }

    /// Finds a periodic state near the motion that starts from `state`. The search begins after the requested number of
    /// periods. If no number is requested, a failed search is repeated after more periods.
    fn find_after_settling(&mut self, state: &mut Vec<f64>) -> Result<Found, ModelError> {
        let requested = self.search.settings().settling_periods;
        let [first, later @ ..] = SETTLING_PERIODS;
        let later = if requested.is_none() { &later[..] } else { &[] };
        let mut found = self.find(state, requested.unwrap_or(first));
        for &periods in later {
            if !matches!(found, Err(ModelError::NoPeriodicState { .. })) {
                break;
            }
            found = self.find(state, periods);
        }
        found
    }

    /// Finds the periodic state to which the motion from `state` settles. If only an unstable periodic state is found,
    /// returns this state with a note.
    fn find_settled(&mut self, mut state: Vec<f64>) -> Result<(Found, Option<String>), ModelError> {
        let near_balanced = self.search.balanced.map(|balanced| {
            let mut near = self.map.restrict(balanced);
            self.find(&mut near, 0)
        });
        let first = match near_balanced {
            // The motion may settle to a periodic state even if none is found near the balanced state.
            None
            | Some(Err(ModelError::NoPeriodicState { .. } | ModelError::PeriodStopped { .. })) => {
                self.find_after_settling(&mut state)?
            }
            Some(found) => found?,
        };
        if first.leading.is_stable() != Some(false) {
            return Ok((first, None));
        }
        // The motion leaves the unstable state and may then settle to another state.
        let growth = first.leading.spectral_radius().map_or(f64::INFINITY, f64::ln);
        let periods = (DEPARTURE.ln() / growth).min(MOST_PERIODS).ceil() as usize;
        match self.find(&mut state, periods) {
            Ok(settled) if settled.leading.is_stable() != Some(false) => Ok((settled, None)),
            Ok(_) | Err(ModelError::NoPeriodicState { .. } | ModelError::PeriodStopped { .. }) => {
                let note = format!(
                    "the periodic state is unstable: the motion leaves it and does not repeat {periods} periods later \
                     (for example, chains may not follow the loads); `myovib run` computes this motion"
                );
                Ok((first, Some(note)))
            }
            Err(error) => Err(error),
        }
    }
}

/// Periodic state to which a system settles.
struct Settled {
    found: Found,
    note: Option<String>,
    /// All unknowns at the start of the period.
    y: Vec<f64>,
    /// Recorded motions of the points that drive chains.
    motions: Vec<Recording>,
    integrations: u64,
    steps: u64,
    /// Factor by which the tolerances of the integrator are multiplied.
    tolerance_factor: f64,
}

impl Settled {
    /// Combines the results of a body and of the chains that it drives.
    fn with_chains(self, chains: Self, count: usize) -> Self {
        let (own, other) = (self.found, chains.found);
        let residual = own.periodic.residual.max(other.periodic.residual);
        let leading = own.leading.with(&other.leading, count);
        let scales = [own.shooting.scales, other.shooting.scales].concat();
        let periodic = PeriodicState {
            state: [own.periodic.state, other.periodic.state].concat(),
            residual,
            iterations: own.periodic.iterations + other.periodic.iterations,
        };
        Self {
            found: Found { shooting: Shooting { scales, ..other.shooting }, periodic, leading },
            note: self.note.or(chains.note),
            y: [self.y, chains.y].concat(),
            motions: Vec::new(),
            integrations: self.integrations + chains.integrations,
            steps: self.steps + chains.steps,
            tolerance_factor: self.tolerance_factor.min(chains.tolerance_factor),
        }
    }
}

/// Task that finds a periodic state and records the motions of the points that drive chains.
struct Find<'a> {
    search: Search<'a>,
    driven: &'a [Oscillators],
}

impl Task for Find<'_> {
    type Out = Settled;

    /// Finds the periodic state near the motion that starts at `y`.
    fn of_system<P: System + Consistent + Clone>(
        self,
        dae: P,
        start: impl StartInterval<P>,
        y: Vec<f64>,
        blocks: Vec<Range<usize>>,
    ) -> Result<Settled, Error> {
        let Self { search, driven } = self;
        let mut map = PeriodMap::new(dae, start, search.period.times, &y)?;
        let state = map.restrict(&y);
        let mut finder = Finder { search, map: &mut map, blocks: &blocks };
        let (found, note) = finder.find_settled(state)?;
        let points =
            driven.iter().flat_map(Oscillators::sources).filter_map(|source| match source {
                Source::Body(point) => Some(Recorder::new(point.clone(), y.len())),
                _ => None,
            });
        let mut recorders: Vec<Recorder> = points.collect();
        if !recorders.is_empty() {
            let observers = recorders.iter_mut().map(|own| own as &mut dyn Observer<P>);
            map.observed(&found.periodic.state, &mut observers.collect::<Vec<_>>())?;
        }
        let [y, _] = map.consistent(&found.periodic.state)?;
        Ok(Settled {
            found,
            note,
            y,
            motions: recorders.into_iter().map(Recorder::finish).collect(),
            integrations: map.evaluations(),
            steps: map.counts().steps,
            tolerance_factor: map.tolerance_factor(),
        })
    }
}

/// Task that writes a periodic state.
struct Write<'a> {
    search: Search<'a>,
    request: FolderRequest<'a>,
    branch: Option<&'a Branch>,
    /// Results of the body and of its chains if they were found separately.
    parts: Option<[Settled; 2]>,
    /// Clocks that were started at the beginning of the search.
    clocks: Clocks,
}

impl Task for Write<'_> {
    type Out = RunResult;

    /// Writes the results. If the periodic state is not known yet, first finds it near the motion that starts at `y`.
    fn of_system<P: System + Consistent + Clone>(
        self,
        dae: P,
        mut start: impl StartInterval<P>,
        y: Vec<f64>,
        blocks: Vec<Range<usize>>,
    ) -> Result<RunResult, Error> {
        let Self { search, request, branch, parts, clocks } = self;
        let Search { scene, options, period, .. } = search;
        let readings = scene.readings()?;
        let settings = search.settings();
        let Settled { found, note, y, integrations, steps, tolerance_factor, .. } = match parts {
            Some([body, chains]) => body.with_chains(chains, settings.multipliers),
            None => Find { search, driven: &[] }.of_system(dae.clone(), &mut start, y, blocks)?,
        };
        let mut map = PeriodMap::new(dae, start, period.times, &y)?;
        map.set_tolerance_factor(tolerance_factor);
        let n = settings.samples;
        let mut samples = Samples::new(&readings, period.times, n, y.len());
        let mut limits = Limits::new(f64::INFINITY, options.interrupt);
        map.observed(&found.periodic.state, &mut [&mut samples, &mut limits])?;
        let rows = samples.rows;
        let note = note.or_else(|| unresolved(&found.leading));
        let shooting = (&found.shooting, tolerance_factor);
        let curve =
            branch.map(|branch| branch.follow(scene, options, shooting, &found.periodic.state));
        let (curve, outcome) = curve.transpose()?.unzip();
        let outcome = outcome.unwrap_or(Outcome::Finished);
        let found = Periodic {
            frequency: period.frequency,
            period: 1.0 / period.frequency,
            start_time: period.times[0],
            differential_variables: found.periodic.state.len(),
            residual: found.periodic.residual,
            newton_iterations: found.periodic.iterations,
            integrations: integrations + map.evaluations(),
            steps: steps + map.counts().steps,
            spectral_radius: found.leading.spectral_radius(),
            is_stable: found.leading.is_stable(),
            multipliers: found.leading.values.iter().map(|z| [z.re, z.im]).collect(),
            probes: harmonics(scene, period, &readings, &rows),
            continuation: curve,
        };
        let folder = request.open().map_err(Error::before_any_output)?;
        for ((probe, reading), rows) in scene.file.probe.iter().zip(&readings).zip(&rows) {
            folder.write(&table_of(&probe.name), csv::table(&reading.columns("t"), rows))?;
        }
        if let Some(curve) = &found.continuation {
            folder.write(continuation::NAME, continuation::table(curve))?;
        }
        if let Some((dae, range)) = map.problem_mut().muscle_at(&y) {
            let state = State::of(dae, period.times[0], &y[range]);
            folder.write(State::NAME, state.encode()?)?;
        }
        let mut document = clocks.document(scene, &outcome);
        document["unknowns"] = json!(y.len());
        document["rtol"] = json!(tolerance_factor * period.rtol);
        extend(&mut document, serde_json::to_value(&found)?);
        let notes = note.into_iter().collect();
        let result = document::finish(&folder, scene, document, outcome, notes)?;
        Ok(RunResult { periodic: Some(found), ..result })
    }
}

/// Returns a note if the stability is not resolved.
fn unresolved(leading: &Multipliers) -> Option<String> {
    let radius = leading.spectral_radius()?;
    leading.is_stable().is_none().then(|| {
        format!(
            "the stability of the periodic state is not resolved: the largest |multiplier| is {radius:.6} with an error of {:.1e}; without \
             damping it is 1, so add damping, or decrease `periodic.tolerance` to reduce the error",
            leading.error(),
        )
    })
}

/// Returns the harmonics of all probes. The last row of each probe is the end of the period and is not used.
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
