//! Harmonic response of scenes.

mod adaptive;
mod assignment;
pub(crate) mod notes;
mod part;
mod peaks;
mod rational;
mod values;

use std::f64::consts::TAU;
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

use myovib_model::harmonic::HarmonicResponse;
use myovib_model::statics::{self, Equilibrium};
use myovib_model::{Field, Formulation, ModelError, Muscle, Quantity, Snapshot, support};
use num_complex::Complex64;
use serde::Serialize;

use crate::modes::{instability, negative_damping, one_sided, oscillating_preload};
use crate::probe::{ColumnKind, HarmonicMotion, Reading};
use crate::run::volume::Volumes;
use crate::scene_file::response::{Adaptive, Grid};
use crate::watch::{Watcher, search};
use crate::{Body, Error, InputError, Scene, vtu};

pub use adaptive::MAX_FREQUENCIES;
use adaptive::Samples;
use assignment::Assignment;
pub(crate) use part::Part;
use peaks::Maximum;
pub use peaks::{Peak, PeakMode};
pub(crate) use values::Values;

/// Amplitudes below this fraction of the largest amplitude of the same kind are regarded as rounding errors.
const ROUNDING: f64 = 1e-10;

/// Harmonic response of a scene at ascending frequencies.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Response {
    /// Time (s) at which the loads of the equilibrium are evaluated; null for a response about rest.
    pub preload_time: Option<f64>,
    /// Frequencies (Hz).
    pub frequencies: Vec<f64>,
    /// Curves of the probes and of the ratios between their values.
    pub probes: Vec<Curves>,
    /// Local maxima of the amplitudes.
    pub peaks: Vec<Peak>,
    /// Number of unknowns of each linear system.
    pub unknowns: usize,
    /// Largest relative prediction error in the last round of adaptive frequencies; null for given frequencies.
    pub interpolation_error: Option<f64>,
    /// Frequencies and curves of the rational function that interpolates adaptive responses, for smooth plots.
    #[serde(skip)]
    pub drawn: Option<(Vec<f64>, Vec<Curves>)>,
    /// Complex fields at the points of the body's grid.
    #[serde(skip)]
    pub fields: Vec<ComplexFields>,
    /// Whether the response was interrupted before its last frequency.
    #[serde(skip)]
    pub is_interrupted: bool,
    /// Notes on probes without amplitudes, on chains, and on stability.
    #[serde(skip)]
    pub notes: Vec<String>,
}

/// Complex fields at one frequency.
#[derive(Debug, Clone, PartialEq)]
pub struct ComplexFields {
    /// Frequency (Hz).
    pub frequency: f64,
    /// Values of all components at all points of the grid.
    pub values: Vec<(Quantity, Vec<Complex64>)>,
}

/// Complex amplitudes of the values of a probe.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Curves {
    pub name: String,
    pub columns: Vec<String>,
    /// Amplitudes for each frequency and value, serialized as [real part, imaginary part].
    #[serde(serialize_with = "pairs")]
    pub amplitudes: Vec<Vec<Complex64>>,
}

fn pairs<S: serde::Serializer>(rows: &[Vec<Complex64>], json: S) -> Result<S::Ok, S::Error> {
    let pair = |z: &Complex64| [z.re, z.im];
    json.collect_seq(rows.iter().map(|row| row.iter().map(pair).collect::<Vec<_>>()))
}

impl Curves {
    /// Returns the column names of a table with the values `names`.
    pub(crate) fn header(names: &[String]) -> Vec<String> {
        let columns = names.iter().flat_map(|name| Part::columns(name));
        std::iter::once("f".to_owned()).chain(columns).collect()
    }

    /// Returns the row with the zero-based index `k`, which belongs to `frequency`.
    pub(crate) fn row(&self, k: usize, frequency: f64) -> Vec<f64> {
        let parts = |z: &Complex64| Part::ALL.map(|part| part.of(*z));
        let values = self.amplitudes[k].iter().flat_map(parts);
        std::iter::once(frequency).chain(values).collect()
    }

