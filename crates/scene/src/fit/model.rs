//! Residuals of measurements as a function of a scene's parameters.

use myovib_fit::{Failed, Model};
use myovib_model::sensitivity::Dependences;
use nalgebra::DMatrix;
use serde_json::{Value, json};

use super::Point;
use super::data::Datum;
use crate::sensitivity::{Output, Parametrised, Precision, Sample, follow};
use crate::watch::Watcher;
use crate::{Error, Scene};

/// Derivatives are solved for to the tolerance of the motion: of them the fit needs fewer digits.
const FRACTION: f64 = 1.0;

/// A scene with the measurements of one experiment.
pub(super) struct Experiment {
    scene: Parametrised,
    outputs: Vec<Output>,
    pub(super) data: Vec<Datum>,
    /// The times of the measurements, each once.
    times: Vec<f64>,
}

impl Experiment {
    /// `data` in the order of time, of outputs that are there.
    pub(super) fn new(scene: Parametrised, outputs: Vec<Output>, data: Vec<Datum>) -> Self {
        let mut times: Vec<f64> = data.iter().map(|datum| datum.t).collect();
        times.dedup();
        Self {
            scene,
            outputs,
            data,
            times,
        }
    }

    /// The scene.
    pub(super) fn scene(&self) -> &Scene {
        &self.scene.scene
    }

    /// What the scene says of what is computed: not where a fit starts, nor between which bounds.
    pub(super) fn computed(&self) -> Value {
        let mut file = json!(self.scene().file);
        let parameters = file["parameter"].as_array_mut();
        for parameter in parameters.into_iter().flatten() {
            if let Some(parameter) = parameter.as_object_mut() {
                parameter.retain(|key, _| !["start", "low", "high"].contains(&key.as_str()));
            }
        }
        file
    }

    /// Whether the scene, and how it depends on its parameters, can be had at these values.
    pub(super) fn expect_computable(&self, values: &[f64]) -> Result<(), Error> {
        self.scene.dependences(values).map(|_| ())
    }

    /// The measurements of this first part of their time.
    fn data_within(&self, part: f64) -> &[Datum] {
        let end = self.times.last().map_or(0.0, |last| part * last);
        &self.data[..self.data.partition_point(|datum| datum.t <= end)]
    }

    /// The outputs at the times of the measurements, as far and as well as `effort` says.
    fn run(
        &self,
        p: &[f64],
        with: bool,
        effort: Effort,
        watcher: Watcher<'_>,
    ) -> Result<Vec<Sample>, Error> {
        let dependences = match with {
            true => self.scene.dependences(p)?,
            false => Dependences::default(),
        };
        let mut scene = self.scene.at(p)?;
        if let Some(body) = &mut scene.body {
            let own = body.settings.relative_tolerance;
            body.settings = body
                .settings
                .clone()
                .with_relative_tolerance(own.max(effort.least_tolerance));
        }
        let asked = (dependences, Precision::Fraction(FRACTION));
        let end = self.times.last().map_or(0.0, |last| effort.part * last);
        let times = &self.times[..self.times.partition_point(|t| *t <= end)];
        let (samples, _) = follow(&scene, &self.outputs, times, asked, watcher)?;
        Ok(samples)
    }

    /// Each measurement with the sample of its time.
    fn pairs<'a>(
        &'a self,
        samples: &'a [Sample],
        part: f64,
    ) -> impl Iterator<Item = (&'a Datum, &'a Sample)> {
        let mut k = 0;
        self.data_within(part).iter().map(move |datum| {
            while samples[k].t < datum.t {
                k += 1;
            }
            (datum, &samples[k])
        })
    }
}

/// How far and how well motions are computed.
#[derive(Debug, Clone, Copy)]
pub(super) struct Effort {
    /// To this relative tolerance at least, whatever the scene says.
    pub(super) least_tolerance: f64,
    /// This first part of the time of the measurements.
    pub(super) part: f64,
}

impl Effort {
    /// As the scene says, to the last measurement.
    pub(super) const FULL: Self = Self {
        least_tolerance: 0.0,
        part: 1.0,
    };
}

/// σ, or 1 where it is not known.
fn deviation(datum: &Datum) -> f64 {
    datum.noise.unwrap_or(1.0)
}

/// All experiments.
pub(super) struct SceneModel<'a> {
    experiments: Vec<Experiment>,
    watcher: Watcher<'a>,
    effort: Effort,
    runs: [u64; 2],
    failure: Option<String>,
}

