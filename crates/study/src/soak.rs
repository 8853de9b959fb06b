//! `upt-study soak`: very many steps of random contacts on one scene, with the process's memory in a log.

use std::io::Write;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Instant;

use anyhow::{Context, Result};
use gauge::resident_bytes;
use tissue::schemes::{Programme, Scheme};

use crate::bench::Bench;

#[derive(clap::Args)]
#[command(
    after_help = "Example:\n  upt-study soak --bundle onnx/brain-coarse-reduced --log soak.csv"
)]
pub struct Options {
    /// Bundle folder.
    #[arg(long)]
    bundle: PathBuf,
    /// Number of steps.
    #[arg(long, default_value_t = 1_000_000)]
    steps: u64,
    /// Steps between two lines of the log.
    #[arg(long, default_value_t = 10_000, value_parser = clap::value_parser!(u64).range(160..))]
    every: u64,
    /// The log, CSV: steps, seconds, resident memory (KiB), largest |u| (mm).
    #[arg(long)]
    log: PathBuf,
}

/// Growth of the resident memory after the first line that still counts as flat, KiB.
const FLAT_KIB: u64 = 1024;

/// Exit code 1 when memory grew or a step failed.
pub fn run(options: &Options) -> Result<ExitCode> {
    let bench = Bench::open(&options.bundle, false)
        .with_context(|| format!("{}", options.bundle.display()))?;
    let scene = bench.scene()?;
    let mut log = std::fs::File::create(&options.log)
        .with_context(|| format!("{}", options.log.display()))?;
    writeln!(log, "steps,seconds,resident_kib,largest_mm")?;
    let start = Instant::now();
    let (mut done, mut case, mut refused) = (0, 0u64, 0);
    let (mut largest, mut memory) = (0.0f32, Vec::new());
    while done < options.steps {
        let Ok(programme) = Programme::new(
            Scheme::NUMBERED[case as usize % 5],
            &bench.domain,
            200_000 + case,
        ) else {
            case += 1;
            continue;
        };
        case += 1;
        let run = bench.run(&scene, 160, |step| {
            let contact = programme.contact(step);
            (
                contact.iter().map(|c| c.node).collect(),
                contact.iter().flat_map(|c| c.displacement).collect(),
            )
        });
        if let Some(error) = run.other {
            anyhow::bail!("after {done} steps: {error}");
        }
        refused += run.refused;
        largest = largest.max(run.largest);
        if done / options.every != (done + 160) / options.every {
            let resident = resident_kib()?;
            let seconds = start.elapsed().as_secs_f64();
            writeln!(
                log,
                "{},{seconds:.1},{resident},{:.3}",
                done + 160,
                run.largest
            )?;
            memory.push(resident);
        }
        done += 160;
    }
    let (first, last) = (
        memory.first().copied().unwrap_or(0),
        memory.last().copied().unwrap_or(0),
    );
    let most = memory.iter().copied().max().unwrap_or(0);
    println!(
        "{done} steps in {:.0} s: resident memory {first} KiB after the first {} steps, {last} KiB at the end, {most} KiB \
         at most; |u| at most {largest:.2} mm; {refused} steps refused by the guard",
        start.elapsed().as_secs_f64(),
        options.every
    );
    Ok(ExitCode::from(u8::from(
        last > first + FLAT_KIB || refused > 0,
    )))
}

fn resident_kib() -> Result<u64> {
    let bytes = resident_bytes().context("resident memory is not known here: only Linux tells")?;
    Ok(bytes / 1024)
}