    /// Returns the local maxima of the amplitudes that are not rounding errors.
    fn peaks(&self, frequencies: &[f64]) -> Vec<Peak> {
        let largest = |k: usize| {
            let sizes = self.amplitudes.iter().map(|row| row[k].norm());
            sizes.fold(0.0, f64::max)
        };
        let mut peaks = Vec::new();
        for (k, column) in self.columns.iter().enumerate() {
            let names = self.columns.iter().enumerate();
            let alike = names.filter(|(_, other)| ColumnKind::is_shared(other, column));
            let size_of_kind = alike.map(|(j, _)| largest(j)).fold(0.0, f64::max);
            if largest(k) <= ROUNDING * size_of_kind {
                continue;
            }
            let values: Vec<Complex64> = self.amplitudes.iter().map(|row| row[k]).collect();
            if peaks::is_constant(values.iter().map(|z| z.norm())) {
                continue;
            }
            let maxima = peaks::maxima(frequencies, &values).into_iter();
            peaks.extend(maxima.map(|maximum| self.peak(column, maximum)));
        }
        peaks
    }

    fn peak(&self, column: &str, maximum: Maximum) -> Peak {
        Peak {
            probe: self.name.clone(),
            column: column.to_owned(),
            frequency: maximum.frequency,
            amplitude: maximum.amplitude,
            damping_ratio: maximum.damping_ratio,
            mode: None,
        }
    }
}

/// Splits rows that contain the values of all tables into the curves of each table.
fn curves_of(tables: &[(String, Vec<String>)], rows: &[Vec<Complex64>]) -> Vec<Curves> {
    let mut first = 0;
    let curves = tables.iter().map(|(name, columns)| {
        let range = first..first + columns.len();
        first = range.end;
        Curves {
            name: name.clone(),
            columns: columns.clone(),
            amplitudes: rows.iter().map(|row| row[range.clone()].to_vec()).collect(),
        }
    });
    curves.collect()
}

/// Returns the phase in degrees. It is positive if the value leads the drive.
pub fn phase(z: Complex64) -> f64 {
    z.arg().to_degrees()
}

impl Response {
    /// Computes the response of the scene's body or rod.
    ///
    /// # Errors
    /// Fails if the scene has no table for a response, if it has no body and no rod, or if the equilibrium or a
    /// factorization fails.
    pub fn of_scene(scene: &Scene, watcher: Watcher<'_>) -> Result<Self, Error> {
        let Some(wanted) = &scene.file.response else {
            return Err(InputError::new("the scene has no [response] table").into());
        };
        let grid = wanted.frequencies.grid().map_err(InputError::new)?;
        let values = Values::of_scene(scene)?;
        let mut found = match (&scene.body, &scene.rod, &scene.file.rod) {
            (Some(body), ..) => of_body(scene, body, &grid, &values, watcher)?,
            (None, Some(rod), Some(file)) => {
                let tau = file.response.map_or(Complex64::ZERO, |tau| tau.complex());
                Self::new(&grid, &values, rod.rod().n_states(), |frequencies| {
                    let rows = frequencies.iter().map(|frequency| {
                        let s = Complex64::new(0.0, TAU * frequency);
                        let states = rod.harmonic_response(s, tau)?;
                        values.read(s, &HarmonicMotion::Rod(&states))
                    });
                    let rows = rows.collect::<Result<Vec<_>, ModelError>>()?;
                    Ok((frequencies.to_vec(), rows))
                })?
            }
            _ => {
                let error = InputError::new("the scene has no body or rod that could vibrate");
                return Err(error.allowed("a scene with a [mesh] and [solid], or a [rod]").into());
            }
        };
        if !scene.chains.is_empty() {
            let note = "chains of oscillators are not part of a response: they are ignored";
            found.notes.push(note.to_owned());
        }
        let omissions = scene.omissions()?;
        for probe in &scene.file.probe {
            let name = &probe.name;
            let is_written = found.probes.iter().any(|curves| curves.name == *name);
            if !is_written && !omissions.iter().any(|(omitted, _)| omitted == name) {
                let note = format!("the probe `{name}` has no harmonic amplitude: it is ignored");
                found.notes.push(note);
            }
        }
        let omissions = omissions.iter().map(|(name, reason)| format!("probe `{name}`: {reason}"));
        found.notes.extend(omissions);
        Ok(found)
    }

