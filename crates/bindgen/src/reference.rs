//! The calls, structs and constants of the C ABI as Markdown: the generated part of `docs/reference/abi.md`.

use std::fmt::Write;
use std::path::Path;

use anyhow::{Context, Result};

use crate::source::{Constant, Doc, Function, Kind, Named, Source, Struct};

const PAGE: &str = "docs/reference/abi.md";
const BEGIN: &str = "<!-- cargo xtask header: begin -->\n";
const END: &str = "<!-- cargo xtask header: end -->";

/// Headings of the calls, by the file of `src/ffi/` that holds them.
const CHAPTERS: [(&str, &str); 16] = [
    ("library.rs", "Library"),
    ("model.rs", "Models"),
    ("locate.rs", "Points of the tissue"),
    ("scene.rs", "Scenes and steps"),
    ("worker.rs", "Steps in the background"),
    ("region.rs", "Parts of the mesh"),
    ("points.rs", "Attached points"),
    ("driven.rs", "What instruments are told, and hulls"),
    ("ties.rs", "Ties and beds"),
    ("cut.rs", "Cuts, removal, stiffness"),
    ("surface.rs", "The surface of a cut body"),
    ("present.rs", "Frames between steps"),
    ("haptics.rs", "Forces for a hand"),
    ("instrument.rs", "Contact found by geometry, and forces"),
    ("state.rs", "Statistics and snapshots"),
    ("record.rs", "Recordings"),
];

/// Headings of the constants, by prefix.
const FAMILIES: [(&str, &str); 16] = [
    ("UPT_ABI_", "Version"),
    ("UPT_PROVIDER_", "Providers"),
    ("UPT_KIND_", "Model kinds"),
    ("UPT_LOG_", "Log levels"),
    ("UPT_PRECISION_", "Precisions"),
    ("UPT_KERNEL_", "Decoders"),
    ("UPT_STEP_", "Step paths"),
    ("UPT_CORRECTIONS_", "Corrections"),
    ("UPT_GUARD_", "Guard policies"),
    ("UPT_FLAG_", "Flags of a step"),
    ("UPT_SET_", "Index sets"),
    ("UPT_VIEW_", "Views"),
    ("UPT_SWITCH_", "Switches"),
    ("UPT_SHAPE_", "Instrument shapes"),
    ("UPT_MODE_", "Instrument modes"),
    ("UPT_END_", "Far ends of ties"),
];

/// The page with its generated part made anew; what people wrote around it stays.
pub fn write(root: &Path, source: &Source) -> Result<String> {
    let page =
        std::fs::read_to_string(root.join(PAGE)).with_context(|| format!("cannot read {PAGE}"))?;
    let (before, rest) = page
        .split_once(BEGIN)
        .with_context(|| format!("{PAGE}: no line `{}`", BEGIN.trim_end()))?;
    let (_, after) = rest
        .split_once(END)
        .with_context(|| format!("{PAGE}: no line `{END}`"))?;
    Ok(format!("{before}{BEGIN}{}{END}{after}", generated(source)?))
}

fn generated(source: &Source) -> Result<String> {
    let mut text = String::from("\n## Calls\n");
    let mut told = 0;
    for (file, heading) in CHAPTERS {
        write!(text, "\n### {heading}\n")?;
        for function in source.functions.iter().filter(|one| one.file == file) {
            call(&mut text, function)?;
            told += 1;
        }
    }
    anyhow::ensure!(
        told == source.functions.len(),
        "a file of src/ffi/ with calls has no heading in crates/bindgen/src/reference.rs"
    );
    text.push_str("\n## Structs\n");
    for one in &source.structs {
        fields(&mut text, one)?;
    }
    text.push_str("\n## Constants\n");
    let statuses = source.constants.iter().filter(|one| is_status(one));
    table(&mut text, "Status codes", statuses)?;
    let mut left: Vec<&Constant> = source
        .constants
        .iter()
        .filter(|one| !is_status(one))
        .collect();
    for (prefix, heading) in FAMILIES {
        let (family, others) = left
            .into_iter()
            .partition::<Vec<_>, _>(|one| one.name.starts_with(prefix));
        table(&mut text, heading, family.into_iter())?;
        left = others;
    }
    anyhow::ensure!(
        left.is_empty(),
        "{} has no heading in crates/bindgen/src/reference.rs",
        left[0].name
    );
    text.push('\n');
    Ok(text)
}

