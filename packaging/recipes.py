"""Recipes of Conan and vcpkg for release archives.

python packaging/recipes.py ARCHIVE... --address URL --out FOLDER writes FOLDER/conan and FOLDER/vcpkg/libupt: the
recipes of this folder with the version, the addresses (URL/NAME OF THE ARCHIVE) and the hashes of these archives.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import re
import shutil
from pathlib import Path

HERE = Path(__file__).resolve().parent
#: Platforms of archives, in the words of Conan (os, arch) and of vcpkg (its triplets' variables).
PLATFORMS = {
    "linux-x64": ("Linux-x86_64", "VCPKG_TARGET_IS_LINUX AND VCPKG_TARGET_ARCHITECTURE STREQUAL x64"),
    "linux-arm64": ("Linux-armv8", "VCPKG_TARGET_IS_LINUX AND VCPKG_TARGET_ARCHITECTURE STREQUAL arm64"),
}


def digest(file: Path, kind: str) -> str:
    """A hash of a file."""
    with file.open("rb") as content:
        return hashlib.file_digest(content, kind).hexdigest()


def main() -> None:
    """Writes both."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("archives", nargs="+", type=Path, metavar="ARCHIVE")
    parser.add_argument("--address", required=True, help="where the archives lie")
    parser.add_argument("--out", required=True, type=Path)
    given = parser.parse_args()
    found = {}
    for archive in given.archives:
        name = re.fullmatch(r"libupt-([^-]+)-(.+)\.tar\.gz", archive.name)
        if not name or name[2] not in PLATFORMS:
            parser.error(f"{archive.name}: an archive for one of {', '.join(PLATFORMS)} is needed")
        found[name[2]] = (name[1], archive)
    versions = {version for version, _ in found.values()}
    if len(versions) > 1:
        parser.error(f"the archives are of several versions: {', '.join(sorted(versions))}")
    version = versions.pop()

    conan = given.out / "conan"
    shutil.copytree(HERE / "conan", conan, dirs_exist_ok=True)
    for name in ("CMakeLists.txt", "minimal.c"):
        shutil.copy(HERE.parent / "examples/c" / name, conan / "test_package" / name)
    data = ["sources:", f'  "{version}":']
    for platform, (_, archive) in sorted(found.items()):
        data += [
            f"    {PLATFORMS[platform][0]}:",
            f'      url: "{given.address}/{archive.name}"',
            f'      sha256: "{digest(archive, "sha256")}"',
        ]
    (conan / "conandata.yml").write_text("\n".join(data) + "\n", encoding="utf-8")

    port = given.out / "vcpkg/libupt"
    shutil.copytree(HERE / "vcpkg/libupt", port, dirs_exist_ok=True)
    manifest = json.loads((port / "vcpkg.json").read_text(encoding="utf-8"))
    manifest["version"] = version
    (port / "vcpkg.json").write_text(json.dumps(manifest, indent=2) + "\n", encoding="utf-8")
    lines = []
    for word, (platform, (_, archive)) in zip(["if"] + ["elseif"] * len(found), sorted(found.items()), strict=False):
        lines += [
            f"{word}({PLATFORMS[platform][1]})",
            f'    set(UPT_ARCHIVE "{archive.name}")',
            f"    set(UPT_SHA512 {digest(archive, 'sha512')})",
        ]
    lines += ["endif()", f'set(UPT_ADDRESS "{given.address}")', f"set(UPT_VERSION {version})"]
    (port / "archives.cmake").write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
