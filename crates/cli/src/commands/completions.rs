//! `myovib completions`: completion scripts for shells.

use clap::Args;
use clap_complete::Shell;

use crate::exit::Exit;
use crate::output;

/// Options of `myovib completions`.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  \
    source <(myovib completions bash)")]
pub struct CompletionsArgs {
    /// The shell.
    pub shell: Shell,
}

pub fn run(args: &CompletionsArgs, mut program: clap::Command) -> anyhow::Result<Exit> {
    let mut text = Vec::new();
    clap_complete::generate(args.shell, &mut program, "myovib", &mut text);
    output::print(&text)?;
    Ok(Exit::Done)
}
