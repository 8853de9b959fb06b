//! `cargo xtask test`: every test of every language, each stage counted, the sum on the last line.

use std::time::Instant;

use anyhow::{Context, Result, bail};
use clap::Args;
use serde_json::{Value, json};

use crate::counts::{Counts, Outcome};
use crate::evidence::{self, Tree};
use crate::stages::{NIGHTLY, STAGES, Stage};
use crate::system;
use crate::workspace::Workspace;

#[derive(Args)]
pub struct Options {
    /// Install no system packages; stages that lack one are skipped by name.
    #[arg(long)]
    no_install: bool,
    /// Run only this stage (repeat for several).
    #[arg(long, value_name = "STAGE")]
    only: Vec<String>,
    /// List the stages.
    #[arg(long)]
    list: bool,
    /// Count a skipped stage as failed; on when UPT_STRICT=1.
    #[arg(long)]
    strict: bool,
}

/// A stage, what it came to, and its time.
type Row = (&'static str, Outcome, f64);

/// Stages of groups, as [`STAGES`] has them.
fn all(groups: &'static [&[&[Stage]]]) -> impl Iterator<Item = &'static Stage> {
    groups.iter().copied().flatten().copied().flatten()
}

/// True when nothing failed.
pub fn run(workspace: &Workspace, options: &Options) -> Result<bool> {
    let every = || all(STAGES).chain(all(NIGHTLY));
    if options.list {
        for stage in every() {
            println!("{:<12} {}", stage.name, stage.about);
        }
        return Ok(true);
    }
    let is_stage = |name: &String| every().any(|stage| stage.name == name);
    if let Some(unknown) = options.only.iter().find(|name| !is_stage(name)) {
        bail!("no stage is called {unknown}; `cargo xtask test --list` names them");
    }
    let is_set = |name: &str| std::env::var(name).is_ok_and(|value| value == "1");
    let strict = options.strict || is_set("UPT_STRICT");
    let (only, nightly) = (&options.only, workspace.is_nightly());
    let asked = |stage: &&Stage| match only.is_empty() {
        true => nightly || !all(NIGHTLY).any(|left_out| left_out.name == stage.name),
        false => only.iter().any(|name| name == stage.name),
    };

    let tree = Tree::now(workspace);
    let mut needs = vec![system::BASE];
    needs.extend(every().filter(asked).map(|stage| stage.needs));
    system::provide(workspace, &needs, !options.no_install)?;

    let mut rows = Vec::new();
    for lanes in STAGES.iter().chain(NIGHTLY) {
        let chosen = |lane: &&'static [Stage]| lane.iter().filter(asked).collect();
        let lanes: Vec<Vec<&Stage>> = lanes.iter().map(chosen).collect();
        rows.extend(side_by_side(workspace, strict, &lanes));
    }
    if only.is_empty() {
        let left_out = all(NIGHTLY).filter(|stage| !asked(stage));
        let skipped = || Outcome::skipped("nightly, or --only it");
        rows.extend(left_out.map(|stage| (stage.name, skipped(), 0.0)));
        rows.extend(absent_bundles(workspace)?.map(|outcome| ("bundles", outcome, 0.0)));
    }
    let stages = rows.iter().map(|(name, outcome, seconds)| {
        let counts = outcome.counts;
        let row = json!({
            "passed": counts.passed,
            "failed": counts.failed,
            "skipped": counts.skipped,
            "seconds": seconds.round(),
            "note": outcome.note,
        });
        ((*name).to_owned(), row)
    });
    evidence::write(workspace, &tree, stages.collect())?;
    Ok(summarise(&rows))
}

/// The bundles of `onnx/index.json` that this clone does not hold, which tests over all of `onnx/` go without.
fn absent_bundles(workspace: &Workspace) -> Result<Option<Outcome>> {
    let folder = workspace.root.join("onnx");
    let path = folder.join("index.json");
    let text = std::fs::read_to_string(&path).with_context(|| path.display().to_string())?;
    let index: Value = serde_json::from_str(&text).with_context(|| path.display().to_string())?;
    let names = index["assets"]
        .as_object()
        .into_iter()
        .flat_map(|assets| assets.keys());
    let is_absent = |name: &&String| !folder.join(name).join("bundle.json").is_file();
    let absent: Vec<&str> = names.filter(is_absent).map(String::as_str).collect();
    if absent.is_empty() {
        return Ok(None);
    }
    let mut outcome = Outcome::skipped(&format!(
        "not in this clone, `upt bundle get NAME --out onnx`: {}",
        absent.join(", ")
    ));
    outcome.counts.skipped = absent.len() as u64;
    Ok(Some(outcome))
}

/// Lanes at the same time, the stages of each one after another.
fn side_by_side(workspace: &Workspace, strict: bool, lanes: &[Vec<&'static Stage>]) -> Vec<Row> {
    let run = |lane: &Vec<&'static Stage>| -> Vec<Row> {
        let rows = lane.iter().map(|stage| run_stage(workspace, strict, stage));
        rows.collect()
    };
    std::thread::scope(|scope| {
        let running: Vec<_> = lanes
            .iter()
            .map(|lane| scope.spawn(move || run(lane)))
            .collect();
        let joined = running.into_iter().map(std::thread::ScopedJoinHandle::join);
        joined
            .flat_map(|rows| rows.unwrap_or_else(|panic| std::panic::resume_unwind(panic)))
            .collect()
    })
}

fn run_stage(workspace: &Workspace, strict: bool, stage: &'static Stage) -> Row {
    let name = stage.name;
    eprintln!("== {name}: {}", stage.about);
    let start = Instant::now();
    let mut outcome = stage.outcome(workspace);
    if strict && outcome.left_out {
        outcome.counts.failed += std::mem::take(&mut outcome.counts.skipped);
    }
    let seconds = start.elapsed().as_secs_f64();
    let colon = if outcome.note.is_empty() { "" } else { ": " };
    eprintln!(
        "   {name}: {} ({seconds:.0} s){colon}{}",
        outcome.counts, outcome.note
    );
    if !outcome.log_tail.is_empty() {
        eprintln!("{}", outcome.log_tail);
    }
    (name, outcome, seconds)
}

fn summarise(rows: &[Row]) -> bool {
    println!(
        "\n{:<12} {:>7} {:>7} {:>8} {:>8}",
        "stage", "passed", "failed", "skipped", "seconds"
    );
    let mut total = Counts::default();
    for (stage, outcome, seconds) in rows {
        let counts = outcome.counts;
        let (passed, failed, skipped) = (counts.passed, counts.failed, counts.skipped);
        let note = match failed + skipped {
            0 => "",
            _ => outcome.note.lines().next().unwrap_or(""),
        };
        println!("{stage:<12} {passed:>7} {failed:>7} {skipped:>8} {seconds:>8.0}  {note}");
        total += counts;
    }
    println!("\n{total}");
    total.failed == 0
}
