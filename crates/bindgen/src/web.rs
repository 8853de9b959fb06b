//! The JavaScript package's table of the C ABI: constants, and where the fields of each struct lie in WebAssembly's memory.

use std::collections::BTreeMap;
use std::fmt::Write;

use anyhow::{Context, Result, bail};

use crate::source::{Kind, Source, Struct};

const HEAD: &str = "\
// Written by `cargo xtask header` from src/ffi/; conventions: docs/reference/abi.md.
// SPDX-License-Identifier: Apache-2.0 OR MIT
// A struct: its bytes, and [type, offset, elements] of each field; pointers have 32 bits.
";

/// The whole file.
pub fn write(source: &Source) -> Result<String> {
    let mut out = String::from(HEAD);
    for constant in &source.constants {
        writeln!(out, "export const {} = {};", constant.name, constant.value)?;
    }
    let mut known = BTreeMap::new();
    for item in &source.structs {
        structure(&mut out, item, &mut known).with_context(|| item.name.clone())?;
    }
    Ok(out)
}

/// Of a struct: bytes, alignment, and the lines of its fields as `(name, type, offset, elements)`.
type Layout = (usize, usize, Vec<(String, &'static str, usize, usize)>);

/// A struct inside of another is written by the names of both: `corrections.mode`.
fn structure(out: &mut String, item: &Struct, known: &mut BTreeMap<String, Layout>) -> Result<()> {
    let (mut end, mut widest, mut fields) = (0, 1, Vec::new());
    for field in &item.fields {
        if let Kind::Named(name) = &field.kind {
            let (size, align, inner) = known.get(name).context("a struct before it is known")?;
            let offset = next_multiple(end, *align);
            for (name, ty, at, count) in inner {
                fields.push((format!("{}.{name}", field.name), *ty, offset + at, *count));
            }
            (end, widest) = (offset + size, widest.max(*align));
            continue;
        }
        let (kind, count) = match &field.kind {
            Kind::Array(element, count) => (element.as_ref(), *count),
            kind => (kind, 1),
        };
        let (ty, size) = number(kind)?;
        let offset = next_multiple(end, size);
        (end, widest) = (offset + count * size, widest.max(size));
        fields.push((field.name.clone(), ty, offset, count));
    }
    let (name, size) = (&item.name, next_multiple(end, widest));
    writeln!(
        out,
        "export const {name} = {{\n  size: {size},\n  fields: {{"
    )?;
    for (name, ty, offset, count) in &fields {
        let name = match name.contains('.') {
            true => format!("\"{name}\""),
            false => name.clone(),
        };
        writeln!(out, "    {name}: [\"{ty}\", {offset}, {count}],")?;
    }
    writeln!(out, "  }},\n}};")?;
    known.insert(item.name.clone(), (size, widest, fields));
    Ok(())
}

fn next_multiple(at: usize, size: usize) -> usize {
    at.div_ceil(size) * size
}

/// The name of a type's accessor in a `DataView`, and its bytes, which are its alignment as well.
fn number(kind: &Kind) -> Result<(&'static str, usize)> {
    Ok(match kind {
        Kind::Pointer(..) => ("Uint32", 4),
        Kind::Number(name) => match name.as_str() {
            "u8" => ("Uint8", 1),
            "i32" => ("Int32", 4),
            "u32" => ("Uint32", 4),
            "u64" => ("BigUint64", 8),
            "f32" => ("Float32", 4),
            "f64" => ("Float64", 8),
            _ => bail!("{name} has no place in a DataView"),
        },
        _ => bail!("{kind:?} has no place in a DataView"),
    })
}
