//! `upt-bindgen`: writes the bindings; `upt-bindgen --check` only says whether they are up to date.

use std::process::ExitCode;

use anyhow::{Context, Result};

fn main() -> Result<ExitCode> {
    let check = std::env::args().nth(1).as_deref() == Some("--check");
    let root = upt_bindgen::root();
    let mut stale = false;
    for output in upt_bindgen::outputs()? {
        let path = root.join(output.path);
        if std::fs::read_to_string(&path).is_ok_and(|text| text == output.text) {
            println!("{} is up to date", output.path);
        } else if check {
            println!("{} is stale; run `cargo xtask header`", output.path);
            stale = true;
        } else {
            std::fs::create_dir_all(path.parent().expect("below the root"))?;
            std::fs::write(&path, output.text).with_context(|| path.display().to_string())?;
            println!("{} written", output.path);
        }
    }
    Ok(ExitCode::from(stale as u8))
}
