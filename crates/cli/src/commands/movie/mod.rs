//! `myovib movie`: animated GIFs of the stored fields of a run, or of the movies on the paper's website.

mod hardening;
mod muscle3d;

use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;

use clap::{Args, ValueEnum};
use myovib_model::IntegratorKind;
use serde_json::json;

use super::figure::{MuscleRun, complex_plane, frames, largest_radius};
use crate::args::CommonArgs;
use crate::chains::{EVERY, on_its_body};
use crate::exit::Exit;
use crate::interrupt;
use crate::output;
use crate::overrides;
use crate::progress::Progress;
use crate::values;
use myovib_report::film;
use myovib_report::plot::{Figure, movie};
use myovib_scene::{InputError, Scene, plain};

/// Time between frames during playback, in hundredths of a second: 25 frames per second.
const DELAY: u16 = 4;

/// Options of `myovib movie`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    myovib movie out\n  \
    myovib movie out --field von_mises --factor 20\n  \
    myovib movie chain --set chain[0].gain=6000\n  \
    myovib movie muscle --out muscle.gif --width-pixels 480\n\n\
    The run must have written fields ([fields] or response.fields in its scene) or modes. The movies chain, muscle, hardening and \
    muscle3d show runs of the built-in scenes figure3, figure5, hardening and muscle3d.")]
pub struct MovieArgs {
    /// Subject of the movie: the folder of a run, or one of the names chain, muscle, hardening and muscle3d.
    #[arg(value_name = "RUN|MOVIE", value_parser = subject)]
    pub subject: Subject,

    /// Field that colors the body; for vectors and tensors, its magnitude [default: the
    /// displacement].
    #[arg(long, value_name = "NAME")]
    pub field: Option<String>,

    /// Magnification of the displacements of a run [default: 1].
    #[arg(long, value_name = "X", value_parser = values::positive)]
    pub factor: Option<f64>,

    /// Frequency of the response or mode whose cycle is shown, Hz; the nearest frequency in response.fields or among
    /// the modes is used [default: the lowest].
    #[arg(long, value_name = "HZ", value_parser = values::finite)]
    pub frequency: Option<f64>,

    /// Output file [default: the name of the folder or movie, with .gif].
    #[arg(long, value_name = "FILE", value_parser = values::output_file)]
    pub out: Option<PathBuf>,

    /// Width of the picture in pixels.
    #[arg(long, value_name = "N", default_value_t = 640, value_parser = clap::value_parser!(u16).range(64..=2000))]
    pub width_pixels: u16,

    /// Start time of the movie of a run or of the chain, s [default: 0 (run), 8 (chain)].
    #[arg(long, value_name = "T", value_parser = values::finite)]
    pub from: Option<f64>,

    /// End time of the movie, s [default: the last (run), 14 (chain), 3 (muscle and hardening, which
    /// show the last cycle of the load), 2 (muscle3d)].
    #[arg(long, value_name = "T", value_parser = values::finite)]
    pub to: Option<f64>,

    /// Mesh of the muscle (Gmsh) with the groups `fixed` and `load` [default: the
    /// built-in spindle].
    #[arg(long, value_name = "FILE")]
    pub mesh: Option<PathBuf>,

    /// Integrator: `bdf`, or Radau IIA of order 5, 9 or 13: `radau5`, `radau9`, `radau13`
    /// [default: the scene's].
    #[arg(long, value_name = "NAME", value_parser = values::integrator)]
    pub integrator: Option<IntegratorKind>,

    /// Change a value of the scene, for example `chain[0].gain=10`; may be repeated.
    #[arg(long, value_name = "KEY=VALUE")]
    pub set: Vec<String>,

