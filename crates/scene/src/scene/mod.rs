//! Validated scenes: the parsed text of [`crate::scene_file`], combined with its mesh to form the model.
//!
//! Errors include their location in the text, as in `scene_file`. If a group is unknown, the error lists the groups of
//! the mesh. If a formulation is incompatible with κ and β, the error lists the compatible formulations. Nothing is
//! computed or written before a [`Scene`] exists.

mod body;
mod builder;
pub mod builtin;
mod chain_places;
mod contact;
mod contraction;
mod distribution;
mod feedback;
mod function;
mod groups;
mod idle;
mod limits;
mod loads;
mod materials;
mod mesh;
mod oscillators;
mod periodic;
mod places;
mod quasi_static;
mod resolution;
mod response;
mod restart;
mod settings;
mod start;
mod supports;
mod unused;
mod unusual;

use std::fs::{self, File};
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use myovib_model::advice::Finding;
use myovib_model::coupling::Feedback;
use myovib_model::harmonic::Excitation;
use myovib_model::statics::Control;
use myovib_model::{
    Contact, Formulation, Load, Measurement, ModelError, Muscle, Quantity, RodDae, Settings,
    Signal, SurfaceLoad, loosening,
};
use serde_json::Value;

pub use chain_places::DrivenPlace;
pub(crate) use limits::runs_at_once;
pub use oscillators::DrivenChain;

use builtin::SCENES;

use crate::InputError;
use crate::inputs::{Input, Inputs};
use crate::probe::Reading;
use crate::scene_file::check::{Problem, nearest, suggest};
use crate::scene_file::integrator::ChainSteps;
use crate::scene_file::output::Probe;
use crate::scene_file::{self, Analysis, SceneFile, Source};
use crate::text::utf8;
use builder::{Builder, Explain};
pub(crate) use settings::absolute_tolerances;
pub(crate) use start::Start;
pub(crate) use supports::NAMES;

/// Validated scene that can be computed.
///
/// To change a value of the file, load the scene again with an override.
#[derive(Debug, Clone)]
pub struct Scene {
    /// Scene as written, with defaults filled in.
    pub(crate) file: SceneFile,
    source: Source,
    /// Overrides of values in the text, each as `key=value`.
    overrides: Vec<String>,
    /// Folder to which file names in the text are relative.
    folder: PathBuf,
    /// End time (s); 0 for a scene without a time interval.
    pub t_end: f64,
    /// Elastic body, if there is one.
    pub body: Option<Body>,
    /// Rod, if there is one. A scene with a rod does not have a body.
    pub rod: Option<RodDae>,
    pub chains: Vec<DrivenChain>,
    /// Feedback of chains on the body.
    pub feedbacks: Vec<Feedback>,
    /// Frequency (Hz) of a periodic state and start (s) of its period; `None` for other analyses.
    pub(crate) repetition: Option<[f64; 2]>,
    /// Input files: the mesh and the tables.
    pub inputs: Vec<Input>,
    /// Paths of the input files.
    pub(crate) paths: Vec<PathBuf>,
    reading_notes: Vec<String>,
}

/// Elastic body and settings for its computation.
#[derive(Debug, Clone)]
pub struct Body {
    pub muscle: Muscle,
    /// Harmonic parts of the loads in a response.
    pub excitation: Excitation,
    pub formulation: Formulation,
    /// Keys of the muscle's loads, its surface loads, and the forces on obstacles. The keys have the same order as the
    /// loads.
    pub(crate) load_keys: Vec<String>,
    pub settings: Settings,
    /// Initial state of the body's motion.
    pub(crate) start: Start,
    /// Zero-based index of each element's material in the scene.
    pub regions: Vec<usize>,
    /// Whether a material defines fiber directions.
    pub has_fibers: bool,
    /// Number of quadrature points where fiber directions at the vertices oppose each other. At these points, the
    /// direction at the nearest vertex is used.
    pub opposed_fibers: usize,
    /// Number of elements in which the fiber directions at two vertices differ by more than 120°.
    pub unresolved_fibers: usize,
}

