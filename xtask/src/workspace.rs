//! Where things are: the repository root and the folders under `target/` that the commands fill.

use std::path::{Path, PathBuf};

/// The repository's folders. Everything that a command makes lies under `target/`.
#[derive(Clone, Debug)]
pub struct Workspace {
    /// The folder that holds the root `Cargo.toml`.
    pub root: PathBuf,
    /// `CARGO_TARGET_DIR` where it is set, else `target/`: what cargo builds.
    pub cargo_target: PathBuf,
}

impl Workspace {
    /// Found from the place where this crate was compiled, so the commands work from any folder.
    pub fn find() -> Self {
        let root = Path::new(env!("CARGO_MANIFEST_DIR"))
            .parent()
            .map(Path::to_path_buf)
            .unwrap_or_else(|| PathBuf::from("."));
        let cargo_target = match std::env::var_os("CARGO_TARGET_DIR") {
            Some(dir) if Path::new(&dir).is_absolute() => PathBuf::from(dir),
            Some(dir) => root.join(dir),
            None => root.join("target"),
        };
        Self { root, cargo_target }
    }

    pub fn path(&self, relative: &str) -> PathBuf {
        self.root.join(relative)
    }

    /// Release builds: `libupt.so`, `upt`.
    pub fn release(&self) -> PathBuf {
        self.cargo_target.join("release")
    }

    pub fn ort(&self) -> PathBuf {
        self.path("target/ort")
    }

    pub fn venv(&self) -> PathBuf {
        self.path("target/venv")
    }

    pub fn logs(&self) -> PathBuf {
        self.path("target/xtask-logs")
    }

    /// The virtual environment's interpreter.
    pub fn python(&self) -> PathBuf {
        self.venv_program("python")
    }

    pub fn venv_program(&self, name: &str) -> PathBuf {
        Self::program_in(&self.venv(), name)
    }

    /// A program of the virtual environment in `folder`.
    pub fn program_in(folder: &Path, name: &str) -> PathBuf {
        if cfg!(windows) {
            folder.join("Scripts").join(format!("{name}.exe"))
        } else {
            folder.join("bin").join(name)
        }
    }

    /// The command `upt` as `cargo build --release` leaves it.
    pub fn upt(&self) -> PathBuf {
        self.release()
            .join(format!("upt{}", std::env::consts::EXE_SUFFIX))
    }
}
