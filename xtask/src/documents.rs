//! The documentation in a package: README.md, CHANGELOG.md and docs/, with links that lead somewhere there.

use std::path::{Component, Path, PathBuf};

use anyhow::Result;
use walkdir::WalkDir;

use crate::package;
use crate::workspace::Workspace;

/// Where in the archive a file or folder of the repository is, seen from the folder of the documents.
const ELSEWHERE: &[(&str, &str)] = &[
    ("examples/c", "../../upt/examples/c"),
    ("examples/cpp", "../../upt/examples/cpp"),
    ("onnx", "../../upt/bundles"),
];

/// Pages outside docs/ that the package has too.
const PAGES: &[&str] = &[
    "README.md",
    "CHANGELOG.md",
    "CONTRIBUTING.md",
    "NOTICE",
    "examples/README.md",
    "python/README.md",
    "unity-plugin/Documentation~/index.md",
];

/// Copies the pages and pictures into `folder`, each at its place in the repository.
pub fn copy(workspace: &Workspace, folder: &Path) -> Result<()> {
    let mut files: Vec<PathBuf> = PAGES.iter().map(PathBuf::from).collect();
    for entry in WalkDir::new(workspace.path("docs")) {
        let entry = entry?;
        if entry.file_type().is_file() {
            files.push(entry.path().strip_prefix(&workspace.root)?.into());
        }
    }
    for file in &files {
        package::copy(&workspace.root.join(file), &folder.join(file))?;
        if file.extension().is_some_and(|extension| extension == "md") {
            let text = std::fs::read_to_string(workspace.root.join(file))?;
            std::fs::write(folder.join(file), relinked(&text, file, &files))?;
        }
    }
    Ok(())
}

/// A page whose links to what is not in the package are plain text, and whose links to what is elsewhere there lead to it.
fn relinked(text: &str, page: &Path, files: &[PathBuf]) -> String {
    let mut out = String::with_capacity(text.len());
    let mut rest = text;
    while let Some((before, after)) = rest.split_once("](") {
        let Some((link, behind)) = after.split_once(')') else {
            break;
        };
        match (before.rfind('['), place(link, page, files)) {
            (None, _) => out.push_str(&format!("{before}]({link})")),
            (Some(_), Some(to)) => out.push_str(&format!("{before}]({to})")),
            (Some(label), None) => {
                out.push_str(before[..label].trim_end_matches('!'));
                out.push_str(&before[label + 1..]);
            }
        }
        rest = behind;
    }
    out + rest
}

/// Where a link of a page leads in the package; none where the package does not have its target.
fn place(link: &str, page: &Path, files: &[PathBuf]) -> Option<String> {
    let target = link.split('#').next().unwrap_or_default();
    if target.is_empty() || link.contains(':') || link.contains(char::is_whitespace) {
        return Some(link.into());
    }
    let folder = page.parent().unwrap_or(Path::new(""));
    let target = normal(&folder.join(target));
    if files.contains(&target) {
        return Some(link.into());
    }
    let up = "../".repeat(folder.components().count());
    let elsewhere = ELSEWHERE.iter().find_map(|(begin, to)| {
        let to = Path::new(to).join(target.strip_prefix(begin).ok()?);
        Some(to.to_string_lossy().trim_end_matches('/').to_owned())
    });
    elsewhere.map(|to| up + &to)
}

/// A path without `.` and `..`.
fn normal(path: &Path) -> PathBuf {
    let mut out = PathBuf::new();
    for component in path.components() {
        match component {
            Component::ParentDir => drop(out.pop()),
            Component::CurDir => {}
            other => out.push(other),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn links_lead_to_the_package_or_become_text() {
        let files = ["README.md", "docs/a.md"].map(PathBuf::from);
        let text = "[a](docs/a.md#b) [`c`](examples/c), [rust](src/lib.rs) [web](https://x.org) ![p](p.png)";
        assert_eq!(
            relinked(text, Path::new("README.md"), &files),
            "[a](docs/a.md#b) [`c`](../../upt/examples/c), rust [web](https://x.org) p"
        );
        assert_eq!(
            relinked(
                "[r](../README.md) [m](../onnx/x)",
                Path::new("docs/a.md"),
                &files
            ),
            "[r](../README.md) [m](../../../upt/bundles/x)"
        );
    }
}
