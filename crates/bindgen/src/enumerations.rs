//! The enumerations of `upt.h`. C before 2023 lets a compiler choose how wide an `enum` is, so a struct cannot hold one: there the name is
//! that of an integer, with the values beside it. C++ and later C have enumerations of a fixed width, which debuggers and compilers know.

use std::fmt::Write;

use anyhow::{Result, ensure};

use crate::source::{Doc, Source};

const HEAD: &str = "
/* An enumeration of a fixed width: `enum` in C++ and C23, where debuggers name its values and compilers
 * check them, else an integer of this name beside an `enum` of the values. */
#if (defined(__cplusplus) && (__cplusplus >= 201103L || defined(_MSC_VER))) || (defined(__STDC_VERSION__) && __STDC_VERSION__ >= 202311L)
#define UPT_ENUM(name, integer) \\
  enum name : integer; \\
  typedef enum name name; \\
  enum name : integer
#else
#define UPT_ENUM(name, integer) \\
  typedef integer name; \\
  enum name##_values
#endif
";

/// All of them, each with its values.
///
/// # Errors
/// A type without a value.
pub fn write(source: &Source) -> Result<String> {
    let mut out = String::from(HEAD);
    for one in &source.enumerations {
        let (sign, bits) = one.number.split_at(1);
        let sign = if sign == "u" { "u" } else { "" };
        out.push('\n');
        comment(&mut out, "", &one.doc);
        writeln!(out, "UPT_ENUM({}, {sign}int{bits}_t) {{", one.name)?;
        let values: Vec<_> = source.values(&one.name).collect();
        ensure!(!values.is_empty(), "{} has no value", one.name);
        for (at, value) in values.iter().enumerate() {
            comment(&mut out, "  ", &value.doc);
            let end = if at + 1 < values.len() { "," } else { "" };
            writeln!(out, "  {} = {}{end}", value.name, value.value)?;
        }
        out.push_str("};\n");
    }
    out.push_str("\n#undef UPT_ENUM\n");
    Ok(out)
}

fn comment(out: &mut String, pad: &str, doc: &Doc) {
    let lines = doc.iter().map(|line| format!("{pad} * {line}\n"));
    let text: String = lines.collect();
    let _ = write!(out, "{pad}/**\n{text}{pad} */\n");
}