    #[command(flatten)]
    pub common: CommonArgs,
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Subject {
    /// Movie of a built-in scene.
    Film(Film),
    /// Folder of a run.
    Run(PathBuf),
}

/// Movies of built-in scenes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Film {
    /// The chain on the rod, in the complex plane: the scene `figure3`.
    Chain,
    /// Magnified deformation of the muscle: the scene `figure5`.
    Muscle,
    /// Magnified waves at a stiff inclusion in the muscle: the scene `hardening`.
    Hardening,
    /// Contraction of a 3D muscle: the scene `muscle3d`, which takes minutes.
    Muscle3d,
}

/// Returns the movie with this name. Any other text is taken as the path of a folder.
fn subject(text: &str) -> Result<Subject, String> {
    let film = Film::from_str(text, false).ok();
    if let Some(film) = film {
        return Ok(Subject::Film(film));
    }
    match Path::new(text).is_dir() {
        true => Ok(Subject::Run(PathBuf::from(text))),
        false => {
            Err("expected the folder of a run, or chain, muscle, hardening or muscle3d".to_owned())
        }
    }
}

impl MovieArgs {
    /// Rejects options that have no effect on this movie.
    fn check(&self) -> Result<(), InputError> {
        let mesh = self.mesh.as_ref().map(|_| "--mesh");
        let from = self.from.map(|_| "--from");
        let of_a_run = [
            self.field.as_ref().map(|_| "--field"),
            self.factor.map(|_| "--factor"),
            self.frequency.map(|_| "--frequency"),
        ];
        let integrator = self.integrator.map(|_| "--integrator");
        let set = self.set.first().map(|_| "--set");
        let (without_effect, next) = match &self.subject {
            Subject::Run(_) => (
                vec![mesh, integrator, set],
                "the run is already stored; run its scene again to use different settings",
            ),
            Subject::Film(Film::Chain) => {
                (vec![mesh], "the chain moves on a rod, which has no mesh")
            }
            Subject::Film(Film::Muscle) => {
                (vec![from], "this movie shows the last cycle of the load")
            }
            Subject::Film(Film::Hardening | Film::Muscle3d) => (
                vec![mesh, from],
                "this movie shows the built-in scene of the same name; for another scene, run it with [fields] and \
                 name its folder",
            ),
        };
        if let Some(option) = without_effect.into_iter().flatten().next() {
            let error = InputError::new("the option has no effect on this movie");
            return Err(error.at(option).next(next));
        }
        match (&self.subject, of_a_run.into_iter().flatten().next()) {
            (Subject::Film(_), Some(option)) => {
                let error = InputError::new("the option has no effect on this movie");
                Err(error.at(option).next("use it with the folder of a run"))
            }
            _ => Ok(()),
        }
    }

    fn default_name(&self) -> PathBuf {
        let name = match &self.subject {
            Subject::Film(film) => film
                .to_possible_value()
                .map_or_else(String::new, |value| value.get_name().to_owned()),
            Subject::Run(folder) => {
                let folder = folder.canonicalize().unwrap_or_else(|_| folder.clone());
                let name = folder.file_name().unwrap_or_default();
                name.to_string_lossy().into_owned()
            }
        };
        PathBuf::from(format!("{name}.gif"))
    }

    /// Returns the scene of the movie. It ends at `to` (s), or at the scene's own end time if `to` is `None`.
    fn scene(&self, name: &str, to: Option<f64>) -> Result<Scene, InputError> {
        let mut changes = Vec::new();
        changes.extend(to.map(overrides::end));
        changes.extend(self.mesh.as_deref().map(overrides::mesh));
        changes.extend(self.integrator.into_iter().flat_map(overrides::integrator));
        changes.extend(self.set.iter().cloned());
        Scene::built_in(name, &changes)
    }
}