fn is_status(constant: &Constant) -> bool {
    constant.name.starts_with("UPT_ERR_") || ["UPT_OK", "UPT_PENDING"].contains(&&*constant.name)
}

fn call(text: &mut String, function: &Function) -> Result<()> {
    let result = match &function.result {
        Some(_) if returns_status(function) => "upt_status ".to_owned(),
        Some(kind) => c_type(kind),
        None => "void ".to_owned(),
    };
    let parameters: Vec<String> = function.parameters.iter().map(declared).collect();
    let parameters = if parameters.is_empty() {
        "void".to_owned()
    } else {
        parameters.join(", ")
    };
    let line = format!("{result}{}({parameters});", function.name);
    let line = if line.len() <= 100 {
        line
    } else {
        line.replace(", ", ",\n    ").replacen('(', "(\n    ", 1)
    };
    write!(
        text,
        "\n#### `{}`\n\n```c\n{line}\n```\n\n{}\n",
        function.name,
        prose(&function.doc)
    )?;
    Ok(())
}

/// Every call whose result is an `i32` returns a status; the others return text and versions.
fn returns_status(function: &Function) -> bool {
    function.result == Some(Kind::Number("i32".into()))
}

fn fields(text: &mut String, one: &Struct) -> Result<()> {
    write!(
        text,
        "\n### `{}`\n\n{}\n\n| field | type | meaning |\n|---|---|---|\n",
        one.name,
        prose(&one.doc)
    )?;
    for field in &one.fields {
        let length = match &field.kind {
            Kind::Array(_, length) => format!("[{length}]"),
            _ => String::new(),
        };
        let kind = named_type(field);
        writeln!(
            text,
            "| `{}` | `{}{length}` | {} |",
            field.name,
            kind.trim_end(),
            line(&field.doc)
        )?;
    }
    Ok(())
}

fn table<'a>(
    text: &mut String,
    heading: &str,
    constants: impl Iterator<Item = &'a Constant>,
) -> Result<()> {
    write!(
        text,
        "\n### {heading}\n\n| constant | value | meaning |\n|---|---:|---|\n"
    )?;
    for one in constants {
        writeln!(
            text,
            "| `{}` | {} | {} |",
            one.name,
            one.value,
            line(&one.doc)
        )?;
    }
    Ok(())
}

/// A doc comment as one cell of a table.
fn line(doc: &Doc) -> String {
    doc.join(" ").trim().replace('|', "\\|")
}

/// A doc comment as paragraphs; what it says of each parameter, of threads and of errors begins a line of its own.
fn prose(doc: &Doc) -> String {
    doc.iter()
        .map(|line| match line.strip_prefix("Threads: ") {
            Some(rest) => format!("\n**Threads:** {rest}"),
            None => line.replace("Threads: ", "**Threads:** "),
        })
        .map(|line| line.replace("Errors: ", "**Errors:** "))
        .map(|line| line.replace('<', "&lt;"))
        .collect::<Vec<_>>()
        .join("\n")
}

fn declared(parameter: &Named) -> String {
    format!("{}{}", named_type(parameter), parameter.name)
}

/// The type of a field or a parameter: an enumeration's own name for its integer.
fn named_type(one: &Named) -> String {
    let mut kind = one.kind.clone();
    let mut at = &mut kind;
    while let Kind::Pointer(inner, _) | Kind::Array(inner, _) = at {
        at = inner;
    }
    if let Some(name) = &one.of {
        *at = Kind::Named(name.clone());
    }
    c_type(&kind)
}

/// A type with the space or star that stands before the name.
fn c_type(kind: &Kind) -> String {
    match kind {
        Kind::Number(name) => match name.as_str() {
            "f32" => "float ".into(),
            "f64" => "double ".into(),
            integer => format!(
                "{}int{}_t ",
                if integer.starts_with('u') { "u" } else { "" },
                &integer[1..]
            ),
        },
        Kind::Named(name) => match name.as_str() {
            "c_char" => "char ".into(),
            "c_void" => "void ".into(),
            name => format!("{name} "),
        },
        Kind::Pointer(to, constant) => {
            let to = c_type(to);
            let constant = if *constant { "const " } else { "" };
            format!("{constant}{to}*")
        }
        Kind::Array(to, _) => c_type(to),
    }
}
