//! Integration of the system of a scene over one period of the loads.

use std::ops::{ControlFlow, Range};
use std::sync::Arc;

use myovib_dae::Problem;
use myovib_model::coupling::{
    CoupledDae, CoupledOptions, ErrorTest, NoBody, Oscillators, Recording, Source, matrices,
    start_coupled_from,
};
use myovib_model::periodic::{Interval, StartInterval, balance};
use myovib_model::radau::options;
use myovib_model::start::Consistent;
use myovib_model::{
    AcceptedStep, Formulation, ModelError, MuscleDae, Observer, Outcome, Settings, TypicalStart,
    start_from,
};

use super::start::{driven_by, driven_by_rod, initial_state, options as chain_options, tolerances};
use crate::probe::{Reading, StateAt};
use crate::scene::absolute_tolerances;
use crate::system::{Body as SystemBody, System};
use crate::watch::Watcher;
use crate::{Body, Error, InputError, Scene};

/// Tolerance of the integrator relative to the tolerance of the periodic state.
const INTEGRATOR: f64 = 1e-2;

/// Scene with the tolerances for integrations over one period.
pub(super) struct Period {
    scene: Scene,
    /// Start time and end time of the period (s).
    pub(super) times: [f64; 2],
    /// Frequency (Hz).
    pub(super) frequency: f64,
    /// Relative tolerance of the integrator.
    pub(super) rtol: f64,
}

/// Computation with the system of a scene. The method is generic because the type of the system depends on the scene,
/// which may contain a body, a rod or chains.
pub(super) trait Task {
    type Out;

    /// Computes the result from a system, a function that starts an integrator for the system, an initial state, and
    /// the ranges (`blocks`) of unknowns of the same kind.
    fn of_system<P: System + Consistent + Clone>(
        self,
        dae: P,
        start: impl StartInterval<P>,
        y: Vec<f64>,
        blocks: Vec<Range<usize>>,
    ) -> Result<Self::Out, Error>;
}

impl Period {
    /// Returns the period of a scene.
    ///
    /// # Errors
    /// Fails if the scene has no periodic state.
    pub(super) fn of(scene: &Scene) -> Result<Self, Error> {
        let wanted = scene.file.periodic.clone().unwrap_or_default();
        let own = &scene.file.integrator;
        let rtol = match &scene.body {
            Some(_) if scene.chains.is_empty() => own.rtol,
            Some(_) => own.rtol.max(own.oscillators.rtol),
            None => own.oscillators.rtol,
        };
        let needed = INTEGRATOR * wanted.tolerance;
        let factors = [own.rtol, own.oscillators.rtol].map(|rtol| f64::min(1.0, needed / rtol));
        let Some([frequency, start]) = scene.repetition else {
            return Err(InputError::new("the scene has no periodic state").into());
        };
        Ok(Self {
            scene: scene.with_scaled_tolerances(factors),
            times: [start, start + 1.0 / frequency],
            frequency,
            rtol: rtol.min(needed),
        })
    }

