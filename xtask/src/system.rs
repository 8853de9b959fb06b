//! System packages: what a command needs, what is missing, and installing it where that is allowed.
//!
//! On Debian and Ubuntu missing packages are installed by `apt-get` when the user is root or has
//! `sudo` without a password; `--no-install` turns that off. Elsewhere the names are printed.

use std::path::Path;
use std::process::Command;

use anyhow::Result;

use crate::process::{has_program, run_logged};
use crate::workspace::Workspace;

/// One prerequisite: how it is recognised and which Debian package brings it.
pub struct Package {
    /// Programs of which one must be on the `PATH`; empty where a file or a Python module tells.
    programs: &'static [&'static str],
    /// Files of which one must exist.
    files: &'static [&'static str],
    pub debian: &'static str,
    pub purpose: &'static str,
}

const fn program(
    names: &'static [&'static str],
    debian: &'static str,
    purpose: &'static str,
) -> Package {
    Package {
        programs: names,
        files: &[],
        debian,
        purpose,
    }
}

const fn file(
    paths: &'static [&'static str],
    debian: &'static str,
    purpose: &'static str,
) -> Package {
    Package {
        programs: &[],
        files: paths,
        debian,
        purpose,
    }
}

/// What every command needs: a linker for cargo and Python for ONNX Runtime's wheel.
pub const BASE: &[Package] = &[
    program(
        &["cc", "gcc", "clang"],
        "build-essential",
        "the C compiler and linker",
    ),
    program(&["python3"], "python3", "Python 3.11 or later"),
    program(
        &["python3-venv-module"],
        "python3-venv",
        "Python virtual environments",
    ),
];

/// What the C and C++ tests need.
pub const NATIVE: &[Package] = &[
    program(&["cmake"], "cmake", "the C and C++ tests"),
    program(&["c++", "g++", "clang++"], "g++", "the C++ tests"),
    program(&["pkg-config"], "pkg-config", "the packaging tests"),
    program(&["Xvfb"], "xvfb", "the simulator's window without a screen"),
    program(
        &["xauth"],
        "xauth",
        "the simulator's window without a screen",
    ),
    program(&["valgrind"], "valgrind", "the memory check of the C host"),
    file(
        &["/usr/include/png.h"],
        "libpng-dev",
        "the C++ simulator's screenshots",
    ),
    file(
        &["/usr/include/GLFW/glfw3.h"],
        "libglfw3-dev",
        "the C++ simulator",
    ),
    file(
        &["/usr/include/GL/gl.h"],
        "libgl1-mesa-dev",
        "the C++ simulator",
    ),
    file(
        &[
            "/usr/lib/x86_64-linux-gnu/dri/swrast_dri.so",
            "/usr/lib/aarch64-linux-gnu/dri/swrast_dri.so",
            "/usr/lib/x86_64-linux-gnu/libgallium.so",
            "/usr/lib/x86_64-linux-gnu/dri/libdril_dri.so",
        ],
        "libgl1-mesa-dri",
        "the C++ simulator and Godot without a graphics card",
    ),
];

/// What the C# tests need.
pub const CSHARP: &[Package] = &[
    program(&["mcs"], "mono-mcs", "the C# tests"),
    program(&["mono"], "mono-runtime", "the C# tests"),
    program(&["nunit-console"], "nunit-console", "the C# tests"),
    file(
        &["/usr/lib/cli/nunit.framework-2.6.3/nunit.framework.dll"],
        "libnunit-framework2.6.3-cil",
        "the C# tests",
    ),
];

/// What the tests of `upt view` need.
pub const BROWSER: &[Package] = &[
    program(&["chromium", "google-chrome"], "chromium", "the page"),
    program(&["chromedriver"], "chromium-driver", "the page"),
    file(
        &[
            "/usr/lib/x86_64-linux-gnu/libEGL_mesa.so.0",
            "/usr/lib/aarch64-linux-gnu/libEGL_mesa.so.0",
        ],
        "libegl-mesa0",
        "drawing the page without a graphics card",
    ),
];

/// What the tests for Windows need.
pub const WINDOWS: &[Package] = &[
    program(&["cmake"], "cmake", "the C and C++ tests"),
    program(
        &["x86_64-w64-mingw32-g++"],
        "g++-mingw-w64-x86-64-posix",
        "building for Windows",
    ),
    file(
        &[
            "/usr/lib/wine/wine64",
            "/usr/bin/wine64",
            "/usr/lib/wine-development/wine64",
        ],
        "wine64",
        "running what is built for Windows",
    ),
    program(
        &["lld-link", "lld-link-14", "lld-link-19"],
        "lld",
        "linking as Microsoft's toolchain does",
    ),
];

