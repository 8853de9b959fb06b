//! Where things are: the repository root, the folders under `target/` that the commands fill, and the programs in them.

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result};
use ort_wheel::Platform;
use walkdir::WalkDir;

/// The repository's folders. Everything that a command makes lies under `target/`.
#[derive(Clone, Debug)]
pub struct Workspace {
    /// The folder that holds the root `Cargo.toml`.
    pub root: PathBuf,
    /// Release builds, `libupt.so` and `upt`, in `CARGO_TARGET_DIR` where it is set, else in `target/`.
    pub release: PathBuf,
}

impl Workspace {
    /// Found from the place where this crate was compiled, so the commands work from any folder.
    pub fn find() -> Self {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).with_file_name("");
        let target = std::env::var_os("CARGO_TARGET_DIR").unwrap_or_else(|| "target".into());
        Self {
            release: root.join(target).join("release"),
            root,
        }
    }

    /// Whether tests run in full, as `.ci/run nightly` asks.
    pub fn is_nightly(&self) -> bool {
        std::env::var("UPT_NIGHTLY").is_ok_and(|value| value == "1")
    }

    pub fn path(&self, relative: &str) -> PathBuf {
        self.root.join(relative)
    }

    /// Folders of the committed bundles, by name.
    pub fn bundles(&self) -> Result<Vec<PathBuf>> {
        let entries = std::fs::read_dir(self.path("onnx"))?;
        let folders = entries.filter_map(|entry| Some(entry.ok()?.path()));
        let is_bundle = |folder: &PathBuf| folder.join("bundle.json").is_file();
        let mut found: Vec<PathBuf> = folders.filter(is_bundle).collect();
        found.sort();
        Ok(found)
    }

    /// The files of a bundle as one folder of its own: name and place, those of its body too.
    pub fn bundle_files(folder: &Path) -> Result<Vec<(String, PathBuf)>> {
        let path = folder.join("bundle.json");
        let bytes =
            std::fs::read(&path).with_context(|| format!("cannot read {}", path.display()))?;
        let manifest: serde_json::Value = serde_json::from_slice(&bytes)?;
        let listed = manifest["files"].as_object().context("files")?.keys();
        let body = manifest["body"].as_str();
        let place = |name: &String| {
            let own = folder.join(name);
            match body.filter(|_| !own.exists()) {
                Some(body) => folder.with_file_name(body).join(name),
                None => own,
            }
        };
        let mut files: Vec<_> = listed.map(|name| (name.clone(), place(name))).collect();
        files.push(("bundle.json".to_owned(), path));
        Ok(files)
    }

    /// A program of the virtual environment.
    pub fn venv_program(&self, name: &str) -> PathBuf {
        program_in(&self.path("target/venv"), name)
    }

    /// The command `upt` as `cargo build --release` leaves it.
    pub fn upt(&self) -> PathBuf {
        self.program("upt")
    }

    /// The study of libupt, `crates/study`.
    pub fn study(&self) -> PathBuf {
        self.program("upt-study")
    }

    fn program(&self, name: &str) -> PathBuf {
        let name = format!("{name}{}", std::env::consts::EXE_SUFFIX);
        self.release.join(name)
    }

    /// `program` in the repository's root with these arguments, which spaces part. Python keeps what it compiled, whatever the environment says:
    /// the tests start it some hundred times, and compiling torch is most of an import.
    pub fn command(&self, program: impl AsRef<std::ffi::OsStr>, arguments: &str) -> Command {
        let mut command = Command::new(program);
        command.current_dir(&self.root);
        command.env_remove("PYTHONDONTWRITEBYTECODE");
        command.args(arguments.split_whitespace());
        command
    }

    pub fn cargo(&self, arguments: &str) -> Command {
        let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
        self.command(cargo, arguments)
    }

    /// The virtual environment's Python.
    pub fn python(&self, arguments: &str) -> Command {
        self.command(self.venv_program("python"), arguments)
    }

    pub fn bash(&self, script: &str) -> Command {
        self.command("bash", script)
    }
}

/// libupt's name on a platform.
pub fn library(platform: Platform) -> &'static str {
    match platform {
        Platform::WindowsX64 => "upt.dll",
        Platform::MacosArm64 | Platform::MacosX64 => "libupt.dylib",
        Platform::LinuxX64 | Platform::LinuxArm64 => "libupt.so",
    }
}

/// A program of the virtual environment in `folder`.
pub fn program_in(folder: &Path, name: &str) -> PathBuf {
    match cfg!(windows) {
        true => folder.join("Scripts").join(format!("{name}.exe")),
        false => folder.join("bin").join(name),
    }
}

/// Copies a file or a folder; links are followed.
pub fn copy(from: &Path, to: &Path) -> Result<()> {
    for entry in WalkDir::new(from).follow_links(true) {
        let entry = entry?;
        let place = match entry.depth() {
            0 => to.to_owned(),
            _ => to.join(entry.path().strip_prefix(from)?),
        };
        if !entry.file_type().is_dir() {
            std::fs::create_dir_all(place.with_file_name(""))?;
            let (from, to) = (entry.path().display(), place.display());
            std::fs::copy(entry.path(), &place)
                .with_context(|| format!("cannot copy {from} to {to}"))?;
        }
    }
    Ok(())
}

/// Replaces what stands between the markers `<!-- cargo xtask NAME: begin -->` and `... end -->` of a page.
///
/// # Errors
/// Where the page or a marker is missing.
pub fn write_between_markers(
    page: &Path,
    name: &str,
    text: impl FnOnce(&str) -> Result<String>,
) -> Result<()> {
    let place = page.display();
    let whole = std::fs::read_to_string(page).with_context(|| format!("cannot read {place}"))?;
    let begin = format!("<!-- cargo xtask {name}: begin -->\n");
    let end = format!("<!-- cargo xtask {name}: end -->");
    let found = whole.find(&begin).zip(whole.find(&end));
    let (start, stop) =
        found.with_context(|| format!("{place}: no markers `{}` and `{end}`", begin.trim()))?;
    let start = start + begin.len();
    let text = text(&whole[start..stop])?;
    std::fs::write(page, format!("{}{text}{}", &whole[..start], &whole[stop..]))?;
    println!("{place} written");
    Ok(())
}
