//! `upt-study haptics`: a simulated hand on a simulated device feels a bundle at 1 kHz; energy, force steps, call times, and the forces against
//! those of the reference solver.
//!
//! | module | what |
//! |---|---|
//! | [`device`] | the device's mass, the hand that holds it, and a clock that jitters |
//! | [`gesture`] | what the hand wants: presses, strokes, taps, two tools |
//! | [`play`] | one gesture: steps at 20 Hz, forces at 1 kHz |
//! | [`truth`] | the reference solver on the way that the tools took |
//! | [`table`] | what is shown |

mod device;
mod gesture;
mod play;
mod table;
mod truth;

use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use anyhow::{Context, Result, bail};
use tissue::mesh::{Boundary, Mesh};
use upt::{Corrections, Model, ModelOptions, SceneOptions};

use crate::publish::Publisher;
use gesture::{GESTURES, Site};
use play::Player;
use table::{Account, Row};
use upt_cli::progress;
use yardstick::bundle_folder::BundleFolder;
use yardstick::machine::{Machine, load_words};

#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  upt-study haptics onnx/brain-coarse-reduced --minutes 1 --load 2\n  upt-study haptics onnx/brain-coarse-reduced --hours 24 --within 20\n  upt-study haptics onnx/brain-reduced --minutes 10 --reference 4 --markdown PAGE --plot force.svg"
)]
pub struct Options {
    /// Bundle folder with corrections.
    bundle: PathBuf,
    /// Simulated time, minutes.
    #[arg(long, default_value_t = 1.0)]
    minutes: f64,
    /// The same in hours.
    #[arg(long, conflicts_with = "minutes")]
    hours: Option<f64>,
    /// Stop after this many minutes of wall time, and report what was simulated by then.
    #[arg(long, value_name = "MINUTES")]
    within: Option<f64>,
    /// Extra threads that only keep the machine busy.
    #[arg(long, default_value_t = 0)]
    load: usize,
    /// Length of a step, ms, 10 to 50. Default: what the bundle recommends to hosts that show frames.
    #[arg(long, value_name = "MS")]
    step_ms: Option<f64>,
    /// Seconds of each gesture that the reference solver replays; 0: none.
    #[arg(long, default_value_t = 0.0)]
    reference: f64,
    /// Age of a step when it arrives, ms.
    #[arg(long, default_value_t = 12.0)]
    latency_ms: f64,
    /// Corrections per step. Default: as many as the bundle recommends.
    #[arg(long)]
    corrections: Option<u32>,
    /// Seed of the sites and of the clock's jitter.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// A page with the markers `begin: study haptics NAME` and `end: study haptics NAME`, NAME the bundle's.
    #[arg(long)]
    markdown: Option<PathBuf>,
    /// Write the force of a stroke over time, and the solver's, as SVG; needs --reference.
    #[arg(long)]
    plot: Option<PathBuf>,
}

