//! The crates that libupt and the command link, and the texts of their licences, for the packages.
//!
//! A crate's own files are taken where it ships them. Some crates on crates.io leave the text out and only name the licence: then the
//! standard text is, with the crate's authors. A licence that is not in [`ACCEPTED`] stops the package.

use std::collections::BTreeMap;
use std::path::Path;

use anyhow::{Context, Result, bail, ensure};

use crate::process::output;
use crate::workspace::Workspace;

/// Licences under which a crate may be linked.
const ACCEPTED: &[&str] = &[
    "0BSD",
    "Apache-2.0",
    "BSD-2-Clause",
    "ISC",
    "MIT",
    // Of each file by itself: asks for the text and for where the source is, and nothing of what links it.
    "MPL-2.0",
    "Unicode-3.0",
    "Unlicense",
    "Zlib",
];

/// A linked crate.
struct Linked {
    name: String,
    version: String,
    licence: String,
    authors: String,
    texts: Vec<String>,
}

/// The notice: a list of all crates, then each text once with the crates that it is for.
pub fn notice(workspace: &Workspace) -> Result<String> {
    let mut crates = linked(workspace)?;
    let mut notice = String::from(
        "Rust crates linked into libupt and the command upt, unmodified: name, version, licence. Their source: \
         https://crates.io/crates/NAME/VERSION\n\n",
    );
    for one in &mut crates {
        ensure!(
            is_accepted(&one.licence),
            "{} {}: the licence {} is not accepted (xtask/src/licences.rs)",
            one.name,
            one.version,
            one.licence
        );
        if one.texts.is_empty() {
            one.texts.push(standard_text(workspace, one)?);
        }
        notice.push_str(&format!("{} v{} {}\n", one.name, one.version, one.licence));
    }
    let mut texts: BTreeMap<String, Vec<&str>> = BTreeMap::new();
    for one in &crates {
        for text in &one.texts {
            texts.entry(text.clone()).or_default().push(&one.name);
        }
    }
    let mut texts: Vec<_> = texts.into_iter().collect();
    texts.sort_by(|a, b| a.1.cmp(&b.1));
    for (text, names) in texts {
        let (rule, names) = ("-".repeat(80), names.join(", "));
        notice.push_str(&format!("\n{rule}\n{names}\n\n{text}\n"));
    }
    Ok(notice)
}

/// True where one side of every `AND` has an accepted choice.
fn is_accepted(expression: &str) -> bool {
    let plain = expression.replace(['(', ')'], " ").replace('/', " OR ");
    plain.split(" AND ").all(|part| {
        part.split(" OR ")
            .any(|choice| ACCEPTED.contains(&choice.trim()))
    })
}

/// What `cargo tree` links, with what `cargo metadata` says of it.
fn linked(workspace: &Workspace) -> Result<Vec<Linked>> {
    let tree = output(
        &mut workspace.cargo("tree -p upt -p upt-cli --edges normal --prefix none --format {p}"),
    )?;
    let names: Vec<(&str, &str)> = tree
        .lines()
        .filter(|line| !line.contains(" (/") && !line.contains("(proc-macro)"))
        .filter_map(|line| line.split_once(" v"))
        .filter_map(|(name, rest)| Some((name, rest.split_whitespace().next()?)))
        .collect();
    let metadata = output(&mut workspace.cargo("metadata --format-version 1"))?;
    let metadata: serde_json::Value = serde_json::from_str(&metadata)?;
    let mut crates = Vec::new();
    for package in metadata["packages"].as_array().context("packages")? {
        let text = |key: &str| package[key].as_str().unwrap_or_default().to_owned();
        let (name, version) = (text("name"), text("version"));
        if !names.contains(&(&*name, &*version)) {
            continue;
        }
        let authors: Vec<&str> = package["authors"]
            .as_array()
            .into_iter()
            .flatten()
            .filter_map(|author| author.as_str())
            .map(|author| author.split(" <").next().unwrap_or(author))
            .collect();
        let manifest = text("manifest_path");
        let folder = Path::new(&manifest).parent().context("manifest_path")?;
        crates.push(Linked {
            authors: authors.join(", "),
            licence: text("license"),
            texts: own_texts(folder)?,
            name,
            version,
        });
    }
    crates.sort_by(|a, b| (&a.name, &a.version).cmp(&(&b.name, &b.version)));
    Ok(crates)
}

/// The licence files of a crate. Of several to choose from the MIT licence is enough; notices always stay.
fn own_texts(folder: &Path) -> Result<Vec<String>> {
    let mut files: Vec<String> = std::fs::read_dir(folder)?
        .filter_map(|entry| entry.ok()?.file_name().into_string().ok())
        .filter(|name| {
            let name = name.to_uppercase();
            ["LICEN", "COPYING", "COPYRIGHT", "NOTICE", "UNLICENSE"]
                .iter()
                .any(|begin| name.starts_with(begin))
        })
        .filter(|name| folder.join(name).is_file())
        .collect();
    files.sort();
    if files.iter().any(|name| name.contains("MIT")) {
        files.retain(|name| !name.contains("APACHE") && !name.contains("UNLICENSE"));
    }
    files
        .iter()
        .map(|name| Ok(String::from_utf8_lossy(&std::fs::read(folder.join(name))?).into_owned()))
        .map(|text: Result<String>| Ok(text?.replace("\r\n", "\n").trim().to_owned()))
        .collect()
}

/// For a crate that ships no text: this repository's own copies of the two licences.
fn standard_text(workspace: &Workspace, one: &Linked) -> Result<String> {
    let read = |name: &str| std::fs::read_to_string(workspace.path(name));
    if one.licence.contains("MIT") {
        let whose = match one.authors.as_str() {
            "" => format!("the authors of {}", one.name),
            authors => authors.to_owned(),
        };
        let text = read("LICENSE-MIT")?;
        let (_, terms) = text
            .split_once("Permission is")
            .context("LICENSE-MIT has no line `Permission is`")?;
        let terms = terms.trim_end();
        return Ok(format!(
            "MIT License\n\nCopyright (c) {whose}\n\nPermission is{terms}"
        ));
    }
    if one.licence.contains("Apache-2.0") {
        return Ok(read("LICENSE-APACHE")?.trim().to_owned());
    }
    bail!(
        "{} {} ships no licence text, and there is none here for {}",
        one.name,
        one.version,
        one.licence
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_linked_crate_has_an_accepted_licence_and_its_text() {
        let notice = notice(&Workspace::find()).unwrap();
        assert!(notice.contains("\nort v"), "ort is linked");
        assert!(
            notice.contains("Copyright (c) "),
            "a text of the MIT licence"
        );
    }

    #[test]
    fn a_licence_is_accepted_where_one_choice_is() {
        for good in [
            "MIT",
            "MIT/Apache-2.0",
            "GPL-3.0 OR Zlib",
            "(MIT OR X) AND Unicode-3.0",
        ] {
            assert!(is_accepted(good), "{good}");
        }
        for bad in ["GPL-3.0", "MIT AND GPL-3.0", ""] {
            assert!(!is_accepted(bad), "{bad}");
        }
    }
}