    /// Returns the unknowns of the body at the start of its periodic motion, computed by harmonic balance. Returns
    /// `None` if the motion is not nearly linear or the scene has no body.
    pub(super) fn balanced(&self, watcher: Watcher<'_>) -> Result<Option<Vec<f64>>, Error> {
        let Some(body) = &self.scene.body else {
            return Ok(None);
        };
        let settings = settings(&self.scene, body, self.times[1]);
        let mut own = MuscleDae::new(body.muscle.clone(), body.formulation)?;
        let start = body.initial_values(&mut own, watcher).map_err(Error::before_any_output)?;
        // The derivative of the constraint does not determine the mean pressure.
        let formulation = match body.formulation {
            Formulation::Velocity | Formulation::Stabilized => Formulation::Position,
            formulation => formulation,
        };
        let mut dae = MuscleDae::new(body.muscle.clone(), formulation)?;
        let convert = |y: &[f64], from: &MuscleDae, to: &MuscleDae| {
            let mut out = vec![0.0; to.n_unknowns()];
            for (field, range) in to.layout().blocks() {
                if let Some(known) = from.layout().range(*field) {
                    out[range.clone()].copy_from_slice(&y[known]);
                }
            }
            out
        };
        let y = match &start {
            Some([y, _]) => convert(y, &own, &dae),
            None => vec![0.0; dae.n_unknowns()],
        };
        let sparse = options(&dae, &settings).sparse;
        let mut matrices = matrices(&mut dae, sparse, settings.linear_solver)?;
        let blocks = dae.layout().blocks().iter().map(|(_, range)| range.clone());
        let blocks: Vec<Range<usize>> = blocks.collect();
        let interrupt = watcher.interrupt;
        let found = balance(&mut dae, &mut matrices, self.times, &y, &blocks, self.rtol, interrupt);
        // If harmonic balance is not applicable or fails, the motion is integrated instead. The integration also
        // handles an interrupt.
        Ok(found.ok().flatten().map(|y| convert(&y, &dae, &own)))
    }

    /// Returns the period of the muscle without its chains, and the chains that the muscle drives. Returns `None`
    /// unless the scene has a body and chains.
    pub(super) fn of_muscle(&self) -> Result<Option<(Self, Vec<Oscillators>)>, Error> {
        let Some(body) = self.scene.body.as_ref().filter(|_| !self.scene.chains.is_empty()) else {
            return Ok(None);
        };
        let dae = MuscleDae::new(body.muscle.clone(), body.formulation)?;
        let driven = driven_by(&self.scene, &dae)?;
        let mut scene = self.scene.clone();
        scene.chains.clear();
        Ok(Some((Self { scene, ..*self }, driven)))
    }

    /// Runs a task for the chains alone. The recorded `motions` of their attachment points drive the chains.
    pub(super) fn of_chains<T: Task>(
        &self,
        driven: &[Oscillators],
        motions: Vec<Recording>,
        task: T,
    ) -> Result<T::Out, Error> {
        let mut motions = motions.into_iter();
        let mut recorded = |source: &Source| match source {
            Source::Body(_) => motions.next().map(|own| Source::Recorded(Arc::new(own))),
            other => Some(other.clone()),
        };
        let alone = driven.iter().map(|own| {
            let sources = own.sources().iter().filter_map(&mut recorded).collect();
            Oscillators::new(own.network().clone(), own.drive(), sources)
        });
        let dae = CoupledDae::new(NoBody, alone.collect::<Result<_, _>>()?);
        let test = ErrorTest::of_states(0, tolerances(&self.scene));
        let options = CoupledOptions::of_oscillators(self.scene.file.integrator.method);
        self.coupled(task, dae, (test, options), Vec::new(), Vec::new())
    }

