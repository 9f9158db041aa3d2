//! Harmonic response of scenes.

mod peaks;

use std::f64::consts::TAU;

use myovib_model::harmonic::HarmonicResponse;
use myovib_model::statics::{self, Equilibrium};
use myovib_model::{Formulation, ModelError, Muscle, support};
use num_complex::Complex64;
use serde::Serialize;

use crate::modes::instability;
use crate::probe::{HarmonicMotion, Reading};
use crate::watch::{Watcher, search};
use crate::{Body, Error, InputError, Scene};

pub use peaks::Peak;

/// Amplitudes below this fraction of the largest of their kind are rounding errors.
const ROUNDING: f64 = 1e-10;

/// Names of the columns for a value `u`: `u_re`, `u_im`, `u_amplitude` and `u_phase`.
const PARTS: [&str; 4] = ["re", "im", "amplitude", "phase"];

/// Harmonic response of a scene at ascending frequencies.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Response {
    /// Time of the loads of the equilibrium about which the body vibrates, s; null for rest.
    pub preload_time: Option<f64>,
    /// Frequencies, Hz.
    pub frequencies: Vec<f64>,
    /// Curves of the probes.
    pub probes: Vec<Curves>,
    /// Local maxima of the amplitudes.
    pub peaks: Vec<Peak>,
    /// Number of unknowns of each linear system.
    pub unknowns: usize,
    /// Notes on probes without amplitudes, chains, and stability.
    #[serde(skip)]
    pub notes: Vec<String>,
}

/// Complex amplitudes of the values of a probe.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Curves {
    /// Name of the probe.
    pub name: String,
    /// Names of the values.
    pub columns: Vec<String>,
    /// Amplitudes for each frequency and value, as [real part, imaginary part].
    #[serde(serialize_with = "pairs")]
    pub amplitudes: Vec<Vec<Complex64>>,
}

/// Writes complex numbers as pairs.
fn pairs<S: serde::Serializer>(rows: &[Vec<Complex64>], json: S) -> Result<S::Ok, S::Error> {
    let pair = |z: &Complex64| [z.re, z.im];
    json.collect_seq(
        rows.iter()
            .map(|row| row.iter().map(pair).collect::<Vec<_>>()),
    )
}

impl Curves {
    /// Returns the names of the columns of its table.
    pub(crate) fn header(names: &[String]) -> Vec<String> {
        let parts = |name: &String| PARTS.map(|part| format!("{name}_{part}"));
        let columns = names.iter().flat_map(parts);
        std::iter::once("f".to_owned()).chain(columns).collect()
    }

    /// Returns the row of its table for frequency number `k`, `frequency`.
    pub(crate) fn row(&self, k: usize, frequency: f64) -> Vec<f64> {
        let parts = |z: &Complex64| [z.re, z.im, z.norm(), phase(*z)];
        let values = self.amplitudes[k].iter().flat_map(parts);
        std::iter::once(frequency).chain(values).collect()
    }
}

impl Curves {
    /// Returns the local maxima of the amplitudes, except rounding errors.
    fn peaks(&self, frequencies: &[f64]) -> Vec<Peak> {
        let kind = |name: &str| name.split('_').next().unwrap_or_default().to_owned();
        let largest = |k: usize| {
            let sizes = self.amplitudes.iter().map(|row| row[k].norm());
            sizes.fold(0.0, f64::max)
        };
        let mut peaks = Vec::new();
        for (k, column) in self.columns.iter().enumerate() {
            let names = self.columns.iter().enumerate();
            let alike = names.filter(|(_, other)| kind(other) == kind(column));
            let size_of_kind = alike.map(|(j, _)| largest(j)).fold(0.0, f64::max);
            if largest(k) <= ROUNDING * size_of_kind {
                continue;
            }
            let values: Vec<Complex64> = self.amplitudes.iter().map(|row| row[k]).collect();
            let maxima = peaks::maxima(frequencies, &values).into_iter();
            peaks.extend(maxima.map(|maximum| Peak {
                probe: self.name.clone(),
                column: column.clone(),
                frequency: maximum.frequency,
                amplitude: maximum.amplitude,
                damping_ratio: maximum.damping_ratio,
            }));
        }
        peaks
    }
}

/// Returns the phase in degrees; positive if the value leads the drive.
pub fn phase(z: Complex64) -> f64 {
    z.arg().to_degrees()
}

impl Response {
    /// Computes the response of the scene's body or rod.
    ///
    /// # Errors
    /// A scene without harmonic loads; errors of the equilibrium and of the factorizations.
    pub fn of_scene(scene: &Scene, watcher: Watcher<'_>) -> Result<Self, Error> {
        let Some(wanted) = &scene.file.response else {
            return Err(InputError::new("the scene has no table [response]").into());
        };
        let mut frequencies = wanted.frequencies.values().map_err(InputError::new)?;
        frequencies.sort_by(f64::total_cmp);
        frequencies.dedup();
        let probes = harmonic_probes(scene)?;
        let mut found = match (&scene.body, &scene.rod, &scene.file.rod) {
            (Some(body), ..) => of_body(scene, body, frequencies, &probes, watcher)?,
            (None, Some(rod), Some(file)) => {
                let tau = file.response.map_or(Complex64::ZERO, |tau| tau.complex());
                let rows = frequencies.iter().map(|frequency| {
                    let s = Complex64::new(0.0, TAU * frequency);
                    let states = rod.harmonic_response(s, tau)?;
                    read(&probes, &HarmonicMotion::Rod(&states))
                });
                let rows = rows.collect::<Result<Vec<_>, ModelError>>()?;
                Self::new(frequencies, &probes, rows, rod.rod().n_states())
            }
            _ => {
                let error = InputError::new("the scene has no body and no rod that could vibrate");
                return Err(error
                    .allowed("a scene with a [mesh] and [solid], or a [rod]")
                    .into());
            }
        };
        if !scene.chains.is_empty() {
            let note = "chains of oscillators are not part of a response: they are ignored";
            found.notes.push(note.to_owned());
        }
        for probe in &scene.file.probe {
            if !found.probes.iter().any(|curves| curves.name == probe.name) {
                let name = &probe.name;
                let note = format!("the probe `{name}` has no harmonic amplitude: it is ignored");
                found.notes.push(note);
            }
        }
        Ok(found)
    }