    /// Computes the response of `values` at the frequencies of `grid` for a body or rod with the given number of
    /// `unknowns`. `compute` returns the amplitudes of all values at ascending frequencies, or at fewer frequencies if
    /// it was interrupted.
    fn new(
        grid: &Grid,
        values: &Values,
        unknowns: usize,
        mut compute: impl FnMut(&[f64]) -> Result<(Vec<f64>, Vec<Vec<Complex64>>), ModelError>,
    ) -> Result<Self, ModelError> {
        let tables = values.tables();
        let mut is_interrupted = false;
        let mut computed = |frequencies: &[f64]| {
            let found = compute(frequencies)?;
            is_interrupted |= found.0.len() < frequencies.len();
            Ok::<_, ModelError>(found)
        };
        let samples = match grid {
            Grid::Fixed(frequencies) => {
                let (frequencies, rows) = computed(frequencies)?;
                Samples::given(frequencies, rows)
            }
            Grid::Adaptive(adaptive) => {
                let names: Vec<&String> = tables.iter().flat_map(|(_, columns)| columns).collect();
                let same = |name: &&String| {
                    let first = names.iter().position(|other| ColumnKind::is_shared(other, name));
                    first.unwrap_or_default()
                };
                let kinds: Vec<usize> = names.iter().map(same).collect();
                adaptive.resolve(&kinds, computed)?
            }
        };
        let (frequencies, interpolation_error) = (samples.frequencies, samples.error);
        let curves = curves_of(&tables, &samples.rows);
        let peaks = match grid {
            Grid::Fixed(_) => {
                let peaks = curves.iter().flat_map(|of| of.peaks(&frequencies));
                peaks.collect()
            }
            Grid::Adaptive(_) => {
                let each =
                    curves.iter().flat_map(|of| of.columns.iter().map(move |name| (of, name)));
                let each: Vec<(&Curves, &String)> = each.collect();
                let peak = |(k, maximum): (usize, Maximum)| each[k].0.peak(each[k].1, maximum);
                samples.peaks.into_iter().map(peak).collect()
            }
        };
        let drawn = samples.drawn.map(|(f, rows)| (f, curves_of(&tables, &rows)));
        let mut notes = Vec::new();
        if !is_interrupted {
            notes.extend(notes::resonances_outside(&curves, &frequencies));
        }
        if let Grid::Adaptive(Adaptive { tolerance, .. }) = grid
            && !is_interrupted
            && interpolation_error.is_none_or(|error| error > *tolerance)
        {
            notes.push(format!(
                "the response is not resolved with {} frequencies: peaks may be missing. Divide the range, or loosen its tolerance",
                frequencies.len()
            ));
        }
        Ok(Self {
            preload_time: None,
            peaks,
            frequencies,
            probes: curves,
            unknowns,
            interpolation_error,
            is_interrupted,
            drawn,
            fields: Vec::new(),
            notes,
        })
    }
}

/// Probes that have complex amplitudes, each with its name.
pub(crate) type HarmonicProbes = Vec<(String, Box<dyn Reading>)>;

