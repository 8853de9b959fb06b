"""Builds the wheel: libupt by cargo into the package, one wheel for every Python 3 of a platform.

UPT_WHEEL_LIBRARY takes a libupt that is built already, and UPT_WHEEL_PLATFORM the platform tag that goes with it:
so `cargo xtask package --wheel --platform ...` makes wheels for other platforms.
"""

import os
import re
import shutil
import subprocess
import sys
import sysconfig
from pathlib import Path

from setuptools import setup
from setuptools.command.bdist_wheel import bdist_wheel
from setuptools.command.build_py import build_py
from setuptools.dist import Distribution

ROOT = Path(__file__).resolve().parent.parent
BUILD = ROOT / "target" / "python"
BUILD.mkdir(parents=True, exist_ok=True)


def library() -> Path:
    """libupt: the one that is stated, or a fresh build."""
    stated = os.environ.get("UPT_WHEEL_LIBRARY")
    if stated:
        return Path(stated)
    if not (ROOT / "Cargo.toml").exists():
        raise SystemExit(f"{ROOT} is not the libupt repository: install from a clone, or from a wheel")
    if not shutil.which("cargo"):
        raise SystemExit("cargo is missing: libupt is built by Rust 1.92 or later (https://rustup.rs)")
    subprocess.run(["cargo", "build", "--release", "--package", "libupt"], cwd=ROOT, check=True)
    target = Path(os.environ.get("CARGO_TARGET_DIR", "target"))
    name = {"win32": "upt.dll", "darwin": "libupt.dylib"}.get(sys.platform, "libupt.so")
    return (ROOT / target / "release" / name).resolve()


def platform_tag(file: Path) -> str:
    """The wheel's platform; on Linux with the newest glibc that the library asks for."""
    stated = os.environ.get("UPT_WHEEL_PLATFORM")
    tag = stated or re.sub(r"[-.]", "_", sysconfig.get_platform())
    if not tag.startswith("linux_"):
        return tag
    versions = {tuple(map(int, v)) for v in re.findall(rb"GLIBC_(\d+)\.(\d+)", file.read_bytes())}
    major, minor = max(versions)
    return f"manylinux_{major}_{minor}_{tag.removeprefix('linux_')}"


class WithLibrary(build_py):
    def run(self) -> None:
        super().run()
        source = library()
        # `upt.dll`, `libupt.so`, `libupt.dylib`: without the version that CMake appends elsewhere.
        folder = Path(self.build_lib) / "upt" / "lib"
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir(parents=True)
        shutil.copy2(source, folder / source.name)


class PlatformWheel(bdist_wheel):
    def finalize_options(self) -> None:
        super().finalize_options()
        self.root_is_pure = False

    def get_tag(self) -> tuple[str, str, str]:
        return "py3", "none", platform_tag(library())


class Binary(Distribution):
    def has_ext_modules(self) -> bool:
        return True


version = re.search(r'^version = "(.+)"', (ROOT / "Cargo.toml").read_text(), re.M)
setup(
    version=version[1] if version else "0",
    distclass=Binary,
    cmdclass={"build_py": WithLibrary, "bdist_wheel": PlatformWheel},
    options={"build": {"build_base": str(BUILD)}, "egg_info": {"egg_base": str(BUILD)}},
)
