//! `upt-bindgen`: writes the bindings; `--check` only says whether they are up to date. `--release` writes the dump of the ABI that
//! `tests/fresh.rs` compares later ones with.

use std::path::Path;
use std::process::ExitCode;

use anyhow::{Context, Result};
use upt_bindgen::{dump, source};

fn main() -> Result<ExitCode> {
    let root = upt_bindgen::root();
    let good = match std::env::args().nth(1).as_deref() {
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

fn release(root: &Path) -> Result<bool> {
    std::fs::write(root.join(dump::PATH), dump::write(&source::read(root)?)?)?;
    println!("{} written", dump::PATH);
    Ok(true)
}
