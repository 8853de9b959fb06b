//! The stages of `cargo xtask test`: one a language or check, each with its own counted result.

use anyhow::Result;

use crate::counts::{self, Outcome};
use crate::process::{output, run_logged};
use crate::system::{self, Needs};
use crate::workspace::Workspace;
use crate::{cross, ort, venv, wheel};

pub struct Stage {
    pub name: &'static str,
    pub about: &'static str,
    /// Packages without which it is skipped.
    pub needs: Needs,
    /// Too long for every run: in the nightly one, and by name.
    pub nightly: bool,
    pub run: Run,
}

/// How a stage runs.
pub enum Run {
    Function(fn(&Workspace) -> Result<Outcome>),
    /// A test script and its arguments; its last line reads `N passed, N failed, N skipped`.
    Script(&'static str),
}

use Run::{Function, Script};

const fn stage(name: &'static str, about: &'static str, needs: Needs, run: Run) -> Stage {
    Stage {
        name,
        about,
        needs,
        nightly: false,
        run,
    }
}

const fn nightly(name: &'static str, about: &'static str, needs: Needs, run: Run) -> Stage {
    Stage {
        nightly: true,
        ..stage(name, about, needs, run)
    }
}

/// In this order: what is cheap and most often wrong comes first.
#[rustfmt::skip]
pub const STAGES: &[Stage] = &[
    stage("fmt", "cargo fmt --check", "", Function(fmt)),
    stage("clippy", "cargo clippy, warnings are errors; also of builds with a single feature or none", "", Function(clippy)),
    stage("style", "ruff, clang-format, unused dependencies", "", Function(style)),
    stage("rust", "cargo test --release --workspace", "", Function(rust)),
    stage("loom", "every interleaving of what threads share without a lock", "", Script("tests/races/run.sh loom")),
    stage("python", "pytest of training/", "", Function(python)),
    stage("wheel", "the Python package: wheel, types, pytest", "", Function(wheel::stage)),
    stage("docs", "the book: links, code blocks, commands, index", "", Function(docs)),
    stage("c", "C and C++ hosts, CMake package, simulator", system::NATIVE, Script("tests/c/run.sh")),
    stage("csharp", "the Unity package's C# under Mono", system::CSHARP, Script("tests/csharp/run.sh")),
    stage("godot", "the GDExtension in a real engine", system::NATIVE, Script("examples/godot/run.sh")),
    stage("package", "the archive, unpacked elsewhere", system::NATIVE, Function(package)),
    stage("view", "upt view in headless Chromium", system::BROWSER, Script("tests/view/run.sh")),
    stage("windows", "built by MinGW, run by Wine", system::WINDOWS, Function(cross::windows)),
    nightly("haptics", "a day of simulated haptics, or what fits into 20 minutes", system::NATIVE, Function(haptics)),
    nightly("races", "what threads share: Miri, ThreadSanitizer", "", Script("tests/races/run.sh nightly")),
    nightly("arm64", "Linux arm64, run by qemu", system::ARM64, Function(cross::arm64)),
];

impl Stage {
    /// Runs it where nothing that it needs is missing; an error is a failure.
    pub fn outcome(&self, workspace: &Workspace) -> Outcome {
        let missing = system::missing(self.needs);
        if !missing.is_empty() {
            return Outcome::skipped(&format!("needs {}", missing.join(", ")));
        }
        let outcome = match self.run {
            Function(run) => run(workspace),
            Script(path) => script(workspace, self.name, path, &[]),
        };
        outcome.unwrap_or_else(|error| Outcome::failed(format!("{error:#}")))
    }
}

/// Runs a test script with what it finds its parts by.
pub fn script(
    workspace: &Workspace,
    name: &str,
    words: &str,
    environment: &[(&str, &std::path::Path)],
) -> Result<Outcome> {
    let mut command = workspace.bash(words);
    workspace.with_parts(&mut command)?;
    command.envs(environment.iter().copied());
    let finished = run_logged(workspace, name, &mut command)?;
    let mut outcome = Outcome::of(&finished, counts::script(&finished.text));
    if outcome.counts.skipped > 0 && outcome.note.is_empty() {
        let lines = finished.text.lines();
        let why: Vec<&str> = lines
            .filter(|line| line.to_lowercase().contains("skipped:"))
            .collect();
        outcome.note = why.join("; ");
    }
    Ok(outcome)
}

/// A check that passes or fails as a whole.
pub fn check(
    workspace: &Workspace,
    label: &str,
    command: &mut std::process::Command,
) -> Result<Outcome> {
    let finished = run_logged(workspace, label, command)?;
    Ok(Outcome::of(&finished, counts::whole(finished.success)))
}

fn fmt(workspace: &Workspace) -> Result<Outcome> {
    check(
        workspace,
        "cargo fmt",
        &mut workspace.cargo("fmt --all --check"),
    )
}

/// Builds of a package without its other features, each of which must compile, tests included.
const PARTIAL: [(&str, &[&str]); 3] = [
    ("upt", &["", "contact", "forces", "haptics", "ndarray"]),
    ("tissue", &["", "files", "linear"]),
    ("upt-cli", &["", "files"]), // the first is the demo's
];

fn clippy(workspace: &Workspace) -> Result<Outcome> {
    let run = |label: &str, what: &str| {
        let words = format!("clippy --release --all-targets {what} -- -D warnings");
        check(workspace, label, &mut workspace.cargo(&words))
    };
    let mut outcome = run("cargo clippy", "--workspace")?;
    for (package, builds) in PARTIAL {
        for &features in builds {
            let label = match features {
                "" => format!("cargo clippy, {package} without features"),
                _ => format!("cargo clippy, {package} with {features} alone"),
            };
            let alone = format!("--package {package} --no-default-features --features={features}");
            outcome = outcome.and(run(&label, &alone)?);
        }
    }
    Ok(outcome)
}

fn style(workspace: &Workspace) -> Result<Outcome> {
    venv::install_tools(workspace)?;
    let tool = |name: &str, words: &str| workspace.command(workspace.venv_program(name), words);
    let listed = output(&mut workspace.command("git", "ls-files *.c *.h *.cpp *.hpp"))?;
    // The generated header is compared with a fresh generation instead.
    let files = listed.lines().filter(|name| *name != "include/upt.h");
    let mut format = tool("clang-format", "--dry-run --Werror");
    Ok(check(workspace, "ruff check", &mut tool("ruff", "check"))?
        .and(check(
            workspace,
            "ruff format",
            &mut tool("ruff", "format --check"),
        )?)
        .and(check(
            workspace,
            "unused dependencies",
            &mut workspace.python("tests/style/dependencies.py"),
        )?)
        .and(check(workspace, "clang-format", format.args(files))?))
}

fn rust(workspace: &Workspace) -> Result<Outcome> {
    let mut command = workspace.cargo("test --release --workspace --no-fail-fast");
    ort::set_environment(workspace, &mut command)?;
    let finished = run_logged(
        workspace,
        "cargo test",
        command.env("CARGO_TERM_COLOR", "never"),
    )?;
    let mut outcome = Outcome::of(&finished, counts::cargo(&finished.text));
    if outcome.counts.failed > 0 {
        let tells = |line: &&str| {
            line.ends_with("... FAILED")
                || line.starts_with("error")
                || line.contains("panicked at")
        };
        let failed: Vec<&str> = finished.text.lines().filter(tells).collect();
        outcome.log_tail = format!("{}\n{}", failed.join("\n"), outcome.log_tail);
    }
    Ok(outcome)
}

/// Python tests compare with the Rust side through its commands.
fn python(workspace: &Workspace) -> Result<Outcome> {
    venv::install_training(workspace)?;
    let mut command = workspace.python("-m pytest -q -p no:cacheprovider training");
    workspace.with_parts(&mut command)?;
    let finished = run_logged(workspace, "pytest", &mut command)?;
    Ok(Outcome::of(&finished, counts::pytest(&finished.text)))
}

fn docs(workspace: &Workspace) -> Result<Outcome> {
    venv::install_docs(workspace)?;
    let mut command = workspace.python("tests/docs/run.py");
    workspace.with_parts(&mut command)?;
    let finished = run_logged(workspace, "docs", &mut command)?;
    Ok(Outcome::of(&finished, counts::script(&finished.text)))
}

/// It reads the pages of the archive.
fn package(workspace: &Workspace) -> Result<Outcome> {
    venv::install_docs(workspace)?;
    script(workspace, "package", "tests/package/run.sh", &[])
}

/// No leak, no force that is no number or that stays: 24 simulated hours, or as many as 20 minutes hold; the log says how many.
fn haptics(workspace: &Workspace) -> Result<Outcome> {
    const WORDS: &str = "run --release --package upt-cli -- haptics onnx/brain-coarse-reduced --hours 24 --within 20";
    check(workspace, "upt haptics", &mut workspace.cargo(WORDS))
}