impl<'a> SceneModel<'a> {
    pub(super) fn new(experiments: Vec<Experiment>, watcher: Watcher<'a>) -> Self {
        Self {
            experiments,
            watcher,
            effort: Effort::FULL,
            runs: [0, 0],
            failure: None,
        }
    }

    /// How all runs are computed from now on; residuals are those of what runs reach.
    pub(super) fn set_effort(&mut self, effort: Effort) {
        self.effort = effort;
    }

    /// Whether runs are to end.
    pub(super) fn is_interrupted(&self) -> bool {
        self.watcher.is_interrupted()
    }

    /// Runs without and with sensitivities so far.
    pub(super) fn runs(&self) -> [u64; 2] {
        self.runs
    }

    /// What the last run that failed said.
    pub(super) fn last_failure(&self) -> Option<&str> {
        self.failure.as_deref()
    }

    /// The measurements with these residuals.
    pub(super) fn points(&self, residuals: &[f64]) -> Vec<Point> {
        let numbered = self.experiments.iter().enumerate();
        let data = numbered.flat_map(|(i, experiment)| {
            let data = experiment.data_within(self.effort.part);
            data.iter().map(move |datum| (i, experiment, datum))
        });
        data.zip(residuals)
            .map(|((i, experiment, datum), &residual)| Point {
                experiment: i + 1,
                output: experiment.outputs[datum.output].name.clone(),
                column: experiment.outputs[datum.output].column_name.clone(),
                t: datum.t,
                measured: datum.value,
                fitted: datum.value + residual * deviation(datum),
                residual,
            })
            .collect()
    }

    /// Each measurement with its output and the sample of its time.
    fn pairs<'s>(
        &'s self,
        all: &'s [Vec<Sample>],
    ) -> impl Iterator<Item = (&'s Output, &'s Datum, &'s Sample)> {
        let each = self.experiments.iter().zip(all);
        each.flat_map(|(experiment, samples)| {
            let pairs = experiment.pairs(samples, self.effort.part);
            pairs.map(|(datum, sample)| (&experiment.outputs[datum.output], datum, sample))
        })
    }

    fn write_residuals(&self, all: &[Vec<Sample>], out: &mut [f64]) {
        for (out, (output, datum, sample)) in out.iter_mut().zip(self.pairs(all)) {
            let difference = output.difference(sample.values[datum.output], datum.value);
            *out = difference / deviation(datum);
        }
    }

    fn write_jacobian(&self, all: &[Vec<Sample>], out: &mut DMatrix<f64>) {
        for (mut row, (_, datum, sample)) in out.row_iter_mut().zip(self.pairs(all)) {
            for (entry, of_p) in row.iter_mut().zip(&sample.derivatives) {
                // A measurement at a kink of its output tells of no slope.
                let is_at_kink =
                    of_p[datum.output].is_nan() && sample.values[datum.output].is_finite();
                let slope = if is_at_kink { 0.0 } else { of_p[datum.output] };
                *entry = slope / deviation(datum);
            }
        }
    }

    fn run(&mut self, p: &[f64], with: bool) -> Result<Vec<Vec<Sample>>, Failed> {
        if self.is_interrupted() {
            return Err(Failed("interrupted".into()));
        }
        let mut all = Vec::with_capacity(self.experiments.len());
        for experiment in &self.experiments {
            self.runs[usize::from(with)] += 1;
            match experiment.run(p, with, self.effort, self.watcher) {
                Ok(samples) => all.push(samples),
                Err(error) => {
                    let message = error.to_string();
                    self.failure = Some(message.clone());
                    return Err(Failed(message));
                }
            }
        }
        Ok(all)
    }
}

impl Model for SceneModel<'_> {
    fn n_residuals(&self) -> usize {
        let all = self.experiments.iter();
        all.map(|e| e.data_within(self.effort.part).len()).sum()
    }

    fn residuals(&mut self, p: &[f64], out: &mut [f64]) -> Result<(), Failed> {
        let all = self.run(p, false)?;
        self.write_residuals(&all, out);
        Ok(())
    }

    /// By forward sensitivities.
    fn jacobian(&mut self, p: &[f64], _: &[f64], out: &mut DMatrix<f64>) -> Result<(), Failed> {
        let all = self.run(p, true)?;
        self.write_jacobian(&all, out);
        Ok(())
    }

    /// From one run with sensitivities.
    fn residuals_with_jacobian(
        &mut self,
        p: &[f64],
        _: &[f64],
        out: &mut [f64],
        jacobian: &mut DMatrix<f64>,
    ) -> Result<bool, Failed> {
        let all = self.run(p, true)?;
        self.write_residuals(&all, out);
        self.write_jacobian(&all, jacobian);
        Ok(true)
    }
}
