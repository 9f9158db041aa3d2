//! Residuals of measurements as functions of the parameters of a scene.

use myovib_fit::{Failed, Model};
use myovib_model::sensitivity::Dependences;
use nalgebra::DMatrix;
use serde_json::{Value, json};

use super::Point;
use super::data::Datum;
use super::evaluations::{Evaluation, Evaluations, Numbers};
use crate::sensitivity::{
    Abscissa, Output, Parameterized, Precision, Sample, equilibria, follow, respond,
};
use crate::watch::Watcher;
use crate::{Error, Scene};

/// Tolerance of the sensitivities as a fraction of the tolerance of the motion. A fit does not need more accurate
/// derivatives.
const FRACTION: f64 = 1.0;

/// Duration and accuracy of the runs.
#[derive(Debug, Clone, Copy)]
pub(super) struct Effort {
    /// Lower limit on the relative tolerance of a run.
    pub(super) least_tolerance: f64,
    /// Duration of a run as a fraction of the time until the last measurement.
    pub(super) part: f64,
}

impl Effort {
    /// Full runs with the scene's tolerance, up to the last measurement.
    pub(super) const FULL: Self = Self { least_tolerance: 0.0, part: 1.0 };
}

/// A scene with the measurements of one experiment.
pub(super) struct Experiment {
    scene: Parameterized,
    outputs: Vec<Output>,
    pub(super) data: Vec<Datum>,
    /// Distinct times, frequencies or load factors of the measurements, in ascending order.
    times: Vec<f64>,
}

impl Experiment {
    /// Creates an experiment that computes only the outputs with measurements. `data` must be sorted by time and must
    /// refer to outputs in `all`.
    pub(super) fn new(scene: Parameterized, all: Vec<Output>, mut data: Vec<Datum>) -> Self {
        let mut times: Vec<f64> = data.iter().map(|datum| datum.t).collect();
        times.dedup();
        let mut outputs = Vec::new();
        for (k, output) in all.into_iter().enumerate() {
            let mut own = data.iter_mut().filter(|datum| datum.output == k).peekable();
            if own.peek().is_some() {
                own.for_each(|datum| datum.output = outputs.len());
                outputs.push(output);
            }
        }
        Self { scene, outputs, data, times }
    }

    pub(super) fn scene(&self) -> &Scene {
        &self.scene.scene
    }

    /// Returns whether the other experiment has the same measurements.
    pub(super) fn has_data_of(&self, other: &Self) -> bool {
        self.outputs == other.outputs && self.data == other.data
    }

    /// Returns the scene as JSON, without the starting values and bounds of the fit. These do not affect the cost.
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

    /// Rejects parameter values at which the scene is invalid or has no derivatives.
    pub(super) fn expect_computable(&self, values: &[f64]) -> Result<(), Error> {
        match self.abscissa() {
            Abscissa::Time => self.scene.dependences(values).map(|_| ()),
            Abscissa::Frequency | Abscissa::Load => {
                self.outside_time(values, &self.times[..1], true, Watcher::NOBODY).map(|_| ())
            }
        }
    }

    /// Returns the independent variable of the measurements.
    fn abscissa(&self) -> Abscissa {
        Abscissa::of(self.scene())
    }

    /// Returns the outputs of a response at the frequencies `at`, or of a static analysis at the load factors `at`.
    fn outside_time(
        &self,
        p: &[f64],
        at: &[f64],
        with: bool,
        watcher: Watcher<'_>,
    ) -> Result<Vec<Sample>, Error> {
        let (scene, outputs) = (&self.scene, &self.outputs);
        match self.abscissa() {
            Abscissa::Load => {
                equilibria(scene, p, outputs, at, with, watcher).map(|(samples, _)| samples)
            }
            _ => respond(scene, p, outputs, at, with, watcher),
        }
    }

    /// Returns the measurements up to the fraction `part` of the time of the last measurement.
    fn data_within(&self, part: f64) -> &[Datum] {
        let end = self.times.last().map_or(0.0, |last| part * last);
        &self.data[..self.data.partition_point(|datum| datum.t <= end)]
    }

    /// Returns the outputs at the measurement times that `effort` includes, or at all measured frequencies or load
    /// factors.
    fn run(
        &self,
        p: &[f64],
        with: bool,
        effort: Effort,
        watcher: Watcher<'_>,
    ) -> Result<Vec<Sample>, Error> {
        if self.abscissa() != Abscissa::Time {
            return self.outside_time(p, &self.times, with, watcher);
        }
        let dependences = match with {
            true => self.scene.dependences(p)?,
            false => Dependences::default(),
        };
        let mut scene = self.scene.at(p)?;
        if let Some(body) = &mut scene.body {
            let own = body.settings.relative_tolerance;
            body.settings =
                body.settings.clone().with_relative_tolerance(own.max(effort.least_tolerance));
        }
        let requested = (dependences, Precision::Fraction(FRACTION));
        let end = self.times.last().map_or(0.0, |last| effort.part * last);
        let times = &self.times[..self.times.partition_point(|t| *t <= end)];
        let (samples, _) = follow(&scene, &self.outputs, times, requested, watcher)?;
        Ok(samples)
    }

