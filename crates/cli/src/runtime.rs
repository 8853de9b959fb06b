//! `upt runtime`: ONNX Runtime for the commands. One that the environment names (`ORT_DYLIB_PATH`) goes first, then that of the
//! build that this program came out of, then the one that this command fetched for the user; otherwise the library looks where
//! it always does. A command that finds none asks whether to fetch it.

use std::io::{BufRead, IsTerminal, Write};
use std::path::PathBuf;
use std::process::{Command, ExitCode};

use anyhow::{Context, Result};
use ort_wheel::{Platform, VERSION};

use foreign::python;
use host::NoRuntime;

const VARIABLE: &str = "ORT_DYLIB_PATH";

/// Fetch ONNX Runtime for this user, by pip, into the user's cache.
///
/// Bundles with a network need it; those of `upt make` do not. The wheel is downloaded from the package index that pip is set up
/// for, and checked against the SHA-256 of the published one. Where it is there already, nothing is downloaded.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  upt runtime\n  PIP_INDEX_URL=https://mirror.example/simple upt runtime"
)]
pub struct Options {}

/// Fetches, and prints the library's path.
pub fn run(_: &Options) -> Result<ExitCode> {
    println!("{}", fetch()?.display());
    Ok(ExitCode::SUCCESS)
}

fn fetch() -> Result<PathBuf> {
    let platform = Platform::host()?;
    let folder = kept()?;
    let python = match ort_wheel::is_there(&folder, platform, VERSION) {
        true => PathBuf::new(),
        false => python::interpreter(&mut |said| eprintln!("{said}"))?,
    };
    let mut run = |label: &str, command: &mut Command| {
        eprintln!("{label} ...");
        python::run(label, command)
    };
    ort_wheel::fetch(&folder, platform, VERSION, &python, &mut run).with_context(|| {
        format!(
            "ONNX Runtime {VERSION} cannot be fetched; you can also set {VARIABLE} to a library of your own"
        )
    })
}

/// Where this command keeps the library.
fn kept() -> Result<PathBuf> {
    Ok(python::cache()?.join("onnxruntime").join(VERSION))
}

/// Names the library to this process, unless the user has.
///
/// # Safety
/// No other thread runs yet.
pub unsafe fn take() {
    if is_named() {
        return;
    }
    if let Some(found) = of_the_build().or_else(of_the_user) {
        // SAFETY: the caller's.
        unsafe { std::env::set_var(VARIABLE, found) };
    }
}

fn is_named() -> bool {
    std::env::var_os(VARIABLE).is_some_and(|path| !path.is_empty())
}

/// What `cargo xtask` fetched next to a `upt` out of `cargo build`.
fn of_the_build() -> Option<PathBuf> {
    let exe = std::env::current_exe().ok()?;
    let target = exe.parent()?.parent()?;
    let file = target.join("ort").join(Platform::host().ok()?.library());
    file.is_file().then_some(file)
}

fn of_the_user() -> Option<PathBuf> {
    let (folder, platform) = (kept().ok()?, Platform::host().ok()?);
    ort_wheel::is_there(&folder, platform, VERSION).then(|| folder.join(platform.library()))
}

/// After a command that found no ONNX Runtime: asks a person, fetches it and starts the command again; tells anyone else how.
/// None where that is not what went wrong.
pub fn offer(error: &anyhow::Error) -> Option<ExitCode> {
    let missing = |cause: &(dyn std::error::Error + 'static)| {
        let told = cause.downcast_ref::<upt::Error>();
        cause.is::<NoRuntime>() || matches!(told, Some(upt::Error::Runtime(_)))
    };
    if !error.chain().any(missing) || is_named() {
        return None;
    }
    eprintln!("error: {error:#}");
    let person = std::io::stdin().is_terminal() && std::io::stderr().is_terminal();
    if !(person && agrees()) {
        eprintln!("`upt runtime` fetches ONNX Runtime {VERSION} for this user");
        return Some(ExitCode::from(2));
    }
    let again = || -> Result<ExitCode> {
        let library = fetch()?;
        let mut command = Command::new(std::env::current_exe()?);
        command.args(std::env::args_os().skip(1));
        let status = command.env(VARIABLE, library).status()?;
        let code = status.code().and_then(|code| u8::try_from(code).ok());
        Ok(ExitCode::from(code.unwrap_or(2)))
    };
    Some(again().unwrap_or_else(|error| {
        eprintln!("error: {error:#}");
        ExitCode::from(2)
    }))
}

fn agrees() -> bool {
    let place = kept().map_or_else(
        |_| "the cache".into(),
        |folder| folder.display().to_string(),
    );
    eprint!("Fetch ONNX Runtime {VERSION} by pip into {place}? [Y/n] ");
    std::io::stderr().flush().ok();
    let mut line = String::new();
    let read = std::io::stdin().lock().read_line(&mut line);
    read.is_ok_and(|read| read > 0)
        && matches!(line.trim().to_lowercase().as_str(), "" | "y" | "yes")
}
