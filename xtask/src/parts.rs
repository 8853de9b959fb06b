//! What is built and fetched before anything can run: libupt, the command `upt`, the study, ONNX Runtime.

use std::process::Command;

use anyhow::Result;

use crate::ort;
use crate::process::run_checked;
use crate::workspace::Workspace;

impl Workspace {
    /// `libupt.so`, the static library, the command `upt` and the study, in the release profile that the tests use too.
    pub fn build(&self) -> Result<()> {
        let mut command = self.cargo("build --release -p libupt -p upt-cli -p upt-study");
        run_checked(self, "cargo build", &mut command)
    }

    /// The command `upt` and the study, for the demo. On a fresh clone it is built without what the demo does not use (files of other
    /// programs, sparse factorisation: half of a cold build); a whole `upt` that is there is brought up to date instead.
    pub fn build_for_demo(&self) -> Result<()> {
        let version = Command::new(self.upt()).arg("--version").output();
        let whole = version.is_ok_and(|output| {
            output.status.success() && !String::from_utf8_lossy(&output.stdout).contains("without")
        });
        if whole {
            return self.build();
        }
        let label = "cargo build, without what the demo does not use";
        let mut command =
            self.cargo("build --release -p upt-cli -p upt-study --no-default-features");
        run_checked(self, label, &mut command)
    }

    /// Builds, fetches ONNX Runtime, and sets what the test scripts of the other languages find their parts by.
    pub fn with_parts(&self, command: &mut Command) -> Result<()> {
        ort::set_environment(self, command)?;
        self.build()?;
        command
            .env("UPT_ROOT", &self.root)
            .env("UPT_LIB_DIR", &self.release)
            .env("UPT_INCLUDE_DIR", self.path("include"))
            .env("UPT_COMMAND", self.upt())
            .env("UPT_STUDY", self.study())
            .env("UPT_PYTHON", self.venv_program("python"))
            .env("UPT_BUNDLES", self.path("onnx"))
            .env("UPT_BUILD_DIR", self.path("target"));
        Ok(())
    }
}
