//! `myovib-bench`: the maintainers' measurements. What accuracy, features and finer meshes cost
//! (`bench`), and where each formulation breaks (`stress`).
#![forbid(unsafe_code)]

mod bench;
mod pages;
mod random;
mod stress;

use std::process::ExitCode;

use clap::{Parser, Subcommand};
use myovib_cli::exit::Exit;

use bench::BenchArgs;
use pages::PagesArgs;
use random::RandomArgs;
use stress::StressArgs;

/// Measurements of myovib's integrators.
#[derive(Debug, Parser)]
#[command(name = "myovib-bench", version, subcommand_required = true)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Measure what accuracy, features and finer meshes cost.
    Bench(BenchArgs),
    /// Run the matrix of formulations, parameters and settings, and see where each breaks.
    Stress(StressArgs),
    Pages(PagesArgs),
    /// Judge random scenes by tighter runs of another method.
    Random(RandomArgs),
}

impl Command {
    fn run(&self) -> anyhow::Result<Exit> {
        match self {
            Self::Bench(args) => bench::run(args),
            Self::Stress(args) => stress::run(args),
            Self::Pages(args) => pages::run(args),
            Self::Random(args) => random::run(args),
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
    fn clap_finds_no_contradiction() {
        Cli::command().debug_assert();
    }
}
