//! The command line as typed text, and the options every command has.

use std::convert::Infallible;
use std::io::{self, Write};
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use clap::{Args, Parser, Subcommand};
use serde::Serialize;

use crate::commands::bench::BenchArgs;
use crate::commands::check::CheckArgs;
use crate::commands::completions::CompletionsArgs;
use crate::commands::doctor::DoctorArgs;
use crate::commands::figure::{FigureArgs, FiguresArgs};
use crate::commands::infsup::InfsupArgs;
use crate::commands::init::InitArgs;
use crate::commands::man::ManArgs;
use crate::commands::modes::ModesArgs;
use crate::commands::movie::MovieArgs;
use crate::commands::run::RunArgs;
use crate::commands::schema::SchemaArgs;
use crate::commands::sweep::SweepArgs;
use crate::commands::synchronization::SynchronizationArgs;
use crate::commands::table1::Table1Args;
use crate::commands::table2::Table2Args;
use crate::error::InputError;
use crate::{json, machine, versions};

/// Deformation and microvibration of skeletal muscle as differential-algebraic equations.
#[derive(Debug, Parser)]
#[command(
    name = "myovib",
    version,
    long_version = versions::long(),
    propagate_version = true,
    subcommand_required = true,
    after_help = "Exit codes: 0 done · 1 a result differs from what was to be shown · 2 wrong \
                  input, nothing written · 3 the integrator stopped, output kept · 130 interrupted, \
                  output kept"
)]
pub struct Cli {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

/// One variant per command.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Say what libraries and what machine this program has, and what the build lacks.
    Doctor(DoctorArgs),
    /// Say of a scene, without running it: index, stability, modes, cost, and what will fail.
    Check(CheckArgs),
    /// Measure the inf–sup constants of P2–P1 and P1–P1 over refined meshes.
    Infsup(InfsupArgs),
    /// Find the muscle's lowest eigenfrequencies and modes, beside its load's 8 Hz.
    Modes(ModesArgs),
    /// Compute the indices of the paper's Table 1 and print them beside the paper's.
    Table1(Table1Args),
    /// Run the paper's Table 2 and print it beside the paper's counts.
    Table2(Table2Args),
    /// Draw one of the paper's figures, with the numbers behind it.
    Figure(FigureArgs),
    /// Draw all of the paper's figures.
    Figures(FiguresArgs),
    /// Measure what accuracy, features and finer meshes cost.
    Bench(BenchArgs),
    /// Animate the chain in the complex plane, or the muscle's deformation (GIF).
    Movie(MovieArgs),
    /// Sweep the drive of a chain and see when the chain locks to it.
    Synchronization(SynchronizationArgs),
    /// Write a commented scene to start from.
    Init(InitArgs),
    /// Compute a scene: a motion or an equilibrium.
    Run(RunArgs),
    /// Print the JSON Schema of scenes, with which editors complete and check.
    Schema(SchemaArgs),
    /// Print completions for a shell.
    Completions(CompletionsArgs),
    /// Print the manual page of the program or of a command.
    Man(ManArgs),
    /// Run a scene over a grid of values, on all cores.
    Sweep(SweepArgs),
}

/// Options of every command.
#[derive(Debug, Clone, Args)]
pub struct CommonArgs {
    /// Write the results as JSON to FILE; without FILE, or with `-`, to standard output, in place
    /// of the text. Put it last, or before another option.
    #[arg(long, value_name = "FILE", num_args = 0..=1, default_missing_value = "-")]
    pub json: Option<JsonTarget>,

    /// No progress on standard error; warnings and errors stay.
    #[arg(long, short)]
    pub quiet: bool,

    /// Threads to use [default: all cores].
    #[arg(long, value_name = "N")]
    pub threads: Option<NonZeroUsize>,
}

/// Where a JSON document goes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum JsonTarget {
    /// Standard output.
    Stdout,
    /// A file.
    File(PathBuf),
}

impl FromStr for JsonTarget {
    type Err = Infallible;

    fn from_str(text: &str) -> Result<Self, Infallible> {
        Ok(if text == "-" {
            Self::Stdout
        } else {
            Self::File(text.into())
        })
    }
}

impl CommonArgs {
    /// Threads to use: those asked for, or one per core.
    pub fn n_threads(&self) -> NonZeroUsize {
        self.threads.unwrap_or_else(machine::n_cores)
    }

    /// Checks before a long computation that its document can be written.
    ///
    /// # Errors
    /// [`InputError`] when the folder of the file of `--json` is not there.
    pub fn check(&self) -> Result<(), InputError> {
        match &self.json {
            Some(JsonTarget::File(path)) => check_folder("--json", path),
            _ => Ok(()),
        }
    }

    /// Gives out the results: the text on standard output, or the document of `command` where
    /// `--json` wants it (both, when it wants a file).
    ///
    /// # Errors
    /// When standard output or the file cannot be written.
    pub fn give(&self, command: &str, text: &str, document: &impl Serialize) -> anyhow::Result<()> {
        if let Some(target) = &self.json {
            json::write(target, command, document)?;
        }
        if self.json != Some(JsonTarget::Stdout) {
            io::stdout().write_all(text.as_bytes())?;
        }
        Ok(())
    }
}

/// Checks that the folder a file is to be written to is there.
///
/// # Errors
/// [`InputError`] naming the option and the folder.
pub fn check_folder(option: &str, file: &Path) -> Result<(), InputError> {
    let folder = file
        .parent()
        .filter(|folder| !folder.as_os_str().is_empty());
    match folder {
        Some(folder) if !folder.is_dir() => Err(InputError::new("no such folder")
            .at(option)
            .found(file.display())
            .next(format!("create it: mkdir -p {}", folder.display()))),
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    use super::*;

    #[test]
    fn clap_finds_no_contradiction() {
        Cli::command().debug_assert();
    }

    #[test]
    fn json_without_a_file_means_standard_output() {
        for (typed, target) in [
            (
                &["myovib", "doctor", "--json"][..],
                Some(JsonTarget::Stdout),
            ),
            (
                &["myovib", "doctor", "--json", "-"],
                Some(JsonTarget::Stdout),
            ),
            (
                &["myovib", "doctor", "--json", "--quiet"],
                Some(JsonTarget::Stdout),
            ),
            (
                &["myovib", "doctor", "--json", "d.json"],
                Some(JsonTarget::File("d.json".into())),
            ),
            (&["myovib", "doctor"], None),
        ] {
            let Command::Doctor(doctor) = Cli::try_parse_from(typed).unwrap().command else {
                panic!("{typed:?} is the doctor's")
            };
            assert_eq!(doctor.common.json, target, "{typed:?}");
        }
    }
}
