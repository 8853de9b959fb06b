//! Writes the bindings of the C ABI from its one source, `src/ffi/`: the C header (cbindgen), the C# class, the Python
//! structs, JavaScript's table and the reference in `docs/reference/abi.md`. All are committed; the test `fresh` fails when they are stale.

pub mod csharp;
pub mod dump;
pub mod enumerations;
pub mod python;
pub mod reference;
pub mod source;
pub mod web;

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};

/// One generated file.
pub struct Output {
    /// Below the repository's root.
    pub path: &'static str,
    /// What it has to hold.
    pub text: String,
}

/// The repository's root.
pub fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .ancestors()
        .nth(2)
        .expect("the crate lies two folders below the root")
        .to_path_buf()
}

/// All generated files.
pub fn outputs() -> Result<Vec<Output>> {
    let root = root();
    let source = source::read(&root)?;
    Ok(vec![
        Output {
            path: "include/upt.h",
            text: header(&root, &source)?,
        },
        Output {
            path: "unity-plugin/Runtime/Interop/Native.g.cs",
            text: csharp::write(&source)?,
        },
        Output {
            path: "python/upt/_native.py",
            text: python::write(&source)?,
        },
        Output {
            path: "web/src/abi.js",
            text: web::write(&source)?,
        },
        Output {
            path: "docs/reference/abi.md",
            text: reference::write(&root, &source)?,
        },
    ])
}

/// `include/upt.h`.
fn header(root: &Path, source: &source::Source) -> Result<String> {
    let mut config =
        cbindgen::Config::from_file(root.join("cbindgen.toml")).map_err(anyhow::Error::msg)?;
    config.after_includes = Some(enumerations::write(source)?);
    let types = source.enumerations.iter().map(|one| one.name.clone());
    let values = source.constants.iter().filter(|one| one.of.is_some());
    config.export.exclude = types.chain(values.map(|one| one.name.clone())).collect();
    let mut builder = cbindgen::Builder::new().with_config(config);
    for file in source::FILES {
        builder = builder.with_src(root.join(source::FOLDER).join(file));
    }
    let mut bytes = Vec::new();
    builder.generate().context("cbindgen")?.write(&mut bytes);
    Ok(without_line_comments(&String::from_utf8(bytes)?))
}

/// C89 has no `//` comments; cbindgen writes them behind `extern "C"` braces and `#endif`.
fn without_line_comments(header: &str) -> String {
    let lines = header.lines().map(|line| match line.split_once(" // ") {
        Some((code, _)) => format!("{}\n", code.trim_end()),
        None => format!("{line}\n"),
    });
    lines.collect()
}
