//! Running other programs: output goes to a log file, the terminal sees one line of progress.

use std::fs::File;
use std::io::{IsTerminal, Write};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail};

/// What a program left behind.
pub struct Finished {
    pub success: bool,
    /// stdout and stderr together, in the order written.
    pub text: String,
    pub log: PathBuf,
}

impl Finished {
    /// The last `count` lines, for an error message.
    pub fn tail(&self, count: usize) -> String {
        let lines: Vec<&str> = self.text.lines().collect();
        lines[lines.len().saturating_sub(count)..].join("\n")
    }
}

/// Runs `command` with its output in `log`, printing `label` and the time it takes.
///
/// On a terminal the line is redrawn; elsewhere a line is printed once a minute, so that a
/// log keeper sees that the job is alive.
pub fn run_logged(label: &str, command: &mut Command, log: &Path) -> Result<Finished> {
    if let Some(folder) = log.parent() {
        std::fs::create_dir_all(folder)?;
    }
    let file = File::create(log).with_context(|| format!("cannot write {}", log.display()))?;
    let started = Instant::now();
    let mut child = command
        .stdin(Stdio::null())
        .stdout(file.try_clone()?)
        .stderr(file)
        .spawn()
        .with_context(|| format!("cannot start {:?}", command.get_program()))?;
    let terminal = std::io::stderr().is_terminal();
    let mut shown = Instant::now();
    let status = loop {
        if let Some(status) = child.try_wait()? {
            break status;
        }
        std::thread::sleep(Duration::from_millis(40));
        let pause = if terminal { 0.5 } else { 60.0 };
        if shown.elapsed().as_secs_f64() > pause {
            shown = Instant::now();
            let seconds = started.elapsed().as_secs();
            if terminal {
                eprint!("\r\x1b[K  {label} ... {seconds} s");
            } else {
                eprintln!("  {label} ... {seconds} s");
            }
            std::io::stderr().flush().ok();
        }
    };
    if terminal {
        eprint!("\r\x1b[K");
    }
    let text = String::from_utf8_lossy(&std::fs::read(log)?).into_owned();
    Ok(Finished {
        success: status.success(),
        text,
        log: log.to_path_buf(),
    })
}

/// As [`run_logged`], but a failure is an error that shows the end of the log.
pub fn run_checked(label: &str, command: &mut Command, log: &Path) -> Result<Finished> {
    let finished = run_logged(label, command, log)?;
    if !finished.success {
        bail!(
            "{label} failed; the end of {}:\n{}",
            finished.log.display(),
            finished.tail(40)
        );
    }
    Ok(finished)
}

/// True when `name` is a program on the `PATH`.
pub fn has_program(name: &str) -> bool {
    let Some(path) = std::env::var_os("PATH") else {
        return false;
    };
    std::env::split_paths(&path)
        .any(|folder| folder.join(name).is_file() || folder.join(format!("{name}.exe")).is_file())
}
