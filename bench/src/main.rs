//! `myovib-bench`: measurements for maintainers. `bench` measures the cost of solvers and of large bodies, and `pages`
//! fills the tables of the guide.
#![forbid(unsafe_code)]
#![allow(missing_docs, reason = "not published as a library")]

mod bench;
mod pages;

use std::process::ExitCode;

use clap::{Parser, Subcommand};
use myovib_cli::exit::Exit;

use bench::BenchArgs;
use pages::PagesArgs;

/// Measurements of myovib's integrators.
#[derive(Debug, Parser)]
#[command(name = "myovib-bench", version, subcommand_required = true)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Measure the cost of linear solvers, default settings, responses and large bodies.
    Bench(BenchArgs),
    Pages(PagesArgs),
}

impl Command {
    fn run(&self) -> anyhow::Result<Exit> {
        match self {
            Self::Bench(args) => bench::run(args),
            Self::Pages(args) => pages::run(args),
        }
    }
}

fn main() -> ExitCode {
    myovib_cli::ended(Cli::parse().command.run()).into()
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    use super::*;

    #[test]
    fn the_command_line_is_consistent() {
        Cli::command().debug_assert();
    }
}
