//! The command line `myovib`: commands that compute, and what they write.
//!
//! Cast: [`cli`] names the commands and runs them; [`commands`] has one file per command, [`args`]
//! the options they share and [`values`] what options take; [`exit`] and [`error`] say how a command ends; [`json`] and [`progress`]
//! are the ways out; [`versions`] and [`machine`] are what a reader of results must know.
//! [`ranks`] is a run by several processes. [`chains`] runs what is behind figures of chains. Only this crate prints.
#![forbid(unsafe_code)]
#![allow(missing_docs, reason = "not published as a library")]
// `println!` and `eprintln!` panic when the reader has gone: `output` prints instead.
#![deny(clippy::print_stdout, clippy::print_stderr)]

/// The Rust of the guide, as tests.
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

use std::process::ExitCode;

use clap::Parser;
use myovib_scene::{Scene, plain};

use crate::cli::{Cli, Command};
use crate::exit::Exit;

/// Reads the command line, runs the command, and gives the exit code.
pub fn main() -> ExitCode {
    interrupt::outlive_large_files();
    ranks::main(command, scene)
}

fn command() -> ExitCode {
    match Cli::try_parse() {
        Ok(cli) => ended(cli.command.run()).into(),
        Err(error) => {
            // What cannot be printed has no reader; the code is clap's, 2, or 0 for help.
            match error.use_stderr() && plain(&error.to_string()) != error.to_string() {
                true => output::print_error(&plain(&error.to_string())),
                false => drop(error.print()),
            }
            ExitCode::from(u8::try_from(error.exit_code()).unwrap_or(2))
        }
    }
}

/// The scene on the command line; what is wrong with it goes to standard error.
fn scene() -> Option<Scene> {
    let Ok(Cli {
        command: Command::Run(args),
    }) = Cli::try_parse()
    else {
        return None;
    };
    Scene::load(&args.scene, &args.set)
        .map_err(|failure| output::print_error(&error::render(&failure.into())))
        .ok()
}

/// Reports the failure of a command, and tells how it ended.
pub fn ended(result: anyhow::Result<Exit>) -> Exit {
    result.unwrap_or_else(|failure| {
        output::print_error(&error::render(&failure));
        // What needs the end of a run that was interrupted fails, and not by its input.
        if interrupt::has_come() {
            Exit::Interrupted
        } else {
            Exit::of_failure(&failure)
        }
    })
}