impl Body {
    /// Returns the volumes (m³) of the `n` materials of the scene; in 2D, the areas (m²).
    pub fn volumes(&self, n: usize) -> Vec<f64> {
        let space = self.muscle.solid.space();
        let mut volumes = vec![0.0; n];
        for (element, &region) in self.regions.iter().enumerate() {
            volumes[region] += space.measure_of(element);
        }
        volumes
    }

    /// Returns the functions of time of the loads, each with its key.
    pub(crate) fn keyed_loads(&self) -> impl Iterator<Item = (&str, &Signal)> {
        let surface_loads = self.muscle.surface_loads.iter().map(SurfaceLoad::signal);
        let signals = self.muscle.loads.iter().map(Load::signal);
        let contacts = self.muscle.contacts.iter().filter(|own| own.is_driven());
        let forces = contacts.flat_map(Contact::signals);
        let keys = self.load_keys.iter().map(String::as_str);
        keys.zip(signals.chain(surface_loads).chain(forces))
    }
}

/// A note is added if the fraction of elements with unresolved fibers exceeds the inverse of this number. Some elements
/// around an apex, where all directions meet, are always unresolved.
const RARE: usize = 50;

/// Maximum size of a scene file (bytes). A larger file is probably not a scene.
const MOST_BYTES: u64 = 1 << 26;

/// Reads the text of a scene file. An open pipe, such as `<(command)` in a shell, is accepted. Named pipes are rejected
/// because reading them may block forever. Devices are rejected because reading them may never end.
fn text_of(path: &Path) -> io::Result<String> {
    let is_open =
        ["/dev/fd", "/dev/stdin", "/proc/self/fd"].iter().any(|open| path.starts_with(open));
    let there = fs::metadata(path)?;
    if there.is_dir() {
        return Err(io::ErrorKind::IsADirectory.into());
    }
    if !there.is_file() && !is_open {
        return Err(io::Error::other("it is not a regular file"));
    }
    let mut bytes = Vec::new();
    let read = File::open(path)?.take(MOST_BYTES + 1).read_to_end(&mut bytes)?;
    if read as u64 > MOST_BYTES {
        let message = format!("it has more than {MOST_BYTES} bytes");
        return Err(io::Error::other(message));
    }
    utf8(bytes).map_err(|line| {
        let message = format!("line {line} is not UTF-8: save the file in this encoding");
        io::Error::new(io::ErrorKind::InvalidData, message)
    })
}

impl Scene {
    /// Returns the scene as written, with defaults filled in.
    pub fn file(&self) -> &SceneFile {
        &self.file
    }

    pub(crate) fn expect_body(&self) -> Result<&Body, ModelError> {
        self.body.as_ref().ok_or(ModelError::NoSuchPart { part: "muscle" })
    }

    /// Returns a chain and its zero-based index.
    pub(crate) fn chain(&self, name: &str) -> Result<(usize, &DrivenChain), ModelError> {
        let found = self.chains.iter().enumerate().find(|(_, chain)| chain.name == name);
        found.ok_or(ModelError::NoSuchPart { part: "chain of that name" })
    }

    /// Returns whether the scene's analysis is a harmonic response.
    pub(crate) fn is_response(&self) -> bool {
        self.file.analysis == Analysis::Response
    }

    /// Returns the name of a chain that acts back on the body, if there is one.
    pub(crate) fn chain_that_acts(&self) -> Option<&str> {
        contraction::chains_that_act(&self.file).next()
    }

