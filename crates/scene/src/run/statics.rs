//! Static analysis: equilibrium under constant loads, or a path of equilibria.

use std::ops::ControlFlow;
use std::path::Path;

use myovib_dae::Problem;
use myovib_model::statics::{self, Control, CriticalKind, CriticalPoint, PathEnd, PathState};
use myovib_model::{EndReason, Formulation, ModelError, Muscle, MuscleDae, Outcome, Parameters};
use serde_json::{Map, Value, json};

use super::document::{self, Clocks};
use super::dynamic::conditions;
use super::folder::{parameter, request};
use super::options::{RunOptions, RunResult};
use super::recorder::Recorder;
use super::stop::Condition;
use super::volume::Volumes;
use crate::json::extend;
use crate::modes::instability;
use crate::probe::{Reading, StateAt};
use crate::result_folder::{FolderRequest, ResultFolder};
use crate::scene::{Body, Scene};
use crate::state::State;
use crate::vtu::{self, Grid, NotFinite, Series};
use crate::watch::search;
use crate::{Error, InputError, inputs};

/// Computes the equilibrium of a scene under the loads at the end time, or a path of equilibria up to these loads.
pub(super) fn compute(scene: &Scene, options: &RunOptions<'_>) -> Result<RunResult, Error> {
    let clocks = Clocks::start();
    let Some(body) = &scene.body else {
        return Err(InputError::new("a static scene needs a [mesh] with [solid]").into());
    };
    let list = scene.file.fields.as_ref().map(|_| vtu::LIST);
    let request = request(scene, options, list.as_slice())?;
    request.check()?;
    let control = match options.neighbor.as_deref().and_then(|folder| neighbor(body, folder)) {
        Some(displacement) => Control::Neighbor(displacement),
        None => scene.control()?,
    };
    let mut recording = Recording {
        readings: scene.readings()?,
        conditions: conditions(scene)?,
        has_growing_loads: grows(&control),
        ..Recording::new(scene, body, request)
    };
    let search = &mut search(options.watcher());
    let mut written = Ok(());
    let end = statics::follow(
        &body.muscle,
        body.formulation,
        scene.t_end,
        &control,
        search,
        &mut |state| {
            let recorded = recording.record(&state);
            let flow = *recorded.as_ref().unwrap_or(&ControlFlow::Break(()));
            written = recorded.map(drop);
            flow
        },
    )?;
    written?;
    let Some((folder, last)) = recording.folder.as_ref().zip(recording.last.as_ref()) else {
        let shortfall = end.shortfall.expect("a path without a state ends early");
        return Err(shortfall.error(end.reached).into());
    };

    let volumes = &recording.volumes;
    let refused = volumes.refusal(false).filter(|_| !scene.allows_inverted());
    let outcome = match (outcome_of(&end, last.load), refused) {
        (Outcome::Finished, Some(refused)) => refused,
        (Outcome::Finished, None) if recording.stopped.is_some() => {
            Outcome::ended(EndReason::Event, recording.stopped.clone().unwrap_or_default())
        }
        (Outcome::Finished, None) => unfinished(&control, &end).unwrap_or(Outcome::Finished),
        (outcome, _) => outcome,
    };
    folder.write(State::NAME, last.state.encode()?)?;
    let mut document = clocks.document(scene, &outcome);
    extend(&mut document, recording.document(&end, last));
    if options.neighbor.is_some() {
        document["is_continued"] = json!(end.is_continued);
    }
    let volume_note = match outcome.reason() {
        Some(EndReason::Inverted) => None, // the message already reports the inversion
        _ => volumes.note(&body.muscle, false),
    };
    let is_path = scene.file.loading_path.is_some();
    let from_rest = (options.neighbor.is_some() && !end.is_continued).then(|| {
        "the search starts from the unloaded body: the previous case has no equilibrium on this mesh, or it is too \
         far away"
            .to_owned()
    });
    let critical = is_path.then(|| note_of(&end.critical_points)).flatten();
    let notes: Vec<String> = critical
        .into_iter()
        .chain(from_rest)
        .chain(last.instabilities.and_then(instability))
        .chain(volume_note)
        .chain(volumes.penetration_note())
        .chain(recording.not_finite().map(|seen| seen.note()))
        .collect();
    document::finish(folder, scene, document, outcome, notes)
}

/// Outputs of the states of a path.
struct Recording<'a> {
    scene: &'a Scene,
    body: &'a Body,
    /// `None` once the folder is open.
    request: Option<FolderRequest<'a>>,
    /// Empty once the folder is open.
    readings: Vec<Box<dyn Reading>>,
    conditions: Vec<Condition>,
    folder: Option<ResultFolder>,
    recorders: Vec<Recorder>,
    series: Option<Series>,
    volumes: Volumes,
    /// Whether load factors can serve as the times of stored fields.
    has_growing_loads: bool,
    /// Largest constraint drift among all states.
    drift: f64,
    /// Description of the stop condition that ended the path, if any.
    stopped: Option<String>,
    states: Vec<Value>,
    last: Option<Last>,
}

