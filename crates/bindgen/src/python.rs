//! The Python bindings: enums, ctypes structs with typed attributes, and the signature of each function.

use std::fmt::Write;

use anyhow::{Result, bail};

use crate::source::{Constant, Doc, Function, Kind, Named, Source, Struct};

const HEAD: &str = "\
# Written by `cargo xtask header` from src/ffi/; conventions: docs/reference/abi.md.
# SPDX-License-Identifier: Apache-2.0 OR MIT
\"\"\"The C ABI in Python: enums, structs and the signature of each function.\"\"\"

from __future__ import annotations

import ctypes
import os
from collections.abc import Sequence
from enum import IntEnum, IntFlag
from typing import Any, TypedDict

from upt._record import Record, boolean, choice, corrections, numbers, switch, text, vector

";

/// The whole file.
pub fn write(source: &Source) -> Result<String> {
    let mut out = String::from(HEAD);
    for constant in &source.constants {
        if constant.of.is_none() {
            let name = constant.name.trim_start_matches("UPT_");
            writeln!(out, "{name} = {}", constant.value)?;
            docstring(&mut out, 0, &constant.doc);
        }
    }
    enums(&mut out, source)?;
    for item in &source.structs {
        structure(&mut out, source, item)?;
        if item.name.ends_with("_options") {
            keywords(&mut out, source, item)?;
        }
    }
    out.push_str(
        "\n\n#: Name: (result, parameters).\nFUNCTIONS: dict[str, tuple[Any, list[Any]]] = {\n",
    );
    for item in &source.functions {
        function(&mut out, source, item)?;
    }
    out.push_str("}\n");
    Ok(out)
}

/// `upt_scene_stats` is `SceneStats`.
fn camel(name: &str) -> String {
    let words = name.trim_start_matches("upt_").split('_');
    words
        .map(|word| {
            let (first, rest) = word.split_at(word.len().min(1));
            first.to_uppercase() + rest
        })
        .collect()
}

fn enums(out: &mut String, source: &Source) -> Result<()> {
    for one in &source.enumerations {
        let name = camel(&one.name);
        let base = if name == "Flag" { "IntFlag" } else { "IntEnum" };
        let members: Vec<&Constant> = source.values(&one.name).collect();
        writeln!(out, "\n\nclass {name}({base}):")?;
        let of = members[0].name.trim_start_matches("UPT_");
        let prefix = of.split('_').next().unwrap_or(of);
        let prefix = if name == "Status" { "ERR" } else { prefix };
        writeln!(
            out,
            "    \"\"\"`UPT_{prefix}_*`. {}\"\"\"\n",
            one.doc.join("\n    ")
        )?;
        for constant in members {
            let member = constant.name.trim_start_matches("UPT_");
            let member = member.strip_prefix(&format!("{prefix}_")).unwrap_or(member);
            writeln!(out, "    {member} = {}", constant.value)?;
            docstring(out, 4, &constant.doc);
        }
    }
    Ok(())
}

/// How a field is seen from Python.
struct Seen {
    /// The annotation of the attribute.
    annotation: String,
    /// What a keyword argument may be.
    accepts: String,
    /// The descriptor over the raw field; none: the raw field itself.
    descriptor: Option<String>,
    /// The ctypes type of the raw field.
    raw: String,
}

fn seen(source: &Source, item: &Struct, field: &Named) -> Result<Seen> {
    let raw = ctype(source, &field.kind)?;
    let name = &field.name;
    let of = |annotation: &str, accepts: &str, descriptor: Option<String>| Seen {
        annotation: annotation.into(),
        accepts: accepts.into(),
        descriptor,
        raw: raw.clone(),
    };
    Ok(match &field.kind {
        Kind::Number(number) => match field.of.as_deref().map(camel) {
            Some(class) if class == "Switch" => of(
                "bool | None",
                "bool | None",
                Some(format!("switch(\"_{name}\")")),
            ),
            Some(class) => of(
                &class,
                &format!("{class} | str | int"),
                Some(format!("choice(\"_{name}\", {class})")),
            ),
            None if number.starts_with('f') => of("float", "float", None),
            None if number == "u8" && field.doc.iter().any(|line| line.contains("1: ")) => {
                of("bool", "bool", Some(format!("boolean(\"_{name}\")")))
            }
            None => of("int", "int", None),
        },
        Kind::Array(element, _) => {
            let element = match element.as_ref() {
                Kind::Number(number) if number.starts_with('f') => "float",
                _ => "int",
            };
            of(
                &format!("tuple[{element}, ...]"),
                &format!("Sequence[{element}]"),
                Some(format!("vector(\"_{name}\")")),
            )
        }
        Kind::Pointer(target, _) => match target.as_ref() {
            Kind::Named(c_char) if c_char == "c_char" => of(
                "str | None",
                "str | os.PathLike[str] | None",
                Some(format!("text(\"_{name}\")")),
            ),
            Kind::Number(number) if item.name.ends_with("_options") => {
                let count = format!("{}_count", name.trim_end_matches('s'));
                if !item.fields.iter().any(|other| other.name == count) {
                    bail!("{}.{name}: a pointer without {count}", item.name);
                }
                let class = field.of.as_deref().map(camel).unwrap_or_else(|| {
                    (if number.starts_with('f') {
                        "float"
                    } else {
                        "int"
                    })
                    .into()
                });
                let element = ctype(source, target)?;
                of(
                    &format!("tuple[{class}, ...]"),
                    &format!("Sequence[{class} | str | int]"),
                    Some(format!(
                        "numbers(\"_{name}\", \"{count}\", {element}, {class})"
                    )),
                )
            }
            _ => of("int | None", "int | None", None),
        },
        Kind::Named(_) if raw == "Corrections" => of(
            &raw,
            "Corrections | str | int",
            Some(format!("corrections(\"_{name}\", {raw})")),
        ),
        Kind::Named(_) => of(&raw, &raw, None),
    })
}

