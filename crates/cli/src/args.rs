//! The options every command has.

use std::io::{self, Write};
use std::num::NonZeroUsize;

use clap::Args;
use myovib_sparse::resources;
use serde::Serialize;

use crate::json::{self, JsonTarget};
use crate::machine;
use crate::values;

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
    #[arg(long, value_name = "N", value_parser = values::one_or_more)]
    pub threads: Option<NonZeroUsize>,

    /// Memory to take at most, as in 8GiB or 500MiB [default: what is free]. Factors that will not
    /// fit are refused before they are computed.
    #[arg(long, value_name = "SIZE", value_parser = values::memory)]
    pub memory: Option<usize>,
}

impl CommonArgs {
    /// Threads to use: those asked for, or one per core.
    pub fn n_threads(&self) -> NonZeroUsize {
        self.threads.unwrap_or_else(machine::n_cores)
    }

    /// Lets the factorisations of one large body have the threads and the memory that are asked for.
    ///
    /// # Errors
    /// Threads that the system does not start.
    pub fn grant_resources(&self) -> anyhow::Result<()> {
        resources::use_threads(self.n_threads().get())?;
        self.memory.into_iter().for_each(resources::limit_memory);
        Ok(())
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
