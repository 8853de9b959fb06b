//! The Python behind a few commands: `UPT_PYTHON` where that is set, else an environment that is made once for a user.

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, bail};

/// The folder in which the commands keep what they make once for a user.
pub fn cache() -> Result<PathBuf> {
    let variable = |name: &str| {
        std::env::var_os(name)
            .filter(|value| !value.is_empty())
            .map(PathBuf::from)
    };
    let cache = variable("XDG_CACHE_HOME")
        .or_else(|| variable("LOCALAPPDATA"))
        .or_else(|| Some(variable("HOME")?.join(".cache")));
    let cache = cache.context("there is no cache folder for downloads; set XDG_CACHE_HOME")?;
    Ok(cache.join("upt"))
}

/// The interpreter; where it is made now, `tell` hears of it.
///
/// # Errors
/// Without Python 3: says what to do.
pub fn interpreter(tell: &mut dyn FnMut(&str)) -> Result<PathBuf> {
    if let Some(named) = named() {
        return Ok(named);
    }
    let folder = cache()?.join("python");
    let python = if cfg!(windows) {
        folder.join("Scripts").join("python.exe")
    } else {
        folder.join("bin").join("python")
    };
    if !python.is_file() {
        tell(&format!(
            "making a Python environment in {}",
            folder.display()
        ));
        let start = if cfg!(windows) { "python" } else { "python3" };
        run(
            "python3 -m venv",
            Command::new(start).args(["-m", "venv"]).arg(&folder),
        )?;
    }
    Ok(python)
}

/// The interpreter, with packages; one that the user named has what the user gave it.
pub fn with(packages: &[&str], tell: &mut dyn FnMut(&str)) -> Result<PathBuf> {
    let python = interpreter(tell)?;
    if named().is_some() {
        return Ok(python);
    }
    let mut command = Command::new(&python);
    let quietly = ["install", "--quiet", "--disable-pip-version-check"];
    command.args(["-m", "pip"]).args(quietly).args(packages);
    run(&format!("pip install {}", packages.join(" ")), &mut command)?;
    Ok(python)
}

/// Runs a command to its end; an error holds the last line that it said.
pub fn run(what: &str, command: &mut Command) -> Result<()> {
    let program = Path::new(command.get_program()).display().to_string();
    let ran = command.output().with_context(|| {
        format!(
            "{what}: {program} cannot be started; install Python 3, or name one with UPT_PYTHON"
        )
    })?;
    if !ran.status.success() {
        let said = String::from_utf8_lossy(&ran.stderr);
        bail!("{what}: {}", said.lines().last().unwrap_or("no message"));
    }
    Ok(())
}

fn named() -> Option<PathBuf> {
    let named = std::env::var_os("UPT_PYTHON").filter(|value| !value.is_empty());
    named.map(PathBuf::from)
}
