//! The ABI as lines of text, and what a later one may not change of them: `docs/reference/abi.md`, "What stays from 1.0 on".
//!
//! ```text
//! const UPT_OK = 0
//! fn upt_model_destroy(upt_model*) -> i32
//! struct upt_view 64
//! field upt_view.kind @4 i32
//! ```
//!
//! Offsets and sizes in bytes, for pointers of 8.

use std::collections::BTreeMap;
use std::fmt::Write;

use anyhow::{Context, Result};

use crate::source::{Kind, Source, Struct};

/// Where the dump of the last release lies, below the repository's root.
pub const PATH: &str = "crates/bindgen/abi.txt";

/// One line for each constant, function, struct and field.
///
/// # Errors
/// A struct by value that is declared after its use.
pub fn write(source: &Source) -> Result<String> {
    let mut out = String::new();
    for constant in &source.constants {
        writeln!(out, "const {} = {}", constant.name, constant.value)?;
    }
    for function in &source.functions {
        let kinds = function.parameters.iter().map(|one| name(&one.kind));
        let parameters: Vec<String> = kinds.collect();
        let result = function.result.as_ref().map_or("void".into(), name);
        let parameters = parameters.join(", ");
        writeln!(out, "fn {}({parameters}) -> {result}", function.name)?;
    }
    let mut known = BTreeMap::new();
    for item in &source.structs {
        structure(&mut out, item, &mut known)?;
    }
    Ok(out)
}

/// Size and alignment.
type Layout = (usize, usize);

fn structure(out: &mut String, item: &Struct, known: &mut BTreeMap<String, Layout>) -> Result<()> {
    let (mut size, mut align) = (0_usize, 1);
    let mut fields = String::new();
    for field in &item.fields {
        let (bytes, to) = layout(&field.kind, known)
            .with_context(|| format!("{}.{}: unknown size", item.name, field.name))?;
        size = size.next_multiple_of(to);
        let kind = name(&field.kind);
        writeln!(fields, "field {}.{} @{size} {kind}", item.name, field.name)?;
        size += bytes;
        align = align.max(to);
    }
    size = size.next_multiple_of(align);
    write!(out, "struct {} {size}\n{fields}", item.name)?;
    known.insert(item.name.clone(), (size, align));
    Ok(())
}

fn layout(kind: &Kind, known: &BTreeMap<String, Layout>) -> Option<Layout> {
    Some(match kind {
        Kind::Number(number) => {
            let bytes = number[1..].parse::<usize>().ok()? / 8;
            (bytes, bytes)
        }
        Kind::Pointer(..) => (8, 8),
        Kind::Array(of, count) => {
            let (bytes, align) = layout(of, known)?;
            (bytes * count, align)
        }
        Kind::Named(name) if name == "c_char" => (1, 1),
        Kind::Named(name) => return known.get(name).copied(),
    })
}

fn name(kind: &Kind) -> String {
    match kind {
        Kind::Number(number) | Kind::Named(number) => number.clone(),
        Kind::Pointer(to, true) => format!("const {}*", name(to)),
        Kind::Pointer(to, false) => format!("{}*", name(to)),
        Kind::Array(of, count) => format!("{}[{count}]", name(of)),
    }
}

/// What of `old` is gone or has changed in `new`. Reserved bytes may become fields, and a struct that states its size may grow.
pub fn broken(old: &str, new: &str) -> Vec<String> {
    let today = read(new);
    let before = read(old);
    let grows = |item: &str| {
        before.contains_key(format!("field {item}.struct_size").as_str())
            && today.contains_key(format!("field {item}.struct_size").as_str())
    };
    let mut faults = Vec::new();
    for (what, was) in &before {
        let is = today.get(what);
        let item = what.strip_prefix("struct ");
        let holds = match (item, is) {
            _ if what.contains(".reserved") => true,
            (_, None) => false,
            (Some(item), Some(is)) if grows(item) => bytes(is) >= bytes(was),
            (_, Some(is)) => is == was,
        };
        if !holds {
            let is = is.unwrap_or(&"gone");
            faults.push(format!("{what}: was `{was}`, is `{is}`"));
        }
    }
    faults
}

fn bytes(size: &str) -> usize {
    size.parse().unwrap_or(0)
}

/// Lines by what they speak of.
fn read(dump: &str) -> BTreeMap<&str, &str> {
    let pairs = dump.lines().filter_map(|line| {
        let mut spaces = line.match_indices([' ', '(']).map(|(at, _)| at);
        let at = spaces.nth(1)?;
        Some((&line[..at], line[at..].trim_start_matches([' ', '='])))
    });
    pairs.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const OLD: &str = "const UPT_OK = 0\nfn upt_f(upt_s*, u32) -> i32\nstruct upt_s 16\nfield upt_s.struct_size @0 u32\n\
        field upt_s.a @4 f32[2]\nfield upt_s.reserved @12 u8[4]\nstruct upt_t 8\nfield upt_t.b @0 u64\n";

    #[test]
    fn what_grows_is_no_break_and_what_changes_is() {
        assert_eq!(broken(OLD, OLD), Vec::<String>::new());
        let grown = OLD
            .replace("upt_s 16", "upt_s 24")
            .replace("reserved @12 u8[4]", "c @12 u8")
            + "const UPT_NEW = 1\nfn upt_g() -> i32\n";
        assert_eq!(broken(OLD, &grown), Vec::<String>::new());
        for (from, to, told) in [
            ("UPT_OK = 0", "UPT_OK = 1", "const UPT_OK"),
            ("const UPT_OK = 0\n", "", "const UPT_OK"),
            ("(upt_s*, u32)", "(upt_s*)", "fn upt_f"),
            ("upt_s 16", "upt_s 12", "struct upt_s"),
            ("upt_t 8", "upt_t 16", "struct upt_t"),
            ("a @4 f32[2]", "a @8 f32[2]", "field upt_s.a"),
            ("a @4 f32[2]", "a @4 f32[3]", "field upt_s.a"),
        ] {
            let faults = broken(OLD, &OLD.replace(from, to));
            assert_eq!(faults.len(), 1, "{from} -> {to}: {faults:?}");
            assert!(faults[0].starts_with(told), "{faults:?}");
        }
    }
}
