//! `cargo xtask test`: every test of every language, each stage counted, the sum on the last line.

use std::time::Instant;

use anyhow::{Result, bail};
use clap::Args;

use crate::counts::{Counts, Outcome};
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

/// True when nothing failed.
pub fn run(workspace: &Workspace, options: &Options) -> Result<bool> {
    let all = || STAGES.iter().chain(NIGHTLY);
    if options.list {
        for stage in all() {
            println!("{:<12} {}", stage.name, stage.about);
        }
        return Ok(true);
    }
    let is_stage = |name: &String| all().any(|stage| stage.name == name);
    if let Some(unknown) = options.only.iter().find(|name| !is_stage(name)) {
        bail!("no stage is called {unknown}; `cargo xtask test --list` names them");
    }
    let is_set = |name: &str| std::env::var(name).is_ok_and(|value| value == "1");
    let strict = options.strict || is_set("UPT_STRICT");
    let asked = |stage: &&Stage| options.only.iter().any(|name| name == stage.name);
    let (chosen, left_out): (Vec<&Stage>, &[Stage]) = match options.only.is_empty() {
        false => (all().filter(asked).collect(), &[]),
        true if is_set("UPT_NIGHTLY") => (all().collect(), &[]),
        true => (STAGES.iter().collect(), NIGHTLY),
    };

    let mut needs = vec![system::BASE];
    needs.extend(chosen.iter().map(|stage| stage.needs));
    system::provide(workspace, &needs, !options.no_install)?;

    let mut rows = Vec::new();
    for stage in chosen {
        eprintln!("== {}: {}", stage.name, stage.about);
        let start = Instant::now();
        let mut outcome = stage.outcome(workspace);
        if strict && outcome.left_out {
            outcome.counts.failed += std::mem::take(&mut outcome.counts.skipped);
        }
        let seconds = start.elapsed().as_secs_f64();
        let colon = if outcome.note.is_empty() { "" } else { ": " };
        eprintln!(
            "   {} ({seconds:.0} s){colon}{}",
            outcome.counts, outcome.note
        );
        if !outcome.log_tail.is_empty() {
            eprintln!("{}", outcome.log_tail);
        }
        rows.push((stage.name, outcome, seconds));
    }
    let skipped = || Outcome::skipped("nightly, or --only it");
    rows.extend(left_out.iter().map(|stage| (stage.name, skipped(), 0.0)));
    Ok(summarise(&rows))
}

fn summarise(rows: &[(&str, Outcome, f64)]) -> bool {
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
