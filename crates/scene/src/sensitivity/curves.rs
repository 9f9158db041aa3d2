//! Runs that sample outputs and their derivatives with respect to parameters.

use std::f64::consts::TAU;

use myovib_dae::LinearSolver;
use myovib_fem::Inverted;
use myovib_model::sensitivity::{
    Dependences, DrivingIntegrator, PerturbedSystems, SensitiveIntegrator,
};
use myovib_model::start::Consistent;
use myovib_model::{Advance, Integrator, IntegratorKind, ModelError, MuscleDae, Settings};

use super::parameters::body;
use crate::probe::{Reading, StateAt, within_half_a_turn};
use crate::response::{Part, Values};
use crate::run::start::{driving, initial};
use crate::scene::Scene;
use crate::scene_file::identification::{Output as OutputSettings, ShearWave};
use crate::system::System;
use crate::watch::Watcher;
use crate::{Error, InputError};

/// An output of a scene: one column of a probe or, in a response, of a ratio.
#[derive(Debug, Clone, PartialEq)]
pub struct Output {
    pub name: String,
    pub column_name: String,
    /// Index of the probe; the ratios of a response follow the probes.
    pub(super) probe: usize,
    /// Zero-based index of the column, not counting the time or frequency.
    pub(super) column: usize,
    /// Standard deviation of a measurement, if it is given in the scene.
    pub noise: Option<f64>,
    /// A full turn if the output is an angle, which is only defined up to full turns.
    turn: Option<f64>,
    /// Shear wave computed from the complex value of the column, which is a shear modulus.
    pub(crate) shear_wave: Option<ShearWave>,
}

impl Output {
    /// Returns the difference of two values. The difference of two angles is at most half a turn.
    pub(crate) fn difference(&self, value: f64, other: f64) -> f64 {
        match self.turn {
            Some(turn) => within_half_a_turn(value - other, turn),
            None => value - other,
        }
    }

    /// Returns the sampling interval (s) of the output's probe.
    pub(super) fn every(&self, scene: &Scene) -> f64 {
        scene.file.probe[self.probe].interval
    }
}

#[cfg(test)]
impl Output {
    /// Returns an output without a probe.
    pub(crate) fn of_test(name: &str, noise: Option<f64>) -> Self {
        Self {
            name: name.to_owned(),
            column_name: name.to_owned(),
            probe: 0,
            column: 0,
            noise,
            turn: None,
            shear_wave: None,
        }
    }
}

/// A source of outputs: a probe, or a ratio of a response.
struct Source<'a> {
    name: &'a str,
    /// `None` for a ratio.
    probe: Option<&'a dyn Reading>,
}

impl<'a> Source<'a> {
    /// Returns the probes and then the ratios of a scene.
    fn all(scene: &'a Scene, probes: &'a [Box<dyn Reading>]) -> Vec<Self> {
        let named = scene.file.probe.iter().zip(probes);
        let probes = named.map(|(file, probe)| Self { name: &file.name, probe: Some(&**probe) });
        let ratios = scene.file.response.iter().flat_map(|response| &response.ratio);
        probes.chain(ratios.map(|ratio| Self { name: &ratio.name, probe: None })).collect()
    }

    /// Returns whether the source accumulates over time.
    fn accumulates(&self) -> bool {
        self.probe.is_some_and(|probe| probe.balance().is_some())
    }

    /// Returns the names of the complex values in a response.
    fn complex_names(&self) -> Vec<String> {
        match self.probe {
            None => vec![self.name.to_owned()],
            Some(probe) if probe.is_harmonic() => probe.names(),
            Some(_) => Vec::new(),
        }
    }

    /// Returns the column names: one per value for a motion, or one per part of each complex value for a response.
    fn column_names(&self, is_response: bool) -> Vec<String> {
        match is_response {
            true => self.complex_names().iter().flat_map(|name| Part::columns(name)).collect(),
            false => self.probe.map(Reading::names).unwrap_or_default(),
        }
    }

    /// Returns the names of the columns from which an output can be computed. Waves are computed from complex values.
    fn names_for(&self, settings: &OutputSettings, is_response: bool) -> Vec<String> {
        match settings.shear_wave {
            None => self.column_names(is_response),
            Some(_) if is_response => self.complex_names(),
            Some(_) => Vec::new(),
        }
    }

    /// Returns a full turn in the unit of a column if the column contains an angle.
    fn turn(&self, is_response: bool, column: usize) -> Option<f64> {
        match is_response {
            true => (Part::of_column(column) == Part::Phase).then_some(360.0),
            false => self.probe.is_some_and(|probe| probe.is_angle(column)).then_some(TAU),
        }
    }
}

