//! Branches of periodic states along which a numeric parameter of the scene varies.

use std::cell::Cell;
use std::ops::Range;
use std::sync::atomic::AtomicBool;

use myovib_model::periodic::{self, PeriodMap, Shooting, StartInterval, multipliers};
use myovib_model::start::Consistent;
use myovib_model::{EndReason, Limits, ModelError, Outcome};
use serde_json::Value;

use super::folder::table_of;
use super::options::RunOptions;
use super::period::{Period, Samples, Task};
use crate::csv;
use crate::periodic::{Column, Curve, CurvePoint};
use crate::probe::Reading;
use crate::scene_file::periodic::Continuation;
use crate::system::System;
use crate::{Error, InputError, Scene};

/// Name of the file with the table of the curve.
pub(super) const NAME: &str = "continuation.csv";

/// Numeric parameter of a scene that varies, and the range over which the branch is followed.
pub(super) struct Branch {
    wanted: Continuation,
    /// Value of the parameter at the start of the branch.
    from: f64,
}

impl Branch {
    /// Returns the branch that the scene requests, if any.
    ///
    /// # Errors
    /// Fails if the key does not refer to a parameter that may vary, if the range is empty, or if the scene at the end
    /// of the branch is invalid.
    pub(super) fn of(scene: &Scene) -> Result<Option<Self>, Error> {
        let periodic = scene.file.periodic.as_ref();
        let Some(wanted) = periodic.and_then(|periodic| periodic.continuation.clone()) else {
            return Ok(None);
        };
        let probes = scene.file.probe.iter();
        if let Some(probe) = probes.map(|probe| &probe.name).find(|name| table_of(name) == NAME) {
            let error =
                InputError::new("the table of this probe would replace the table of the curve");
            let error = error.found(format!("a probe \"{probe}\"")).next("rename the probe");
            return Err(scene.wrong("periodic.continuation", error).into());
        }
        if periodic.is_some_and(|own| own.multipliers == 0) {
            let error = InputError::new("a curve of periodic states needs their stability")
                .allowed("at least 1 multiplier");
            return Err(scene.wrong("periodic.multipliers", error).into());
        }
        let key = &wanted.parameter;
        if ["mesh", "group"].iter().any(|table| key.trim_start().starts_with(table)) {
            let error =
                InputError::new("a curve of periodic states cannot change the mesh or its groups");
            let error = error.found(format!("\"{key}\"")).next("compute a sweep over this key");
            return Err(scene.wrong("periodic.continuation.parameter", error).into());
        }
        let parts = key.split(['.', '[', ']']).filter(|part| !part.is_empty());
        let pointer: String = parts.map(|part| format!("/{}", part.trim())).collect();
        let found = scene.written().pointer(&pointer).and_then(Value::as_f64);
        let Some(from) = found else {
            let error = InputError::new(format!("the scene has no numeric key `{key}`"));
            let error =
                error.next("choose a numeric key of the scene, such as traction[0].y.frequency");
            return Err(scene.wrong("periodic.continuation.parameter", error).into());
        };
        if from == wanted.to {
            let error = InputError::new(
                "the continuation range is empty: the scene already has this value",
            )
            .found(wanted.to);
            return Err(scene.wrong("periodic.continuation.to", error).into());
        }
        let branch = Self { wanted, from };
        branch.at(scene, branch.wanted.to)?;
        Ok(Some(branch))
    }

    fn at(&self, scene: &Scene, value: f64) -> Result<Scene, InputError> {
        scene.with(&[format!("{}={value:?}", self.wanted.parameter)])
    }

