//! `upt-bindgen`: writes the bindings; `--check` only says whether they are up to date. `--stays` says what of the last release's ABI is gone
//! or has changed, and `--release` writes the dump that a later `--stays` compares with.

use std::path::Path;
use std::process::ExitCode;

use anyhow::{Context, Result};
use upt_bindgen::{dump, source};

fn main() -> Result<ExitCode> {
    let root = upt_bindgen::root();
    let good = match std::env::args().nth(1).as_deref() {
        Some("--stays") => stays(&root)?,
        Some("--release") => release(&root)?,
        word => bindings(&root, word == Some("--check"))?,
    };
    Ok(ExitCode::from(u8::from(!good)))
}

/// False where a binding is stale.
fn bindings(root: &Path, check: bool) -> Result<bool> {
    let mut fresh = true;
    for output in upt_bindgen::outputs()? {
        let path = root.join(output.path);
        if std::fs::read_to_string(&path).is_ok_and(|text| text == output.text) {
            println!("{} is up to date", output.path);
        } else if check {
            println!("{} is stale; run `cargo xtask header`", output.path);
            fresh = false;
        } else {
            std::fs::create_dir_all(path.parent().expect("below the root"))?;
            std::fs::write(&path, output.text).with_context(|| path.display().to_string())?;
            println!("{} written", output.path);
        }
    }
    Ok(fresh)
}

/// False where something of the last release's ABI does not stand.
fn stays(root: &Path) -> Result<bool> {
    let old = std::fs::read_to_string(root.join(dump::PATH)).context(dump::PATH)?;
    let faults = dump::broken(&old, &dump::write(&source::read(root)?)?);
    for fault in &faults {
        println!("{fault}");
    }
    match faults.len() {
        0 => println!(
            "the ABI of {} stands: {} lines",
            dump::PATH,
            old.lines().count()
        ),
        _ => println!(
            "From 1.0 on this waits for the next major version. Before it: `cargo xtask header --release`, with a row in \
             docs/reference/from-0.1-to-1.0.md"
        ),
    }
    Ok(faults.is_empty())
}

fn release(root: &Path) -> Result<bool> {
    std::fs::write(root.join(dump::PATH), dump::write(&source::read(root)?)?)?;
    println!("{} written", dump::PATH);
    Ok(true)
}
