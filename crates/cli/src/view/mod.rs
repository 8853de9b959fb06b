//! `upt view`: a bundle in the browser. A local page shows the organ; a tool that is dragged with the mouse presses it; the
//! library steps and its surface is streamed over a WebSocket.
//!
//! Only 127.0.0.1 is served, and only who knows the token of the printed address. What the two sides say to each other is
//! in `protocol.rs`; a bad message closes the client that sent it and nothing else.

mod breath;
mod clock;
mod http;
mod instruments;
#[cfg(feature = "linear")]
mod measured;
mod protocol;
mod server;
mod session;
mod surgery;
mod undone;

use std::net::TcpListener;
use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::{Context, Result, bail};
use clap::{Args, ValueEnum};

/// What an organ is made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Tissue {
    /// As the bundle has it.
    Paper,
    /// By measured laws.
    Measured,
}

#[derive(Args)]
#[command(
    after_help = "Examples:\n  upt view onnx/brain-reduced\n  upt view onnx/brain-fast --threads 2 --port 8080\n  upt view onnx/brain-coarse-reduced --tissue measured"
)]
pub struct Options {
    /// The bundle's folder.
    bundle: PathBuf,
    /// Tissue of a brain: paper, as the bundle has it, or measured, with laws of human cortex, ganglia, callosum and corona radiata. That bundle is made on
    /// the first call, within minutes, and kept in the user's cache.
    #[arg(long, value_enum, default_value = "paper", hide_possible_values = true)]
    tissue: Tissue,
    /// Port on 127.0.0.1; 0: any free port.
    #[arg(long, default_value_t = 0)]
    port: u16,
    /// Threads of a step.
    #[arg(long, default_value_t = 1)]
    threads: u32,
    /// Length of a step, ms, 10 to 50. Default: what the bundle recommends to hosts that show frames. A longer one leaves more of the
    /// processor to the picture.
    #[arg(long, value_name = "MS")]
    step_ms: Option<f64>,
    /// Make all corrections of a step, even where steps then fall behind the clock. A replay is then exact to the bit.
    #[arg(long)]
    exact: bool,
}

pub fn run(options: &Options) -> Result<ExitCode> {
    if let Some(ms) = options.step_ms
        && !(1e3 * upt::SHORTEST_STEP_S..=1e3 * upt::LONGEST_STEP_S).contains(&ms)
    {
        bail!("--step-ms is {ms}; a step takes 10 to 50 ms");
    }
    give_way();
    let bundle = match options.tissue {
        Tissue::Paper => options.bundle.clone(),
        #[cfg(feature = "linear")]
        Tissue::Measured => measured::folder(&options.bundle)?,
        #[cfg(not(feature = "linear"))]
        Tissue::Measured => return Err(crate::left_out::missing("linear")),
    };
    let listener = TcpListener::bind(("127.0.0.1", options.port)).with_context(|| {
        format!(
            "port {} on 127.0.0.1 cannot be opened; choose another with --port, or leave it out",
            options.port
        )
    })?;
    let model = server::open(&bundle, options.threads, options.step_ms, options.exact)?;
    let server = server::Server::new(&bundle, model, &listener)?;
    println!("{}", server.address());
    println!("open this address in a browser; Ctrl-C stops the server");
    server.serve(&listener);
    Ok(ExitCode::SUCCESS)
}

/// A page that draws on the same cores comes first: the threads that are started from here on inherit the lower priority.
#[cfg(unix)]
fn give_way() {
    // SAFETY: it takes numbers; where it fails, the priority stays.
    unsafe { libc::setpriority(libc::PRIO_PROCESS, 0, 10) };
}

#[cfg(not(unix))]
fn give_way() {}
