//! The measured part of docs/results/performance.md: a section a bench target, between two markers.

use std::fmt::Write;

use anyhow::{Context, Result, bail};

use super::row::{Row, table};
use crate::workspace::Workspace;

const BEGIN: &str = "<!-- cargo xtask bench: begin -->";
const END: &str = "<!-- cargo xtask bench: end -->";

/// Replaces the sections of the tables that were measured; the others stay, with the machine that they name, and so
/// does what is written by hand around the markers. `partly`: rows that were not measured stay too.
pub fn write(
    workspace: &Workspace,
    quick: bool,
    partly: bool,
    tables: &[(String, Vec<Row>)],
    failed: &[String],
    notes: &[String],
) -> Result<()> {
    let path = workspace.path("docs/results/performance.md");
    let text = std::fs::read_to_string(&path)
        .with_context(|| format!("cannot read {}", path.display()))?;
    let (Some(start), Some(end)) = (text.find(BEGIN), text.find(END)) else {
        bail!(
            "{}: the markers `{BEGIN}` and `{END}` are missing",
            path.display()
        );
    };
    let how = format!(
        "Measured on {}{}.",
        machine(),
        if quick {
            ", short runs (`--quick`)"
        } else {
            ""
        }
    );
    let measured = tables
        .iter()
        .map(|(name, rows)| (name.clone(), format!("{how}\n\n{}", table(rows))))
        .collect();
    let old = sections(&text[start + BEGIN.len()..end]);
    let measured = match partly {
        true => rows_into(&old, measured),
        false => measured,
    };
    let sections = merge(old, measured);
    let mut body = String::new();
    for (name, section) in &sections {
        let _ = write!(body, "\n### {name}\n\n{}\n", section.trim());
    }
    for name in failed {
        let _ = write!(body, "\nNot measured: {name} (failed).\n");
    }
    for note in notes {
        let _ = write!(body, "\nNot measured: {note}\n");
    }
    let page = format!("{}{BEGIN}\n{body}\n{}", &text[..start], &text[end..]);
    std::fs::write(&path, page)?;
    println!("{} written", path.display());
    Ok(())
}

/// Title and text of each section; remarks of an earlier run on what it did not measure are dropped.
fn sections(body: &str) -> Vec<(String, String)> {
    body.split("\n### ")
        .skip(1)
        .map(|section| {
            let (title, text) = section.split_once('\n').unwrap_or((section, ""));
            let text: Vec<&str> = text
                .lines()
                .filter(|line| !line.starts_with("Not measured: "))
                .collect();
            (title.to_owned(), text.join("\n"))
        })
        .collect()
}

/// The sections of `new` as those of `old`, with the rows of `new` in the places of rows with the same name and behind them.
fn rows_into(old: &[(String, String)], new: Vec<(String, String)>) -> Vec<(String, String)> {
    let name = |line: &str| line.split('|').nth(1).map(str::to_owned);
    let is_row = |line: &&str| line.starts_with("| ") && !line.starts_with("| |");
    let into = |(title, text): (String, String)| {
        let Some((_, before)) = old.iter().find(|section| section.0 == title) else {
            return (title, text);
        };
        let mut rows: Vec<&str> = text.lines().filter(is_row).collect();
        let mut lines = Vec::new();
        for line in before.trim_end().lines() {
            let same = rows.iter().position(|row| name(row) == name(line));
            match same.filter(|_| is_row(&line)) {
                Some(at) => lines.push(rows.remove(at)),
                None => lines.push(line),
            }
        }
        lines.extend(rows);
        (title, lines.join("\n"))
    };
    new.into_iter().map(into).collect()
}

/// `old` with the sections of `new` in their places, new ones added; by title.
fn merge(mut old: Vec<(String, String)>, new: Vec<(String, String)>) -> Vec<(String, String)> {
    for (title, text) in new {
        match old.iter_mut().find(|section| section.0 == title) {
            Some(section) => section.1 = text,
            None => old.push((title, text)),
        }
    }
    old.sort();
    old
}

fn machine() -> String {
    let text = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let name = text
        .lines()
        .find_map(|line| line.strip_prefix("model name"))
        .map(|rest| rest.trim_start_matches([' ', '\t', ':']).to_owned());
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    format!(
        "{}, {cores} cores",
        name.unwrap_or_else(|| std::env::consts::ARCH.into())
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_of_a_part_go_to_their_places() {
        let section = |rows: &str| {
            (
                "upt: step".to_owned(),
                format!("head\n\n| | value |\n|---|---|\n{rows}"),
            )
        };
        let old = [section("| a/step | 1 |\n| b/step | 2 |\n| c/step | 3 |\n")];
        let merged = rows_into(&old, vec![section("| b/step | 5 |\n| d/step | 6 |\n")]);
        let want = section("| a/step | 1 |\n| b/step | 5 |\n| c/step | 3 |\n| d/step | 6 |");
        assert_eq!(merged, [want]);
    }

    #[test]
    fn sections_that_were_not_measured_stay() {
        let body = "\n### upt: step\n\nold step\n\nNot measured: a card\n\n### upt: kernels\n\nold kernels\n";
        let merged = merge(
            sections(body),
            vec![
                ("upt: step".into(), "new step".into()),
                ("unity-plugin: overhead".into(), "calls".into()),
            ],
        );
        let titles: Vec<&str> = merged.iter().map(|section| section.0.as_str()).collect();
        assert_eq!(
            titles,
            ["unity-plugin: overhead", "upt: kernels", "upt: step"]
        );
        assert_eq!(merged[1].1.trim(), "old kernels");
        assert_eq!(merged[2].1, "new step");
        assert!(!sections(body)[0].1.contains("Not measured"));
    }
}
