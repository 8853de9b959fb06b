//! `cargo xtask test`: every test of every language, each stage counted, the sum on the last line.

use anyhow::{Result, bail};
use clap::Args;

use crate::counts::Counts;
use crate::stages::{Outcome, STAGES, Stage};
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

struct Row {
    stage: &'static str,
    counts: Counts,
    seconds: f64,
    note: String,
}

/// True when nothing failed.
pub fn run(workspace: &Workspace, options: &Options) -> Result<bool> {
    if options.list {
        for stage in STAGES {
            println!("{:<12} {}", stage.name, stage.about);
        }
        return Ok(true);
    }
    if let Some(unknown) = options
        .only
        .iter()
        .find(|name| !STAGES.iter().any(|stage| stage.name == **name))
    {
        bail!("no stage is called {unknown}; `cargo xtask test --list` names them");
    }
    let chosen: Vec<&Stage> = STAGES
        .iter()
        .filter(|stage| {
            options.only.is_empty() || options.only.iter().any(|name| name == stage.name)
        })
        .collect();
    let nightly = std::env::var("UPT_NIGHTLY").is_ok_and(|value| value == "1");
    let (chosen, left_out): (Vec<&Stage>, Vec<&Stage>) = chosen
        .into_iter()
        .partition(|stage| !stage.nightly || nightly || !options.only.is_empty());
    let strict = options.strict || std::env::var("UPT_STRICT").is_ok_and(|value| value == "1");

    let mut groups: Vec<&[system::Package]> = vec![system::BASE];
    groups.extend(chosen.iter().flat_map(|stage| stage.needs.iter().copied()));
    let missing = system::provide(workspace, &groups, !options.no_install)?;

    let mut rows = Vec::new();
    for stage in chosen {
        eprintln!("== {}: {}", stage.name, stage.about);
        let started = std::time::Instant::now();
        let lacking: Vec<&str> = stage
            .needs
            .iter()
            .flat_map(|group| group.iter())
            .filter(|package| missing.iter().any(|name| name == package.debian))
            .map(|package| package.debian)
            .collect();
        let outcome = if lacking.is_empty() {
            (stage.run)(workspace).unwrap_or_else(|error| Outcome::failed(format!("{error:#}")))
        } else {
            Outcome::skipped(format!("needs {}", lacking.join(", ")))
        };
        let mut counts = outcome.counts;
        if strict && outcome.left_out {
            counts = Counts {
                passed: counts.passed,
                failed: counts.failed + counts.skipped,
                skipped: 0,
            };
        }
        let seconds = started.elapsed().as_secs_f64();
        eprintln!(
            "   {counts} ({seconds:.0} s){}{}",
            if outcome.note.is_empty() { "" } else { ": " },
            outcome.note
        );
        if !outcome.log_tail.is_empty() {
            eprintln!("{}", outcome.log_tail);
        }
        rows.push(Row {
            stage: stage.name,
            counts,
            seconds,
            note: outcome.note,
        });
    }
    rows.extend(left_out.iter().map(|stage| Row {
        stage: stage.name,
        counts: Counts {
            skipped: 1,
            ..Counts::default()
        },
        seconds: 0.0,
        note: "nightly, or --only it".into(),
    }));
    Ok(summarise(&rows))
}

fn summarise(rows: &[Row]) -> bool {
    println!();
    println!(
        "{:<12} {:>7} {:>7} {:>8} {:>8}",
        "stage", "passed", "failed", "skipped", "seconds"
    );
    let mut total = Counts::default();
    for row in rows {
        let first = row.note.lines().next().unwrap_or("");
        let note = if row.counts.failed + row.counts.skipped > 0 {
            first
        } else {
            ""
        };
        println!(
            "{:<12} {:>7} {:>7} {:>8} {:>8.0}  {note}",
            row.stage, row.counts.passed, row.counts.failed, row.counts.skipped, row.seconds
        );
        total += row.counts;
    }
    println!();
    println!("{total}");
    total.failed == 0
}
