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
    let mut script = Vec::new();
    clap_complete::generate(options.shell, &mut A::command(), "upt", &mut script);
    // Not straight to stdout: the generator panics in its own way where the reader has gone.
    print!("{}", String::from_utf8_lossy(&script));
    Ok(ExitCode::SUCCESS)
}
