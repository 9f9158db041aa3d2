//! The command line as typed text, and the options every command has.

use std::convert::Infallible;
use std::io::{self, Write};
use std::num::NonZeroUsize;
use std::path::PathBuf;
use std::str::FromStr;

use clap::{Args, Parser, Subcommand};
use serde::Serialize;

use crate::commands::doctor::DoctorArgs;
use crate::commands::init::InitArgs;
use crate::commands::schema::SchemaArgs;
use crate::commands::table2::Table2Args;
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
    /// Run the paper's Table 2 and print it beside the paper's counts.
    Table2(Table2Args),
    /// Write a commented scene to start from.
    Init(InitArgs),
    /// Print the JSON Schema of scenes, with which editors complete and check.
    Schema(SchemaArgs),
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
