//! `upt completions`: a completion script for the user's shell.

use std::process::ExitCode;

use anyhow::Result;
use clap::{Args, CommandFactory};
use clap_complete::Shell;

#[derive(Args)]
#[command(
    after_help = "Example:\n  upt completions bash > ~/.local/share/bash-completion/completions/upt"
)]
pub struct Options {
    shell: Shell,
}

pub fn run<A: CommandFactory>(options: &Options) -> Result<ExitCode> {
    clap_complete::generate(
        options.shell,
        &mut A::command(),
        "upt",
        &mut std::io::stdout(),
    );
    Ok(ExitCode::SUCCESS)
}
