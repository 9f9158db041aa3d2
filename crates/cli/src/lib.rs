//! The command line `myovib`: commands that compute, and what they write.
//!
//! Cast: [`cli`] names the commands and runs them; [`commands`] has one file per command, [`args`]
//! the options they share; [`scene_file`] reads scenes; [`exit`] and [`error`] say how a command
//! ends; [`json`], [`csv`], [`atomic_file`] and [`report`] are the ways out; [`versions`] and
//! [`machine`] are what a reader of results must know. [`experiments`] runs what is behind figures
//! of chains. Only this crate prints.
#![forbid(unsafe_code)]
// `println!` panics when the reader has gone; what cannot be written is an error of the command.
#![deny(clippy::print_stdout)]

pub mod args;
pub mod atomic_file;
pub mod cli;
pub mod commands;
pub mod csv;
mod energy;
pub mod error;
pub mod exit;
pub mod experiments;
pub mod interrupt;
pub mod json;
pub mod machine;
pub mod mesh_file;
pub mod parallel;
pub mod picture;
pub mod plot;
pub mod progress;
pub mod report;
pub mod requirements;
pub mod scene;
pub mod scene_file;
pub mod statistics;
pub mod versions;
pub mod vtu;
pub mod watch;

use std::process::ExitCode;

use clap::Parser;

use crate::cli::Cli;
use crate::exit::Exit;

/// Reads the command line, runs the command, reports its failure, and gives the exit code.
pub fn main() -> ExitCode {
    let cli = Cli::parse();
    let exit = cli.command.run().unwrap_or_else(|failure| {
        if error::is_broken_pipe(&failure) {
            return Exit::Done;
        }
        eprint!("{}", error::render(&failure));
        // What needs the end of a run that was interrupted fails, and not by its input.
        if interrupt::has_come() {
            Exit::Interrupted
        } else {
            Exit::Usage
        }
    });
    exit.into()
}