    fn new(
        frequencies: Vec<f64>,
        probes: &[(String, Box<dyn Reading>)],
        rows: Vec<Vec<Vec<Complex64>>>,
        unknowns: usize,
    ) -> Self {
        let mut curves: Vec<Curves> = probes
            .iter()
            .map(|(name, reading)| Curves {
                name: name.clone(),
                columns: reading.names(),
                amplitudes: Vec::with_capacity(frequencies.len()),
            })
            .collect();
        for row in rows {
            for (curves, values) in curves.iter_mut().zip(row) {
                curves.amplitudes.push(values);
            }
        }
        Self {
            preload_time: None,
            peaks: curves
                .iter()
                .flat_map(|curves| curves.peaks(&frequencies))
                .collect(),
            frequencies,
            probes: curves,
            unknowns,
            notes: Vec::new(),
        }
    }
}

/// Probes that have amplitudes, with their names.
pub(crate) type HarmonicProbes = Vec<(String, Box<dyn Reading>)>;

/// Returns the probes that have amplitudes.
///
/// # Errors
/// Probes that measure nothing in the scene; stresses of a body whose stress relaxes.
pub(crate) fn harmonic_probes(scene: &Scene) -> Result<HarmonicProbes, InputError> {
    let relaxes = scene
        .body
        .as_ref()
        .is_some_and(|body| body.muscle.solid.n_slots() > 0);
    let mut probes = Vec::new();
    for (i, (probe, reading)) in scene.file.probe.iter().zip(scene.readings()?).enumerate() {
        if relaxes
            && reading.stress_evaluations() > 0
            && reading.measurements().iter().any(|m| m.has_stress())
        {
            let error = InputError::new(
                "stress amplitudes of a body whose stress relaxes are not available",
            );
            let error = error.next("remove the stresses from the quantities of the probe");
            return Err(scene.wrong(&format!("probe[{i}].quantities"), error));
        }
        if reading.harmonic().is_some() {
            probes.push((probe.name.clone(), reading));
        }
    }
    if probes.is_empty() {
        let error =
            InputError::new("no probe has a harmonic amplitude, so there is nothing to write");
        let error = error.next("add a [[probe]], such as type = \"point\"");
        return Err(scene.wrong("probe", error));
    }
    Ok(probes)
}

/// Returns the amplitudes of each probe.
fn read(
    probes: &[(String, Box<dyn Reading>)],
    of: &HarmonicMotion<'_>,
) -> Result<Vec<Vec<Complex64>>, ModelError> {
    let readings = probes.iter().filter_map(|(_, reading)| reading.harmonic());
    readings.map(|reading| reading.amplitudes(of)).collect()
}

/// Computes the response of a body.
fn of_body(
    scene: &Scene,
    body: &Body,
    frequencies: Vec<f64>,
    probes: &[(String, Box<dyn Reading>)],
    watcher: Watcher<'_>,
) -> Result<Response, Error> {
    let muscle = &body.muscle;
    let preload_time = scene
        .file
        .response
        .as_ref()
        .and_then(|own| own.preload_time);
    let free = frequencies.first().filter(|first| **first == 0.0);
    if let Some(free) = free.and_then(|_| support::free_parts(muscle)) {
        let error = InputError::new(format!("at 0 Hz the supports do not hold the body: {free}"));
        let error = error.next("use frequencies above 0 Hz, or fix more components");
        return Err(scene.wrong("response.frequencies", error).into());
    }
    let at = equilibrium(scene, muscle, body.formulation, preload_time, watcher)?;
    let response = HarmonicResponse::about(muscle, body.formulation, &at, &body.drive)?;
    let n = frequencies.len();
    let done = std::sync::atomic::AtomicUsize::new(0);
    let rows = response.map(&frequencies, |amplitude| {
        if watcher.is_interrupted() {
            return Err(ModelError::Interrupted);
        }
        let k = 1 + done.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
        watcher
            .progress
            .on_progress(&|| format!("response: {k} of {n} frequencies"));
        read(probes, &HarmonicMotion::Body(&response, amplitude))
    })?;
    let mut found = Response::new(frequencies, probes, rows, response.n_unknowns());
    found.preload_time = preload_time;
    found.notes.extend(instability(&at));
    Ok(found)
}

/// Returns the equilibrium under the loads at a time, or the unloaded body.
fn equilibrium(
    scene: &Scene,
    muscle: &Muscle,
    formulation: Formulation,
    preload_time: Option<f64>,
    watcher: Watcher<'_>,
) -> Result<Equilibrium, Error> {
    match preload_time {
        None => Ok(Equilibrium::unloaded(muscle)),
        Some(_) if muscle.models().next().is_some() => {
            let error = InputError::new(
                "the activation model `bestel` needs a motion: its tension is 0 at the start",
            );
            let error = error.next("use a tension of type = \"given\"");
            Err(scene.wrong("response.preload_time", error).into())
        }
        Some(t) => {
            let watch = &mut search(watcher);
            Ok(statics::equilibrium_watched(muscle, formulation, t, watch)?)
        }
    }
}
