//! Running other programs: output goes to a log file in `target/xtask-logs/`, the terminal sees one line of progress.

use std::fs::File;
use std::io::IsTerminal;
use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail};

use crate::workspace::Workspace;

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

/// What runs now, in the order of its starts, for the line of progress.
static RUNNING: Mutex<Vec<(String, Instant)>> = Mutex::new(Vec::new());

fn running() -> MutexGuard<'static, Vec<(String, Instant)>> {
    RUNNING.lock().unwrap_or_else(PoisonError::into_inner)
}

/// On the list of what runs, until it is dropped.
struct Running(Instant);

impl Running {
    fn new(label: &str) -> Self {
        let start = Instant::now();
        running().push((label.to_owned(), start));
        Self(start)
    }

    fn line() -> String {
        let all = running();
        let each = all
            .iter()
            .map(|(label, start)| format!("{label} ... {} s", start.elapsed().as_secs()));
        each.collect::<Vec<_>>().join(", ")
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        running().retain(|(_, start)| *start != self.0);
    }
}

/// Runs `command` with its output in a log named after `label`.
///
/// On a terminal the line of progress is redrawn; elsewhere a line is printed once a minute, so that a log keeper sees
/// that the job is alive.
pub fn run_logged(workspace: &Workspace, label: &str, command: &mut Command) -> Result<Finished> {
    let name = label.replace([' ', '/'], "-");
    let log = workspace.path(&format!("target/xtask-logs/{name}.log"));
    std::fs::create_dir_all(log.with_file_name(""))?;
    let file = File::create(&log).with_context(|| format!("cannot write {}", log.display()))?;
    command.stdin(Stdio::null()).stdout(file.try_clone()?);
    let mut child = command
        .stderr(file)
        .spawn()
        .with_context(|| format!("cannot start {:?}", command.get_program()))?;
    let _running = Running::new(label);
    let terminal = std::io::stderr().is_terminal();
    let mut shown = Instant::now();
    let status = loop {
        if let Some(status) = child.try_wait()? {
            break status;
        }
        std::thread::sleep(Duration::from_millis(40));
        if shown.elapsed().as_secs_f64() > if terminal { 0.5 } else { 60.0 } {
            shown = Instant::now();
            let line = Running::line();
            match terminal {
                true => eprint!("\r\x1b[K  {line}"),
                false => eprintln!("  {line}"),
            }
        }
    };
    if terminal {
        eprint!("\r\x1b[K");
    }
    Ok(Finished {
        success: status.success(),
        text: String::from_utf8_lossy(&std::fs::read(&log)?).into_owned(),
        log,
    })
}

/// As [`run_logged`], but a failure is an error that shows the end of the log.
pub fn run_checked(workspace: &Workspace, label: &str, command: &mut Command) -> Result<()> {
    let finished = run_logged(workspace, label, command)?;
    if !finished.success {
        let (log, end) = (finished.log.display(), finished.tail(40));
        bail!("{label} failed; the end of {log}:\n{end}");
    }
    Ok(())
}

/// What a program prints; a failure is an error with its messages.
pub fn output(command: &mut Command) -> Result<String> {
    let output = command
        .output()
        .with_context(|| format!("cannot start {:?}", command.get_program()))?;
    if !output.status.success() {
        let message = String::from_utf8_lossy(&output.stderr);
        bail!("{:?}: {message}", command.get_program());
    }
    Ok(String::from_utf8(output.stdout)?)
}

/// Runs `command` in the terminal; false where it failed, which it has said itself.
pub fn run_visibly(command: &mut Command) -> Result<bool> {
    let status = command
        .status()
        .with_context(|| format!("cannot start {:?}", command.get_program()))?;
    Ok(status.success())
}
