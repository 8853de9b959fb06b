//! Parts of a page that a command writes: what stands between two marks.

use std::path::Path;

use anyhow::{Context, Result};

/// Replaces what a page has between the markers `begin: name` and `end: name`; makes the page where there is none.
pub fn replace_between(path: &Path, name: &str, text: &str) -> Result<()> {
    let (begin, end) = (
        format!("<!-- begin: {name} -->"),
        format!("<!-- end: {name} -->"),
    );
    let page = std::fs::read_to_string(path).unwrap_or_else(|_| format!("{begin}\n{end}\n"));
    let (from, to) = page.find(&begin).zip(page.find(&end)).with_context(|| {
        format!(
            "{}: the markers {begin} and {end} are missing",
            path.display()
        )
    })?;
    let page = format!("{}{begin}{text}\n{}", &page[..from], &page[to..]);
    std::fs::write(path, page).with_context(|| format!("{}", path.display()))
}
