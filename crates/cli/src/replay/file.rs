//! Reads a replay: lines of JSON (`docs/reference/formats.md`), which a scene's recording writes.

use anyhow::{Context, Result, bail, ensure};
use upt::replay::lines::{Header, Line, VERSION};

/// Header and lines of a whole file; without the last, which counts them.
///
/// # Errors
/// What is wrong, with the number of the line; a file that ends too early.
pub fn parse(text: &str) -> Result<(Header, Vec<Line<'static>>)> {
    let mut all = (1..).zip(text.lines());
    let (_, first) = all.next().context("the file is empty")?;
    let header: Header =
        serde_json::from_str(first).context("line 1 is not the first line of a replay")?;
    ensure!(
        header.upt_replay == VERSION,
        "line 1: the replay has version {}, this upt reads {VERSION}",
        header.upt_replay
    );
    let mut lines = Vec::new();
    while let Some((number, text)) = all.next() {
        let line = serde_json::from_str(text).with_context(|| format!("line {number}"))?;
        if let Line::End(count) = line {
            ensure!(
                count == lines.len() as u64,
                "line {number}: the end counts {count} lines, there are {}; some are missing",
                lines.len()
            );
            if let Some((number, _)) = all.next() {
                bail!("line {number} comes after the end");
            }
            return Ok((header, lines));
        }
        lines.push(line);
    }
    bail!(
        "the file is cut off after {} lines: its last line must be {{\"end\":COUNT}}",
        lines.len() + 1
    )
}