    /// Follows the curve from the periodic state of the scene. If the curve ends inside its range, the points found so
    /// far are kept.
    ///
    /// # Errors
    /// Returns the errors of the probes.
    pub(super) fn follow(
        &self,
        scene: &Scene,
        options: &RunOptions<'_>,
        (shooting, tolerance_factor): (&Shooting, f64),
        state: &[f64],
    ) -> Result<(Curve, Outcome), Error> {
        let Self { wanted, from } = self;
        let progress = options.watcher().progress;
        let interrupt = options.interrupt;
        // Distances along the curve are measured by the root mean square of the state.
        let root = (state.len() as f64).sqrt();
        let continuation = periodic::Continuation {
            shooting: Shooting {
                scales: shooting.scales.iter().map(|scale| root * scale).collect(),
                tolerance: shooting.tolerance / root,
                ..shooting.clone()
            },
            parameter_scale: (wanted.to - from).abs(),
            range: [from.min(wanted.to), from.max(wanted.to)],
            is_descending: wanted.to < *from,
            max_step: wanted.max_step,
            max_points: wanted.max_points,
        };
        let failed = Cell::new(None);
        let of_model = |error: Error| match error {
            Error::Model(error) => error,
            error => {
                failed.set(Some(error));
                ModelError::Interrupted
            }
        };
        let mut map = |state: &[f64], value: f64| {
            progress.on_progress(&|| format!("periodic: {} = {value:.6}", wanted.parameter));
            let end = || {
                // An iterate may leave the valid range of the parameter. The step is then shortened.
                let scene = self.at(scene, value).map_err(|error| ModelError::PeriodStopped {
                    t: 0.0,
                    message: error.to_string(),
                })?;
                let period = Period::of(&scene)?;
                let end = End { times: period.times, state, tolerance_factor, interrupt };
                period.run(None, end)
            };
            end().map_err(of_model)
        };
        let mut points = Vec::new();
        let mut visit = |point: periodic::Point| {
            let found = self.read(scene, &point, (shooting, tolerance_factor), interrupt);
            points.push(found.map_err(of_model)?);
            Ok(())
        };
        let end = periodic::follow(&mut map, (state, *from), &continuation, &mut visit);
        let failure = end.err();
        let failure = failure.map(|error| failed.take().unwrap_or(Error::Model(error)));
        let outcome = failure.as_ref().map_or(Outcome::Finished, outcome);
        let curve = Curve {
            parameter: wanted.parameter.clone(),
            columns: names(scene, &scene.readings()?),
            points,
            incomplete: outcome.message().map(str::to_owned),
        };
        Ok((curve, outcome))
    }

    /// Computes the amplitudes and the stability at a point of the curve.
    fn read(
        &self,
        scene: &Scene,
        point: &periodic::Point,
        (shooting, tolerance_factor): (&Shooting, f64),
        interrupt: Option<&'static AtomicBool>,
    ) -> Result<CurvePoint, Error> {
        let scene = self.at(scene, point.parameter)?;
        let period = Period::of(&scene)?;
        let reading = Read {
            period: &period,
            readings: &scene.readings()?,
            samples: scene.file.periodic.clone().unwrap_or_default().samples,
            state: &point.state,
            shooting,
            tolerance_factor,
            interrupt,
        };
        let (amplitudes, spectral_radius, is_stable) = period.run(None, reading)?;
        Ok(CurvePoint {
            parameter: point.parameter,
            frequency: period.frequency,
            is_fold: point.is_fold,
            spectral_radius,
            // At a fold, one multiplier is 1.
            is_stable: is_stable.filter(|_| !point.is_fold),
            amplitudes,
        })
    }
}

/// Returns the outcome of a curve that ends inside its range.
fn outcome(failure: &Error) -> Outcome {
    let reason = match failure {
        Error::Model(ModelError::Interrupted) => {
            return Outcome::ended(EndReason::Interrupted, "interrupted".to_owned());
        }
        Error::Model(ModelError::CurveTooLong { .. }) => EndReason::MaxSteps,
        Error::Model(ModelError::NoPeriodicState { .. }) => EndReason::ConvergenceFailures,
        _ => EndReason::ResidualFailed,
    };
    Outcome::ended(reason, failure.to_string())
}

