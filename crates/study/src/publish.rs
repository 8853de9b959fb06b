//! Where every report goes: parts of pages between their marks, the terminal as text or JSON, and what was left out.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use serde::Serialize;
use upt_cli::marks::replace_between;

/// The places that a command was asked for.
pub struct Publisher<'a> {
    /// Nothing but the report as JSON is printed.
    pub json: bool,
    /// Pages with marks.
    pub pages: &'a [PathBuf],
}

impl Publisher<'_> {
    /// A part of the report, Markdown: printed, and in each page between the marks of this name.
    pub fn part(&self, mark: &str, text: &str) -> Result<()> {
        self.say(text);
        self.write_pages(mark, text)
    }

    /// In pages alone.
    pub fn write_pages(&self, mark: &str, text: &str) -> Result<()> {
        let write = |page: &PathBuf| replace_between(page, mark, &format!("\n{text}"));
        self.pages.iter().try_for_each(write)
    }

    /// Lines for who reads the terminal.
    pub fn say(&self, text: &str) {
        if !self.json {
            println!("{}", text.trim_end());
        }
    }

    /// The end: all of the report as JSON, or what is not in it and why.
    pub fn end(&self, report: &impl Serialize, left_out: &[String]) -> Result<()> {
        if self.json {
            println!("{}", serde_json::to_string_pretty(report)?);
        }
        for note in left_out {
            self.say(&format!("left out: {note}"));
        }
        Ok(())
    }
}

/// Writes a file of a report; makes its folder.
pub fn file(path: &Path, report: &impl Serialize) -> Result<()> {
    if let Some(folder) = path.parent() {
        std::fs::create_dir_all(folder)
            .with_context(|| format!("cannot make {}", folder.display()))?;
    }
    let text = serde_json::to_string_pretty(report)? + "\n";
    std::fs::write(path, text).with_context(|| path.display().to_string())
}