/// Exit code 1 when a force was not a number, or stayed when the tools had gone.
pub fn run(options: &Options) -> Result<ExitCode> {
    if options.plot.is_some() && options.reference <= 0.0 {
        bail!("--plot also shows the solver's force; say for how many seconds with --reference");
    }
    let minutes = options.hours.map_or(options.minutes, |hours| 60.0 * hours);
    if !(minutes > 0.0 && minutes <= 10_000.0) {
        bail!("--minutes is {minutes}; it must be above 0 and at most 10000");
    }
    if !(0.0..=40.0).contains(&options.latency_ms) {
        bail!("--latency-ms is {}; it must be 0 to 40", options.latency_ms);
    }
    let bundle = BundleFolder::read(&options.bundle)?;
    let mesh = Mesh::read(&bundle.mesh_file)?;
    let boundary: Boundary = bundle.boundary.parse().map_err(anyhow::Error::msg)?;
    let model = Model::open(&options.bundle, &ModelOptions::default())
        .with_context(|| options.bundle.display().to_string())?;
    let scene = SceneOptions {
        threads: 1,
        corrections: match options.corrections {
            Some(count) => Corrections::Fixed(count),
            None => Corrections::Recommended,
        },
        step_s: options
            .step_ms
            .map_or(model.info().frame_step_s, |ms| 1e-3 * ms),
        ..SceneOptions::default()
    };
    let step_ms = 1e3 * scene.step_s;
    if options.latency_ms >= step_ms {
        bail!(
            "--latency-ms is {}: a step of {step_ms:.0} ms must arrive before the next one starts",
            options.latency_ms
        );
    }
    let load = Load::start(options.load);
    let started = Instant::now();
    let seconds = 60.0 * minutes;
    let each: f64 = GESTURES.iter().map(|gesture| gesture.seconds).sum();
    let rounds = (seconds / each).ceil().max(1.0) as u64;
    let bar = progress::cases(rounds as usize * GESTURES.len(), "gestures");
    let mut rows: Vec<Row> = GESTURES
        .iter()
        .map(|gesture| Row::new(gesture.name))
        .collect();
    let mut account = Account::default();
    for round in 0..rounds {
        for (row, gesture) in rows.iter_mut().zip(&GESTURES) {
            let site = Site::new(gesture, &mesh, options.seed + round)?;
            let mut player = Player::new(&model, &scene, options.latency_ms, &site)?;
            let track = player.play(gesture, &site, true, options.seed + round)?;
            row.add(&track);
            account.add(&track);
            if round == 0 {
                let mut bare = Player::new(&model, &scene, options.latency_ms, &site)?;
                row.add_bare(&bare.play(gesture, &site, false, options.seed)?);
                if options.reference > 0.0 {
                    let seconds = options.reference.min(gesture.seconds);
                    let truth = truth::replay(&model, &mesh, boundary, &site, &track, seconds)?;
                    row.compare(&track, &truth);
                    if let (Some(path), true) = (&options.plot, gesture.shown) {
                        std::fs::write(path, table::plot(&track, &truth))
                            .with_context(|| path.display().to_string())?;
                    }
                }
            }
            bar.inc(1);
        }
        account.end_round(round);
        let spent = started.elapsed().as_secs_f64() / 60.0;
        if options.within.is_some_and(|most| spent >= most) {
            break;
        }
    }
    drop(load);
    bar.finish_and_clear();
    let text = table::markdown(&rows, &account, options.reference > 0.0);
    let publisher = Publisher {
        json: false,
        pages: options.markdown.as_slice(),
    };
    let (mark, lead) = heading(options, &bundle.name, (mesh.node_count(), step_ms));
    publisher.part(&mark, &format!("{lead}{text}"))?;
    Ok(ExitCode::from(u8::from(account.is_bad())))
}

/// Threads that spin until it is dropped.
struct Load(Arc<AtomicBool>);

impl Load {
    fn start(threads: usize) -> Load {
        let over = Arc::new(AtomicBool::new(false));
        for _ in 0..threads {
            let over = Arc::clone(&over);
            std::thread::spawn(move || {
                while !over.load(Ordering::Relaxed) {
                    std::hint::spin_loop();
                }
            });
        }
        Load(over)
    }
}

impl Drop for Load {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Relaxed);
    }
}

/// The name of the table's marks, and the sentence above it.
fn heading(options: &Options, name: &str, (nodes, step_ms): (usize, f64)) -> (String, String) {
    let machine = Machine::this();
    let lead = format!(
        "`{name}`, {nodes} nodes, steps of {step_ms:.0} ms that arrive {} ms late; {} ({} cores{}), --load {}.\n\n",
        options.latency_ms,
        machine.cpu,
        machine.cores,
        load_words(),
        options.load
    );
    let own = match options.step_ms {
        Some(ms) => format!(" --step-ms {ms}"),
        None => String::new(),
    };
    (format!("study haptics {name}{own}"), lead)
}