/// Last state that was recorded.
struct Last {
    load: f64,
    instabilities: Option<usize>,
    unknowns: usize,
    results: Map<String, Value>,
    state: State,
}

impl<'a> Recording<'a> {
    fn new(scene: &'a Scene, body: &'a Body, request: FolderRequest<'a>) -> Self {
        Self {
            scene,
            body,
            request: Some(request),
            readings: Vec::new(),
            conditions: Vec::new(),
            folder: None,
            recorders: Vec::new(),
            series: None,
            volumes: Volumes::default(),
            has_growing_loads: false,
            drift: 0.0,
            stopped: None,
            states: Vec::new(),
            last: None,
        }
    }

    /// Writes a state. If the scene has a loading path, writes the unloaded body first.
    fn record(&mut self, state: &PathState) -> Result<ControlFlow<()>, Error> {
        if let Some(request) = self.request.take() {
            self.open(request)?;
            if self.scene.file.loading_path.is_some() {
                self.write(&PathState {
                    load: 0.0,
                    displacement: vec![0.0; state.displacement.len()],
                    pressure: vec![0.0; state.pressure.len()],
                    instabilities: Some(0),
                    newton_iterations: 0,
                    multipliers: Vec::new(),
                })?;
            }
        }
        self.write(state)?;
        Ok(match self.stopped {
            Some(_) => ControlFlow::Break(()),
            None => ControlFlow::Continue(()),
        })
    }

    /// Opens the folder and the tables of the probes.
    fn open(&mut self, request: FolderRequest<'_>) -> Result<(), Error> {
        let (file, body) = (&self.scene.file, self.body);
        let folder = request.open().map_err(Error::before_any_output)?;
        let parameter = parameter(file);
        for (probe, what) in file.probe.iter().zip(self.readings.drain(..)) {
            let t_end = self.scene.t_end;
            let recorder = Recorder::new(probe, what, t_end, parameter, &folder)?;
            self.recorders.push(recorder);
        }
        self.series = file.fields.as_ref().map(|fields| {
            let (grid, quantities) = (Grid::of_body(body), fields.quantities.clone());
            Series::new(grid, quantities, &[])
        });
        self.folder = Some(folder);
        Ok(())
    }

    fn write(&mut self, state: &PathState) -> Result<(), Error> {
        let t = self.scene.t_end;
        // Outputs are computed with the loads under which this state is in equilibrium.
        let whole = &self.body.muscle;
        let has_multipliers = !state.multipliers.iter().all(Vec::is_empty);
        let muscle = match state.load {
            1.0 if !has_multipliers => whole,
            load => &whole.under_part_of_loads(load).with_multipliers(state.multipliers.clone()),
        };
        let mut dae = at_rest(muscle, self.body.formulation, t)?;
        let y = unknowns(state);
        let rest = vec![0.0; dae.n_unknowns()];
        let is_path = self.scene.file.loading_path.is_some();
        let parameter = if is_path { state.load } else { t };
        let drift = dae.constraint_drift(t, &y).map_err(ModelError::from)?;
        self.drift = self.drift.max(drift);
        let mut results = Map::new();
        for (probe, recorder) in self.scene.file.probe.iter().zip(&mut self.recorders) {
            let (y, y_dot) = (&y[..], &rest[..]);
            let values = recorder.what.values(&mut dae, StateAt { t, y, y_dot })?;
            recorder.write(parameter, &values)?;
            let named = recorder.what.names().into_iter();
            let named: Map<_, _> = named.zip(values.into_iter().map(Value::from)).collect();
            results.insert(probe.name.clone(), named.into());
        }
        self.volumes.see_contacts(t, &mut dae, &y);
        let snapshot = dae.snapshot(t, &y, &rest);
        self.volumes.see(t, snapshot.solid, snapshot.displacement);
        if let (Some(series), Some(folder)) = (&mut self.series, &self.folder) {
            // On a path with arc-length control or given loads, a load factor may occur more than once.
            let place = match (is_path, self.has_growing_loads) {
                (true, true) => state.load,
                (true, false) => self.states.len() as f64,
                (false, _) => t,
            };
            series.write(folder, place, &snapshot, &[])?;
        }
        let mut met = self.conditions.iter();
        let met = met.find(|condition| condition.excess_of_body(&snapshot) > 0.0);
        self.stopped = met.map(Condition::describe);
        self.states.push(json!({
            "load": state.load,
            "instabilities": state.instabilities,
            "newton_iterations": state.newton_iterations,
        }));
        let mut saved = State::of(&mut dae, t, &y);
        saved.load_reached = Some(state.load);
        self.last = Some(Last {
            load: state.load,
            instabilities: state.instabilities,
            unknowns: state.displacement.len() + state.pressure.len(),
            results,
            state: saved,
        });
        Ok(())
    }

