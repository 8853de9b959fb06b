//! The measured part of a page: a section a bench target, between two markers.

use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::Path;

use anyhow::Result;

use crate::workspace::write_between_markers;

/// Title and text of each section.
type Sections = BTreeMap<String, String>;

/// What a run came to.
#[derive(Default)]
pub struct Measured {
    /// Tables by the title of their section.
    pub tables: Sections,
    /// What was not measured, and why.
    pub notes: Vec<String>,
}

/// Replaces the sections of the tables that were measured; the others stay, with the machine that they name, and so
/// does what is written by hand around the markers. `partly`: rows that were not measured stay too.
pub fn write(page: &Path, quick: bool, partly: bool, measured: &Measured) -> Result<()> {
    let short = match quick {
        true => ", short runs (`--quick`)",
        false => "",
    };
    let how = format!("Measured on {}{short}.", machine());
    write_between_markers(page, "bench", |old| {
        let mut sections = sections(old);
        for (title, table) in &measured.tables {
            let old = sections.get(title).filter(|_| partly);
            let new = match old {
                Some(old) => rows_into(old, table),
                None => format!("{how}\n\n{table}"),
            };
            sections.insert(title.clone(), new);
        }
        let mut body = String::new();
        for (title, text) in &sections {
            write!(body, "\n### {title}\n\n{}\n", text.trim())?;
        }
        for note in &measured.notes {
            write!(body, "\nNot measured: {note}\n")?;
        }
        Ok(body + "\n")
    })
}

/// The sections of a page; remarks of an earlier run on what it did not measure are dropped.
fn sections(body: &str) -> Sections {
    let sections = body.split("\n### ").skip(1).map(|section| {
        let (title, text) = section.split_once('\n').unwrap_or((section, ""));
        let stays = |line: &&str| !line.starts_with("Not measured: ");
        let text: Vec<&str> = text.lines().filter(stays).collect();
        (title.to_owned(), text.join("\n"))
    });
    sections.collect()
}

/// A section with the rows of a table in the places of rows with the same name and behind them.
fn rows_into(section: &str, table: &str) -> String {
    let name = |line: &str| line.split('|').nth(1).map(str::to_owned);
    let is_row = |line: &&str| line.starts_with("| ") && !line.starts_with("| |");
    let mut rows: Vec<&str> = table.lines().filter(is_row).collect();
    let mut lines = Vec::new();
    for line in section.trim_end().lines() {
        let same = rows.iter().position(|row| name(row) == name(line));
        lines.push(match same.filter(|_| is_row(&line)) {
            Some(at) => rows.remove(at),
            None => line,
        });
    }
    lines.extend(rows);
    lines.join("\n")
}

fn machine() -> String {
    let text = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let name = text
        .lines()
        .find_map(|line| line.strip_prefix("model name"));
    let name = name.map(|rest| rest.trim_start_matches([' ', '\t', ':']));
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    format!("{}, {cores} cores", name.unwrap_or(std::env::consts::ARCH))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_of_a_part_go_to_their_places() {
        let section = |rows: &str| format!("head\n\n| | value |\n|---|---|\n{rows}");
        let old = section("| a/step | 1 |\n| b/step | 2 |\n| c/step | 3 |\n");
        let merged = rows_into(&old, &section("| b/step | 5 |\n| d/step | 6 |\n"));
        let want = section("| a/step | 1 |\n| b/step | 5 |\n| c/step | 3 |\n| d/step | 6 |");
        assert_eq!(merged, want);
    }

    #[test]
    fn sections_are_read_without_remarks() {
        let body = "\n### upt: step\n\nold step\n\nNot measured: a card\n\n### upt: kernels\n\nold kernels\n";
        let read = sections(body);
        let names: Vec<&str> = read.keys().map(String::as_str).collect();
        assert_eq!(names, ["upt: kernels", "upt: step"]);
        assert_eq!(read["upt: step"].trim(), "old step");
    }
}