    /// Reads the scene at `path`, or the built-in scene with that name, and applies the overrides.
    ///
    /// # Errors
    /// Returns an [`InputError`] if the file cannot be read or the scene is invalid.
    pub fn load(path: &Path, overrides: &[String]) -> Result<Self, InputError> {
        let name = path.display().to_string();
        match (text_of(path), builtin::find(&name).ok()) {
            (Ok(text), _) => {
                let folder = path.parent().unwrap_or(Path::new(""));
                Self::build(&name, &text, overrides, folder)
            }
            (Err(_), Some(scene)) => Self::build(&name, scene.text, overrides, Path::new("")),
            (Err(error), None) => {
                let is_missing = error.kind() == io::ErrorKind::NotFound;
                let error = InputError::new(format!("cannot read the scene `{name}`: {error}"));
                if !is_missing {
                    return Err(error);
                }
                let names: Vec<&str> = SCENES.iter().map(|scene| scene.name).collect();
                let error =
                    error.allowed(format!("a file, or a built-in scene: {}", names.join(", ")));
                let error = suggest(error, nearest(&name, &names));
                Err(error.next("`myovib init` writes a scene to start from"))
            }
        }
    }

    /// Returns the built-in scene `name` with the overrides applied.
    ///
    /// # Errors
    /// Fails if the name is not in [`SCENES`] or an override is invalid.
    pub fn built_in(name: &str, overrides: &[String]) -> Result<Self, InputError> {
        Self::build(name, builtin::find(name)?.text, overrides, Path::new(""))
    }

    /// Returns the scene with additional overrides.
    ///
    /// # Errors
    /// Fails if an override is invalid.
    pub(crate) fn with(&self, set: &[String]) -> Result<Self, InputError> {
        let overrides = [&self.overrides[..], set].concat();
        let source = &self.source;
        Self::build(source.name(), source.text(), &overrides, &self.folder)
    }

    /// Returns the scene with all tolerances multiplied by the factor that [`loosening`] returns.
    #[must_use]
    pub fn with_looser_tolerances(&self) -> Self {
        let integrator = &self.file.integrator;
        let largest = integrator.rtol.max(integrator.oscillators.rtol);
        self.with_scaled_tolerances([loosening(integrator.method, largest); 2])
    }

    /// Returns the scene with scaled tolerances. The first factor applies to the body, the second to the rod and the
    /// oscillators.
    #[must_use]
    pub(crate) fn with_scaled_tolerances(&self, [factor, of_oscillators]: [f64; 2]) -> Self {
        let mut scene = self.clone();
        let integrator = &mut scene.file.integrator;
        integrator.rtol *= factor;
        let atol = &mut integrator.atol;
        for block in [&mut atol.u, &mut atol.v, &mut atol.p, &mut atol.p_rate] {
            *block = block.map(|atol| factor * atol);
        }
        integrator.oscillators.rtol *= of_oscillators;
        integrator.oscillators.atol *= of_oscillators;
        if let Some(body) = &mut scene.body {
            let settings = body.settings.clone();
            body.settings = settings.with_relative_tolerance(integrator.rtol);
        }
        scene
    }

    /// Returns whether states with inverted elements are accepted.
    pub(crate) fn allows_inverted(&self) -> bool {
        let solid = self.file.solid.as_ref();
        solid.is_some_and(|solid| solid.allow_inverted)
    }

    /// Returns whether the chains are integrated separately from the body or rod.
    pub(crate) fn has_separate_chains(&self) -> bool {
        let wanted = &self.file.integrator;
        let is_driven = self.body.is_some() || self.rod.is_some();
        let can_be_separate =
            is_driven && self.feedbacks.is_empty() && wanted.oscillators.in_error_test;
        let is_wanted = wanted.chains != Some(ChainSteps::Together);
        !self.chains.is_empty() && can_be_separate && is_wanted
    }

    /// Returns the overrides of values in the scene's text, each as `key=value`.
    pub fn overrides(&self) -> &[String] {
        &self.overrides
    }

