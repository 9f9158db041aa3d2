//! Options common to all commands.

use std::num::NonZeroUsize;

use clap::Args;
use myovib_sparse::resources;
use serde::Serialize;

use crate::json::{self, JsonTarget};
use crate::machine;
use crate::output;
use crate::values;

/// Options of every command.
#[derive(Debug, Clone, Args)]
// Negative numbers reach the parsers of values, which report the allowed values.
#[command(allow_negative_numbers = true)]
pub struct CommonArgs {
    /// Print the results as JSON instead of text; with `=FILE`, write them to FILE. Only a file that this program wrote
    /// is replaced.
    #[arg(long, value_name = "FILE", num_args = 0..=1, require_equals = true, default_missing_value = "-")]
    pub json: Option<JsonTarget>,

    /// Do not report progress on standard error; warnings and errors are still printed.
    #[arg(long, short)]
    pub quiet: bool,

    /// Number of threads [default: all cores].
    #[arg(long, value_name = "N", value_parser = values::threads)]
    pub threads: Option<NonZeroUsize>,

    /// Memory limit, for example 8GiB or 500MiB [default: the available memory]. Factorizations
    /// that would exceed it are rejected before they start.
    #[arg(long, value_name = "SIZE", value_parser = values::memory)]
    pub memory: Option<usize>,
}

impl CommonArgs {
    /// Returns the requested number of threads; the default is one per core.
    pub fn n_threads(&self) -> NonZeroUsize {
        self.threads.unwrap_or_else(machine::n_cores)
    }

    /// Sets the memory and thread limits of the process. If `side_by_side` is true, the command runs several
    /// computations in parallel, each on one thread.
    pub fn grant_resources(&self, side_by_side: bool) -> anyhow::Result<()> {
        if !side_by_side {
            resources::use_threads(self.n_threads().get())?;
        }
        self.memory.into_iter().for_each(resources::limit_memory);
        Ok(())
    }

    /// Prints the text to standard output. With `--json`, writes the document of `command` instead; if `--json` names a
    /// file, does both.
    pub fn print_or_write(
        &self,
        command: &str,
        text: &str,
        document: &impl Serialize,
    ) -> anyhow::Result<()> {
        if let Some(target) = &self.json {
            json::write(target, command, document)?;
        }
        if self.json != Some(JsonTarget::Stdout) {
            output::print(text)?;
        }
        Ok(())
    }
}
