//! `myovib man`: manual pages in roff.

use clap::Args;

use crate::exit::Exit;
use crate::output;
use myovib_scene::InputError;

/// Options of `myovib man`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  myovib man | man -l -\n  myovib man run > myovib-run.1")]
pub struct ManArgs {
    /// Command whose manual page is printed [default: the page of the program].
    pub command: Option<String>,
}

/// Prints the manual page of `program` or of one of its commands.
pub fn run(args: &ManArgs, program: clap::Command) -> anyhow::Result<Exit> {
    let command = match &args.command {
        None => program,
        Some(name) => match program.find_subcommand(name) {
            Some(command) => command.clone().display_name(format!("myovib-{name}")),
            None => {
                let names: Vec<&str> = program.get_subcommands().map(|c| c.get_name()).collect();
                return Err(InputError::new(format!("unknown command `{name}`"))
                    .allowed(names.join(", "))
                    .into());
            }
        },
    };
    let mut text = Vec::new();
    clap_mangen::Man::new(command).render(&mut text)?;
    output::print(&text)?;
    Ok(Exit::Done)
}
