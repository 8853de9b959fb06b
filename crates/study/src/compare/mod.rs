//! `upt-study compare`: a bundle against the reference solver on the same contacts: the error over random steps without a reset, what
//! falling asleep after a release costs, and, on these and on cases from disk that the bundle was not trained on, false
//! alarms, how well the warnings rank the error, and the error of the contact force and of attached points.

mod observer;
mod outside;
mod pair;
mod picture;
mod rank;
mod release;
mod replay;
mod tables;
mod tools;

use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::{Context, Result, ensure};
use tissue::schemes::{Programme, Scheme};
use upt::Corrections;

use crate::bench::{Bench, push, ramp};
use crate::publish::Publisher;
use observer::Moment;
use pair::Pair;
use release::{CASE, HELD, Release};
use upt_cli::progress;

#[derive(clap::Args)]
#[command(after_help = "Examples:
  upt-study compare --bundle onnx/brain-coarse-reduced --markdown PAGE --images docs/results/images
  upt-study compare --bundle onnx/brain-coarse-reduced --uncorrected
  upt-study compare --bundle onnx/brain-coarse-reduced --steps 0 --tools 20
  upt-study compare --bundle onnx/brain-fast --steps 0 --held-out DATASET --held-out DATASET-S5/case-00000.trajectory.safetensors --outside DATASET-HARD/case-00000.trajectory.safetensors")]
pub struct Options {
    /// Bundle folder.
    #[arg(long)]
    bundle: PathBuf,
    /// Random steps to compare with the solver: schemes 1 to 5 in turn, 160 steps each, then contacts outside the envelope and a release. This
    /// takes minutes on a coarse mesh and an hour on a fine one. 0 leaves the solver out.
    #[arg(long, default_value_t = 1600)]
    steps: usize,
    /// Programmes of rigid tools to compare with the solver, one after another without a reset; the bundle gets only their poses.
    #[arg(long, default_value_t = 0, value_name = "COUNT")]
    tools: usize,
    /// Cases inside the envelope that the bundle was not trained on: a dataset folder (its test split) or a
    /// trajectory; may be repeated.
    #[arg(long, value_name = "PATH", num_args = 1..)]
    held_out: Vec<PathBuf>,
    /// Such cases outside the envelope.
    #[arg(long, value_name = "PATH", num_args = 1..)]
    outside: Vec<PathBuf>,
    /// Make no corrections, though the bundle recommends some: the learned part alone. Not for --tools.
    #[arg(long, conflicts_with = "tools")]
    uncorrected: bool,
    /// Page whose part between the markers `study compare NAME` is replaced, and that of --tools between `study compare --tools NAME`.
    #[arg(long)]
    markdown: Option<PathBuf>,
    /// Folder for the plots.
    #[arg(long)]
    images: Option<PathBuf>,
}

pub fn run(options: &Options) -> Result<ExitCode> {
    ensure!(
        options.steps == 0 || options.steps >= 2 * CASE,
        "--steps {} is too short to compare a later scheme with the first; give at least {}, or 0 to leave the solver out",
        options.steps,
        2 * CASE
    );
    ensure!(
        options.steps > 0 || options.tools > 0 || !options.held_out.is_empty(),
        "--steps 0 without --tools and --held-out leaves nothing to do"
    );
    let mut bench = Bench::open(&options.bundle, false)
        .with_context(|| format!("{}", options.bundle.display()))?;
    if options.uncorrected {
        bench.corrections = Corrections::None;
    }
    let (mut text, mut of_tools) = (String::new(), String::new());
    let (mut inside, mut outside) = (Vec::new(), Vec::new());
    let mut complaints = Vec::new();
    if options.steps > 0 {
        let random = random_steps(&bench, options.steps)?;
        let release = release(&bench)?;
        if !tables::schemes(&mut text, &random) {
            complaints.push("the error GROWS after the first schemes");
        }
        tables::release(&mut text, &release);
        if let Some(folder) = &options.images {
            let name = &bench.subject;
            picture::run(&folder.join(format!("{name}-compared.svg")), &random)?;
            picture::release(
                &folder.join(format!("{name}-release.svg")),
                &release.moments,
            )?;
        }
        inside.extend(random);
        outside.extend(outside::moments(&bench)?);
    }
    if options.tools > 0 {
        let driven = tools::run(&bench, &options.bundle, options.tools)?;
        if !tools::table(&mut of_tools, &driven) {
            complaints.push("the error under tools GROWS");
        }
    }
    let held_out = replay::groups(&bench, &options.held_out)?;
    let far = replay::groups(&bench, &options.outside)?;
    if !held_out.is_empty() {
        tables::cases(&mut text, &held_out, &far);
    }
    inside.extend(held_out.into_iter().flat_map(|group| group.moments));
    outside.extend(far.into_iter().flat_map(|group| group.moments));
    if inside.iter().any(Moment::alarmed) {
        complaints.push("there are FALSE ALARMS inside the envelope");
    }
    if !inside.is_empty() {
        tables::ranks(&mut text, &inside, &outside);
        tables::points(&mut text, &inside);
    }
    let publisher = Publisher {
        json: false,
        pages: options.markdown.as_slice(),
    };
    let parts = [("study compare", text), ("study compare --tools", of_tools)];
    for (what, text) in parts.iter().filter(|(_, text)| !text.is_empty()) {
        publisher.part(&format!("{what} {}", bench.subject), text)?;
    }
    for complaint in &complaints {
        publisher.say(complaint);
    }
    Ok(ExitCode::from(u8::from(!complaints.is_empty())))
}

fn random_steps(bench: &Bench, steps: usize) -> Result<Vec<Moment>> {
    let bar = progress::cases(steps / CASE, &bench.subject);
    let mut pair = Pair::new(bench)?;
    let mut moments = Vec::with_capacity(steps);
    for case in 0..steps / CASE {
        let programme = Programme::new(
            Scheme::NUMBERED[case % 5],
            &bench.domain,
            70_000 + case as u64,
        )?;
        for step in 1..=CASE {
            let contact = programme.contact(step);
            moments.push(pair.step(&contact)?);
        }
        bar.inc(1);
    }
    bar.finish_and_clear();
    Ok(moments)
}

fn release(bench: &Bench) -> Result<Release> {
    let mut pair = Pair::new(bench)?;
    let patch = bench.central()?;
    let depth = 0.7 * f64::from(bench.max_push);
    let mut moments = Vec::new();
    let mut asleep = None;
    for step in 1..=4 * HELD {
        let touch = match step {
            1..=HELD => push(&patch, patch.inward, ramp(step, depth)),
            _ => (Vec::new(), Vec::new()),
        };
        moments.push(pair.step(&pair::contact(&touch))?);
        if pair.sleeps() && asleep.is_none() {
            asleep = Some(step);
        }
    }
    Ok(Release { moments, asleep })
}