/// Returns the probes that have complex amplitudes.
///
/// # Errors
/// Fails if a chain acts back on the body, if a probe cannot measure anything in the scene, if a probe measures
/// stresses of a body with stress relaxation, or if no probe has amplitudes.
pub(crate) fn harmonic_probes(scene: &Scene) -> Result<HarmonicProbes, InputError> {
    if let Some(chain) = scene.chain_that_acts() {
        let error = InputError::new(format!(
            "the chain `{chain}` acts on the body, and its oscillators have no harmonic response"
        ));
        let error = error.next("remove the feedback, or use analysis = \"dynamic\"");
        return Err(scene.wrong("analysis", error));
    }
    let relaxes = scene.body.as_ref().is_some_and(|body| body.muscle.solid.n_slots() > 0);
    let mut probes = Vec::new();
    for (i, (probe, reading)) in scene.file.probe.iter().zip(scene.readings()?).enumerate() {
        if relaxes
            && reading.stress_evaluations() > 0
            && reading.measurements().iter().any(|m| m.has_stress())
        {
            let error = InputError::new(
                "stress amplitudes are not available for a body whose stress relaxes",
            );
            let error = error.next("remove the stresses from the quantities of the probe");
            return Err(scene.wrong(&format!("probe[{i}].quantities"), error));
        }
        if reading.is_harmonic() && !reading.names().is_empty() {
            probes.push((probe.name.clone(), reading));
        }
    }
    if probes.is_empty() {
        let error =
            InputError::new("no probe has a harmonic amplitude, so there is nothing to write");
        let error = match scene.omissions()?.first() {
            Some((name, reason)) => error.found(format!("probe `{name}`: {reason}")),
            None => error,
        };
        let error = error.next("add a [[probe]], such as type = \"point\"");
        return Err(scene.wrong("probe", error));
    }
    Ok(probes)
}

fn of_body(
    scene: &Scene,
    body: &Body,
    grid: &Grid,
    values: &Values,
    watcher: Watcher<'_>,
) -> Result<Response, Error> {
    let muscle = &body.muscle;
    let preload_time = scene.file.response.as_ref().and_then(|own| own.preload_time);
    let [first, last] = grid.ends();
    if first == 0.0
        && let Some(free) = support::free_parts(muscle)
    {
        let error = InputError::new(format!("at 0 Hz the supports do not fix the body: {free}"));
        let error = error.next("use frequencies above 0 Hz, or fix more components");
        return Err(scene.wrong("response.frequencies", error).into());
    }
    let (at, volume_note) =
        equilibrium(scene, muscle, body.formulation, (PRELOAD, preload_time), watcher)?;
    // The modes are computed first, so that their factors are released before the response needs memory. For bodies
    // under follower pressures without an energy, no modes are available, but the peaks are still valid.
    let has_modes = first < last && body.formulation.has(Field::Pressure);
    let modes = match has_modes {
        true => {
            watcher.progress.on_progress(&|| "response: modes".to_owned());
            Assignment::new(muscle, &at, last).ok()
        }
        false => None,
    };
    let response = HarmonicResponse::about(muscle, body.formulation, &at, &body.excitation)?;
    let mut coordinates: Vec<(f64, Vec<Complex64>)> = Vec::new();
    let done = AtomicUsize::new(0);
    let mut largest = notes::Largest::default();
    let mut found = Response::new(grid, values, response.n_unknowns(), |frequencies| {
        let n = done.load(Relaxed) + frequencies.len();
        let found = response.map(frequencies, |amplitude| {
            if watcher.is_interrupted() {
                return Err(ModelError::Interrupted);
            }
            let k = 1 + done.fetch_add(1, Relaxed);
            watcher.progress.on_progress(&|| format!("response: {k} of {n} frequencies"));
            let motion = HarmonicMotion::Body(response.stiffness(), amplitude);
            let sizes =
                notes::displacement_and_strain(muscle.solid.space(), &amplitude.displacement);
            let coordinates =
                modes.as_ref().map(|modes| modes.coordinates(&amplitude.displacement));
            Ok((values.read(amplitude.s, &motion)?, sizes, coordinates.unwrap_or_default()))
        });
        let rows = found?.into_iter().map(|(frequency, (row, sizes, modal))| {
            largest.add(frequency, sizes);
            coordinates.push((frequency, modal));
            (frequency, row)
        });
        Ok(rows.unzip())
    })?;
    found.preload_time = preload_time;
    if let Some(own) = &scene.file.response
        && !own.fields.is_empty()
    {
        found.fields = fields(&response, &vtu::Grid::of_body(body), &own.fields)?;
    }
    found.notes.extend(at.instabilities.and_then(instability));
    found.notes.extend(volume_note);
    found.notes.extend(one_sided(muscle, &at));
    found.notes.extend(oscillating_preload(muscle, preload_time));
    found.notes.extend(notes::undamped(muscle));
    found.notes.extend(largest.note(support::extent(&body.muscle)));
    if let Some(modes) = modes.filter(|_| !found.is_interrupted) {
        let rigid = support::free_parts(muscle).map_or(0, |free| free.count);
        let elastic = modes.body.modes.get(rigid..).unwrap_or_default();
        found.notes.extend(notes::modes_below(elastic, first));
        found.notes.extend(negative_damping(&modes.body.modes));
        coordinates.sort_by(|a, b| a.0.total_cmp(&b.0));
        let coordinates: Vec<_> = coordinates.into_iter().map(|(_, modal)| modal).collect();
        modes.assign(&mut found, &coordinates, values, response.stiffness())?;
    }
    Ok(found)
}

