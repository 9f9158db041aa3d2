//! The command line program `myovib`: its commands and their output.
//!
//! [`cli`] defines the commands and runs them. [`commands`] has one file per command, [`args`] defines the common
//! options, and [`values`] has the parsers of option values. [`exit`] and [`error`] define exit codes and error
//! messages; [`json`] and [`progress`] write documents and progress. [`versions`] and [`machine`] describe the program
//! and the machine on which results were computed. [`ranks`] runs several processes. [`chains`] runs the chains of
//! figures. Only this crate prints.
#![forbid(unsafe_code)]
#![allow(missing_docs, reason = "not published as a library")]
// `println!` and `eprintln!` panic if the reader has closed the pipe; `output` is used instead.
#![deny(clippy::print_stdout, clippy::print_stderr)]

/// Code examples of the guide in Rust, compiled as tests.
#[cfg(doctest)]
mod pages {
    #[doc = include_str!("../../../docs/src/rust.md")]
    mod rust {}
    #[doc = include_str!("../../../docs/src/extending.md")]
    mod extending {}
}

pub mod args;
pub mod chains;
pub mod cli;
pub mod commands;
pub mod error;
pub mod exit;
pub mod interrupt;
pub mod json;
pub mod machine;
pub mod output;
mod overrides;
pub mod progress;
pub mod ranks;
pub mod requirements;
pub mod values;
pub mod versions;
mod watched;

use std::env;
use std::ffi::OsString;
use std::process::ExitCode;

use clap::Parser;
use myovib_scene::{Scene, plain};
use myovib_sparse::Allocator;

use crate::cli::{Cli, Command};
use crate::exit::Exit;

/// Parses the command line, runs the command, and returns the exit code.
pub fn main() -> ExitCode {
    interrupt::install();
    interrupt::ignore_file_size_signal();
    // This error is the last output, even if another thread runs out of memory before the process ends.
    let print = |error: &str| Allocator::print_last_error(|| output::print_error(error));
    ranks::main(|| execute(env::args_os(), print).into(), scene)
}

/// Runs the program with these arguments; the first argument is the name of the program.
pub fn command(arguments: impl IntoIterator<Item = OsString>) -> Exit {
    execute(arguments, output::print_error)
}

fn execute(arguments: impl IntoIterator<Item = OsString>, print: impl FnOnce(&str)) -> Exit {
    match Cli::try_parse_from(arguments) {
        Ok(cli) => exit(cli.command.run(), print),
        Err(error) => {
            // Failures to print are ignored, because nobody reads the output.
            match error.use_stderr() && plain(&error.to_string()) != error.to_string() {
                true => output::print_error(&plain(&error.to_string())),
                false => drop(error.print()),
            }
            // The parser also returns an error for `--help` and `--version`, which are not errors.
            if error.use_stderr() { Exit::Usage } else { Exit::Done }
        }
    }
}

/// Reads the scene given on the command line. Errors are printed to standard error.
fn scene() -> Option<Scene> {
    let Ok(Cli { command: Command::Run(args) }) = Cli::try_parse() else {
        return None;
    };
    Scene::load(&args.scene, &args.set)
        .map_err(|failure| output::print_error(&error::render(&failure.into())))
        .ok()
}

/// Prints the error of a failed command and returns the exit code.
pub fn ended(result: anyhow::Result<Exit>) -> Exit {
    exit(result, output::print_error)
}

fn exit(result: anyhow::Result<Exit>, print: impl FnOnce(&str)) -> Exit {
    result.unwrap_or_else(|failure| {
        print(&error::render(&failure));
        // A command that fails because an interrupted run has no result still has valid input.
        if interrupt::is_interrupted() { Exit::Interrupted } else { Exit::of_failure(&failure) }
    })
}
