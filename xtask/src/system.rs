//! System packages: what a command needs, what is missing, and installing it where that is allowed.
//!
//! On Debian and Ubuntu missing packages are installed by `apt-get` when the user is root or has
//! `sudo` without a password; `--no-install` turns that off. Elsewhere the names are printed.

use std::path::Path;
use std::process::Command;

use anyhow::Result;

use crate::process::run_logged;
use crate::workspace::Workspace;

/// Prerequisites, one a line: the Debian package, then programs on the `PATH` or files of which one must be there, or
/// `import:` and modules that Python must have.
pub type Needs = &'static str;

/// What every command needs: a linker for cargo and Python for ONNX Runtime's wheel.
pub const BASE: Needs = "
    build-essential  cc gcc clang
    python3          python3
    python3-venv     import:venv,ensurepip";

/// What the C and C++ tests need, and those of Godot: also without a screen and without a graphics card.
pub const NATIVE: Needs = "
    cmake            cmake
    g++              c++ g++ clang++
    pkg-config       pkg-config
    xvfb             Xvfb
    xauth            xauth
    valgrind         valgrind
    libpng-dev       /usr/include/png.h
    libglfw3-dev     /usr/include/GLFW/glfw3.h
    libgl1-mesa-dev  /usr/include/GL/gl.h
    libgl1-mesa-dri  /usr/lib/x86_64-linux-gnu/dri/swrast_dri.so /usr/lib/aarch64-linux-gnu/dri/swrast_dri.so \
                     /usr/lib/x86_64-linux-gnu/libgallium.so /usr/lib/x86_64-linux-gnu/dri/libdril_dri.so";

/// What the tests of packages need.
pub const PACKAGE: Needs = "
    cmake       cmake
    g++         c++ g++ clang++
    pkg-config  pkg-config
    dpkg-dev    dpkg-source
    lintian     lintian";

/// What the C# tests need.
pub const CSHARP: Needs = "
    mono-mcs                     mcs
    mono-runtime                 mono
    nunit-console                nunit-console
    libnunit-framework2.6.3-cil  /usr/lib/cli/nunit.framework-2.6.3/nunit.framework.dll";

/// What the tests of `upt view` need.
pub const BROWSER: Needs = "
    chromium         chromium google-chrome
    chromium-driver  chromedriver
    libegl-mesa0     /usr/lib/x86_64-linux-gnu/libEGL_mesa.so.0 /usr/lib/aarch64-linux-gnu/libEGL_mesa.so.0";

/// What the tests of the module need; without a browser they leave out the page.
pub const WEB: Needs = "
    nodejs           node nodejs";

/// What the tests for Windows need.
pub const WINDOWS: Needs = "
    cmake                       cmake
    g++-mingw-w64-x86-64-posix  x86_64-w64-mingw32-g++
    wine64                      /usr/lib/wine/wine64 /usr/bin/wine64 /usr/lib/wine-development/wine64
    lld                         lld-link lld-link-14 lld-link-19";

/// What the tests for Linux arm64 need.
pub const ARM64: Needs = "
    cmake                  cmake
    g++-aarch64-linux-gnu  aarch64-linux-gnu-g++
    qemu-user-static       qemu-aarch64-static qemu-aarch64";

/// The Debian names of what is not there.
pub fn missing(needs: Needs) -> Vec<&'static str> {
    let lines = needs.lines().filter_map(|line| line.trim().split_once(' '));
    let absent = lines.filter(|(_, signs)| !signs.split_whitespace().any(is_there));
    absent.map(|(debian, _)| debian).collect()
}

fn is_there(sign: &str) -> bool {
    match sign.strip_prefix("import:") {
        Some(modules) => succeeds("python3", &["-c", &format!("import {modules}")]),
        None if sign.starts_with('/') => Path::new(sign).exists(),
        None => has_program(sign),
    }
}

/// True when `name` is a program on the `PATH`.
pub fn has_program(name: &str) -> bool {
    let path = std::env::var_os("PATH").unwrap_or_default();
    let file = format!("{name}{}", std::env::consts::EXE_SUFFIX);
    std::env::split_paths(&path).any(|folder| folder.join(&file).is_file())
}

fn succeeds(program: &str, arguments: &[&str]) -> bool {
    let output = Command::new(program).args(arguments).output();
    output.is_ok_and(|output| output.status.success())
}

/// Tries to install what is missing, unless `install` is false, and says what then is. Nothing is an error here: a stage
/// that lacks something is reported as skipped.
pub fn provide(workspace: &Workspace, needs: &[Needs], install: bool) -> Result<Vec<&'static str>> {
    let all = || -> Vec<&'static str> { needs.iter().flat_map(|needs| missing(needs)).collect() };
    let absent = all();
    if !absent.is_empty() && install && has_program("apt-get") {
        install_by_apt(workspace, &absent)?;
    }
    let left = all();
    if !left.is_empty() {
        let names = left.join(" ");
        eprintln!("missing on this machine; on Debian or Ubuntu: apt-get install {names}");
        eprintln!("elsewhere: install the programs of the same names, then run the command again");
    }
    Ok(left)
}

fn install_by_apt(workspace: &Workspace, names: &[&str]) -> Result<()> {
    let root = Command::new("id").arg("-u").output();
    let before = if root.is_ok_and(|output| output.stdout.trim_ascii() == b"0") {
        "env"
    } else if succeeds("sudo", &["-n", "true"]) {
        "sudo -n env"
    } else {
        eprintln!("not root and no passwordless sudo: nothing can be installed for you");
        return Ok(());
    };
    eprintln!("installing {}", names.join(" "));
    let apt = |label: &str, arguments: &str| {
        let line = format!("{before} DEBIAN_FRONTEND=noninteractive apt-get {arguments}");
        run_logged(workspace, label, workspace.bash("-c").arg(line))
    };
    apt("apt-get update", "update -q")?;
    const INSTALL: &str = "install -q -y --no-install-recommends";
    let all = apt("apt-get install", &format!("{INSTALL} {}", names.join(" ")))?;
    if !all.success {
        let (log, end) = (all.log.display(), all.tail(15));
        eprintln!("apt-get install failed; the end of {log}:\n{end}");
        // One package of a list may be unknown on this release: take the others one by one.
        for name in names {
            let label = format!("apt-get install {name}");
            apt(&label, &format!("{INSTALL} {name}"))?;
        }
    }
    Ok(())
}
