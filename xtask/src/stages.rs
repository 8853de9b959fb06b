//! The stages of `cargo xtask test`: one a language or check, each with its own counted result.

use std::path::Path;
use std::process::Command;

use anyhow::Result;

use crate::counts::{self, Counts};
use crate::process::{Finished, has_program, run_checked, run_logged};
use crate::system::{self, Package};
use crate::workspace::Workspace;
use crate::{cross, ort, venv, wheel};

/// What a stage reports.
pub struct Outcome {
    pub counts: Counts,
    /// Why something failed or was skipped; empty where all passed.
    pub note: String,
    /// The end of the log where something failed.
    pub log_tail: String,
    /// The stage did not run at all.
    pub left_out: bool,
}

impl Outcome {
    fn counted(counts: Counts) -> Self {
        Self {
            counts,
            note: String::new(),
            log_tail: String::new(),
            left_out: false,
        }
    }

    pub fn failed(note: String) -> Self {
        Self {
            note,
            ..Self::counted(Counts {
                failed: 1,
                ..Counts::default()
            })
        }
    }

    pub fn skipped(note: String) -> Self {
        Self {
            note,
            left_out: true,
            ..Self::counted(Counts {
                skipped: 1,
                ..Counts::default()
            })
        }
    }

    /// The counts of a program that ran; one that failed without a failed test counts as one failure.
    pub fn of(finished: &Finished, counts: Counts) -> Self {
        let mut outcome = Self::counted(counts);
        if !finished.success && counts.failed == 0 {
            outcome.counts.failed = 1;
        }
        if finished.success && counts == Counts::default() {
            outcome.counts.failed = 1;
            outcome.note = "ran no tests".into();
        }
        if outcome.counts.failed > 0 {
            if outcome.note.is_empty() {
                outcome.note = format!("see {}", finished.log.display());
            }
            outcome.log_tail = finished.tail(40);
        }
        outcome
    }
}

pub struct Stage {
    pub name: &'static str,
    pub about: &'static str,
    pub needs: &'static [&'static [Package]],
    /// Too long for every run: in the nightly one, and by name.
    pub nightly: bool,
    pub run: fn(&Workspace) -> Result<Outcome>,
}

/// In this order: what is cheap and most often wrong comes first.
pub const STAGES: &[Stage] = &[
    Stage {
        name: "fmt",
        about: "cargo fmt --check",
        needs: &[],
        nightly: false,
        run: fmt,
    },
    Stage {
        name: "clippy",
        about: "cargo clippy, warnings are errors; also of builds with a single feature or none",
        needs: &[],
        nightly: false,
        run: clippy,
    },
    Stage {
        name: "style",
        about: "ruff, clang-format, unused dependencies",
        needs: &[],
        nightly: false,
        run: style,
    },
    Stage {
        name: "rust",
        about: "cargo test --release --workspace",
        needs: &[],
        nightly: false,
        run: rust,
    },
    Stage {
        name: "loom",
        about: "every interleaving of what threads share without a lock",
        needs: &[],
        nightly: false,
        run: loom,
    },
    Stage {
        name: "python",
        about: "pytest of training/",
        needs: &[],
        nightly: false,
        run: python,
    },
    Stage {
        name: "wheel",
        about: "the Python package: wheel, types, pytest",
        needs: &[],
        nightly: false,
        run: wheel::stage,
    },
    Stage {
        name: "docs",
        about: "the book: links, code blocks, commands, index",
        needs: &[],
        nightly: false,
        run: docs,
    },
    Stage {
        name: "c",
        about: "C and C++ hosts, CMake package, simulator",
        needs: &[system::NATIVE],
        nightly: false,
        run: c,
    },
    Stage {
        name: "csharp",
        about: "the Unity package's C# under Mono",
        needs: &[system::CSHARP],
        nightly: false,
        run: csharp,
    },
    Stage {
        name: "godot",
        about: "the GDExtension in a real engine",
        needs: &[system::NATIVE],
        nightly: false,
        run: godot,
    },
    Stage {
        name: "package",
        about: "the archive, unpacked elsewhere",
        needs: &[system::NATIVE],
        nightly: false,
        run: package,
    },
    Stage {
        name: "view",
        about: "upt view in headless Chromium",
        needs: &[system::BROWSER],
        nightly: false,
        run: view,
    },
    Stage {
        name: "haptics",
        about: "a day of simulated haptics, or what fits into 20 minutes",
        needs: &[system::NATIVE],
        nightly: true,
        run: haptics,
    },
    Stage {
        name: "races",
        about: "what threads share: Miri, ThreadSanitizer",
        needs: &[],
        nightly: true,
        run: races,
    },
    Stage {
        name: "windows",
        about: "built by MinGW, run by Wine",
        needs: &[system::WINDOWS],
        nightly: true,
        run: cross::windows,
    },
    Stage {
        name: "arm64",
        about: "Linux arm64, run by qemu",
        needs: &[system::ARM64],
        nightly: true,
        run: cross::arm64,
    },
];