    /// Runs a task from the initial state of the scene. If `watcher` is `None`, the task starts from rest.
    ///
    /// # Errors
    /// Fails if the initial state cannot be computed. Also returns the errors of the task.
    pub(super) fn run<T: Task>(
        &self,
        watcher: Option<Watcher<'_>>,
        task: T,
    ) -> Result<T::Out, Error> {
        let scene = &self.scene;
        match (&scene.body, &scene.rod) {
            (Some(body), _) => {
                let settings = settings(scene, body, self.times[1]);
                let mut dae = MuscleDae::new(body.muscle.clone(), body.formulation)?;
                let mut y = vec![0.0; dae.n_unknowns()];
                if let Some(watcher) = watcher {
                    let start = body.initial_values(&mut dae, watcher);
                    if let Some([values, _]) = start.map_err(Error::before_any_output)? {
                        y = values;
                    }
                }
                let blocks = dae.layout().blocks().iter().map(|(_, range)| range.clone());
                let blocks: Vec<Range<usize>> = blocks.collect();
                if scene.chains.is_empty() {
                    let start =
                        move |dae: MuscleDae, interval: Interval, y: &[f64], y_dot: &[f64]| {
                            let Interval { times, fixed_step, tolerance_factor } = interval;
                            let rtol = tolerance_factor * settings.relative_tolerance;
                            let settings = settings.clone().with_relative_tolerance(rtol);
                            let settings = Settings { fixed_step, ..settings };
                            start_from(dae, &settings, times[0], y, y_dot)
                        };
                    return task.of_system(dae, start, y, blocks);
                }
                let test = ErrorTest::of_muscle(&dae, &settings);
                let options = CoupledOptions::of_muscle(&dae, &settings);
                let dae = CoupledDae::new(dae.clone(), driven_by(scene, &dae)?);
                self.coupled(task, dae, (test, options), y, blocks)
            }
            (None, Some(rod)) => {
                let n = rod.n_unknowns();
                let test = ErrorTest::of_states(n, tolerances(scene));
                let dae = CoupledDae::new(rod.clone(), driven_by_rod(scene, rod)?);
                let blocks = vec![0..n / 2, n / 2..n];
                let options = chain_options(scene);
                self.coupled(task, dae, (test, options), vec![0.0; n], blocks)
            }
            (None, None) => {
                let error = InputError::new("a periodic state needs a body or a rod under load");
                Err(error.next("for chains alone, use analysis = \"dynamic\"").into())
            }
        }
    }

    /// Runs a task for a body with its chains. `blocks` contains the ranges of unknowns of the same kind in the body.
    fn coupled<B: SystemBody + Clone, T: Task>(
        &self,
        task: T,
        dae: CoupledDae<B>,
        (test, options): (ErrorTest, CoupledOptions),
        y: Vec<f64>,
        mut blocks: Vec<Range<usize>>,
    ) -> Result<T::Out, Error> {
        let test = test.with_oscillators(&dae, tolerances(&self.scene));
        for k in 0..dae.n_networks() {
            let Range { start, end } = dae.range(k);
            let middle = start + dae.oscillators(k).network().n_oscillators();
            blocks.extend([start..middle, middle..end]);
        }
        let y = initial_state(&self.scene, &dae, &y);
        let start = move |dae: CoupledDae<B>, interval: Interval, y: &[f64], y_dot: &[f64]| {
            let options = options.clone().with_fixed_step(interval.fixed_step);
            let test = test.clone().scaled(|_| interval.tolerance_factor);
            start_coupled_from(dae, test, options, interval.times, y, y_dot)
        };
        task.of_system(dae, start, y, blocks)
    }
}

/// Returns the settings of a body for an integration to `t_end`, the end of the period.
fn settings(scene: &Scene, body: &Body, t_end: f64) -> Settings {
    let wanted = &scene.file.integrator;
    Settings {
        t_end,
        absolute_tolerances: absolute_tolerances(
            wanted,
            &body.muscle,
            t_end,
            TypicalStart::At([0.0; 2]),
        ),
        ..body.settings.clone()
    }
}

/// Observer that records the largest magnitude in each block of unknowns.
pub(super) struct Extent<'a> {
    pub(super) blocks: &'a [Range<usize>],
    pub(super) sizes: Vec<f64>,
    pub(super) y: Vec<f64>,
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

/// Observer that samples the probes at equidistant times over the period, including both ends.
pub(super) struct Samples<'a> {
    readings: &'a [Box<dyn Reading>],
    times: Vec<f64>,
    next: usize,
    /// Rows of each probe. Each row consists of the time and the values.
    pub(super) rows: Vec<Vec<Vec<f64>>>,
    y: Vec<f64>,
    y_dot: Vec<f64>,
}

impl<'a> Samples<'a> {
    pub(super) fn new(
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
                let at = StateAt { t: inside, y: &self.y, y_dot: &self.y_dot };
                let values = reading.values(system, at)?;
                rows.push(std::iter::once(t).chain(values).collect());
            }
        }
        Ok(ControlFlow::Continue(()))
    }
}
