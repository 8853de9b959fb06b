//! `cargo xtask`: the repository's commands. Each does its own set-up, so that a fresh clone needs
//! nothing but Rust and Python.

mod counts;
mod ort;
mod process;
mod stages;
mod system;
mod test;
mod venv;
mod workspace;

use anyhow::Result;
use clap::{Parser, Subcommand};

use workspace::Workspace;

#[derive(Parser)]
#[command(
    name = "cargo xtask",
    about = "Set-up, tests, demo, benches and packages of libupt"
)]
struct Arguments {
    #[command(subcommand)]
    command: Task,
}

#[derive(Subcommand)]
enum Task {
    /// Run all tests of all languages, with all set-up; the last line sums them.
    #[command(
        after_help = "Examples:\n  cargo xtask test\n  cargo xtask test --only rust --only python\n  cargo xtask test --list"
    )]
    Test(test::Options),
    /// Fetch ONNX Runtime's shared library into target/ort/.
    #[command(
        after_help = "Examples:\n  cargo xtask ort\n  cargo xtask ort --platform windows-x64"
    )]
    Ort {
        /// Default: this machine's.
        #[arg(long)]
        platform: Option<ort::Platform>,
        /// A version whose checksum is in the committed table.
        #[arg(long, default_value = ort::VERSION)]
        version: String,
    },
}

fn main() -> std::process::ExitCode {
    let workspace = Workspace::find();
    match run(&workspace, Arguments::parse().command) {
        Ok(true) => std::process::ExitCode::SUCCESS,
        Ok(false) => std::process::ExitCode::FAILURE,
        Err(error) => {
            eprintln!("error: {error:#}");
            std::process::ExitCode::FAILURE
        }
    }
}

/// False when the command ran and something failed that it has already reported.
fn run(workspace: &Workspace, task: Task) -> Result<bool> {
    match task {
        Task::Test(options) => test::run(workspace, &options),
        Task::Ort { platform, version } => ort::run(workspace, platform, &version).map(|()| true),
    }
}
