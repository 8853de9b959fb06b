//! The stages of `cargo xtask test`: one a language or check, each with its own counted result.

use anyhow::Result;

use crate::counts::{self, Outcome, check, counted, script};
use crate::system::{self, Needs};
use crate::workspace::Workspace;
use crate::{cross, ort, venv, web, wheel};

pub struct Stage {
    pub name: &'static str,
    pub about: &'static str,
    /// Packages without which it is skipped.
    pub needs: Needs,
    pub run: Run,
}

/// How a stage runs.
pub enum Run {
    Function(fn(&Workspace) -> Result<Outcome>),
    /// Arguments of cargo; passes or fails as a whole.
    Cargo(&'static str),
    /// A test script and its arguments; its last line reads `N passed, N failed, N skipped`.
    Script(&'static str),
}

use Run::{Cargo, Function, Script};

const fn stage(name: &'static str, about: &'static str, needs: Needs, run: Run) -> Stage {
    Stage {
        name,
        about,
        needs,
        run,
    }
}

/// Rust's tests, with the features of a release, so that what [`Workspace::build`] wants later is built already.
const TESTS: &str = "test --release --workspace --exclude upt-bindgen";

/// No leak, no force that is no number or that stays; the log says how many hours fitted.
const HAPTICS: &str =
    "run --release --package upt-study -- haptics onnx/brain-coarse-reduced --hours 24 --within 20";

/// In this order: what is cheap and most often wrong comes first. Groups run one after another, the lanes of a group at the same
/// time, the stages of a lane one after another. No stage runs beside `build`, which replaces the programs that others use. A lane
/// waits now and then for one core, so that two of them keep two cores busy.
#[rustfmt::skip]
pub const STAGES: &[&[&[Stage]]] = &[
    &[&[
        stage("fmt", "cargo fmt --check", "", Cargo("fmt --all --check")),
        stage("clippy", "cargo clippy, warnings are errors; also without features, nightly for WebAssembly and for Windows", "", Function(clippy)),
        stage("rustdoc", "cargo doc of the libraries, warnings are errors", "", Function(rustdoc)),
        stage("style", "ruff, clang-format, dependencies, licences, circles and upward imports, sizes of files", "", Function(style)),
        stage("abi", "bindings are fresh, and the last release's C ABI stands", "", Function(abi)),
        stage("build", "cargo test --release --workspace --no-run", "", Function(build)),
    ]],
    &[
        &[
            stage("rust", "cargo test --release --workspace", "", Function(rust)),
            stage("view", "upt view in headless Chromium", system::BROWSER, Script("tests/view/run.sh")),
            stage("loom", "every interleaving of what threads share without a lock", "", Script("tests/races/run.sh loom")),
            stage("wheel", "the Python package: wheel, types, pytest", "", Function(wheel::stage)),
            stage("docs", "the book: links, code blocks, commands, index", "", Function(docs)),
            stage("csharp", "the Unity package's C# under Mono", system::CSHARP, Script("tests/csharp/run.sh")),
        ],
        &[
            stage("python", "pytest of training/", "", Function(python)),
            stage("web", "WebAssembly in Node, the site in headless Chromium", system::WEB, Function(web::stage)),
            stage("c", "C and C++ hosts, CMake package, simulator", system::NATIVE, Script("tests/c/run.sh")),
            stage("package", "the archive, unpacked elsewhere", system::PACKAGE, Function(package)),
            stage("godot", "the GDExtension in a real engine", system::NATIVE, Script("examples/godot/run.sh")),
        ],
    ],
];

/// Too long for every run: these are in the nightly one, and run by name.
#[rustfmt::skip]
pub const NIGHTLY: &[&[&[Stage]]] = &[&[&[
    stage("haptics", "a day of simulated haptics, or what fits into 20 minutes", system::NATIVE, Cargo(HAPTICS)),
    stage("races", "what threads share: Miri, ThreadSanitizer", "", Script("tests/races/run.sh nightly")),
    stage("windows", "built by MinGW, run by Wine", system::WINDOWS, Function(cross::windows)),
    stage("arm64", "Linux arm64, run by qemu", system::ARM64, Function(cross::arm64)),
    stage("linked", "macOS, MSVC and Android: linked, the files read, MSVC's run by Wine", system::WINDOWS, Function(cross::linked_stage)),
]]];

impl Stage {
    /// Runs it where nothing that it needs is missing; an error is a failure.
    pub fn outcome(&self, workspace: &Workspace) -> Outcome {
        let missing = system::missing(self.needs);
        if !missing.is_empty() {
            return Outcome::skipped(&format!("needs {}", missing.join(", ")));
        }
        let outcome = match self.run {
            Function(run) => run(workspace),
            Cargo(words) => check(workspace, self.name, &mut workspace.cargo(words)),
            Script(path) => script(workspace, self.name, path, &[]),
        };
        outcome.unwrap_or_else(|error| Outcome::failed(format!("{error:#}")))
    }
}

fn style(workspace: &Workspace) -> Result<Outcome> {
    venv::install(workspace, venv::TOOLS)?;
    let mut command = workspace.bash("tests/style/run.sh");
    command.env("UPT_PYTHON", workspace.venv_program("python"));
    counted(workspace, "style", &mut command, counts::summary)
}

fn clippy(workspace: &Workspace) -> Result<Outcome> {
    let mut command = workspace.bash("tests/style/clippy.sh");
    counted(workspace, "cargo clippy", &mut command, counts::summary)
}

/// In release, as `clippy` before it: what the two check of other crates is the same.
fn rustdoc(workspace: &Workspace) -> Result<Outcome> {
    let mut command = workspace.cargo("doc --release --no-deps --workspace --lib");
    command.env("RUSTDOCFLAGS", "-D warnings");
    check(workspace, "cargo doc", &mut command)
}

/// Apart from [`rust`]: the layouts that it compares are written by a feature of libupt that no release has.
fn abi(workspace: &Workspace) -> Result<Outcome> {
    let mut command = workspace.cargo("test --profile layout --no-fail-fast -p upt-bindgen");
    counted(workspace, "cargo test", &mut command, counts::cargo)
}

/// What all later stages run, and ONNX Runtime.
fn build(workspace: &Workspace) -> Result<Outcome> {
    let mut command = workspace.cargo(&format!("{TESTS} --no-run"));
    ort::set_environment(workspace, &mut command)?;
    check(workspace, "cargo test --no-run", &mut command)
}

fn rust(workspace: &Workspace) -> Result<Outcome> {
    let mut command = workspace.cargo(&format!("{TESTS} --no-fail-fast"));
    if workspace.is_nightly() {
        // A test that is too long for every run is ignored, and says so.
        command.args(["--", "--include-ignored"]);
    }
    ort::set_environment(workspace, &mut command)?;
    command.env("CARGO_TERM_COLOR", "never");
    counted(workspace, "cargo test", &mut command, counts::cargo)
}

/// Python tests compare with the Rust side through its commands.
fn python(workspace: &Workspace) -> Result<Outcome> {
    venv::install(workspace, venv::TRAINING)?;
    in_python(workspace, "-m pytest -q -rs -p no:cacheprovider training")
}

fn docs(workspace: &Workspace) -> Result<Outcome> {
    venv::install(workspace, venv::DOCS)?;
    in_python(workspace, "tests/docs/run.py")
}

fn in_python(workspace: &Workspace, words: &str) -> Result<Outcome> {
    let mut command = workspace.python(words);
    workspace.with_parts(&mut command)?;
    counted(workspace, words, &mut command, counts::summary)
}

/// It reads the pages of the archive, and follows the recipes of other package managers.
fn package(workspace: &Workspace) -> Result<Outcome> {
    venv::install(workspace, venv::DOCS)?;
    venv::install(workspace, venv::RECIPES)?;
    script(workspace, "package", "tests/package/run.sh", &[])
}
