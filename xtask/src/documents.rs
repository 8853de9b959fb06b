//! The documentation in a package: README.md, CHANGELOG.md and docs/, with links that lead somewhere there.

use std::path::{Component, Path, PathBuf};

use anyhow::{Context, Result};

use crate::workspace::Workspace;

/// Where in the archive a file or folder of the repository is, seen from the folder of the documents.
const ELSEWHERE: &[(&str, &str)] = &[
    ("examples/c", "../../upt/examples/c"),
    ("examples/cpp", "../../upt/examples/cpp"),
    ("onnx", "../../upt/bundles"),
];

/// Pages beside docs/ that the package has too.
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
    list(&workspace.root, Path::new("docs"), &mut files)?;
    for file in &files {
        let (from, to) = (workspace.root.join(file), folder.join(file));
        let context = || format!("cannot copy {}", from.display());
        std::fs::create_dir_all(to.parent().context("a file has a folder")?)?;
        if file.extension().is_some_and(|extension| extension == "md") {
            let text = std::fs::read_to_string(&from).with_context(context)?;
            std::fs::write(&to, relinked(&text, file, &files)).with_context(context)?;
        } else {
            std::fs::copy(&from, &to).with_context(context)?;
        }
    }
    Ok(())
}

fn list(root: &Path, folder: &Path, files: &mut Vec<PathBuf>) -> Result<()> {
    let mut entries: Vec<_> = std::fs::read_dir(root.join(folder))?.collect::<Result<_, _>>()?;
    entries.sort_by_key(std::fs::DirEntry::file_name);
    for entry in entries {
        let path = folder.join(entry.file_name());
        if entry.path().is_dir() {
            list(root, &path, files)?;
        } else {
            files.push(path);
        }
    }
    Ok(())
}

/// A page whose links to what is not in the package are plain text, and whose links to what is elsewhere there lead to it.
fn relinked(text: &str, page: &Path, files: &[PathBuf]) -> String {
    let mut out = String::with_capacity(text.len());
    let mut rest = text;
    while let Some(open) = rest.find("](") {
        let Some(length) = rest[open + 2..].find(')') else {
            break;
        };
        let link = &rest[open + 2..open + 2 + length];
        let label = rest[..open].rfind('[');
        match (label, place(link, page, files)) {
            (_, Place::Here) | (None, _) => out.push_str(&rest[..open + length + 3]),
            (Some(_), Place::There(to)) => {
                out.push_str(&rest[..open]);
                out.push_str(&format!("]({to})"));
            }
            (Some(label), Place::Nowhere) => {
                out.push_str(rest[..label].trim_end_matches('!'));
                out.push_str(&rest[label + 1..open]);
            }
        }
        rest = &rest[open + length + 3..];
    }
    out.push_str(rest);
    out
}

enum Place {
    /// The link is right as it stands.
    Here,
    /// The target is in the package at this place, seen from the page.
    There(String),
    /// The package does not have it.
    Nowhere,
}

fn place(link: &str, page: &Path, files: &[PathBuf]) -> Place {
    let target = link.split('#').next().unwrap_or_default();
    if target.is_empty() || link.contains(':') || link.contains(char::is_whitespace) {
        return Place::Here;
    }
    let folder = page.parent().unwrap_or(Path::new(""));
    let target = normal(&folder.join(target));
    if files.contains(&target) {
        return Place::Here;
    }
    let up = "../".repeat(folder.components().count());
    for (begin, to) in ELSEWHERE {
        if let Ok(rest) = target.strip_prefix(begin) {
            let to = Path::new(to).join(rest);
            return Place::There(format!(
                "{up}{}",
                to.to_string_lossy().trim_end_matches('/')
            ));
        }
    }
    Place::Nowhere
}

/// A path without `.` and `..`.
fn normal(path: &Path) -> PathBuf {
    let mut out = PathBuf::new();
    for component in path.components() {
        match component {
            Component::ParentDir => {
                out.pop();
            }
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
