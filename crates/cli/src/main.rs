//! The command `upt`: its subcommands, which the library `upt_cli` runs. A closed pipe ends it quietly.

mod completions;
mod reference;

use std::process::ExitCode;

use clap::{Parser, Subcommand};
#[cfg(not(feature = "linear"))]
use upt_cli::left_out;
use upt_cli::{
    bundle, dataset, doctor, fit, loads, materials, mesh, replay, rollout, runtime, simulate, view,
};
#[cfg(feature = "linear")]
use upt_cli::{check, corrections, export, make, modes, prior, validate};

/// Names what a build leaves out; `cargo xtask demo` builds without what it does not need.
const VERSION: &str = match cfg!(feature = "linear") {
    true => env!("CARGO_PKG_VERSION"),
    false => concat!(env!("CARGO_PKG_VERSION"), " (without linear)"),
};

macro_rules! explained {
    () => {
        "Each command explains itself: `upt make --help`. Most take --json for machine-readable output."
    };
}

/// Says first what a build is that leaves something out.
const AFTER: &str = match cfg!(feature = "linear") {
    true => explained!(),
    false => concat!(
        "This is the small `upt` that `cargo xtask demo` builds: it shows and measures bundles, and makes none. The whole command: \
         `cargo build --release -p upt-cli` in the clone, then target/release/upt.\n\n",
        explained!()
    ),
};

#[derive(Parser)]
#[command(
    name = "upt",
    version = VERSION,
    about = "Soft tissue in real time: surrogates of nonlinear FEM, and the solver that they are measured against",
    after_help = AFTER,
    arg_required_else_help = true
)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Make a bundle from an organ's surface or mesh, with a certificate.
    #[cfg(feature = "linear")]
    Make(Box<make::Options>),
    /// Left out of this small `upt`; `cargo build --release -p upt-cli` builds the whole.
    #[cfg(not(feature = "linear"))]
    Make(left_out::Options),
    /// Check a bundle on held-out contacts against the reference solver.
    #[cfg(feature = "linear")]
    Check(check::Options),
    /// Left out of this small `upt`; `cargo build --release -p upt-cli` builds the whole.
    #[cfg(not(feature = "linear"))]
    Check(left_out::Options),
    /// Show what is on this machine: ONNX Runtime, providers, CPU features, bundles.
    Doctor(doctor::Options),
    /// List bundles, and fetch those that a clone does not hold.
    Bundle(bundle::Options),
    /// Fetch ONNX Runtime for this user.
    Runtime(runtime::Options),
    /// Inspect, import and fill meshes.
    Mesh(mesh::Options),
    /// Write a trajectory for ParaView, or one frame's surface as PLY or glTF.
    #[cfg(feature = "linear")]
    Export(export::Options),
    /// Left out of this small `upt`; `cargo build --release -p upt-cli` builds the whole.
    #[cfg(not(feature = "linear"))]
    Export(left_out::Options),
    /// Compute the linear-elastic compliance columns of a mesh, from which priors and reduced bundles are made.
    #[cfg(feature = "linear")]
    Prior(prior::Options),
    /// Left out of this small `upt`; `cargo build --release -p upt-cli` builds the whole.
    #[cfg(not(feature = "linear"))]
    Prior(left_out::Options),
    /// Give a bundle the coarse space that its corrections need.
    #[cfg(feature = "linear")]
    Corrections(corrections::Options),
    /// Left out of this small `upt`; `cargo build --release -p upt-cli` builds the whole.
    #[cfg(not(feature = "linear"))]
    Corrections(left_out::Options),
    /// Compute the natural modes of a held mesh: how it swings after a release.
    #[cfg(feature = "linear")]
    Modes(modes::Options),
    /// Left out of this small `upt`; `cargo build --release -p upt-cli` builds the whole.
    #[cfg(not(feature = "linear"))]
    Modes(left_out::Options),
    /// List the schemes and the programmes of tools, with the ranges that their cases are drawn from.
    Loads(loads::Options),
    /// Fit a law to measured curves of tension, compression, shear and torsion.
    Fit(fit::Options),
    /// Hold laws and solver against measured tissue and closed forms.
    #[cfg(feature = "linear")]
    Validate(validate::Options),
    /// Left out of this small `upt`; `cargo build --release -p upt-cli` builds the whole.
    #[cfg(not(feature = "linear"))]
    Validate(left_out::Options),
    /// List tissues that a law may be named by, with their sources.
    Materials(materials::Options),
    /// Run one reference simulation and write its trajectory.
    Simulate(simulate::Options),
    /// Run many reference simulations into a folder; resumes, and splits over machines.
    Dataset(dataset::Options),
    /// Replay one contact through a bundle, with the paper's metrics.
    Rollout(rollout::Options),
    /// Step through a recorded session again, and compare it to the bit.
    Replay(replay::Options),
    /// Show a bundle in the browser: drag a tool, watch the tissue.
    View(view::Options),
    /// Print shell completions.
    Completions(completions::Options),
    /// The page docs/reference/cli.md, on stdout.
    #[command(hide = true)]
    Reference,
}

