//! `upt dataset`: many cases in a folder, resumable and shardable (docs/guide/datasets.md).

use crate::counted::counted;
use crate::simulate::SolverArguments;
use crate::{loads, tool_size};
use anyhow::{Context, Result, bail};
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use tissue::dataset::{Dataset, DatasetPlan, Load};
use tissue::mesh::{Boundary, Mesh};
use tissue::programmes::{ToolProgramme, ToolScale};
use tissue::schemes::{FRAME_S, Scheme};
use tissue::solver::SolverOptions;
use yardstick::tool_scale::Chosen;

#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  upt dataset --mesh onnx/meshes/brain-coarse.mesh.safetensors --schemes 1-4 --count 200 --out data/coarse\n  upt dataset --mesh brain.mesh.safetensors --schemes probe --count 40 --shard 0/4 --out data/probe\n  upt dataset --mesh brain.mesh.safetensors --columns brain.columns.safetensors --schemes static,static-two --count 100 --out data/statics\n  upt dataset --mesh brain.mesh.safetensors --tools all --count 50 --out data/tools"
)]
pub struct Options {
    /// Mesh file (*.mesh.safetensors).
    #[arg(long)]
    mesh: PathBuf,
    /// Held nodes: `fixed` or `supported`.
    #[arg(long, default_value = "fixed")]
    boundary: Boundary,
    #[arg(long, help = loads::schemes_help(), value_parser = Scheme::parse_list, required_unless_present = "tools")]
    schemes: Option<std::vec::Vec<Scheme>>,
    #[arg(long, help = loads::programmes_help(), value_parser = ToolProgramme::parse_list)]
    tools: Option<std::vec::Vec<ToolProgramme>>,
    #[command(flatten)]
    sizes: tool_size::Arguments,
    /// Number of cases over all shards.
    #[arg(long)]
    count: usize,
    /// Seed of the dataset.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Folder; an interrupted run resumes where it stopped.
    #[arg(long)]
    out: PathBuf,
    /// Cases computed at a time, one thread each.
    #[arg(long, default_value_t = 1)]
    jobs: usize,
    /// Compute only the cases of shard `i/n`, counted from 0.
    #[arg(long, value_parser = parse_shard, default_value = "0/1")]
    shard: (usize, usize),
    /// Store displacements as f16.
    #[arg(long)]
    half: bool,
    /// Time between recorded frames of --tools, ms; it must divide the step of 50 ms. `cargo xtask study report --shown` needs shorter frames.
    #[arg(long, default_value_t = 1e3 * FRAME_S, requires = "tools", conflicts_with = "schemes")]
    frame_ms: f64,
    /// Inner step of the split `train`, ms; held-out cases keep `--inner-step-ms`. Needs `--train-mass-scaling-ms`.
    #[arg(long, requires = "train_mass_scaling_ms")]
    train_inner_step_ms: Option<f64>,
    /// Mass scaling of the split `train`, ms; held-out cases keep `--mass-scaling-ms`.
    #[arg(long, requires = "train_inner_step_ms")]
    train_mass_scaling_ms: Option<f64>,
    /// File of `upt prior` for this mesh and boundary; the static schemes need it.
    #[arg(long)]
    columns: Option<PathBuf>,
    #[command(flatten)]
    solver: SolverArguments,
}

impl Options {
    /// Schemes, then programmes of tools.
    fn loads(&self) -> Vec<Load> {
        let schemes = self.schemes.iter().flatten().map(|s| Load::Scheme(*s));
        let tools = self.tools.iter().flatten().map(|t| Load::Tools(*t));
        schemes.chain(tools).collect()
    }

    fn frames_per_step(&self) -> anyhow::Result<usize> {
        let step_ms = 1e3 * FRAME_S;
        let count = (step_ms / self.frame_ms).round();
        let whole = count >= 1.0 && (count * self.frame_ms - step_ms).abs() < 1e-6 * step_ms;
        if !whole {
            bail!(
                "--frame-ms {}: it must divide a step of {step_ms} ms, such as 5",
                self.frame_ms
            );
        }
        Ok(count as usize)
    }