/// Computes the fields of displacement and pressure at the given frequencies.
fn fields(
    response: &HarmonicResponse,
    grid: &vtu::Grid,
    frequencies: &[f64],
) -> Result<Vec<ComplexFields>, ModelError> {
    let found = response.map(frequencies, |amplitude| {
        let field = |quantity| {
            let read = |snapshot: &Snapshot<'_>| grid.values(snapshot, quantity).concat();
            (quantity, response.stiffness().amplitudes(amplitude, read))
        };
        Ok([Quantity::Displacement, Quantity::Pressure].map(field).to_vec())
    })?;
    let fields = found.into_iter();
    let fields = fields.map(|(frequency, values)| ComplexFields { frequency, values });
    Ok(fields.collect())
}

pub(crate) const PRELOAD: &str = "response.preload_time";

/// Returns the equilibrium under the loads at `preload_time`, which is the value of `key`, or the unloaded body if no
/// time is given. Also returns a note on implausible volumes.
///
/// # Errors
/// Fails if no equilibrium is found, or if it contains inverted elements and the scene does not allow this.
pub(crate) fn equilibrium(
    scene: &Scene,
    muscle: &Muscle,
    formulation: Formulation,
    (key, preload_time): (&str, Option<f64>),
    watcher: Watcher<'_>,
) -> Result<(Equilibrium, Option<String>), Error> {
    match preload_time {
        None => Ok((Equilibrium::unloaded(muscle), None)),
        Some(_) if muscle.models().next().is_some() => {
            let error = InputError::new(
                "the activation model `bestel` requires a dynamic analysis: its tension is 0 at the start",
            );
            let error = error.next("use a tension of type = \"given\"");
            Err(scene.wrong(key, error).into())
        }
        Some(t) => {
            let watch = &mut search(watcher);
            let found = statics::equilibrium_watched(muscle, formulation, t, watch)?;
            let mut volumes = Volumes::default();
            volumes.see(t, &muscle.solid, &found.nodal_displacement(muscle));
            match volumes.inversion().filter(|_| !scene.allows_inverted()) {
                None => Ok((found, volumes.note(muscle, false))),
                Some(inversion) => {
                    let error = InputError::new(inversion.note(false));
                    let error = error.next("`solid.allow_inverted = true` accepts it");
                    Err(scene.wrong(key, error).into())
                }
            }
        }
    }
}