fn cargo(workspace: &Workspace) -> Command {
    let mut command = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    command.current_dir(&workspace.root);
    command
}

/// No leak, no force that is no number or that stays: 24 simulated hours, or as many as 20 minutes hold; the log says how many.
fn haptics(workspace: &Workspace) -> Result<Outcome> {
    let mut command = cargo(workspace);
    command.args(["run", "--release", "--package", "upt-cli", "--", "haptics"]);
    command.args([
        "onnx/brain-coarse-reduced",
        "--hours",
        "24",
        "--within",
        "20",
    ]);
    check(workspace, "upt haptics", &mut command)
}

fn loom(workspace: &Workspace) -> Result<Outcome> {
    script_with(workspace, "loom", "tests/races/run.sh", |command| {
        command.arg("loom");
    })
}

fn races(workspace: &Workspace) -> Result<Outcome> {
    script_with(workspace, "races", "tests/races/run.sh", |command| {
        command.arg("nightly");
    })
}

/// A check that passes or fails as a whole.
pub fn check(workspace: &Workspace, label: &str, command: &mut Command) -> Result<Outcome> {
    let log = workspace
        .logs()
        .join(format!("{}.log", label.replace(' ', "-")));
    let finished = run_logged(label, command, &log)?;
    let passed = u64::from(finished.success);
    Ok(Outcome::of(
        &finished,
        Counts {
            passed,
            failed: 1 - passed,
            skipped: 0,
        },
    ))
}

fn fmt(workspace: &Workspace) -> Result<Outcome> {
    check(
        workspace,
        "cargo fmt",
        cargo(workspace).args(["fmt", "--all", "--check"]),
    )
}

/// Builds of a package without its other features, each of which must compile, tests included.
const PARTIAL: [(&str, &[&str]); 3] = [
    ("upt", &["", "contact", "forces", "haptics", "ndarray"]),
    ("tissue", &["", "files", "linear"]),
    ("upt-cli", &["", "files"]), // the first is the demo's
];

fn clippy(workspace: &Workspace) -> Result<Outcome> {
    let run = |label: &str, arguments: &[&str]| {
        let mut command = cargo(workspace);
        command.args(["clippy", "--release", "--all-targets"]);
        command.args(arguments).args(["--", "-D", "warnings"]);
        check(workspace, label, &mut command)
    };
    let mut outcomes = vec![run("cargo clippy", &["--workspace"])?];
    for (package, builds) in PARTIAL {
        for &features in builds {
            let label = match features {
                "" => format!("cargo clippy, {package} without features"),
                _ => format!("cargo clippy, {package} with {features} alone"),
            };
            let alone = ["--no-default-features", "--features", features];
            outcomes.push(run(
                &label,
                &[&["--package", package], &alone[..]].concat(),
            )?);
        }
    }
    Ok(joined(outcomes))
}