    /// Solver settings of the split `train`, where they differ.
    fn training(&self) -> Option<SolverOptions> {
        let (step, scaling) = (self.train_inner_step_ms?, self.train_mass_scaling_ms?);
        Some(SolverOptions {
            inner_step_s: step * 1e-3,
            mass_scaling_s: scaling * 1e-3,
            ..self.solver.options(1)
        })
    }
}

fn parse_shard(text: &str) -> Result<(usize, usize), String> {
    text.split_once('/')
        .and_then(|(i, n)| Some((i.parse().ok()?, n.parse().ok()?)))
        .filter(|(i, n)| i < n)
        .ok_or_else(|| format!("--shard `{text}`: write i/n with i from 0 to n - 1"))
}

pub fn run(options: &Options) -> Result<ExitCode> {
    if options.jobs == 0 {
        bail!("--jobs must be at least 1");
    }
    let mesh = Mesh::read(&options.mesh)?;
    let tool_scale = match &options.tools {
        Some(_) => {
            let sizes = Chosen::of(options.sizes.tool_scale, &mesh, None);
            eprintln!("{}", sizes.words());
            sizes.scale
        }
        None => ToolScale::TABLE,
    };
    let plan = DatasetPlan {
        boundary: options.boundary,
        loads: options.loads(),
        count: options.count,
        seed: options.seed,
        half: options.half,
        frames_per_step: options.frames_per_step()?,
        tool_scale,
        training: options.training(),
        columns: options.columns.clone(),
        options: options.solver.options(1),
    };
    let dataset = Dataset::open(&plan, &mesh, &options.out)?;
    let pending = dataset.pending(options.shard.0, options.shard.1);
    // A case of equilibria or tools has fewer frames than a motion of a scheme.
    let frames = |index: usize| (plan.frames_per_step * (plan.load(index).frames() - 1)) as u64;
    let total = pending.iter().map(|case| frames(case.index)).sum();
    let bar =
        indicatif::ProgressBar::new(total).with_style(indicatif::ProgressStyle::with_template(
            "{bar:40} {msg}, {percent} %, {elapsed} gone, {eta} left",
        )?);
    bar.set_message(format!("0/{} cases", pending.len()));
    let next = AtomicUsize::new(0);
    let finished = AtomicUsize::new(0);
    let failure = Mutex::new(None);
    let manifest_turn = Mutex::new(());
    std::thread::scope(|scope| {
        for _ in 0..options.jobs.min(pending.len()) {
            scope.spawn(|| {
                while let Some(case) = pending.get(next.fetch_add(1, Ordering::Relaxed)) {
                    let mut reached = 0;
                    let outcome = dataset.compute(case, |frame| {
                        bar.inc(frame as u64 - reached);
                        reached = frame as u64;
                    });
                    let written = outcome.and_then(|record| {
                        let _turn = manifest_turn.lock();
                        dataset.write_manifest().map(|_| record)
                    });
                    match written {
                        Ok(record) => {
                            bar.inc(frames(case.index) - reached);
                            let count = finished.fetch_add(1, Ordering::Relaxed) + 1;
                            bar.set_message(format!("{count}/{} cases", pending.len()));
                            if let Some(cause) = record.cause {
                                bar.suspend(|| {
                                    eprintln!("case {} failed: {cause}", record.case.index)
                                });
                            }
                            for skipped in &record.skipped {
                                bar.suspend(|| eprintln!("case {}: {skipped}", record.case.index));
                            }
                        }
                        Err(error) => {
                            // Nothing more can be written: let the others finish their case.
                            next.store(pending.len(), Ordering::Relaxed);
                            if let Ok(mut slot) = failure.lock() {
                                *slot = Some(error);
                            }
                        }
                    }
                }
            });
        }
    });
    bar.finish_and_clear();
    if let Some(error) = failure.into_inner().ok().flatten() {
        return Err(error)
            .context("the dataset is incomplete; run the same command again to continue");
    }
    let manifest = dataset.write_manifest()?;
    let with = |status: &str| manifest.cases.iter().filter(|c| c.status == status).count();
    println!(
        "{}: {} done, {} failed, {} pending of {}",
        options.out.display(),
        with("done"),
        with("failed"),
        with("pending"),
        counted(manifest.cases.len(), "case")
    );
    Ok(ExitCode::SUCCESS)
}
