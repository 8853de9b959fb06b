"""Builds the wheel: libupt by cargo into the package, one wheel for every Python 3 of a platform; and the sdist,
which holds libupt's source as crates.io has it (`rust/`).

UPT_WHEEL_LIBRARY takes a libupt that is built already, and UPT_WHEEL_PLATFORM the platform tag that goes with it:
so `cargo xtask package --wheel --platform ...` makes wheels for other platforms.
"""

import hashlib
import json
import os
import re
import shutil
import subprocess
import sys
import sysconfig
import tarfile
from pathlib import Path

from setuptools import setup
from setuptools.command.bdist_wheel import bdist_wheel
from setuptools.command.build_py import build_py
from setuptools.command.sdist import sdist
from setuptools.dist import Distribution

HERE = Path(__file__).resolve().parent
CLONE = HERE.parent
#: An sdist is no clone: it holds the packages of libupt and its layers.
RUST = HERE / "rust"
IS_CLONE = not RUST.is_dir()
BUILD = CLONE / "target" / "python" if IS_CLONE else HERE / "build"
BUILD.mkdir(parents=True, exist_ok=True)

#: The organ in the package.
ORGAN = "liver-coarse"


def source() -> Path:
    """The folder of the crate `libupt`."""
    if IS_CLONE:
        if not (CLONE / "Cargo.toml").exists():
            raise SystemExit(f"{CLONE} is not the libupt repository: install from a clone, an sdist or a wheel")
        return CLONE
    return next(RUST.glob("libupt-[0-9]*"))


def library() -> Path:
    """libupt: the one that is stated, or a fresh build."""
    stated = os.environ.get("UPT_WHEEL_LIBRARY")
    if stated:
        return Path(stated)
    if not shutil.which("cargo"):
        raise SystemExit("cargo is missing: libupt is built by Rust 1.92 or later (https://rustup.rs)")
    subprocess.run(["cargo", "build", "--release", "--package", "libupt"], cwd=source(), check=True)
    target = Path(os.environ.get("CARGO_TARGET_DIR", "target"))
    name = {"win32": "upt.dll", "darwin": "libupt.dylib"}.get(sys.platform, "libupt.so")
    return (source() / target / "release" / name).resolve()


def platform_tag(file: Path) -> str:
    """The wheel's platform; on Linux with the newest glibc that the library asks for."""
    stated = os.environ.get("UPT_WHEEL_PLATFORM")
    tag = stated or re.sub(r"[-.]", "_", sysconfig.get_platform())
    if not tag.startswith("linux_"):
        return tag
    versions = {tuple(map(int, v)) for v in re.findall(rb"GLIBC_(\d+)\.(\d+)", file.read_bytes())}
    major, minor = max(versions)
    return f"manylinux_{major}_{minor}_{tag.removeprefix('linux_')}"


def organs(to: Path) -> None:
    """The organ of the package, and the hashes by which `upt.download` knows the others."""
    shutil.rmtree(to, ignore_errors=True)
    if not IS_CLONE:
        shutil.copytree(HERE / "organs", to)
        return
    bundles = CLONE / "onnx"
    shutil.copytree(bundles / ORGAN, to / ORGAN, ignore=shutil.ignore_patterns("*.html"))
    assets = json.loads((bundles / "index.json").read_text(encoding="utf-8"))["assets"]
    found = sorted(bundles.glob("*/bundle.json"))
    index = {name: one["sha256"] for name, one in assets.items()}
    index |= {file.parent.name: hashlib.sha256(file.read_bytes()).hexdigest() for file in found}
    (to / "index.json").write_text(json.dumps(index, indent=1) + "\n", encoding="utf-8")


class WithLibrary(build_py):
    def run(self) -> None:
        super().run()
        built = library()
        # `upt.dll`, `libupt.so`, `libupt.dylib`: without the version that CMake appends elsewhere.
        package = Path(self.build_lib) / "upt"
        folder = package / "lib"
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir(parents=True)
        shutil.copy2(built, folder / built.name)
        organs(package / "organs")


class PlatformWheel(bdist_wheel):
    def finalize_options(self) -> None:
        super().finalize_options()
        self.root_is_pure = False

    def get_tag(self) -> tuple[str, str, str]:
        return "py3", "none", platform_tag(library())


class WithSource(sdist):
    def make_release_tree(self, base_dir: str, files: list[str]) -> None:
        super().make_release_tree(base_dir, files)
        organs(Path(base_dir, "organs"))
        rust = Path(base_dir, "rust")
        told = subprocess.run(
            ["cargo", "metadata", "--format-version", "1", "--no-deps"], cwd=CLONE, capture_output=True, check=True
        )
        names = [one["name"] for one in json.loads(told.stdout)["packages"] if one["publish"] is None]
        chosen = [word for name in names for word in ("--package", name)]
        scratch = BUILD / "crates"
        quietly = ["cargo", "package", "--quiet", "--no-verify", "--allow-dirty", "--target-dir", str(scratch)]
        subprocess.run([*quietly, *chosen], cwd=CLONE, check=True)
        patches = ["[patch.crates-io]"]
        for crate in sorted((scratch / "package").glob("*.crate")):
            with tarfile.open(crate) as archive:
                # Python before 3.11.4 has no filters, and cargo has just written these.
                safely = {"filter": "data"} if hasattr(tarfile, "data_filter") else {}
                archive.extractall(rust, **safely)
            patches.append(f"{crate.stem.rpartition('-')[0]} = {{ path = '{crate.stem}' }}")
        shutil.rmtree(scratch)
        # The layers beside the library, in place of a registry.
        (rust / ".cargo").mkdir()
        (rust / ".cargo" / "config.toml").write_text("\n".join(patches) + "\n", encoding="utf-8")


class Binary(Distribution):
    def has_ext_modules(self) -> bool:
        return True


version = re.search(r'^version = "(.+)"', (source() / "Cargo.toml").read_text(encoding="utf-8"), re.M)
setup(
    version=version[1] if version else "0",
    distclass=Binary,
    cmdclass={"build_py": WithLibrary, "bdist_wheel": PlatformWheel, "sdist": WithSource},
    options={"build": {"build_base": str(BUILD)}, "egg_info": {"egg_base": str(BUILD)}},
)
