//! `myovib synchronization`: checks whether the external vibration can synchronize the chain.
//!
//! The paper raises this question, and sweeps answer it. For each combination of gain γ, frequency spread, coupling D
//! and drive frequency, they determine the settled |Ψ|, |χ| and centroid frequency, and whether the chain is locked to
//! the drive. Because the chain does not act on the body, the body is integrated once per drive frequency, and the
//! chains are driven by its recorded motion.

mod report;

use std::path::PathBuf;
use std::sync::Arc;

use clap::{Args, ValueEnum};
use myovib_model::IntegratorKind;
use myovib_model::coupling::{LockCriterion, Recording, Settling, Synchrony};
use myovib_report::picture;
use myovib_scene::result_folder::FolderRequest;
use myovib_scene::{InputError, Scene, parallel};

use crate::args::CommonArgs;
use crate::chains::{ChainRun, EVERY, record, replay};
use crate::exit::Exit;
use crate::overrides::{self, change};
use crate::progress::Progress;
use crate::values;

/// Options of `myovib synchronization`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    myovib synchronization\n  \
    myovib synchronization --gamma 1,6000 --t-end 60\n  \
    myovib synchronization --gamma 1000,4000,6000 --frequency-spread 0.008,0.08 --coupling 1,3\n  \
    myovib synchronization --gamma 250,1000,4000 --frequency 7,7.5,8,8.5 --json\n  \
    myovib synchronization --body muscle --set 'chain[0].at=[0.02, 0]' --gamma 1,1000,10000\n\n\
    The rod and its chain are from the built-in scene `figure3`, the muscle and its chain from `figure7`.\n\
    The body is integrated once per frequency, and its motion is replayed to each chain.\n\
    Locked: over the trailing window the centroid's mean frequency differs from the drive's by\n\
    less than `--slip` turns per window, and |χ| never falls below `--coherence`.")]
pub struct SynchronizationArgs {
    /// Body that drives the chain.
    #[arg(long, value_enum, default_value_t = BodyName::Rod)]
    pub body: BodyName,

    /// Mesh of the muscle (Gmsh) with the groups `fixed` and `load` [default: the
    /// built-in spindle].
    #[arg(long, value_name = "FILE")]
    pub mesh: Option<PathBuf>,

    /// Gains γ of the forcing.
    #[arg(
        long,
        value_name = "G,…",
        value_delimiter = ',',
        default_values_t = [1.0, 10.0, 100.0, 300.0, 1000.0, 2000.0, 3000.0, 3500.0, 4000.0, 6000.0, 10000.0],
        value_parser = values::finite
    )]
    pub gamma: Vec<f64>,

    /// Half-widths of the interval of natural frequencies, Hz [default: the scene's, 0.008 on the
    /// rod, 0.08 on the muscle].
    #[arg(long, value_name = "S,…", value_delimiter = ',', value_parser = values::finite)]
    pub frequency_spread: Vec<f64>,

    /// Coupling constants D between neighbors [default: the scene's: 3].
    #[arg(long, value_name = "D,…", value_delimiter = ',', value_parser = values::finite)]
    pub coupling: Vec<f64>,

    /// Frequencies of the drive, Hz.
    #[arg(long, value_name = "F,…", value_delimiter = ',', default_values_t = [8.0],
          value_parser = values::positive)]
    pub frequency: Vec<f64>,

    /// End time of each run, s. Near the onset of entrainment, transients last 150 s [default: 200
    /// with the rod, 50 with the muscle].
    #[arg(long, value_name = "T", value_parser = values::positive)]
    pub t_end: Option<f64>,

    /// Integrator of body and chains: `bdf`, or Radau IIA of order 5, 9 or 13: `radau5`,
    /// `radau9`, `radau13`. For long runs of oscillators, order 9 takes a fortieth of the time of
    /// BDF.
    #[arg(long, value_name = "NAME", default_value = "radau9", value_parser = values::integrator)]
    pub integrator: IntegratorKind,

    /// Change a value of the scene, for example `chain[0].seed=7`; may be repeated.
    #[arg(long, value_name = "KEY=VALUE")]
    pub set: Vec<String>,

    /// Maximum slip of a locked centroid relative to the drive in the window, in turns.
    #[arg(long, value_name = "TURNS", default_value_t = LockCriterion::default().slip,
          value_parser = values::positive)]
    pub slip: f64,

    /// Minimum |χ| of a locked chain in the window.
    #[arg(long, value_name = "CHI", default_value_t = LockCriterion::default().coherence,
          value_parser = values::positive)]
    pub coherence: f64,

    /// Folder for the figure and the table; created if missing.
    #[arg(long, value_name = "DIR", default_value = "synchronization", value_parser = values::output_folder)]
    pub out: PathBuf,

    /// Also write the picture as PNG.
    #[arg(long)]
    pub png: bool,

    #[command(flatten)]
    pub common: CommonArgs,
}

/// Body that drives the chain.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum BodyName {
    /// The rod of section 3.1.
    Rod,
    /// The displacement u_y of the muscle of section 3.2.
    Muscle,
}