    /// Returns the part of the document that describes the states.
    fn document(&self, end: &PathEnd, last: &Last) -> Value {
        let critical: Vec<Value> = end.critical_points.iter().map(described).collect();
        let mut document = json!({
            "load_reached": last.load,
            "unknowns": last.unknowns,
            "unknowns_paper": self.body.muscle.n_unknowns_paper(),
            "opposed_fibers": self.body.opposed_fibers,
            "newton_iterations": end.newton_iterations,
            "load_steps": end.load_steps,
            "critical_points": critical,
            "constraint_drift": self.drift,
            "results": last.results,
            "inversion": self.volumes.inversion(),
            "volume_ratios": self.volumes.ratios(),
            "not_finite": self.not_finite(),
        });
        if self.scene.file.loading_path.is_some() {
            document["path"] = json!(self.states);
        }
        document
    }

    fn not_finite(&self) -> Option<NotFinite> {
        self.series.as_ref().and_then(Series::not_finite)
    }
}

/// Returns whether the load factors are given, positive and increasing.
fn grows(control: &Control) -> bool {
    match control {
        Control::Load(loads) => loads[0] > 0.0 && loads.is_sorted_by(|a, b| a < b),
        Control::Neighbor(_) | Control::ArcLength { .. } => false,
    }
}

/// Returns the displacement of all nodes in the equilibrium stored in a folder. Returns `None` if the mesh is different
/// or the full load was not reached.
fn neighbor(body: &Body, folder: &Path) -> Option<Vec<f64>> {
    let state = State::decode(&inputs::text(&folder.join(State::NAME)).ok()?).ok()?;
    let fits = state.is_of(body.muscle.solid.space()) && state.load_reached == Some(1.0);
    fits.then_some(state.displacement)
}

fn described(point: &CriticalPoint) -> Value {
    let kind = match point.kind {
        CriticalKind::Limit => "limit",
        CriticalKind::Bifurcation => "bifurcation",
    };
    json!({ "type": kind, "loads": point.loads })
}

/// Returns a note on limit and bifurcation points, if there are any.
fn note_of(points: &[CriticalPoint]) -> Option<String> {
    let words = points.iter().map(|point| {
        let [from, to] = point.loads;
        match point.kind {
            CriticalKind::Limit => format!("limit point at load factor {from:.6}"),
            CriticalKind::Bifurcation => {
                format!("bifurcation between load factors {from:.6} and {to:.6}")
            }
        }
    });
    let words: Vec<String> = words.collect();
    (!words.is_empty()).then(|| format!("critical points of the path: {}", words.join("; ")))
}

/// Returns the outcome of a path with arc-length control that reached its maximum number of steps.
fn unfinished(control: &Control, end: &PathEnd) -> Option<Outcome> {
    let is_short = matches!(control, Control::ArcLength { .. }) && end.reached.abs() < 1.0;
    is_short.then(|| {
        let message = format!(
            "the path ends at load factor {:.6} after {} steps: increase `static.steps`",
            end.reached, end.load_steps
        );
        Outcome::ended(EndReason::MaxSteps, message)
    })
}

/// Returns the outcome of the search, including a description of the saved state.
fn outcome_of(end: &PathEnd, load: f64) -> Outcome {
    let Some(shortfall) = end.shortfall.clone() else {
        return Outcome::Finished;
    };
    let error = shortfall.error(end.reached);
    let reason = match error {
        ModelError::Interrupted => EndReason::Interrupted,
        _ => EndReason::NoEquilibrium,
    };
    let part = 100.0 * load;
    Outcome::ended(
        reason,
        format!("{error}; the output is the equilibrium under {part:.1} % of the load"),
    )
}

/// Converts a state of the path to the unknowns of the system returned by [`at_rest`].
pub(crate) fn unknowns(state: &PathState) -> Vec<f64> {
    let mut y = state.displacement.clone();
    y.resize(2 * state.displacement.len(), 0.0);
    y.extend(&state.pressure);
    y
}

/// Returns the muscle at rest at time `t` as an undamped system with the unknowns (q, v, λ), or (q, v) without
/// pressure. This system is used only for outputs and is not integrated.
pub(crate) fn at_rest(
    muscle: &Muscle,
    formulation: Formulation,
    t: f64,
) -> Result<MuscleDae, ModelError> {
    let mut muscle = muscle.relaxed().with_supports_at(t);
    let kappa = muscle.parameters.kappa();
    muscle.parameters = Parameters::new(0.0, 0.0, kappa)?;
    let formulation = match formulation {
        Formulation::Displacement => formulation,
        _ => Formulation::Position,
    };
    Ok(MuscleDae::for_analysis(muscle, formulation))
}