    /// Pairs each measurement with the sample at the same time, frequency or load factor.
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

/// Returns the standard deviation of a measurement, or 1 if it is unknown.
fn deviation(datum: &Datum) -> f64 {
    datum.noise.unwrap_or(1.0)
}

pub(super) struct SceneModel<'a> {
    experiments: Vec<Experiment>,
    watcher: Watcher<'a>,
    evaluations: &'a Evaluations,
    effort: Effort,
    runs: [u64; 2],
    failure: Option<Error>,
}

impl<'a> SceneModel<'a> {
    pub(super) fn new(
        experiments: Vec<Experiment>,
        watcher: Watcher<'a>,
        evaluations: &'a Evaluations,
    ) -> Self {
        Self {
            experiments,
            watcher,
            evaluations,
            effort: Effort::FULL,
            runs: [0, 0],
            failure: None,
        }
    }

    /// Sets the effort of all later runs. The effort also determines the number of residuals.
    pub(super) fn set_effort(&mut self, effort: Effort) {
        self.effort = effort;
    }

    /// Returns whether all measurements are functions of time. Only then can shorter runs be used.
    pub(super) fn is_in_time(&self) -> bool {
        let mut all = self.experiments.iter();
        all.all(|experiment| experiment.abscissa() == Abscissa::Time)
    }

    pub(super) fn is_interrupted(&self) -> bool {
        self.watcher.is_interrupted()
    }

    /// Returns the number of runs without sensitivities and the number of runs with sensitivities.
    pub(super) fn runs(&self) -> [u64; 2] {
        self.runs
    }

    /// Removes and returns the error of the last failed run.
    pub(super) fn take_failure(&mut self) -> Option<Error> {
        self.failure.take()
    }

    /// Combines the measurements with the given residuals.
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
                abscissa: experiment.abscissa(),
                measured: datum.value,
                fitted: datum.value + residual * deviation(datum),
                residual,
            })
            .collect()
    }

    /// Pairs each measurement with its output and with the sample at the same time, frequency or load factor.
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
                // An output has no derivative at a kink.
                let is_at_kink =
                    of_p[datum.output].is_nan() && sample.values[datum.output].is_finite();
                let slope = if is_at_kink { 0.0 } else { of_p[datum.output] };
                *entry = slope / deviation(datum);
            }
        }
    }

    fn run(&mut self, p: &[f64], with: bool) -> Result<Vec<Vec<Sample>>, Error> {
        let mut all = Vec::with_capacity(self.experiments.len());
        for experiment in &self.experiments {
            self.runs[usize::from(with)] += 1;
            all.push(experiment.run(p, with, self.effort, self.watcher)?);
        }
        Ok(all)
    }

    fn numbers(&mut self, p: &[f64], with: bool) -> Result<Numbers, Error> {
        let all = self.run(p, with)?;
        let mut residuals = vec![0.0; self.n_residuals()];
        self.write_residuals(&all, &mut residuals);
        let n_columns = if with { p.len() } else { 0 };
        let mut jacobian = DMatrix::zeros(residuals.len(), n_columns);
        if with {
            self.write_jacobian(&all, &mut jacobian);
        }
        Ok(Numbers { residuals, jacobian: jacobian.as_slice().to_vec() })
    }

    /// Returns the residuals at the parameters `p` and, if requested, their derivatives. The values come from an
    /// earlier fit or from new runs.
    fn evaluate(&mut self, p: &[f64], with: bool) -> Result<Numbers, Failed> {
        if self.is_interrupted() {
            return Err(Failed("interrupted".into()));
        }
        let key = Evaluations::key(p, self.effort, with);
        let n = self.n_residuals();
        let sizes = [n, if with { n * p.len() } else { 0 }];
        let fits = |known: &Numbers| [known.residuals.len(), known.jacobian.len()] == sizes;
        let known = self.evaluations.known(&key);
        if let Some(known) = known.filter(|known| fits(&known.numbers)) {
            self.runs[usize::from(with)] += known.runs;
            return Ok(known.numbers.clone());
        }
        let before = self.runs[usize::from(with)];
        match self.numbers(p, with) {
            Ok(numbers) => {
                let runs = self.runs[usize::from(with)] - before;
                if !self.is_interrupted() {
                    self.evaluations.add(key, &Evaluation { runs, numbers: numbers.clone() });
                }
                Ok(numbers)
            }
            Err(failure) => {
                let message = failure.to_string();
                self.failure = Some(failure);
                Err(Failed(message))
            }
        }
    }
}

impl Model for SceneModel<'_> {
    fn n_residuals(&self) -> usize {
        let all = self.experiments.iter();
        all.map(|e| e.data_within(self.effort.part).len()).sum()
    }

    fn residuals(&mut self, p: &[f64], out: &mut [f64]) -> Result<(), Failed> {
        out.copy_from_slice(&self.evaluate(p, false)?.residuals);
        Ok(())
    }

    /// Computes the derivatives by forward sensitivities.
    fn jacobian(&mut self, p: &[f64], _: &[f64], out: &mut DMatrix<f64>) -> Result<(), Failed> {
        out.copy_from_slice(&self.evaluate(p, true)?.jacobian);
        Ok(())
    }

    /// Computes the residuals and their derivatives in one run with sensitivities.
    fn residuals_with_jacobian(
        &mut self,
        p: &[f64],
        _: &[f64],
        out: &mut [f64],
        jacobian: &mut DMatrix<f64>,
    ) -> Result<bool, Failed> {
        let both = self.evaluate(p, true)?;
        out.copy_from_slice(&both.residuals);
        jacobian.copy_from_slice(&both.jacobian);
        Ok(true)
    }
}
