//! Command line of the program, parsed by clap, and the dispatch of its commands.

use clap::{CommandFactory, Parser, Subcommand};

use crate::args::CommonArgs;
use crate::commands::{
    check, completions, doctor, figure, fit, infsup, init, man, modes, movie, periodic, response,
    run, scenes, schema, sensitivity, sweep, synchronization, table1, table2,
};
use crate::exit::Exit;
use crate::versions;

/// Simulate deformation and vibration of soft tissue.
#[derive(Debug, Parser)]
#[command(
    name = "myovib",
    version,
    long_version = versions::long(),
    propagate_version = true,
    subcommand_required = true,
    after_help = "Exit codes: 0 done · 1 a reproduction check failed · 2 wrong \
                  input, nothing written · 3 the integrator stopped, output kept · 4 failed while \
                  running, output kept · 130 interrupted, output kept"
)]
pub struct Cli {
    /// Command to run.
    #[command(subcommand)]
    pub command: Command,
}

/// One variant per command.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Write a commented scene to start from.
    Init(init::InitArgs),
    /// List the built-in scenes.
    Scenes(scenes::ScenesArgs),
    /// Inspect a scene before running it: DAE index, inf–sup stability, modes, estimated cost,
    /// likely problems.
    Check(check::CheckArgs),
    /// Compute a scene: a motion, an equilibrium, eigenmodes, a harmonic response, or a periodic state.
    Run(run::RunArgs),
    /// Run a scene for a grid of parameter values in parallel and collect the results in a table.
    Sweep(sweep::SweepArgs),
    /// Compute the lowest eigenfrequencies and modes of a scene's body or of the paper's muscle.
    Modes(modes::ModesArgs),
    /// Compute the harmonic response of a scene over frequencies.
    Response(response::ResponseArgs),
    /// Find the periodic state of a scene under periodic loads, and determine its stability.
    Periodic(periodic::PeriodicArgs),
    /// Compute the sensitivities of a scene's outputs to its parameters.
    Sensitivity(sensitivity::SensitivityArgs),
    /// Fit parameters of a scene to measurements.
    Fit(fit::FitArgs),
    /// Measure the inf–sup constants of P2–P1 and P1–P1 over refined meshes.
    Infsup(infsup::InfsupArgs),
    /// Compute the indices of the paper's Table 1 and compare them with the published values.
    Table1(table1::Table1Args),
    /// Run the paper's Table 2 and compare the step counts with the published values.
    Table2(table2::Table2Args),
    /// Compute a figure of the paper and its data.
    Figure(figure::FigureArgs),
    /// Compute all figures of the paper.
    Figures(figure::FiguresArgs),
    /// Animate the deformation of a body or the oscillators of a chain (GIF).
    Movie(movie::MovieArgs),
    /// Sweep the drive of a chain and determine where the chain locks to the drive.
    Synchronization(synchronization::SynchronizationArgs),
    /// Print the JSON Schema of scenes, for completion and validation in editors.
    Schema(schema::SchemaArgs),
    /// Report the linked libraries, the machine and missing build requirements.
    Doctor(doctor::DoctorArgs),
    /// Print shell completions.
    Completions(completions::CompletionsArgs),
    /// Print the manual page of the program or of a command.
    Man(man::ManArgs),
}

impl Command {
    /// Returns whether the command uses its threads for several runs in parallel.
    fn runs_side_by_side(&self) -> bool {
        matches!(self, Self::Sweep(_) | Self::Table2(_) | Self::Synchronization(_))
    }

    /// Runs a command that computes, with the threads and the memory that its common options grant.
    fn granted(
        &self,
        common: &CommonArgs,
        run: impl FnOnce() -> anyhow::Result<Exit>,
    ) -> anyhow::Result<Exit> {
        common.grant_resources(self.runs_side_by_side())?;
        run()
    }