fn main() -> ExitCode {
    end_quietly_on_closed_pipe();
    // SAFETY: no other thread runs yet.
    unsafe { runtime::take() };
    let outcome = match Arguments::parse().command {
        #[cfg(feature = "linear")]
        Command::Make(options) => make::run(&options),
        #[cfg(not(feature = "linear"))]
        Command::Make(options) => left_out::run("linear", &options),
        #[cfg(feature = "linear")]
        Command::Check(options) => check::run(&options),
        #[cfg(not(feature = "linear"))]
        Command::Check(options) => left_out::run("linear", &options),
        Command::Doctor(options) => doctor::run(&options),
        Command::Bundle(options) => bundle::run(&options),
        Command::Runtime(options) => runtime::run(&options),
        Command::Mesh(options) => mesh::run(&options),
        #[cfg(feature = "linear")]
        Command::Export(options) => export::run(&options),
        #[cfg(not(feature = "linear"))]
        Command::Export(options) => left_out::run("linear", &options),
        #[cfg(feature = "linear")]
        Command::Prior(options) => prior::run(&options),
        #[cfg(not(feature = "linear"))]
        Command::Prior(options) => left_out::run("linear", &options),
        #[cfg(feature = "linear")]
        Command::Corrections(options) => corrections::run(&options),
        #[cfg(not(feature = "linear"))]
        Command::Corrections(options) => left_out::run("linear", &options),
        #[cfg(feature = "linear")]
        Command::Modes(options) => modes::run(&options),
        #[cfg(not(feature = "linear"))]
        Command::Modes(options) => left_out::run("linear", &options),
        Command::Loads(options) => loads::run(&options),
        Command::Fit(options) => fit::run(&options),
        #[cfg(feature = "linear")]
        Command::Validate(options) => validate::run(&options),
        #[cfg(not(feature = "linear"))]
        Command::Validate(options) => left_out::run("linear", &options),
        Command::Materials(options) => materials::run(&options),
        Command::Simulate(options) => simulate::run(&options),
        Command::Dataset(options) => dataset::run(&options),
        Command::Rollout(options) => rollout::run(&options),
        Command::Replay(options) => replay::run(&options),
        Command::View(options) => view::run(&options),
        Command::Completions(options) => completions::run::<Arguments>(&options),
        Command::Reference => reference::run::<Arguments>(),
    };
    outcome.unwrap_or_else(|error| {
        if let Some(code) = runtime::offer(&error) {
            return code;
        }
        eprintln!("error: {error:#}");
        ExitCode::from(2)
    })
}

/// `upt ... | head` must not panic. On Unix Rust ignores SIGPIPE at start, and the default action is put back; Windows has
/// no such signal, so there the panic of a print that finds its reader gone ends the program.
fn end_quietly_on_closed_pipe() {
    #[cfg(unix)]
    // SAFETY: no other thread runs yet, and SIG_DFL is a valid disposition of SIGPIPE.
    unsafe {
        libc::signal(libc::SIGPIPE, libc::SIG_DFL);
    }
    #[cfg(not(unix))]
    {
        let usual = std::panic::take_hook();
        std::panic::set_hook(Box::new(move |info| {
            let text = info.payload_as_str().unwrap_or_default();
            if text.starts_with("failed printing to stdout") {
                std::process::exit(0);
            }
            usual(info);
        }));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    fn without_examples(command: &clap::Command, missing: &mut Vec<String>) {
        for sub in command.get_subcommands() {
            let help = sub.get_after_help().map(ToString::to_string);
            if !sub.is_hide_set() && !help.is_some_and(|text| text.contains("Example")) {
                missing.push(sub.get_name().to_owned());
            }
            without_examples(sub, missing);
        }
    }

    #[test]
    fn every_commands_help_has_examples() {
        let command = Arguments::command();
        command.clone().debug_assert();
        let mut missing = Vec::new();
        without_examples(&command, &mut missing);
        assert!(missing.is_empty(), "without an example: {missing:?}");
    }
}
