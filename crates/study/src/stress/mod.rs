//! `upt-study stress`: a fixed suite of stiff and extreme cases for the reference solver and for bundles, as a table: what was
//! done, what happened, and whether that is what must happen. Exit code 1 when a verdict is bad.

mod half;
mod inputs;
mod outside;
mod reference;
mod row;
mod storm;
mod surrogate;
mod tools;

use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::{Context, Result};

use crate::publish::{self, Publisher};
use crate::table::{Column, Table};
pub use row::{Row, Verdict};
use upt_cli::counted::counted;

#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  upt-study stress --quick\n  upt-study stress --bundle onnx/brain-reduced --bundle onnx/brain-fast --markdown PAGE\n  upt-study stress --no-reference --sudden --bundle onnx/brain-reduced\n  upt-study stress --no-reference --sudden deep,cut --bundle onnx/brain-reduced"
)]
pub struct Options {
    /// Bundle folders to stress. Default: only the reference solver.
    #[arg(long = "bundle")]
    bundles: Vec<PathBuf>,
    /// Mesh of the reference cases. Default: an ellipsoid phantom.
    #[arg(long)]
    mesh: Option<PathBuf>,
    /// Leave out the reference solver.
    #[arg(long)]
    no_reference: bool,
    /// Of bundles only the rows that a step could lose or that take longest, or those of some kinds.
    #[arg(long, value_enum, num_args = 0.., value_delimiter = ',', value_name = "KIND")]
    sudden: Option<Vec<tools::Sudden>>,
    /// Make a twentieth of the steps, for tests.
    #[arg(long)]
    quick: bool,
    /// Rows as JSON.
    #[arg(long)]
    json: Option<PathBuf>,
    /// The tables as a page; text outside its markers is kept.
    #[arg(long)]
    markdown: Option<PathBuf>,
}

pub fn run(options: &Options) -> Result<ExitCode> {
    let mut rows = Vec::new();
    if !options.no_reference {
        rows.extend(reference::rows(options.mesh.as_deref(), options.quick)?);
    }
    for bundle in &options.bundles {
        let found = match &options.sudden {
            Some(kinds) => surrogate::sudden_rows(bundle, options.quick, kinds),
            None => surrogate::rows(bundle, options.quick),
        };
        rows.extend(found.with_context(|| format!("{}", bundle.display()))?);
    }
    // What happened is long: it comes last.
    let [subject, case, happened, verdict] = COLUMNS;
    let columns = [subject, case, verdict, happened];
    let publisher = Publisher {
        json: false,
        pages: options.markdown.as_slice(),
    };
    publisher.say(&Table::of(&[0, 1, 2, 3], &columns, &rows).text());
    publisher.write_pages("study stress", &markdown(&rows))?;
    if let Some(path) = &options.json {
        publish::file(path, &rows)?;
    }
    let bad = rows.iter().filter(|r| r.verdict == Verdict::Bad).count();
    let left = rows.iter().filter(|r| r.verdict == Verdict::Left).count();
    println!(
        "{}: {} as it should be, {bad} not, {left} left out",
        counted(rows.len(), "case"),
        rows.len() - bad - left
    );
    Ok(ExitCode::from(u8::from(bad > 0)))
}

fn word(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Good => "good",
        Verdict::Bad => "BAD",
        Verdict::Left => "left out",
    }
}

const COLUMNS: [Column<Row>; 4] = [
    ("subject", |row| row.subject.clone()),
    ("case", |row| row.case.clone()),
    ("what happened", |row| row.happened.clone()),
    ("verdict", |row| word(row.verdict).into()),
];

fn markdown(rows: &[Row]) -> String {
    let of_one = rows.chunk_by(|a, b| a.subject == b.subject).map(|own| {
        let table = Table::of(&[0, 1, 2], &COLUMNS[1..], own).markdown();
        format!("### {}\n\n{table}", own[0].subject)
    });
    of_one.collect::<Vec<_>>().join("\n")
}