impl BodyName {
    /// Returns the scene that contains the body and the chain, and the key of the load frequency in this scene.
    fn scene(self) -> (&'static str, &'static str) {
        match self {
            Self::Rod => ("figure3", "rod.load.frequency"),
            Self::Muscle => ("figure7", "traction[0].y.frequency"),
        }
    }
}

/// Combination of values in the sweep.
struct Case {
    frequency: f64,
    scene: Scene,
    /// Index of the drive frequency in the list of recorded motions.
    drive: usize,
}

struct Outcome {
    frequency: f64,
    run: ChainRun,
    /// `None` for a run that stopped before its end time and therefore has not settled.
    verdict: Option<Verdict>,
}

/// Settled state of a chain.
#[derive(Clone, Copy)]
struct Verdict {
    settled: Settling,
    synchrony: Synchrony,
}

impl SynchronizationArgs {
    /// Returns the scene of the body and the chain, with the changes of the options and of `more`.
    fn scene(&self, more: &[String]) -> Result<Scene, InputError> {
        let mut changes = Vec::new();
        changes.extend(self.t_end.map(overrides::end));
        changes.extend(self.mesh.as_deref().map(overrides::mesh));
        changes.extend(overrides::integrator(self.integrator));
        changes.extend(self.set.iter().cloned());
        changes.extend(more.iter().cloned());
        let (name, _) = self.body.scene();
        Scene::built_in(name, &changes)
    }

    fn check(&self) -> Result<(), InputError> {
        // The window of half the run needs at least two samples to determine a frequency.
        let shortest = 4.0 * EVERY;
        let too_short = |t_end: &f64| *t_end < shortest;
        if let Some(t_end) = self.t_end.filter(too_short) {
            let error = InputError::new("value out of range").at("--t-end");
            let allowed = format!("a finite number of at least {shortest} s");
            return Err(error.found(format!("{t_end:e}")).allowed(allowed));
        }
        if self.body == BodyName::Rod && self.mesh.is_some() {
            let error = InputError::new("a rod has no mesh").at("--mesh");
            return Err(error.next("use --body muscle with a mesh"));
        }
        Ok(())
    }

    /// Returns a scene for each drive frequency.
    fn drives(&self) -> Result<Vec<Scene>, InputError> {
        let (_, key) = self.body.scene();
        let frequencies = self.frequency.iter();
        let drive = |frequency: &f64| self.scene(&[change(key, format!("{frequency:e}"))]);
        frequencies.map(drive).collect()
    }

    /// Returns all combinations of values; γ changes fastest.
    fn cases(&self) -> Result<Vec<Case>, InputError> {
        // If no values are given, the scene's value is used.
        let values = |given: &[f64], key: &str| match given {
            [] => vec![Vec::new()],
            given => given.iter().map(|value| vec![change(key, format!("{value:e}"))]).collect(),
        };
        let mut cases = Vec::new();
        for (drive, &frequency) in self.frequency.iter().enumerate() {
            let (_, key) = self.body.scene();
            for spread in values(&self.frequency_spread, "chain[0].frequency_spread") {
                for coupling in values(&self.coupling, "chain[0].coupling") {
                    for gamma in values(&self.gamma, "chain[0].gain") {
                        let load = change(key, format!("{frequency:e}"));
                        let changes = [&[load][..], &spread, &coupling, &gamma].concat();
                        let scene = self.scene(&changes)?;
                        cases.push(Case { frequency, scene, drive });
                    }
                }
            }
        }
        Ok(cases)
    }
}

pub fn run(args: &SynchronizationArgs) -> anyhow::Result<Exit> {
    args.check()?;
    let (drives, cases) = (args.drives()?, args.cases()?);
    let files = picture::names(report::NAME, args.png);
    let request = FolderRequest::to_add(&args.out, report::NAME, files);
    request.check()?;
    let progress = Progress::new(args.common.quiet);
    let threads = args.common.n_threads();
    let recordings = parallel::map(&drives, threads, |scene| record(scene, &progress));
    let recordings = recordings.into_iter().collect::<anyhow::Result<Vec<Arc<Recording>>>>()?;
    let criterion = LockCriterion { slip: args.slip, coherence: args.coherence };
    let runs = parallel::map(&cases, threads, |case| {
        replay(case.scene.clone(), &recordings[case.drive], &progress)
    });
    let (mut results, mut exit) = (Vec::new(), Exit::Done);
    for (case, run) in cases.iter().zip(runs) {
        let run = run?;
        if run.exit() != Exit::Done {
            exit = run.exit();
        }
        let settled = run.settled().filter(|_| run.exit() == Exit::Done);
        results.push(Outcome {
            frequency: case.frequency,
            verdict: settled.map(|settled| Verdict {
                settled,
                synchrony: criterion.judge(&settled, case.frequency),
            }),
            run,
        });
    }
    report::write_and_print(args, &results, &request.open()?)?;
    Ok(exit)
}