pub fn run(args: &MovieArgs) -> anyhow::Result<Exit> {
    args.check()?;
    let (first, last) = match args.subject {
        Subject::Run(_) => (0.0, f64::MAX),
        Subject::Film(Film::Chain) => (8.0, 14.0),
        Subject::Film(_) => (0.0, 3.0),
    };
    let (from, to) = (args.from.unwrap_or(first), args.to.unwrap_or(last));
    if !(0.0..to).contains(&from) {
        let end = args.to.map_or("the end of the run".to_owned(), |to| format!("{to} s"));
        return Err(InputError::new("the movie has no duration")
            .at("--from, --to")
            .found(format!("{from} s to {end}"))
            .allowed("0 ≤ from < to")
            .into());
    }
    let path = args.out.clone().unwrap_or_else(|| args.default_name());
    // A path from the command line was checked when it was parsed; the default path is checked here.
    values::output_file(&path.display().to_string())
        .map_err(|reason| InputError::new(reason).at(path.display()))?;
    let movie = match &args.subject {
        Subject::Run(folder) => stored(args, folder, [from, to])?,
        Subject::Film(Film::Chain) => chain(args, from, to)?,
        Subject::Film(Film::Muscle) => deformation(args, to)?,
        Subject::Film(Film::Hardening) => hardening::film(args)?,
        Subject::Film(Film::Muscle3d) => muscle3d::film(args)?,
    };
    if movie.frames.is_empty() && movie.exit != Exit::Done {
        output::line("no movie: the run ended before the start time of the movie");
        return Ok(movie.exit);
    }
    // Ctrl-C while drawing ends the movie after the frames drawn so far. If the computation was interrupted, all of its
    // results are drawn.
    let is_interrupted = interrupt::flag();
    let draws_all = interrupt::is_interrupted();
    let mut n_frames = 0;
    let frames = movie.frames.into_iter();
    let frames = frames.take_while(|_| draws_all || !is_interrupted.load(Ordering::Relaxed));
    let mut frames = frames.inspect(|_| n_frames += 1).map(Ok).peekable();
    if frames.peek().is_none() && interrupt::is_interrupted() {
        output::line("no movie: the command was interrupted before the first frame was drawn");
        return Ok(Exit::Interrupted);
    }
    let mut bytes = Vec::new();
    movie::write(&mut bytes, frames, args.width_pixels, DELAY)?;
    output::save(&path, bytes)?;
    let document = json!({ "file": path.display().to_string(), "frames": n_frames });
    let text = plain(&format!("{}: {n_frames} frames\n", path.display()));
    args.common.print_or_write("movie", &text, &document)?;
    Ok(match interrupt::is_interrupted() {
        true => Exit::Interrupted,
        false => movie.exit,
    })
}

struct Movie {
    frames: Vec<Figure>,
    exit: Exit,
}

/// Makes a movie of the stored fields of a run.
fn stored(args: &MovieArgs, folder: &Path, between: [f64; 2]) -> anyhow::Result<Movie> {
    let factor = args.factor.unwrap_or(1.0);
    let (field, frequency) = (args.field.as_deref(), args.frequency);
    let request = film::Request { field, factor, between, frequency };
    Ok(Movie { frames: film::frames(folder, request)?, exit: Exit::Done })
}

/// Shows each sample of 0.01 s for 0.04 s. This is a quarter of the real speed, at 12.5 frames per cycle.
fn chain(args: &MovieArgs, from: f64, to: f64) -> anyhow::Result<Movie> {
    let scene = args.scene("figure3", Some(to))?;
    let run = on_its_body(scene, &Progress::new(args.common.quiet))?;
    let history = &run.history;
    let radius = largest_radius(history);
    let first = (from / EVERY).ceil() as usize;
    let frames =
        (first..history.t.len()).map(|i| Figure::of("", complex_plane(history, i, radius)));
    Ok(Movie { frames: frames.collect(), exit: run.exit() })
}

/// Shows the last cycle of the load in 50 frames, at one sixteenth of its real speed.
fn deformation(args: &MovieArgs, to: f64) -> anyhow::Result<Movie> {
    let scene = args.scene("figure5", Some(to))?;
    let run = MuscleRun::compute(scene, &Progress::new(args.common.quiet))?;
    Ok(Movie { frames: frames(&run)?, exit: run.exit() })
}