/// Returns the outputs of a scene: its `[[output]]` entries or, without such entries, all columns of its probes and
/// ratios. If a scene has outputs for motions and for responses, only the outputs for its analysis are returned.
///
/// # Errors
/// Fails if a probe, ratio or column is unknown, if a probe accumulates over time, or if a name is used twice.
pub fn outputs(scene: &Scene) -> Result<Vec<Output>, InputError> {
    let probes = scene.readings()?;
    let is_response = scene.is_response();
    if is_response {
        Values::of_scene(scene)?;
    }
    let file = &scene.file;
    let sources = Source::all(scene, &probes);
    if file.output.is_empty() {
        return all_columns(is_response, &sources);
    }
    // Outputs for the other analysis are skipped if the scene has outputs for both analyses.
    let has_column = |is_response: bool, source: &Source<'_>, settings: &OutputSettings| {
        source.names_for(settings, is_response).contains(&settings.column)
    };
    let is_own = |settings: &OutputSettings| {
        let mut named = sources.iter().filter(|source| source.name == settings.probe);
        named.any(|source| has_column(is_response, source, settings))
    };
    let has_own = file.output.iter().any(is_own);
    let named = file.output.iter().enumerate().map(|(i, settings)| {
        let k = source_of(scene, i, &sources)?;
        let source = &sources[k];
        let names = source.names_for(settings, is_response);
        let column = names.iter().position(|name| *name == settings.column);
        let is_other = has_own && has_column(!is_response, source, settings);
        if column.is_none() && !is_other {
            return Err(no_column(scene, i, &names));
        }
        if file.output[..i].iter().any(|other| other.name == settings.name) {
            let error = InputError::new(format!("duplicate output name `{}`", settings.name));
            return Err(scene.wrong(&format!("output[{i}].name"), error));
        }
        Ok(column.map(|column| {
            let own = Output {
                name: settings.name.clone(),
                column_name: settings.column.clone(),
                probe: k,
                column,
                noise: settings.noise,
                turn: None,
                shear_wave: settings.shear_wave,
            };
            match settings.shear_wave {
                Some(wave) => Output {
                    column_name: wave.label().to_owned(),
                    column: Part::ALL.len() * column,
                    ..own
                },
                None => Output { turn: source.turn(is_response, column), ..own },
            }
        }))
    });
    named.filter_map(Result::transpose).collect()
}

fn all_columns(is_response: bool, sources: &[Source<'_>]) -> Result<Vec<Output>, InputError> {
    let mut all = Vec::new();
    for (k, source) in sources.iter().enumerate().filter(|(_, source)| !source.accumulates()) {
        let names = source.column_names(is_response).into_iter().enumerate();
        all.extend(names.map(|(column, name)| Output {
            name: format!("{}.{name}", source.name),
            column_name: name,
            probe: k,
            column,
            noise: None,
            turn: source.turn(is_response, column),
            shear_wave: None,
        }));
    }
    match all.is_empty() {
        true => Err(InputError::new("the scene has no probe with derivatives")
            .next("add a [[probe]] with type = \"point\"")),
        false => Ok(all),
    }
}

/// Returns the index of the source to which the `[[output]]` entry with index `i` refers.
fn source_of(scene: &Scene, i: usize, sources: &[Source<'_>]) -> Result<usize, InputError> {
    let name = &scene.file.output[i].probe;
    let error = match sources.iter().position(|source| source.name == *name) {
        Some(k) if !sources[k].accumulates() => return Ok(k),
        Some(_) => InputError::new(format!("the probe `{name}` accumulates over time"))
            .allowed("a probe of the state: a point, line, average, reaction, volume or coherence"),
        None => {
            let names: Vec<&str> = sources.iter().map(|source| source.name).collect();
            InputError::new(format!("unknown probe `{name}`")).allowed(names.join(", "))
        }
    };
    Err(scene.wrong(&format!("output[{i}].probe"), error))
}

/// Returns the error for the `[[output]]` entry with index `i`, whose column is not among the `names`.
fn no_column(scene: &Scene, i: usize, names: &[String]) -> InputError {
    let OutputSettings { probe, column, shear_wave, .. } = &scene.file.output[i];
    let (key, error) = match shear_wave {
        Some(_) if !scene.is_response() => {
            let error = InputError::new("a shear wave needs a harmonic response");
            ("shear_wave", error.next("set analysis = \"response\", or remove `shear_wave`"))
        }
        Some(_) if names.is_empty() => {
            let error = InputError::new(format!("the probe `{probe}` has no harmonic amplitude"));
            ("probe", error.next("use a probe with type = \"reaction\""))
        }
        _ => {
            let error = InputError::new(format!("`{probe}` has no column `{column}`"));
            ("column", error.allowed(names.join(", ")))
        }
    };
    scene.wrong(&format!("output[{i}].{key}"), error)
}

/// The outputs at one time, frequency or load factor.
#[derive(Debug, Clone, PartialEq)]
pub struct Sample {
    /// Time (s), frequency (Hz) or load factor.
    pub t: f64,
    pub values: Vec<f64>,
    /// Derivatives of the outputs with respect to each parameter; empty for a run without sensitivities.
    pub derivatives: Vec<Vec<f64>>,
}

/// Computational work of a run.
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize)]
pub struct Cost {
    pub steps: u64,
    /// Number of real and complex factorizations.
    pub factorizations: u64,
    /// Number of real and complex solves for sensitivities.
    pub sensitivity_solves: u64,
}

