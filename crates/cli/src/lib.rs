//! The command line `myovib`: commands that compute, and what they write.
//!
//! Cast: [`cli`] names the commands and runs them; [`commands`] has one file per command, [`args`]
//! the options they share and [`values`] what options take; [`exit`] and [`error`] say how a command ends; [`json`] and [`progress`]
//! are the ways out; [`versions`] and [`machine`] are what a reader of results must know.
//! [`ranks`] is a run by several processes. [`chains`] runs what is behind figures of chains. Only this crate prints.
#![forbid(unsafe_code)]
// `println!` panics when the reader has gone; what cannot be written is an error of the command.
#![deny(clippy::print_stdout)]

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
mod overrides;
pub mod progress;
pub mod ranks;
pub mod requirements;
pub mod values;
pub mod versions;
mod watched;

use std::process::ExitCode;

use clap::Parser;
use myovib_scene::Scene;

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
            let _ = error.print();
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
        .map_err(|failure| eprint!("{}", error::render(&failure.into())))
        .ok()
}

/// Reports the failure of a command, and tells how it ended.
pub fn ended(result: anyhow::Result<Exit>) -> Exit {
    result.unwrap_or_else(|failure| {
        if error::is_broken_pipe(&failure) {
            return Exit::Done;
        }
        eprint!("{}", error::render(&failure));
        // What needs the end of a run that was interrupted fails, and not by its input.
        if interrupt::has_come() {
            Exit::Interrupted
        } else {
            Exit::of_failure(&failure)
        }
    })
}