    pub fn run(&self) -> anyhow::Result<Exit> {
        match self {
            Self::Doctor(args) => self.granted(&args.common, || doctor::run(args)),
            Self::Check(args) => self.granted(&args.common, || check::run(args)),
            Self::Infsup(args) => self.granted(&args.common, || infsup::run(args)),
            Self::Modes(args) => self.granted(&args.common, || modes::run(args)),
            Self::Response(args) => self.granted(&args.common, || response::run(args)),
            Self::Periodic(args) => self.granted(&args.common, || periodic::run(args)),
            Self::Table1(args) => self.granted(&args.common, || table1::run(args)),
            Self::Table2(args) => self.granted(&args.common, || table2::run(args)),
            Self::Figure(args) => self.granted(&args.options.common, || figure::run(args)),
            Self::Figures(args) => self.granted(&args.options.common, || figure::run_all(args)),
            Self::Init(args) => init::run(args),
            Self::Scenes(args) => scenes::run(args),
            Self::Run(args) => self.granted(&args.common, || run::run(args)),
            Self::Completions(args) => completions::run(args, Cli::command()),
            Self::Man(args) => man::run(args, Cli::command()),
            Self::Movie(args) => self.granted(&args.common, || movie::run(args)),
            Self::Synchronization(args) => {
                self.granted(&args.common, || synchronization::run(args))
            }
            Self::Schema(args) => schema::run(args),
            Self::Sweep(args) => self.granted(&args.common, || sweep::run(args)),
            Self::Sensitivity(args) => self.granted(&args.common, || sensitivity::run(args)),
            Self::Fit(args) => self.granted(&args.common, || fit::run(args)),
        }
    }
}

#[cfg(test)]
mod tests {
    use clap::Arg;
    use clap::error::ErrorKind;

    use super::*;
    use crate::json::JsonTarget;

    #[test]
    fn clap_finds_no_contradiction() {
        Cli::command().debug_assert();
    }

    /// Regression: options such as `movie --from` accepted `nan`, and -1 was reported as an unknown argument.
    #[test]
    fn options_for_numbers_reject_other_values() {
        let mut n_numbers = 0;
        for command in Cli::command().get_subcommands() {
            let valued = |arg: &&Arg| arg.get_long().is_some() && arg.get_action().takes_values();
            for arg in command.get_arguments().filter(valued) {
                let option = arg.get_long().unwrap();
                let is_accepted = |value: &str| {
                    let typed = ["myovib", command.get_name(), &format!("--{option}={value}")];
                    let error = Cli::command().try_get_matches_from(typed).err();
                    // Other errors, such as missing arguments, are found later.
                    let kind = error.map(|error| error.kind());
                    !matches!(kind, Some(ErrorKind::ValueValidation | ErrorKind::InvalidValue))
                };
                // These options accept a number but not a word.
                let is_number = ["1", "0.5", "1GiB"].iter().any(|&value| is_accepted(value));
                if !is_number || is_accepted("word") {
                    continue;
                }
                n_numbers += 1;
                let typed = ["myovib", command.get_name(), &format!("--{option}"), "-1"];
                let error = Cli::command().try_get_matches_from(typed).err();
                let is_unknown = error.is_some_and(|e| e.kind() == ErrorKind::UnknownArgument);
                assert!(!is_unknown, "{} --{option} -1", command.get_name());
                for value in ["", " ", "nan", "NaN", "-nan", "inf", "-inf", "1e999", "0x1"] {
                    assert!(!is_accepted(value), "{} --{option}={value}", command.get_name());
                }
            }
        }
        assert!(n_numbers > 30, "{n_numbers}");
    }

    #[test]
    fn json_without_a_file_means_standard_output() {
        for (typed, target) in [
            (&["myovib", "doctor", "--json"][..], Some(JsonTarget::Stdout)),
            (&["myovib", "doctor", "--json=-"], Some(JsonTarget::Stdout)),
            (&["myovib", "doctor", "--json", "--quiet"], Some(JsonTarget::Stdout)),
            (&["myovib", "doctor", "--json=d.json"], Some(JsonTarget::File("d.json".into()))),
            (&["myovib", "doctor"], None),
        ] {
            let Command::Doctor(doctor) = Cli::try_parse_from(typed).unwrap().command else {
                panic!("{typed:?} is the doctor's")
            };
            assert_eq!(doctor.common.json, target, "{typed:?}");
        }
    }
}