fn names(scene: &Scene, readings: &[Box<dyn Reading>]) -> Vec<String> {
    let probes = scene.file.probe.iter().zip(readings);
    let names = probes.flat_map(|(probe, reading)| {
        let names = reading.names().into_iter();
        names.map(|name| format!("{}.{name}", probe.name))
    });
    names.collect()
}

/// Task that integrates over one period and returns the final state.
struct End<'a> {
    times: [f64; 2],
    state: &'a [f64],
    tolerance_factor: f64,
    interrupt: Option<&'static AtomicBool>,
}

impl Task for End<'_> {
    type Out = Vec<f64>;

    fn of_system<P: System + Consistent + Clone>(
        self,
        dae: P,
        start: impl StartInterval<P>,
        y: Vec<f64>,
        _: Vec<Range<usize>>,
    ) -> Result<Self::Out, Error> {
        let mut map = PeriodMap::new(dae, start, self.times, &y)?;
        map.set_tolerance_factor(self.tolerance_factor);
        let mut limits = Limits::new(f64::INFINITY, self.interrupt);
        Ok(map.observed(self.state, &mut [&mut limits])?)
    }
}

/// Task that computes the amplitudes and the stability at a point of the curve.
struct Read<'a> {
    period: &'a Period,
    readings: &'a [Box<dyn Reading>],
    samples: usize,
    state: &'a [f64],
    shooting: &'a Shooting,
    tolerance_factor: f64,
    interrupt: Option<&'static AtomicBool>,
}

impl Task for Read<'_> {
    /// Amplitudes of the first harmonics, spectral radius, and stability.
    type Out = (Vec<f64>, f64, Option<bool>);

    fn of_system<P: System + Consistent + Clone>(
        self,
        dae: P,
        start: impl StartInterval<P>,
        y: Vec<f64>,
        _: Vec<Range<usize>>,
    ) -> Result<Self::Out, Error> {
        let times = self.period.times;
        let mut map = PeriodMap::new(dae, start, times, &y)?;
        map.set_tolerance_factor(self.tolerance_factor);
        let mut samples = Samples::new(self.readings, times, self.samples, y.len());
        map.observed(self.state, &mut [&mut samples])?;
        let mut amplitudes = Vec::new();
        let start = times[0] * self.period.frequency;
        for (reading, rows) in self.readings.iter().zip(&samples.rows) {
            for (j, name) in reading.names().into_iter().enumerate() {
                let values = rows.iter().take(self.samples).map(|row| row[j + 1]);
                let column = Column::new(name, &values.collect::<Vec<f64>>(), start);
                amplitudes.push(column.amplitudes[0]);
            }
        }
        let mut evaluate = |state: &[f64]| {
            let mut limits = Limits::new(f64::INFINITY, self.interrupt);
            map.observed(state, &mut [&mut limits])
        };
        let leading = multipliers(&mut evaluate, self.state, self.shooting, 1)?;
        Ok((amplitudes, leading.spectral_radius().unwrap_or(0.0), leading.is_stable()))
    }
}

/// Returns the table of a curve. The column `is_stable` contains 1 or 0, or NaN on the stability boundary.
pub(super) fn table(curve: &Curve) -> String {
    let first = ["frequency", "is_fold", "spectral_radius", "is_stable"];
    let names = std::iter::once(&*curve.parameter).chain(first);
    let names: Vec<&str> = names.chain(curve.columns.iter().map(String::as_str)).collect();
    let number = |is: bool| f64::from(u8::from(is));
    let rows = curve.points.iter().map(|point| {
        let mut row = vec![
            point.parameter,
            point.frequency,
            number(point.is_fold),
            point.spectral_radius,
            point.is_stable.map_or(f64::NAN, number),
        ];
        row.extend(&point.amplitudes);
        row
    });
    csv::table(&names, rows)
}