    /// Returns notes on corrections of the mesh, on ignored grid points, on unclear fiber directions, and on settings,
    /// loads and materials without effect.
    pub fn notes(&self) -> Vec<String> {
        let mut notes = self.reading_notes.clone();
        let body = self.body.as_ref();
        notes.extend(settings::without_effect(&self.file, self.source.value(), body));
        let Some(body) = &self.body else {
            return notes;
        };
        let mesh = body.muscle.solid.space().mesh();
        notes.extend(mesh.notes().iter().map(ToString::to_string));
        notes.extend(self.chains.iter().filter_map(DrivenChain::note));
        notes.extend(settings::missing(&self.file.integrator, body.formulation));
        notes.extend(resolution::notes(&self.file, body));
        notes.extend(idle::notes(&self.file, body, self.t_end));
        notes.extend(limits::coarse_probes(
            &self.file,
            self.t_end,
            body.muscle.forcing_frequency(),
        ));
        let n_elements = mesh.n_elements();
        if body.unresolved_fibers > n_elements / RARE {
            notes.push(format!(
                "in {} of {n_elements} elements, fiber directions at two vertices are more than 120° apart: the mesh does not \
                 resolve the change of direction; refine it there, or reverse vectors of opposite sign",
                body.unresolved_fibers
            ));
        }
        if let Start::State(state) = &body.start {
            notes.extend(state.notes(&body.muscle));
        }
        if body.opposed_fibers > 0 {
            notes.push(format!(
                "at {} quadrature points, fiber directions at the vertices are opposite: the direction of the nearest vertex is used",
                body.opposed_fibers
            ));
        }
        notes
    }

    /// Returns the method by which the loading path of a static analysis is followed.
    ///
    /// # Errors
    /// Fails if the path has keys without effect for this method.
    pub(crate) fn control(&self) -> Result<Control, InputError> {
        let Some(path) = &self.file.loading_path else {
            return Ok(Control::Load(vec![1.0]));
        };
        path.control().map_err(|(key, message)| {
            let error = InputError::new(message).next(format!("remove `{key}`"));
            self.wrong(&format!("static.{key}"), error)
        })
    }

    /// Returns the load factors of a loading path; empty if the path does not prescribe them.
    ///
    /// # Errors
    /// Fails if the path has keys without effect for its method.
    pub(crate) fn loads(&self) -> Result<Vec<f64>, InputError> {
        Ok(match self.control()? {
            Control::Load(loads) => loads,
            Control::Neighbor(_) | Control::ArcLength { .. } => Vec::new(),
        })
    }

    /// Returns the values as written in the scene, with overrides but without defaults.
    pub(crate) fn written(&self) -> &Value {
        self.source.value()
    }

    /// Returns findings about allowed but unusual values of the body.
    pub fn unusual(&self) -> Vec<Finding> {
        let body = self.body.as_ref();
        body.map_or(Vec::new(), |body| unusual::findings(&self.file, body, self.t_end))
    }

    /// Returns the text of the scene without overrides.
    pub fn text(&self) -> &str {
        self.source.text()
    }

    /// Converts the error of the model to an input error with the location of the value at `path`, such as `probe[0]`.
    ///
    /// # Errors
    /// Returns the error of the model with an explanation.
    pub fn at<T>(&self, path: &str, result: Result<T, ModelError>) -> Result<T, InputError> {
        result.map_err(|error| self.wrong(path, error.explain()))
    }

    /// Returns the readings of the probes. For a response, quantities without an amplitude are omitted.
    pub(crate) fn readings(&self) -> Result<Vec<Box<dyn Reading>>, InputError> {
        let mut readings = self.all_readings()?;
        let is_kept = |quantity| self.omission(quantity).is_none();
        readings.iter_mut().for_each(|reading| reading.retain(&is_kept));
        Ok(readings)
    }

    /// Returns the names of the probes for which [`Self::readings`] omits quantities, each with a reason.
    pub(crate) fn omissions(&self) -> Result<Vec<(&str, &'static str)>, InputError> {
        let readings = self.all_readings()?;
        let all = self.file.probe.iter().zip(&readings).flat_map(|(probe, reading)| {
            let quantities = reading.measurements().iter().flat_map(Measurement::quantities);
            let mut reasons: Vec<_> = quantities.filter_map(|own| self.omission(*own)).collect();
            reasons.sort_unstable();
            reasons.dedup();
            reasons.into_iter().map(|reason| (&*probe.name, reason))
        });
        Ok(all.collect())
    }

