//! `cargo xtask`: the repository's commands. Each does its own set-up, so that a fresh clone needs
//! nothing but Rust and Python.

mod archive;
mod bench;
mod counts;
mod crates;
mod cross;
mod demo;
mod evidence;
mod footprint;
mod ort;
mod package;
mod parts;
mod process;
mod rivals;
mod sbom;
mod semver;
mod stages;
mod system;
mod test;
mod upkeep;
mod venv;
mod web;
mod wheel;
mod workspace;

use std::process::ExitCode;

use anyhow::Result;
use clap::{Parser, Subcommand};

use workspace::Workspace;

#[derive(Parser)]
#[command(
    name = "cargo xtask",
    about = "Set-up, tests, demo, benches and packages of libupt"
)]
struct Arguments {
    #[command(subcommand)]
    command: Task,
}

#[derive(Subcommand)]
enum Task {
    /// Run all tests of all languages, with all set-up; the last line sums them.
    #[command(
        after_help = "Examples:\n  cargo xtask test\n  cargo xtask test --only rust --only python\n  cargo xtask test --list"
    )]
    Test(test::Options),
    /// Push the brain: reference simulation, replay through every committed bundle, table and page.
    #[command(
        after_help = "Examples:\n  cargo xtask demo\n  cargo xtask demo --organ liver\n  cargo xtask demo --scheme 3 --seed 7"
    )]
    Demo(demo::Options),
    /// Run the speed tables of docs/results/speed.md.
    #[command(
        after_help = "Examples:\n  cargo xtask bench --quick\n  cargo xtask bench --only kernels --json rows.json"
    )]
    Bench(bench::Options),
    /// Show a bundle in the browser, with all set-up.
    #[command(after_help = "Examples:\n  cargo xtask view\n  cargo xtask view onnx/brain-fast")]
    View {
        /// The bundle's folder.
        #[arg(default_value = "onnx/brain")]
        bundle: std::path::PathBuf,
    },
    /// Make the archive for C and C++ hosts, the Unity package, the wheel or the npm package.
    #[command(
        after_help = "Examples:\n  cargo xtask package\n  cargo xtask package --unity\n  cargo xtask package --wheel\n  cargo xtask package --platform windows-x64\n  cargo xtask package --platform web"
    )]
    Package(package::Options),
    /// Write bills of materials (CycloneDX, SPDX) and checksums beside packages; `cargo xtask package` does it too.
    #[command(
        after_help = "Examples:\n  cargo xtask sbom\n  cargo xtask sbom target/package/libupt-0.1.0-linux-x64.tar.gz"
    )]
    Sbom {
        /// Packages; default: all of target/package.
        packages: Vec<std::path::PathBuf>,
    },
    /// Compare the Rust interface of the published packages with that of a release or a commit (cargo-semver-checks).
    #[command(
        after_help = "Examples:\n  cargo xtask semver\n  cargo xtask semver --baseline HEAD~20 --package libupt-contact"
    )]
    Semver(semver::Options),
    /// Write what a manufacturer needs to know of libupt as software of unknown provenance (IEC 62304): requirements and their tests, anomalies, hashes.
    #[command(after_help = "Example:\n  cargo xtask soup --out target/soup")]
    Soup {
        /// Folder for soup.json and soup.md.
        #[arg(long, default_value = "target/soup")]
        out: std::path::PathBuf,
    },
    /// Write a static site that shows organs, for any host.
    #[command(after_help = "Example:\n  cargo xtask site --out site")]
    Site {
        /// Folder for the result; what was in it goes.
        #[arg(long, default_value = "target/site")]
        out: std::path::PathBuf,
    },
    /// Put tables that `cargo xtask study report` wrote into a page.
    #[command(
        after_help = "Example:\n  cargo xtask readme --report target/report/report.md --page target/results/paper-measure.md"
    )]
    Readme {
        /// report.md files of `cargo xtask study report`, in the order in which they should appear.
        #[arg(long = "report", value_name = "FILE", required = true)]
        reports: Vec<std::path::PathBuf>,
        /// The page that takes them, between its markers; from the repository's root.
        #[arg(long, value_name = "FILE")]
        page: std::path::PathBuf,
    },
    /// Compare with what a developer would pick instead, on the same mesh and poses: MuJoCo, Newton, Jolt, rapier, Bullet.
    #[command(
        after_help = "Examples:\n  cargo xtask rivals -- --cases press --only libupt Jolt\n  cargo xtask rivals -- --page target/results/rivals.md"
    )]
    Rivals {
        /// Arguments of the study, such as `--help`.
        #[arg(last = true)]
        arguments: Vec<String>,
    },
    /// Measure libupt: errors, times, abuse, against the reference solver; the tables of docs/results/.
    #[command(
        after_help = "Examples:\n  cargo xtask study help\n  cargo xtask study report --bundle onnx/brain-coarse-reduced --data DATA\n  cargo xtask study stress --quick"
    )]
    Study {
        /// A command of the study and its arguments.
        #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
        arguments: Vec<String>,
    },
    /// Build libupt for each cargo feature and tell what it adds.
    #[command(after_help = "Example:\n  cargo xtask footprint")]
    Footprint {
        /// Page whose table between the marks is replaced.
        #[arg(long, value_name = "FILE")]
        page: Option<std::path::PathBuf>,
    },
    /// Write include/upt.h and the C# bindings from the library's source.
    #[command(after_help = "Examples:\n  cargo xtask header\n  cargo xtask header --check")]
    Header {
        /// Only say whether they are up to date.
        #[arg(long)]
        check: bool,
        /// Write the dump of the ABI that the stage `abi` compares with: at a release.
        #[arg(long, conflicts_with = "check")]
        release: bool,
    },
    /// Write the pages of docs/reference on C++, C#, Python, GDScript and JavaScript from their sources.
    #[command(after_help = "Examples:\n  cargo xtask api\n  cargo xtask api --check")]
    Api {
        /// Only say whether they are up to date.
        #[arg(long)]
        check: bool,
    },
    /// Train, evaluate or export bundles: runs the Python package with its environment set up.
    #[command(
        after_help = "Examples:\n  cargo xtask bundle -- export --help\n  cargo xtask bundle --module upt_training.reduced -- --help"
    )]
    Bundle {
        /// The Python module to run.
        #[arg(long, default_value = "upt_training")]
        module: String,
        /// Its arguments.
        #[arg(last = true)]
        arguments: Vec<String>,
    },
    /// Fetch ONNX Runtime's shared library into target/ort/.
    #[command(
        after_help = "Examples:\n  cargo xtask ort\n  cargo xtask ort --platform windows-x64"
    )]
    Ort {
        /// Default: this machine's.
        #[arg(long)]
        platform: Option<ort::Platform>,
        /// A version whose checksum is in the committed table.
        #[arg(long, default_value = ort::VERSION)]
        version: String,
    },
}

