//! `myovib synchronization`: is the external vibration able to synchronise the chain?
//!
//! The paper's question, answered by sweeps: for each gain γ, width of the frequencies, coupling D
//! and frequency of the drive, the settled |Ψ|, |χ| and frequency of the centroid, and whether the
//! chain is locked to the drive. The body moves the same whatever the chain does, so it is
//! integrated once per drive frequency, and its motion replayed to the chains.

mod driver;
mod report;

use std::path::PathBuf;
use std::sync::Arc;

use clap::Args;
use myovib_model::IntegratorKind;
use myovib_model::coupling::{LockCriterion, Recording, Settling, Synchrony};
use serde_json::Value;

use crate::args::CommonArgs;
use crate::exit::Exit;
use crate::experiments::{ChainArgs, ChainSetup, Course, EVERY, GeneratorName, replay};
use crate::progress::Progress;
use crate::values;
use driver::{BodyName, Driver};
use myovib_scene::InputError;
use myovib_scene::parallel;
use myovib_scene::scene_file::chain::ReachName;

/// Options of `myovib synchronization`.
#[derive(Debug, Args)]
#[command(
    allow_negative_numbers = true,
    after_help = "Examples:\n  \
    myovib synchronization\n  \
    myovib synchronization --gamma 1,6000 --t-end 60\n  \
    myovib synchronization --gamma 1000,4000,6000 --width 0.05,0.5 --coupling 1,3\n  \
    myovib synchronization --gamma 250,1000,4000 --frequency 7,7.5,8,8.5 --json\n  \
    myovib synchronization --body muscle --point 0.02,0 --gamma 1,1000,10000 --integrator radau9\n\n\
    The body is integrated once per frequency, and its motion replayed to each chain.\n\
    Locked: over the trailing window the centroid's mean frequency differs from the drive's by\n\
    less than `--slip` turns per window, and |χ| never falls below `--coherence`."
)]
pub struct SynchronizationArgs {
    /// What drives the chain.
    #[arg(long, value_enum, default_value_t = BodyName::Rod)]
    pub body: BodyName,

    /// Mesh of the muscle (Gmsh 4.1 ASCII) with the groups `fixed` and `load` [default: the
    /// built-in spindle].
    #[arg(long, value_name = "FILE")]
    pub mesh: Option<PathBuf>,

    /// Gains γ of the forcing.
    #[arg(
        long,
        value_name = "G,…",
        value_delimiter = ',',
        default_values_t = [1.0, 10.0, 100.0, 300.0, 1000.0, 2000.0, 3000.0, 3500.0, 4000.0, 6000.0, 10000.0]
    )]
    pub gamma: Vec<f64>,

    /// Half widths of the interval of natural frequencies, rad/s [default: 0.05 on the rod, 0.5 on
    /// the muscle].
    #[arg(long, value_name = "W,…", value_delimiter = ',')]
    pub width: Vec<f64>,

    /// Couplings D of neighbours.
    #[arg(long, value_name = "D,…", value_delimiter = ',', default_values_t = [3.0])]
    pub coupling: Vec<f64>,

    /// Frequencies of the drive, Hz.
    #[arg(long, value_name = "F,…", value_delimiter = ',', default_values_t = [8.0],
          value_parser = values::positive)]
    pub frequency: Vec<f64>,

    /// Number of oscillators [default: 20 on the rod, 5 on the muscle].
    #[arg(long, value_name = "N")]
    pub oscillators: Option<usize>,

    /// Generator of the natural frequencies: matlab, chacha8.
    #[arg(long, value_name = "NAME", default_value_t)]
    pub generator: GeneratorName,

    /// Seed of the generator.
    #[arg(long, value_name = "S", default_value_t = myovib_oscillators::Detuning::DEFAULT_SEED)]
    pub seed: u32,

    /// Oscillators that the forcing reaches: all, boundary.
    #[arg(long, value_name = "NAME", default_value = "all", value_parser = values::named::<ReachName>)]
    pub reach: ReachName,

    /// Where the chain is driven: X on the rod [default: 0.05], X,Y in the muscle [default: 0,0].
    #[arg(long, value_name = "POINT", value_delimiter = ',')]
    pub point: Vec<f64>,

    /// End time of each run, s; near the onset of entrainment transients last 150 s [default: 200
    /// with the rod, 50 with the muscle].
    #[arg(long, value_name = "T")]
    pub t_end: Option<f64>,

    /// Integrator of body and chains: `ida` (BDF), or Radau IIA of order 5, 9 or 13: `radau`,
    /// `radau9`, `radau13`.
    #[arg(long, value_name = "NAME", default_value = "ida", value_parser = values::integrator)]
    pub integrator: IntegratorKind,

    /// Turns by which a locked centroid may slip against the drive in the window.
    #[arg(long, value_name = "TURNS", default_value_t = LockCriterion::default().slip,
          value_parser = values::positive)]
    pub slip: f64,

    /// Least |χ| of a locked chain in the window.
    #[arg(long, value_name = "CHI", default_value_t = LockCriterion::default().coherence,
          value_parser = values::positive)]
    pub coherence: f64,

    /// Folder for picture and table; made if it is not there.
    #[arg(long, value_name = "DIR", default_value = "out", value_parser = values::output_folder)]
    pub out: PathBuf,

    /// Write the picture as PNG too.
    #[arg(long)]
    pub png: bool,

    /// Options of every command.
    #[command(flatten)]
    pub common: CommonArgs,
}

