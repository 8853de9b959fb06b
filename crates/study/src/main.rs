//! The study of libupt: what measures us, and not a user's bundle. Cases, what drives them, and figures of both; its tables are the
//! pages of `docs/results/`. Not published; `cargo xtask study` runs it.
//!
//! One file or folder a subcommand: each has its options (`clap::Args`) and `run(options) -> anyhow::Result<ExitCode>`.
//! Exit codes: 0 done; 1 the command ran and its finding is bad (`stress`); 2 wrong usage or input.

mod bench;
mod beside;
mod compare;
mod cuts;
mod date;
mod envelope;
mod hang_report;
mod haptics;
mod load_report;
mod mobilise_report;
mod posed;
mod publish;
mod report;
mod shown;
mod soak;
mod stress;
mod table;
mod tools;

use std::process::ExitCode;

use clap::{Parser, Subcommand};
use upt_cli::{dataset, rollout, runtime, simulate};

#[derive(Parser)]
#[command(
    name = "upt-study",
    version,
    about = "What libupt comes to: errors, times, abuse, against the reference solver",
    arg_required_else_help = true
)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Compare bundles and plain methods on the same contacts: error against run time.
    Report(report::Options),
    /// Find out which rigid tools a bundle is good for, and write them into its manifest.
    Envelope(envelope::Options),
    /// Run stiff and extreme cases, and say whether each ended as it should.
    Stress(stress::Options),
    /// Run a bundle and the reference solver side by side: error over random steps, warnings, forces, release.
    Compare(compare::Options),
    /// Let a simulated hand feel a bundle at 1 kHz: energy, force steps, call times, forces against the reference solver.
    Haptics(haptics::Options),
    /// Make many steps on one scene and log the memory.
    Soak(soak::Options),
    /// `upt simulate`: a case for a report.
    Simulate(simulate::Options),
    /// `upt dataset`: many of them.
    Dataset(dataset::Options),
    /// `upt rollout`: what a report of one case must agree with.
    #[command(hide = true)]
    Rollout(rollout::Options),
}

fn main() -> ExitCode {
    // SAFETY: no other thread runs yet.
    unsafe { runtime::take() };
    let outcome = match Arguments::parse().command {
        Command::Report(options) => report::run(&options),
        Command::Envelope(options) => envelope::run(&options),
        Command::Stress(options) => stress::run(&options),
        Command::Compare(options) => compare::run(&options),
        Command::Haptics(options) => haptics::run(&options),
        Command::Soak(options) => soak::run(&options),
        Command::Simulate(options) => simulate::run(&options),
        Command::Dataset(options) => dataset::run(&options),
        Command::Rollout(options) => rollout::run(&options),
    };
    outcome.unwrap_or_else(|error| {
        if let Some(code) = runtime::offer(&error) {
            return code;
        }
        eprintln!("error: {error:#}");
        ExitCode::from(2)
    })
}