fn style(workspace: &Workspace) -> Result<Outcome> {
    venv::install_tools(workspace)?;
    let ruff = workspace.venv_program("ruff");
    let mut parts = vec![
        check(
            workspace,
            "ruff check",
            Command::new(&ruff)
                .arg("check")
                .current_dir(&workspace.root),
        )?,
        check(
            workspace,
            "ruff format",
            Command::new(&ruff)
                .args(["format", "--check"])
                .current_dir(&workspace.root),
        )?,
        check(
            workspace,
            "unused dependencies",
            Command::new(workspace.python()).arg(workspace.path("tests/style/dependencies.py")),
        )?,
    ];
    let listed = Command::new("git")
        .args(["ls-files", "-z", "*.c", "*.h", "*.cpp", "*.hpp"])
        .current_dir(&workspace.root)
        .output()?;
    let listed = String::from_utf8_lossy(&listed.stdout).into_owned();
    // The generated header is compared with a fresh generation instead.
    let files: Vec<&str> = listed
        .split('\0')
        .filter(|name| !name.is_empty() && *name != "include/upt.h")
        .collect();
    if !files.is_empty() {
        let mut command = Command::new(workspace.venv_program("clang-format"));
        command
            .args(["--dry-run", "--Werror"])
            .args(&files)
            .current_dir(&workspace.root);
        parts.push(check(workspace, "clang-format", &mut command)?);
    }
    Ok(joined(parts))
}

pub fn joined(parts: Vec<Outcome>) -> Outcome {
    let mut sum = Outcome::counted(Counts::default());
    for part in parts {
        sum.counts += part.counts;
        for (all, one) in [
            (&mut sum.note, part.note),
            (&mut sum.log_tail, part.log_tail),
        ] {
            if !one.is_empty() {
                if !all.is_empty() {
                    all.push('\n');
                }
                all.push_str(&one);
            }
        }
    }
    sum
}

fn rust(workspace: &Workspace) -> Result<Outcome> {
    let library = ort::host_library(workspace)?;
    let mut command = cargo(workspace);
    command
        .args(["test", "--release", "--workspace", "--no-fail-fast"])
        .env("CARGO_TERM_COLOR", "never");
    ort::set_environment(&mut command, &library);
    let finished = run_logged(
        "cargo test",
        &mut command,
        &workspace.logs().join("cargo-test.log"),
    )?;
    let mut outcome = Outcome::of(&finished, counts::cargo(&finished.text));
    if outcome.counts.failed > 0 {
        let failed: Vec<&str> = finished
            .text
            .lines()
            .filter(|line| {
                line.ends_with("... FAILED")
                    || line.starts_with("error")
                    || line.contains("panicked at")
            })
            .collect();
        outcome.log_tail = format!("{}\n{}", failed.join("\n"), outcome.log_tail);
    }
    Ok(outcome)
}

fn python(workspace: &Workspace) -> Result<Outcome> {
    if !workspace.path("training/pyproject.toml").exists() {
        return Ok(Outcome::skipped(
            "training/pyproject.toml does not exist".into(),
        ));
    }
    let library = ort::host_library(workspace)?;
    venv::install_training(workspace)?;
    // Python tests compare with the Rust side through its commands.
    build(workspace)?;
    let mut command = Command::new(workspace.python());
    command
        .args(["-m", "pytest", "-q", "-p", "no:cacheprovider", "training"])
        .current_dir(&workspace.root);
    set_test_environment(workspace, &mut command, &library);
    let finished = run_logged("pytest", &mut command, &workspace.logs().join("pytest.log"))?;
    Ok(Outcome::of(&finished, counts::pytest(&finished.text)))
}

/// `libupt.so`, the static library and the command `upt`, in the release profile that the tests use too.
pub fn build(workspace: &Workspace) -> Result<()> {
    let mut command = cargo(workspace);
    command.args(["build", "--release", "-p", "upt", "-p", "upt-cli"]);
    run_checked(
        "cargo build",
        &mut command,
        &workspace.logs().join("cargo-build.log"),
    )?;
    Ok(())
}

