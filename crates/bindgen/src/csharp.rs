//! The C# bindings: blittable structs, raw pointers, C names. C# 7.2, no `in` parameters (Mono crashes on them).

use std::fmt::Write;

use anyhow::{Result, bail};

use crate::source::{Enumeration, Function, Kind, Named, Source, Struct};

const HEAD: &str = "\
// Written by `cargo xtask header` from src/ffi/; conventions: docs/reference/abi.md.
// SPDX-License-Identifier: Apache-2.0 OR MIT
using System;
using System.Runtime.InteropServices;

namespace Upt.Interop
{
";

/// Unity links a WebGL player's own code, and `Plugins/WebGL/libupt.jslib` as that.
const LIBRARY: &str = "\
#if UNITY_WEBGL && !UNITY_EDITOR
        const string Library = \"__Internal\";
#else
        const string Library = \"upt\";
#endif

";

/// The whole file.
pub fn write(source: &Source) -> Result<String> {
    let mut out = String::from(HEAD);
    for item in &source.enumerations {
        enumeration(&mut out, source, item)?;
        out.push('\n');
    }
    for item in &source.structs {
        structure(&mut out, source, item)?;
        out.push('\n');
    }
    out.push_str("    /// <summary>The C ABI, as it is.</summary>\n");
    out.push_str("    public static unsafe class Native\n    {\n");
    out.push_str(LIBRARY);
    for constant in &source.constants {
        summary(&mut out, 8, &constant.doc);
        let (name, value) = (&constant.name, &constant.value);
        match &constant.of {
            Some(of) => writeln!(out, "        public const {of} {name} = {of}.{name};")?,
            None => {
                let ty = if constant.unsigned { "uint" } else { "int" };
                writeln!(out, "        public const {ty} {name} = {value};")?;
            }
        }
    }
    for item in &source.functions {
        out.push('\n');
        function(&mut out, source, item)?;
    }
    out.push_str("    }\n}\n");
    Ok(out)
}

/// Its values have the names of C; `Native` has them, too.
fn enumeration(out: &mut String, source: &Source, item: &Enumeration) -> Result<()> {
    let Enumeration { doc, name, number } = item;
    summary(out, 4, doc);
    // A set of bits.
    if name == "upt_flag" {
        out.push_str("    [Flags]\n");
    }
    let number = ty(source, &Kind::Number(number.clone()))?;
    writeln!(out, "    public enum {name} : {number}\n    {{")?;
    for constant in source.values(name) {
        summary(out, 8, &constant.doc);
        writeln!(out, "        {} = {},", constant.name, constant.value)?;
    }
    out.push_str("    }\n");
    Ok(())
}

fn structure(out: &mut String, source: &Source, item: &Struct) -> Result<()> {
    summary(out, 4, &item.doc);
    out.push_str("    [StructLayout(LayoutKind.Sequential)]\n");
    writeln!(out, "    public unsafe struct {}\n    {{", item.name)?;
    for Named {
        doc,
        name,
        kind,
        of,
    } in &item.fields
    {
        summary(out, 8, doc);
        match kind {
            Kind::Array(element, length) => {
                let element = ty(source, element)?;
                writeln!(out, "        public fixed {element} {name}[{length}];")?;
            }
            _ => writeln!(out, "        public {} {name};", typed(source, kind, of)?)?,
        }
    }
    out.push_str("    }\n");
    Ok(())
}

fn function(out: &mut String, source: &Source, item: &Function) -> Result<()> {
    summary(out, 8, &item.doc);
    out.push_str("        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]\n");
    let result = match &item.result {
        Some(kind) => typed(source, kind, &item.result_of)?,
        None => "void".into(),
    };
    let parameters = item
        .parameters
        .iter()
        .map(|parameter| {
            Ok(format!(
                "{} {}",
                typed(source, &parameter.kind, &parameter.of)?,
                escape(&parameter.name)
            ))
        })
        .collect::<Result<Vec<_>>>()?;
    let (name, parameters) = (&item.name, parameters.join(", "));
    writeln!(
        out,
        "        public static extern {result} {name}({parameters});"
    )?;
    Ok(())
}

/// A type whose numbers may be of an enumeration, also behind a pointer.
fn typed(source: &Source, kind: &Kind, of: &Option<String>) -> Result<String> {
    Ok(match (kind, of) {
        (Kind::Number(_), Some(of)) => of.clone(),
        (Kind::Pointer(target, _), Some(_)) => format!("{}*", typed(source, target, of)?),
        _ => ty(source, kind)?,
    })
}

fn ty(source: &Source, kind: &Kind) -> Result<String> {
    Ok(match kind {
        Kind::Number(name) => match name.as_str() {
            "u8" => "byte",
            "i32" => "int",
            "u32" => "uint",
            "u64" => "ulong",
            "f32" => "float",
            "f64" => "double",
            _ => bail!("{name} has no C# type"),
        }
        .into(),
        Kind::Named(name) if name == "upt_log_fn" => "IntPtr".into(),
        Kind::Named(name) if source.structs.iter().any(|item| item.name == *name) => name.clone(),
        Kind::Pointer(target, _) => match target.as_ref() {
            Kind::Named(name) if name == "c_char" => "byte*".into(),
            Kind::Named(name) if name == "c_void" || source.opaque.contains(name) => {
                "IntPtr".into()
            }
            target => format!("{}*", ty(source, target)?),
        },
        _ => bail!("{kind:?} has no C# type"),
    })
}

/// `out`, `in`, `ref`, `params` are words of C#.
fn escape(name: &str) -> String {
    match name {
        "out" | "in" | "ref" | "params" | "object" | "string" => format!("@{name}"),
        _ => name.into(),
    }
}

fn summary(out: &mut String, indent: usize, doc: &[String]) {
    let paragraph = doc.join("\n");
    let text = paragraph
        .trim()
        .replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;");
    let pad = " ".repeat(indent);
    let lines: Vec<&str> = text.lines().collect();
    match lines.as_slice() {
        [] => {}
        [line] => {
            let _ = writeln!(out, "{pad}/// <summary>{line}</summary>");
        }
        lines => {
            let _ = writeln!(out, "{pad}/// <summary>");
            for line in lines {
                let _ = writeln!(out, "{}", format!("{pad}/// {line}").trim_end());
            }
            let _ = writeln!(out, "{pad}/// </summary>");
        }
    }
}
