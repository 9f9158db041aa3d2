//! One file per command.

pub mod bench;
pub mod check;
pub mod completions;
pub mod doctor;
pub mod figure;
pub mod infsup;
pub mod init;
pub mod man;
pub mod modes;
pub mod movie;
pub mod run;
pub mod schema;
pub mod sweep;
pub mod synchronization;
pub mod table1;
pub mod table2;

use crate::args::Command;
use crate::exit::Exit;

/// Runs the command.
///
/// # Errors
/// When the input is wrong or an output cannot be written.
pub fn run(command: &Command) -> anyhow::Result<Exit> {
    match command {
        Command::Bench(args) => bench::run(args),
        Command::Doctor(args) => doctor::run(args),
        Command::Check(args) => check::run(args),
        Command::Infsup(args) => infsup::run(args),
        Command::Modes(args) => modes::run(args),
        Command::Table1(args) => table1::run(args),
        Command::Table2(args) => table2::run(args),
        Command::Figure(args) => figure::run(args),
        Command::Figures(args) => figure::run_all(args),
        Command::Init(args) => init::run(args),
        Command::Run(args) => run::run(args),
        Command::Completions(args) => completions::run(args),
        Command::Man(args) => man::run(args),
        Command::Movie(args) => movie::run(args),
        Command::Synchronization(args) => synchronization::run(args),
        Command::Schema(args) => schema::run(args),
        Command::Sweep(args) => sweep::run(args),
    }
}