/// Returns settings that support sensitivities. The method becomes `radau9` unless the scene uses a Radau IIA method.
pub fn settings(settings: &Settings) -> Settings {
    match settings.integrator.stages() {
        Some(_) => settings.clone(),
        None => settings.clone().with_integrator(IntegratorKind::Radau9),
    }
}

/// Reader for the outputs of a state.
pub(super) struct Readings<'a> {
    outputs: &'a [Output],
    probes: Vec<Box<dyn Reading>>,
    allows_inverted: bool,
}

impl<'a> Readings<'a> {
    /// Prepares the probes of `scene`.
    pub(super) fn new(scene: &Scene, outputs: &'a [Output]) -> Result<Self, InputError> {
        let probes = scene.readings()?;
        Ok(Self { outputs, probes, allows_inverted: scene.allows_inverted() })
    }

    /// Returns the outputs at a state of the motion or path.
    ///
    /// # Errors
    /// Returns [`ModelError::Inverted`] if an element is inverted at a vertex and the scene does not allow this.
    pub(super) fn accepted_values(
        &self,
        system: &mut dyn System,
        at: StateAt<'_>,
    ) -> Result<Vec<f64>, ModelError> {
        if !self.allows_inverted {
            inverted_at_vertices(system, at.t, at.y)?;
        }
        self.values(system, at)
    }

    /// Returns the outputs at any state, such as a state near the motion for a difference quotient. Each probe is read
    /// once.
    pub(super) fn values(
        &self,
        system: &mut dyn System,
        at: StateAt<'_>,
    ) -> Result<Vec<f64>, ModelError> {
        let mut rows: Vec<Option<Vec<f64>>> = vec![None; self.probes.len()];
        let mut values = Vec::with_capacity(self.outputs.len());
        for Output { probe, column, .. } in self.outputs {
            let row = match rows[*probe].take() {
                Some(row) => row,
                None => self.probes[*probe].values(system, at)?,
            };
            values.push(row[*column]);
            rows[*probe] = Some(row);
        }
        Ok(values)
    }

    /// Returns each output as a weighted sum of unknowns, or `None` if the output is not a displacement or velocity.
    pub(super) fn functionals(&self, dae: &MuscleDae) -> Vec<Option<Vec<(usize, f64)>>> {
        let space = dae.muscle().solid.space();
        let functional = |output: &Output| {
            let mut column = output.column;
            for measurement in self.probes[output.probe].measurements() {
                let width = measurement.names().len();
                if column < width {
                    let (quantity, components) = measurement.functional(space, column)?;
                    return Some(dae.unknowns_among(quantity, &components));
                }
                column -= width;
            }
            None
        };
        self.outputs.iter().map(functional).collect()
    }
}

/// Returns an error if an element of the body is inverted at a vertex.
fn inverted_at_vertices(system: &mut dyn System, t: f64, y: &[f64]) -> Result<(), ModelError> {
    let Some((dae, range)) = system.muscle_at(y) else {
        return Ok(());
    };
    let snapshot = dae.snapshot(t, &y[range], &[]);
    let seen = snapshot.solid.vertex_volume_ratios(snapshot.displacement);
    let (element, barycentric) = (seen.at.element, seen.at.barycentric);
    let inverted = Inverted { element, barycentric, jacobian: seen.smallest };
    if seen.smallest > 0.0 { Ok(()) } else { Err(inverted.into()) }
}

/// Advances a motion over the ascending `times`. Calls `at` with each time and with the nearest time within the last
/// step. The two times may differ by rounding errors at the ends of the run.
///
/// # Errors
/// Fails if the integration stops before the last time, or if `at` fails.
pub(super) fn sample<P, I: Integrator<P>>(
    scene: &Scene,
    integrator: &mut I,
    times: &[f64],
    watcher: Watcher<'_>,
    mut at: impl FnMut(&mut I, f64, f64) -> Result<(), Error>,
) -> Result<(), Error> {
    let mut due = times.iter().copied().peekable();
    while due.peek().is_some() {
        integrator.pass_jump()?;
        let from = integrator.time();
        if watcher.is_interrupted() {
            return Err(Error::Stopped("interrupted".to_owned()));
        }
        if let Advance::Stopped { message, .. } = integrator.advance()? {
            return Err(Error::Stopped(message));
        }
        let to = integrator.time();
        let t_end = scene.t_end;
        watcher.progress.on_progress(&|| format!("t = {to:.3} of {t_end} s"));
        // Times that exceed the end of the run only by rounding errors are included.
        let reach = if to >= t_end { f64::INFINITY } else { to };
        while let Some(t) = due.next_if(|t| *t <= reach) {
            at(integrator, t, t.clamp(from, to))?;
        }
    }
    Ok(())
}