fn main() -> Result<ExitCode> {
    let passed = run(&Workspace::find(), Arguments::parse().command)?;
    Ok(ExitCode::from(u8::from(!passed)))
}

/// False when the command ran and something failed that it has already reported.
fn run(workspace: &Workspace, task: Task) -> Result<bool> {
    match task {
        Task::Test(options) => test::run(workspace, &options),
        Task::Demo(options) => demo::run(workspace, &options),
        Task::Bench(options) => bench::run(workspace, &options),
        Task::View { bundle } => upkeep::view(workspace, &bundle),
        Task::Package(options) => package::run(workspace, &options),
        Task::Sbom { packages } => sbom::run(workspace, &packages),
        Task::Semver(options) => semver::run(workspace, &options),
        Task::Soup { out } => upkeep::soup(workspace, &out),
        Task::Site { out } => web::site(workspace, &out),
        Task::Readme { reports, page } => upkeep::readme(workspace, &page, &reports),
        Task::Rivals { arguments } => rivals::run(workspace, &arguments),
        Task::Study { arguments } => upkeep::study(workspace, &arguments),
        Task::Footprint { page } => footprint::run(workspace, page.as_deref()),
        Task::Header { check, release } => upkeep::header(workspace, check, release),
        Task::Api { check } => upkeep::api(workspace, check),
        Task::Bundle { module, arguments } => upkeep::bundle(workspace, &module, &arguments),
        Task::Ort { platform, version } => {
            let platform = platform.map_or_else(ort::Platform::host, Ok)?;
            let folder = ort::fetch(workspace, platform, &version)?;
            println!("{}", folder.join(platform.library()).display());
            Ok(true)
        }
    }
}
