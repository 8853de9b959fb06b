//! One layout, seen by four: the Rust types, `upt.h` (cbindgen), safer_ffi's own header, and the C# structs.
//!
//! Each side prints `struct size`, then `struct.field offset` for every field; the lists have to be equal.

use std::collections::HashSet;
use std::fmt::Write as _;
use std::io::Write;
use std::path::Path;
use std::process::Command;

use safer_ffi::headers::{Definer, languages};
use safer_ffi::layout::{CLayoutOf, CType};
use upt::ffi::*;
use upt_bindgen::source::{self, Source};

/// Collects safer_ffi's definitions.
#[derive(Default)]
struct Definitions {
    names: HashSet<String>,
    text: Vec<u8>,
}

impl Definer for Definitions {
    fn insert(&mut self, name: &str) -> bool {
        self.names.insert(name.to_owned())
    }

    fn out(&mut self) -> &mut dyn Write {
        &mut self.text
    }
}

macro_rules! structs {
    ($($name:ident),*) => {
        /// `(name, size in Rust)`
        const RUST_SIZES: &[(&str, usize)] = &[$((stringify!($name), size_of::<$name>())),*];

        fn safer_ffi_header() -> String {
            let mut definitions = Definitions::default();
            $(
                <CLayoutOf<$name> as CType>::define_self(&languages::C, &mut definitions).unwrap();
            )*
            String::from_utf8(definitions.text).unwrap()
        }
    };
}

structs!(
    upt_init_options,
    upt_model_options,
    upt_model_info,
    upt_corrections,
    upt_scene_options,
    upt_haptics_options,
    upt_haptic_pose,
    upt_haptic_force,
    upt_scene_stats,
    upt_scene_timing,
    upt_input,
    upt_tie,
    upt_tie_reading,
    upt_bed,
    upt_view,
    upt_instrument,
    upt_instrument_reading,
    upt_instrument_contact,
    upt_cut,
    upt_blade,
    upt_surface,
    upt_point_force,
    upt_pressure,
    upt_support
);

fn run(command: &mut Command) -> String {
    let output = command
        .output()
        .unwrap_or_else(|error| panic!("{command:?}: {error}"));
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{command:?}\n{errors}");
    String::from_utf8(output.stdout).unwrap()
}

/// The list as a C compiler sees it with this header.
fn c_layout(source: &Source, header: &str, folder: &Path, name: &str) -> String {
    let mut program =
        format!("{header}\n#include <stddef.h>\n#include <stdio.h>\nint main(void) {{\n");
    for item in &source.structs {
        let ty = &item.name;
        writeln!(
            program,
            "printf(\"{ty} %lu\\n\", (unsigned long)sizeof(struct {ty}));"
        )
        .unwrap();
        for field in &item.fields {
            let field = &field.name;
            writeln!(
                program,
                "printf(\"{ty}.{field} %lu\\n\", (unsigned long)offsetof(struct {ty}, {field}));"
            )
            .unwrap();
        }
    }
    program.push_str("return 0; }\n");
    let (code, executable) = (folder.join(format!("{name}.c")), folder.join(name));
    std::fs::write(&code, program).unwrap();
    let compiler = std::env::var("CC").unwrap_or_else(|_| "cc".into());
    run(Command::new(compiler).arg(&code).arg("-o").arg(&executable));
    run(&mut Command::new(&executable))
}

#[test]
fn c_headers_agree_with_rust() {
    let root = upt_bindgen::root();
    let source = source::read(&root).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let header = std::fs::read_to_string(root.join("include/upt.h")).unwrap();
    let cbindgen = c_layout(&source, &header, folder.path(), "cbindgen");
    let safer_ffi = c_layout(&source, &safer_ffi_header(), folder.path(), "safer_ffi");
    assert_eq!(cbindgen, safer_ffi);

    let listed: Vec<&str> = source
        .structs
        .iter()
        .map(|item| item.name.as_str())
        .collect();
    let tested: Vec<&str> = RUST_SIZES.iter().map(|(name, _)| *name).collect();
    assert_eq!(listed, tested, "a struct of the ABI is not in this test");
    for (name, size) in RUST_SIZES {
        let line = format!("{name} {size}");
        assert!(
            cbindgen.lines().any(|found| found == line),
            "{line}\n{cbindgen}"
        );
    }
}

#[test]
fn csharp_agrees_with_c() {
    if Command::new("mcs").arg("--version").output().is_err() {
        println!("skipped: no C# compiler (mono-mcs)");
        return;
    }
    let root = upt_bindgen::root();
    let source = source::read(&root).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let mut program = String::from(
        "using System;\nusing System.Runtime.InteropServices;\nusing Upt.Interop;\n\
         public static class Layout {\n  static void Main() {\n",
    );
    for item in &source.structs {
        let ty = &item.name;
        writeln!(
            program,
            "    Console.WriteLine(\"{ty} \" + Marshal.SizeOf(typeof({ty})));"
        )
        .unwrap();
        for field in &item.fields {
            let field = &field.name;
            writeln!(
                program,
                "    Console.WriteLine(\"{ty}.{field} \" + Marshal.OffsetOf(typeof({ty}), \"{field}\"));"
            )
            .unwrap();
        }
    }
    program.push_str("  }\n}\n");
    let (code, executable) = (
        folder.path().join("Layout.cs"),
        folder.path().join("Layout.exe"),
    );
    std::fs::write(&code, program).unwrap();
    run(Command::new("mcs")
        .args(["-unsafe", "-langversion:7.2"])
        .arg(format!("-out:{}", executable.display()))
        .arg(&code)
        .arg(root.join("unity-plugin/Runtime/Interop/Native.g.cs")));
    let csharp = run(Command::new("mono").arg(&executable));

    let header = std::fs::read_to_string(root.join("include/upt.h")).unwrap();
    assert_eq!(
        csharp,
        c_layout(&source, &header, folder.path(), "cbindgen")
    );
}