/// Accuracy of sensitivities.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Precision {
    /// The motion determines the steps. Linear systems for sensitivities are solved to a third of the motion's
    /// tolerance.
    #[default]
    OfMotion,
    /// The motion determines the steps. Linear systems for sensitivities are solved to this fraction of the motion's
    /// tolerance.
    Fraction(f64),
    /// The error test includes the sensitivities.
    Tested,
}

/// Computes the motion of a scene, and samples its outputs and their derivatives at the ascending `times`.
///
/// # Errors
/// Fails if the motion of the body cannot start, or if the integration stops before the last time.
pub fn follow(
    scene: &Scene,
    outputs: &[Output],
    times: &[f64],
    (dependences, precision): (Dependences, Precision),
    watcher: Watcher<'_>,
) -> Result<(Vec<Sample>, Cost), Error> {
    let body = body(scene)?;
    let settings = settings(&body.settings);
    let request =
        Request { scene, outputs, times, n_parameters: dependences.count(), precision, watcher };
    // Chains do not act on the body here, so they are integrated only if an output measures them.
    if !outputs.iter().any(|output| scene.file.probe[output.probe].kind.reads_chain()) {
        let mut dae = MuscleDae::new(body.muscle.clone(), body.formulation)?;
        let [y, y_dot] = initial(body, &mut dae, watcher)?;
        let start = [&y[..], &y_dot];
        let integrator = SensitiveIntegrator::starting_at(dae, &settings, start, dependences);
        return request.run(integrator.map_err(wrong_input)?);
    }
    let (dae, how, [y, y_dot]) = driving(scene, body, &settings, watcher)?;
    let start = [&y[..], &y_dot];
    let integrator = DrivingIntegrator::driving(dae, how, scene.t_end, start, dependences);
    request.run(integrator.map_err(wrong_input)?)
}

/// Converts the error of an integrator that rejected its settings to an input error, because nothing has been computed
/// yet.
fn wrong_input(error: ModelError) -> Error {
    Error::from(error).before_any_output()
}

/// A run whose outputs are sampled.
struct Request<'a> {
    scene: &'a Scene,
    outputs: &'a [Output],
    times: &'a [f64],
    n_parameters: usize,
    precision: Precision,
    watcher: Watcher<'a>,
}

impl Request<'_> {
    fn run<P, M, Q>(
        &self,
        integrator: SensitiveIntegrator<P, M, Q>,
    ) -> Result<(Vec<Sample>, Cost), Error>
    where
        P: System + Consistent,
        M: LinearSolver<P>,
        Q: PerturbedSystems<P>,
    {
        let mut integrator = match self.precision {
            Precision::OfMotion => integrator,
            Precision::Fraction(fraction) => integrator.with_tolerance(fraction),
            Precision::Tested => integrator.controlling_steps(),
        };
        let readings = Readings::new(self.scene, self.outputs)?;
        let mut read = |system: &mut P, t: f64, y: &[f64], y_dot: &[f64]| {
            readings.values(system, StateAt { t, y, y_dot })
        };
        let mut samples = Vec::with_capacity(self.times.len());
        let (scene, times) = (self.scene, self.times);
        sample(scene, &mut integrator, times, self.watcher, |integrator, t, inside| {
            let mut accepted = |system: &mut P, t: f64, y: &[f64], y_dot: &[f64]| {
                readings.accepted_values(system, StateAt { t, y, y_dot })
            };
            let values = integrator.read(inside, &mut accepted)?;
            let derivative = |j| integrator.derivative(j, inside, &values, &mut read);
            let derivatives = (0..self.n_parameters).map(derivative).collect::<Result<_, _>>()?;
            samples.push(Sample { t, values, derivatives });
            Ok(())
        })?;
        let (counts, work) = (integrator.counts(), integrator.work());
        let factorizations = counts
            .radau_work
            .map_or(0, |work| work.real_factorizations + work.complex_factorizations);
        let cost = Cost {
            steps: counts.steps,
            factorizations,
            sensitivity_solves: work.real_solves + work.complex_solves,
        };
        Ok((samples, cost))
    }
}