fn structure(out: &mut String, source: &Source, item: &Struct) -> Result<()> {
    let class = camel(&item.name);
    writeln!(out, "\n\nclass {class}(Record):")?;
    docstring(out, 4, &item.doc);
    out.push('\n');
    let mut fields = String::new();
    for field in &item.fields {
        let Seen {
            annotation,
            descriptor,
            raw,
            ..
        } = seen(source, item, field)?;
        let name = &field.name;
        match descriptor {
            Some(descriptor) => {
                writeln!(out, "    {name}: {annotation} = {descriptor}")?;
                writeln!(fields, "        (\"_{name}\", {raw}),")?;
            }
            None => {
                writeln!(out, "    {name}: {annotation}")?;
                writeln!(fields, "        (\"{name}\", {raw}),")?;
            }
        }
        docstring(out, 4, &field.doc);
    }
    writeln!(out, "\n    _fields_ = [\n{fields}    ]")?;
    Ok(())
}

/// The keyword arguments that make an options struct, for type checkers.
fn keywords(out: &mut String, source: &Source, item: &Struct) -> Result<()> {
    writeln!(
        out,
        "\n\nclass {}Keywords(TypedDict, total=False):",
        camel(&item.name)
    )?;
    writeln!(out, "    \"\"\"Fields of `{}`.\"\"\"\n", camel(&item.name))?;
    for field in &item.fields {
        let hidden = field.name == "struct_size"
            || field.name.starts_with("reserved")
            || field.name.ends_with("_count");
        if !hidden {
            let accepts = seen(source, item, field)?.accepts;
            writeln!(out, "    {}: {accepts}", field.name)?;
            docstring(out, 4, &field.doc);
        }
    }
    Ok(())
}

fn function(out: &mut String, source: &Source, item: &Function) -> Result<()> {
    let result = match &item.result {
        Some(kind) => ctype(source, kind)?,
        None => "None".into(),
    };
    let parameters = item
        .parameters
        .iter()
        .map(|parameter| ctype(source, &parameter.kind))
        .collect::<Result<Vec<_>>>()?;
    writeln!(
        out,
        "    \"{}\": ({result}, [{}]),",
        item.name,
        parameters.join(", ")
    )?;
    Ok(())
}

fn ctype(source: &Source, kind: &Kind) -> Result<String> {
    Ok(match kind {
        Kind::Number(name) => match name.as_str() {
            "u8" => "ctypes.c_uint8",
            "i32" => "ctypes.c_int32",
            "u32" => "ctypes.c_uint32",
            "u64" => "ctypes.c_uint64",
            "f32" => "ctypes.c_float",
            "f64" => "ctypes.c_double",
            _ => bail!("{name} has no ctypes type"),
        }
        .into(),
        Kind::Array(element, length) => format!("{} * {length}", ctype(source, element)?),
        Kind::Named(name) if name == "upt_log_fn" => "ctypes.c_void_p".into(),
        Kind::Named(name) if source.structs.iter().any(|item| item.name == *name) => camel(name),
        Kind::Pointer(target, _) => match target.as_ref() {
            Kind::Named(name) if name == "c_char" => "ctypes.c_char_p".into(),
            _ => "ctypes.c_void_p".into(),
        },
        _ => bail!("{kind:?} has no ctypes type"),
    })
}

fn docstring(out: &mut String, indent: usize, doc: &Doc) {
    let pad = " ".repeat(indent);
    let text = doc.join(&format!("\n{pad}"));
    if !text.trim().is_empty() {
        let text = text.trim().replace('\\', "\\\\");
        let _ = writeln!(out, "{pad}\"\"\"{text}\"\"\"");
    }
}
