"""What a wheel says of itself, read here, also where its platform is another.

python tests/cross/wheel_file.py WHEEL...: name, tags and list of hashes agree; it holds one libupt in the format of its
platform, the organ and the types; its tag promises no older system than the library asks for. Ends with 1 and
a line for each fault.
"""

from __future__ import annotations

import base64
import hashlib
import re
import struct
import sys
import zipfile
from dataclasses import dataclass, field
from pathlib import Path

from macho import BUILD_VERSION, CPUS, MAGIC, VERSION_MIN, commands

ELF_CPUS = {62: "x86_64", 183: "aarch64"}
PE_CPUS = {0x8664: "amd64", 0xAA64: "arm64"}
NAMES = {"ELF": "libupt.so", "PE": "upt.dll", "Mach-O": "libupt.dylib"}
ALSO = ("upt/__init__.py", "upt/py.typed", "upt/organs/index.json", "upt/organs/liver-coarse/bundle.json")


@dataclass
class Library:
    """A library of one of the three formats, and the oldest system that it runs on."""

    format: str
    cpu: str
    since: tuple[int, int] = field(default=(0, 0))


def library(file: bytes) -> Library | None:
    """Reads its head; None where it is none of the three."""
    if file[:5] == b"\x7fELF\x02":
        found = re.findall(rb"GLIBC_(\d+)\.(\d+)", file)
        since = max(((int(major), int(minor)) for major, minor in found), default=(0, 0))
        return Library("ELF", ELF_CPUS.get(struct.unpack_from("<H", file, 18)[0], "?"), since)
    if file[:2] == b"MZ":
        at = struct.unpack_from("<I", file, 60)[0]
        if file[at : at + 4] == b"PE\0\0":
            return Library("PE", PE_CPUS.get(struct.unpack_from("<H", file, at + 4)[0], "?"))
    if len(file) > 8 and struct.unpack_from("<I", file)[0] == MAGIC:
        told = dict(commands(file))
        at, command = (12, told[BUILD_VERSION]) if BUILD_VERSION in told else (8, told[VERSION_MIN])
        oldest = struct.unpack_from("<I", command, at)[0]
        return Library("Mach-O", CPUS.get(struct.unpack_from("<I", file, 4)[0], "?"), (oldest >> 16, oldest >> 8 & 255))
    return None


def promised(platform: str) -> Library | None:
    """What the tag of a platform says of the library; None for a tag that no registry of wheels takes."""
    if platform == "win_amd64":
        return Library("PE", "amd64")
    for pattern, kind in ((r"manylinux_(\d+)_(\d+)_(\w+)", "ELF"), (r"macosx_(\d+)_(\d+)_(\w+)", "Mach-O")):
        if match := re.fullmatch(pattern, platform):
            return Library(kind, match[3], (int(match[1]), int(match[2])))
    return None


def listed(wheel: zipfile.ZipFile, info: str) -> list[str]:
    """Faults of the list of hashes."""
    faults = []
    lines = (line.rsplit(",", 2) for line in wheel.read(f"{info}/RECORD").decode().splitlines())
    known = {name: (told, size) for name, told, size in lines}
    for name in wheel.namelist():
        told, size = known.pop(name, ("", ""))
        content = wheel.read(name)
        own = base64.urlsafe_b64encode(hashlib.sha256(content).digest()).rstrip(b"=").decode()
        if not name.endswith("/RECORD") and (told, size) != (f"sha256={own}", str(len(content))):
            faults.append(f"RECORD has another hash or size of {name}")
    return faults + [f"RECORD names {name}, which is not there" for name in known]


def check(path: Path) -> tuple[list[str], str]:
    """Faults of a wheel, and what it is."""
    name, version, *tags = path.stem.split("-")
    tag = "-".join(tags)
    with zipfile.ZipFile(path) as wheel:
        files = wheel.namelist()
        info = f"{name}-{version}.dist-info"
        faults = listed(wheel, info)
        about = wheel.read(f"{info}/WHEEL").decode().splitlines()
        faults += [f"WHEEL lacks `{line}`" for line in (f"Tag: {tag}", "Root-Is-Purelib: false") if line not in about]
        metadata = wheel.read(f"{info}/METADATA").decode().splitlines()
        faults += [f"METADATA lacks `{n}`" for n in (f"Name: {name}", f"Version: {version}") if n not in metadata]
        faults += [f"{one} is missing" for one in ALSO if one not in files]
        inside = [one for one in files if one.startswith("upt/lib/")]
        found = library(wheel.read(inside[0])) if len(inside) == 1 else None
    wanted = promised(tags[-1])
    if found is None or wanted is None:
        return [*faults, f"tag {tag} with {', '.join(inside) or 'no library'}"], ""
    if inside != [f"upt/lib/{NAMES[found.format]}"]:
        faults.append(f"{inside[0]} is a file of {found.format}")
    if (found.format, found.cpu) != (wanted.format, wanted.cpu):
        faults.append(f"tag {tag} with {found.format} for {found.cpu}")
    if found.since > wanted.since:
        since = "{}.{}".format(*found.since)
        faults.append(f"tag {tag} promises an older system than the library runs on: {since}")
    what = f"{found.format} for {found.cpu}, {len(files)} files, {path.stat().st_size / 1e6:.1f} MB"
    return faults, what


def main() -> int:
    """Checks wheels."""
    failed = len(sys.argv) < 2
    for path in map(Path, sys.argv[1:]):
        faults, what = check(path)
        print("\n".join(f"{path.name}: {line}" for line in faults or [what]))
        failed |= bool(faults)
    return int(failed)


if __name__ == "__main__":
    sys.exit(main())