    /// Returns the reason why a response has no amplitude of a quantity, if this is the case.
    fn omission(&self, quantity: Quantity) -> Option<&'static str> {
        let about_rest = self.file.response.as_ref().is_none_or(|own| own.preload_time.is_none());
        let is_incompressible = |body: &Body| body.muscle.parameters.is_incompressible();
        match quantity {
            _ if !self.is_response() => None,
            _ if about_rest && quantity.has_kink_at_rest() => Some(
                "principal values and von Mises stresses have no derivative at rest and are omitted; a preload makes them differentiable",
            ),
            Quantity::VolumeRatio if self.body.as_ref().is_some_and(is_incompressible) => {
                Some("the volume ratio of an incompressible body is constant and is omitted")
            }
            _ => None,
        }
    }

    fn all_readings(&self) -> Result<Vec<Box<dyn Reading>>, InputError> {
        let probes = self.file.probe.iter().enumerate();
        let reading = |(i, probe): (usize, &Probe)| {
            self.at(&format!("probe[{i}]"), probe.kind.kind().reading(self))
        };
        probes.map(reading).collect()
    }

    /// Adds the location of the value at `path` to the error.
    pub(crate) fn wrong(&self, path: &str, error: InputError) -> InputError {
        self.source.report(Problem::new(path, error))
    }

    /// Builds a scene from its text. File names in the text are relative to `folder`.
    ///
    /// # Errors
    /// Returns an [`InputError`] with the file, the line, the column, and the expected value.
    pub fn build(
        name: &str,
        text: &str,
        overrides: &[String],
        folder: &Path,
    ) -> Result<Self, InputError> {
        let scene_file::Read { scene: mut file, source } = scene_file::read(name, text, overrides)?;
        let inputs = Inputs::new(folder);
        let given = Builder::new(&file, &source, &inputs);
        given.limits()?;
        given.integrator()?;
        let note = match file.analysis {
            Analysis::Periodic => periodic::without_bdf(&mut file.integrator),
            _ => None,
        };
        let builder = Builder::new(&file, &source, &inputs);
        builder.notes.borrow_mut().extend(note);
        match file.analysis {
            analysis if analysis.is_in_time() && file.time.is_none() => {
                let error = InputError::new("the analysis requires a time interval")
                    .next("add a [time] table with `end` in s")
                    .next("or set `analysis` to \"static\", \"modes\" or \"response\"");
                return Err(builder.wrong("", error));
            }
            Analysis::QuasiStatic => builder.quasi_static()?,
            Analysis::Static | Analysis::Dynamic | Analysis::Modes | Analysis::Periodic => {}
            Analysis::Response => builder.response()?,
        }
        let body = builder.body_of()?;
        let rod = file.rod.as_ref().map(|rod| builder.rod(rod)).transpose()?;
        let chains = builder.chains(body.as_ref())?;
        let feedbacks = builder.feedbacks(body.as_ref(), &chains)?;
        builder.chain_steps(&feedbacks)?;
        if body.is_none() {
            builder.start(None)?;
        }
        builder.driven(body.as_ref())?;
        let repetition = match file.analysis {
            Analysis::Periodic => Some(builder.periodic(body.as_ref(), rod.as_ref())?),
            _ => None,
        };
        builder.probes()?;
        if let Some(body) = &body {
            builder.places(body)?;
        }
        let (t_end, mut reading_notes) = (builder.t_end, builder.notes.take());
        reading_notes.extend(unused::notes(&file));
        if file.analysis == Analysis::Static {
            file.probe.retain(|probe| !probe.kind.kind().requires_motion());
        }
        Ok(Self {
            t_end,
            body,
            rod,
            chains,
            feedbacks,
            repetition,
            paths: inputs.paths(),
            reading_notes,
            inputs: inputs.into_read(),
            file,
            source,
            overrides: overrides.to_vec(),
            folder: folder.to_owned(),
        })
    }
}
