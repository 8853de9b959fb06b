"""What a package holds: its crates, and what its files say of others' libraries, data and scripts.

What lies in it decides: a package without a library of ours has no crates, and a bundle of an unknown surface stops.
"""

from __future__ import annotations

import hashlib
import re
import subprocess
import tarfile
import zipfile
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath

import crates

OURS = "Apache-2.0 OR MIT"
FREESURFER = "LicenseRef-FreeSurfer"
TARGETS = {
    "linux-x64": "x86_64-unknown-linux-gnu",
    "linux-arm64": "aarch64-unknown-linux-gnu",
    "windows-x64": "x86_64-pc-windows-gnu",
    "macos-arm64": "aarch64-apple-darwin",
    "macos-x64": "x86_64-apple-darwin",
    "linux_x86_64": "x86_64-unknown-linux-gnu",
    "macosx_10_12_x86_64": "x86_64-apple-darwin",
    "x86_64": "x86_64-unknown-linux-gnu",
    "aarch64": "aarch64-unknown-linux-gnu",
    "win_amd64": "x86_64-pc-windows-gnu",
    "arm64": "aarch64-apple-darwin",
}
LIBRARY = re.compile(r"libupt\.so[.\d]*|upt\.dll|libupt[.\d]*\.dylib|upt\.wasm")
RUNTIME = re.compile(r"libonnxruntime\.so[.\d]*|onnxruntime\.dll|libonnxruntime[.\d]*\.dylib")


@dataclass
class Part:
    """A part of a package. `kind` is one of library, application, data."""

    key: str
    name: str
    version: str
    licence: str
    kind: str = "library"
    purl: str = ""
    sha256: str | None = None
    source: str = ""
    needs: list[str] = field(default_factory=list)


def members(package: Path) -> Iterator[tuple[str, bytes]]:
    """Files of a package, with forward slashes; links are left out."""
    if package.suffix in (".whl", ".zip"):
        with zipfile.ZipFile(package) as wheel:
            for name in wheel.namelist():
                yield name, wheel.read(name)
        return
    with tarfile.open(package) as archive:
        for member in archive:
            if member.isfile() and (stream := archive.extractfile(member)):
                yield member.name, stream.read()


def is_source(package: Path) -> bool:
    """A package of crates.io or an sdist, from which the library is built elsewhere."""
    return bool(re.fullmatch(r"libupt-[^-]+\.tar\.gz|.+\.crate", package.name))


def words(package: Path) -> tuple[str, ...]:
    """What cargo builds for a package, by its name."""
    name = package.name
    if found := re.fullmatch(r"libupt-godot-[^-]+-(.+)\.zip", name):
        return ("-p", "libupt", "--target", TARGETS[found[1]])
    if found := re.fullmatch(r"libupt-[^-]+-(.+)\.tar\.gz", name):
        return (*crates.ALL, "--target", TARGETS[found[1]])
    if re.fullmatch(r"libupt-[^-]+\.tgz", name):
        features = ("--no-default-features", "--features", "instruments")
        return ("-p", "libupt", *features, "--target", "wasm32-unknown-unknown")
    if name.startswith("org.libupt.") or is_source(package):
        return ("-p", name.removesuffix(".crate").rpartition("-")[0] if name.endswith(".crate") else "libupt")
    if name.endswith(".whl"):
        target = next(
            target for tag, target in TARGETS.items() if name.endswith(f"_{tag}.whl") or f"-{tag}.whl" in name
        )
        return ("-p", "libupt", "--target", target)
    raise SystemExit(f"{name} is no package of `cargo xtask package`")


def of_crates(chosen: tuple[str, ...]) -> list[Part]:
    """The linked crates, and Rust's standard library, which every one of them calls."""
    told = subprocess.run(["rustc", "-vV"], capture_output=True, text=True, check=True).stdout
    release = re.search(r"^release: (\S+)", told, re.MULTILINE)[1]
    commit = re.search(r"^commit-hash: (\S+)", told, re.MULTILINE)[1]
    std = "rust std"
    rust = "https://github.com/rust-lang/rust"
    found = [
        Part(
            std,
            "std",
            release,
            OURS,
            purl=f"pkg:github/rust-lang/rust@{commit}",
            source=f"{rust}/tree/{commit}/library",
        )
    ]
    for key, crate in crates.linked(chosen).items():
        place = f"https://crates.io/crates/{crate.name}/{crate.version}"
        found.append(
            Part(
                key,
                crate.name,
                crate.version,
                crate.licence,
                purl="" if crate.ours else f"pkg:cargo/{crate.name}@{crate.version}",
                sha256=crate.sha256,
                source="" if crate.ours else place,
                needs=[*crate.needs, std],
            )
        )
    return found


def version_of(file: str, pattern: str) -> str:
    """A version that a file of the repository states."""
    return re.search(pattern, (crates.ROOT / file).read_text(encoding="utf-8"))[1]


def bundle_licence(name: str) -> str:
    """A bundle's own licence and that of the surface that it was made of; NOTICE says which."""
    if name == "block":
        return f"({OURS})"
    surfaces = {"brain": FREESURFER, "liver": "LGPL-2.1-or-later"}
    found = surfaces.get(name.partition("-")[0])
    if not found:
        raise SystemExit(f"bundle {name}: parts.py does not know the licence of its surface; NOTICE should say it")
    return f"({OURS}) AND {found}"


def of(package: Path) -> tuple[Part, list[Part]]:
    """The package as a whole, and its parts."""
    version = version_of("Cargo.toml", r'\nversion = "([^"]+)"')
    others: list[Part] = []
    library = command = False
    for name, content in members(package):
        path, digest = PurePosixPath(name), hashlib.sha256(content).hexdigest()
        library = library or bool(LIBRARY.fullmatch(path.name))
        command = command or path.name in ("upt", "upt.exe")
        if RUNTIME.fullmatch(path.name):
            runtime = version_of("crates/ort-wheel/src/lib.rs", r'VERSION: &str = "([^"]+)"')
            source = f"https://github.com/microsoft/onnxruntime/tree/v{runtime}"
            purl = f"pkg:pypi/onnxruntime@{runtime}"
            others.append(Part("onnxruntime", "onnxruntime", runtime, "MIT", purl=purl, sha256=digest, source=source))
        if path.name == "bundle.json":
            bundle = path.parent.name
            licence = bundle_licence(bundle)
            others.append(Part(f"bundle {bundle}", bundle, version, licence, kind="data", sha256=digest))
    if command:
        three = version_of("NOTICE", r"three\.js (\d[\d.]*\d)")
        others.append(
            Part("three.js", "three", three, "MIT", purl=f"pkg:npm/three@{three}", source="https://threejs.org")
        )
    # Of source, what a build of it will take with its lock file.
    linked = of_crates(words(package)) if library or is_source(package) else []
    called = {need for part in linked for need in part.needs}
    digest = hashlib.sha256(package.read_bytes()).hexdigest()
    kind = "application" if command else "library"
    needs = [part.key for part in (*linked, *others) if part.key not in called]
    terms = {term for part in others for term in part.licence.split(" AND ")}
    return Part(
        "", package.name, version, " AND ".join(sorted({f"({OURS})", *terms})), kind=kind, sha256=digest, needs=needs
    ), [
        *linked,
        *others,
    ]