/// The command `upt` for the demo. On a fresh clone it is built without what the demo does not use (files of other
/// programs, sparse factorisation: half of a cold build); a whole `upt` that is there is brought up to date instead.
pub fn build_for_demo(workspace: &Workspace) -> Result<()> {
    let version = Command::new(workspace.upt()).arg("--version").output();
    let whole = version.is_ok_and(|output| {
        output.status.success() && !String::from_utf8_lossy(&output.stdout).contains("without")
    });
    if whole {
        return build(workspace);
    }
    let mut command = cargo(workspace);
    command.args([
        "build",
        "--release",
        "-p",
        "upt-cli",
        "--no-default-features",
    ]);
    run_checked(
        "cargo build, without what the demo does not use",
        &mut command,
        &workspace.logs().join("cargo-build.log"),
    )?;
    Ok(())
}

/// What the test scripts of the other languages find their parts by.
pub fn set_test_environment(workspace: &Workspace, command: &mut Command, library: &Path) {
    ort::set_environment(command, library);
    command
        .env("UPT_ROOT", &workspace.root)
        .env("UPT_LIB_DIR", workspace.release())
        .env("UPT_INCLUDE_DIR", workspace.path("include"))
        .env("UPT_COMMAND", workspace.upt())
        .env("UPT_PYTHON", workspace.python())
        .env("UPT_BUNDLES", workspace.path("onnx"))
        .env("UPT_BUILD_DIR", workspace.path("target"));
}

/// Runs a test script whose last line reads `N passed, N failed, N skipped`.
fn script(workspace: &Workspace, name: &str, path: &str) -> Result<Outcome> {
    script_with(workspace, name, path, |_| {})
}

/// As [`script`], with arguments and environment of its own.
pub fn script_with(
    workspace: &Workspace,
    name: &str,
    path: &str,
    prepare: impl FnOnce(&mut Command),
) -> Result<Outcome> {
    let file = workspace.path(path);
    if !file.exists() {
        return Ok(Outcome::skipped(format!("{path} does not exist")));
    }
    let library = ort::host_library(workspace)?;
    build(workspace)?;
    let mut command = Command::new("bash");
    command.arg(&file).current_dir(&workspace.root);
    set_test_environment(workspace, &mut command, &library);
    prepare(&mut command);
    let finished = run_logged(
        name,
        &mut command,
        &workspace.logs().join(format!("{name}.log")),
    )?;
    let counts = counts::script(&finished.text).unwrap_or_default();
    let mut outcome = Outcome::of(&finished, counts);
    if counts.skipped > 0 && outcome.note.is_empty() {
        let why: Vec<&str> = finished
            .text
            .lines()
            .filter(|line| line.to_lowercase().contains("skipped:"))
            .collect();
        outcome.note = why.join("; ");
    }
    Ok(outcome)
}

fn docs(workspace: &Workspace) -> Result<Outcome> {
    let library = ort::host_library(workspace)?;
    venv::install_docs(workspace)?;
    build(workspace)?;
    let mut command = Command::new(workspace.python());
    command
        .arg("tests/docs/run.py")
        .current_dir(&workspace.root);
    set_test_environment(workspace, &mut command, &library);
    let log = workspace.logs().join("docs.log");
    let finished = run_logged("docs", &mut command, &log)?;
    let counts = counts::script(&finished.text).unwrap_or_default();
    Ok(Outcome::of(&finished, counts))
}

fn c(workspace: &Workspace) -> Result<Outcome> {
    script(workspace, "c", "tests/c/run.sh")
}

fn csharp(workspace: &Workspace) -> Result<Outcome> {
    script(workspace, "csharp", "tests/csharp/run.sh")
}

fn godot(workspace: &Workspace) -> Result<Outcome> {
    script(workspace, "godot", "examples/godot/run.sh")
}

fn view(workspace: &Workspace) -> Result<Outcome> {
    script(workspace, "view", "tests/view/run.sh")
}

fn package(workspace: &Workspace) -> Result<Outcome> {
    if !has_program("cmake") {
        return Ok(Outcome::skipped("needs cmake".into()));
    }
    // It reads the pages of the archive.
    venv::install_docs(workspace)?;
    script(workspace, "package", "tests/package/run.sh")
}