/// One point of the sweep.
struct Case {
    frequency: f64,
    setup: ChainSetup,
    /// Index of the drive among the recordings.
    drive: usize,
}

/// What a case came to.
struct Outcome {
    frequency: f64,
    setup: ChainSetup,
    /// None for a run that did not reach its end: it has not settled.
    verdict: Option<Verdict>,
    /// Statistics and settings of the run, for JSON.
    run: Value,
}

/// What a chain settled to.
#[derive(Clone, Copy)]
struct Verdict {
    settled: Settling,
    synchrony: Synchrony,
}

impl SynchronizationArgs {
    fn t_end(&self) -> f64 {
        let (_, _, default) = self.body.defaults();
        self.t_end.unwrap_or(default)
    }

    fn oscillators(&self) -> usize {
        let (default, _, _) = self.body.defaults();
        self.oscillators.unwrap_or(default)
    }

    fn widths(&self) -> Vec<f64> {
        let (_, default, _) = self.body.defaults();
        match &self.width[..] {
            [] => vec![default],
            given => given.to_vec(),
        }
    }

    fn check(&self) -> Result<(), InputError> {
        // Two samples make a frequency, in half of the run.
        let (shortest, t_end) = (4.0 * EVERY, self.t_end());
        if !(t_end >= shortest && t_end.is_finite()) {
            let error = InputError::new("value out of range").at("--t-end");
            let allowed = format!("a finite number, {shortest} at least (s)");
            return Err(error.found(format!("{t_end:e}")).allowed(allowed));
        }
        Ok(())
    }

    /// All combinations, γ fastest.
    fn cases(&self) -> Result<Vec<Case>, InputError> {
        let mut cases = Vec::new();
        for (drive, &frequency) in self.frequency.iter().enumerate() {
            for width in self.widths() {
                for &coupling in &self.coupling {
                    for &gamma in &self.gamma {
                        let chain = ChainArgs {
                            generator: Some(self.generator),
                            seed: Some(self.seed),
                            gamma: Some(gamma),
                            coupling: Some(coupling),
                            reach: Some(self.reach),
                            ..ChainArgs::default()
                        };
                        cases.push(Case {
                            frequency,
                            setup: chain.setup(self.oscillators(), width)?,
                            drive,
                        });
                    }
                }
            }
        }
        Ok(cases)
    }
}

/// Runs the sweep.
///
/// # Errors
/// Wrong options, or an output that cannot be written.
pub fn run(args: &SynchronizationArgs) -> anyhow::Result<Exit> {
    args.check()?;
    let driver = Driver::new(args)?;
    let cases = args.cases()?;
    let progress = Progress::new(args.common.quiet);
    let course = Course {
        t_end: args.t_end(),
        integrator: args.integrator,
        progress: &progress,
    };
    let threads = args.common.n_threads();
    let recordings: Vec<Arc<Recording>> = parallel::map(&args.frequency, threads, |frequency| {
        driver.record(*frequency, course)
    })
    .into_iter()
    .collect::<anyhow::Result<_>>()?;
    let criterion = LockCriterion {
        slip: args.slip,
        coherence: args.coherence,
    };
    let runs = parallel::map(&cases, threads, |case| {
        let recording = Arc::clone(&recordings[case.drive]);
        replay(&case.setup, recording, course)
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
            setup: case.setup.clone(),
            verdict: settled.map(|settled| Verdict {
                settled,
                synchrony: criterion.judge(&settled, case.frequency),
            }),
            run: serde_json::to_value(run.json())?,
        });
    }
    report::give(args, &driver, &results)?;
    Ok(exit)
}