/// What the tests for Linux arm64 need.
pub const ARM64: &[Package] = &[
    program(&["cmake"], "cmake", "the C and C++ tests"),
    program(
        &["aarch64-linux-gnu-g++"],
        "g++-aarch64-linux-gnu",
        "building for arm64",
    ),
    program(
        &["qemu-aarch64-static", "qemu-aarch64"],
        "qemu-user-static",
        "running what is built for arm64",
    ),
];

impl Package {
    pub fn present(&self) -> bool {
        if self.programs == ["python3-venv-module"] {
            return Command::new("python3")
                .args(["-c", "import venv, ensurepip"])
                .output()
                .is_ok_and(|output| output.status.success());
        }
        self.programs.iter().any(|name| has_program(name))
            || self.files.iter().any(|path| Path::new(path).exists())
    }
}

/// The Debian names of what is missing, after trying to install it.
///
/// `install` is false under `--no-install`. Nothing is an error here: a stage that lacks something
/// is reported as skipped, with these names.
pub fn provide(
    workspace: &Workspace,
    packages: &[&[Package]],
    install: bool,
) -> Result<Vec<String>> {
    let missing = |list: &[&[Package]]| -> Vec<(String, &'static str)> {
        list.iter()
            .flat_map(|group| group.iter())
            .filter(|package| !package.present())
            .map(|package| (package.debian.to_owned(), package.purpose))
            .collect()
    };
    let absent = missing(packages);
    if absent.is_empty() {
        return Ok(Vec::new());
    }
    let names: Vec<String> = absent.iter().map(|(name, _)| name.clone()).collect();
    if install && has_program("apt-get") {
        match privilege() {
            Some(prefix) => install_by_apt(workspace, &prefix, &names)?,
            None => {
                eprintln!("not root and no passwordless sudo: nothing can be installed for you")
            }
        }
    }
    let left = missing(packages);
    if !left.is_empty() {
        eprintln!("missing on this machine:");
        for (name, purpose) in &left {
            eprintln!("  {name:<24} {purpose}");
        }
        let left_names: Vec<&str> = left.iter().map(|(name, _)| name.as_str()).collect();
        eprintln!(
            "on Debian or Ubuntu: apt-get install {}",
            left_names.join(" ")
        );
        eprintln!("elsewhere: install the programs of the same names, then run the command again");
    }
    Ok(left.into_iter().map(|(name, _)| name).collect())
}

/// The words before `apt-get`: none for root, `sudo -n` where it needs no password.
fn privilege() -> Option<Vec<String>> {
    let root = Command::new("id")
        .arg("-u")
        .output()
        .is_ok_and(|output| output.stdout.trim_ascii() == b"0");
    if root {
        return Some(Vec::new());
    }
    let sudo = Command::new("sudo").args(["-n", "true"]).output();
    sudo.is_ok_and(|output| output.status.success())
        .then(|| vec!["sudo".into(), "-n".into()])
}

fn install_by_apt(workspace: &Workspace, prefix: &[String], names: &[String]) -> Result<()> {
    eprintln!("installing {}", names.join(" "));
    let apt = |arguments: &[&str]| {
        let mut words: Vec<String> = prefix.to_vec();
        words.extend([
            "env".into(),
            "DEBIAN_FRONTEND=noninteractive".into(),
            "apt-get".into(),
        ]);
        words.extend(arguments.iter().map(|word| (*word).to_owned()));
        let mut command = Command::new(&words[0]);
        command.args(&words[1..]);
        command
    };
    let log = workspace.logs().join("apt.log");
    run_logged("apt-get update", &mut apt(&["update", "-q"]), &log)?;
    let mut arguments = vec!["install", "-q", "-y", "--no-install-recommends"];
    arguments.extend(names.iter().map(String::as_str));
    let finished = run_logged("apt-get install", &mut apt(&arguments), &log)?;
    if !finished.success {
        eprintln!(
            "apt-get install failed; the end of {}:\n{}",
            log.display(),
            finished.tail(15)
        );
        // One package of a list may be unknown on this release: take the others one by one.
        for name in names {
            run_logged(
                name,
                &mut apt(&["install", "-q", "-y", "--no-install-recommends", name]),
                &log,
            )?;
        }
    }
    Ok(())
}
