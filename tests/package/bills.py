"""Bills of materials of packages that a usual run does not build: each names what is in it and links for its platform.

python tests/package/bills.py FOLDER (target/venv's Python): lays down packages whose names are those of `cargo xtask
package` and whose files are stubs, and has sbom.py write their bills; the parts follow from names alone. Ends with 1
and a line for each fault.
"""

from __future__ import annotations

import io
import json
import os
import subprocess
import sys
import tarfile
import zipfile
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
SHARE = "p/share/upt/bundles/liver-coarse/bundle.json"
ORGAN = "upt/organs/liver-coarse/bundle.json"
# What is linked on one platform alone, or never there.
WINDOWS, X86, LEARNED, COMMAND = "windows-link", "safe_arch", "ort", "clap"


@dataclass
class Kind:
    """A package: files in it, and parts that its bill has and has not."""

    name: str
    files: tuple[str, ...]
    has: tuple[str, ...]
    lacks: tuple[str, ...] = ()


KINDS = [
    Kind(
        "libupt-{v}-windows-x64.tar.gz",
        ("p/bin/upt.exe", "p/bin/upt.dll", "p/bin/onnxruntime.dll", SHARE),
        (WINDOWS, X86, LEARNED, COMMAND, "three", "onnxruntime", "liver-coarse"),
    ),
    Kind(
        "libupt-{v}-linux-arm64.tar.gz",
        ("p/bin/upt", "p/lib/libupt.so.{v}", "p/lib/libonnxruntime.so", SHARE),
        (LEARNED, COMMAND, "three", "onnxruntime", "liver-coarse"),
        (X86, WINDOWS),
    ),
    Kind(
        "libupt-{v}-macos-arm64.tar.gz",
        ("p/bin/upt", "p/lib/libupt.{v}.dylib", "p/lib/libonnxruntime.dylib", SHARE),
        (LEARNED, COMMAND, "three", "onnxruntime", "liver-coarse"),
        (X86, WINDOWS),
    ),
    Kind(
        "libupt-{v}.tgz",
        ("package/upt.wasm", "package/block/bundle.json"),
        ("block",),
        (LEARNED, COMMAND, WINDOWS, "onnxruntime"),
    ),
    Kind("libupt-{v}-py3-none-manylinux_2_35_aarch64.whl", ("upt/lib/libupt.so", ORGAN), (LEARNED,), (X86, COMMAND)),
    Kind("libupt-{v}-py3-none-win_amd64.whl", ("upt/lib/upt.dll", ORGAN), (WINDOWS, LEARNED), (COMMAND,)),
    Kind(
        "libupt-{v}-py3-none-macosx_10_12_x86_64.whl",
        ("upt/lib/libupt.dylib", ORGAN),
        (LEARNED, X86),
        (WINDOWS, COMMAND),
    ),
    Kind("libupt-{v}-py3-none-macosx_11_0_arm64.whl", ("upt/lib/libupt.dylib", ORGAN), (LEARNED,), (X86, WINDOWS)),
    Kind(
        "libupt-godot-{v}-linux-x64.zip",
        ("addons/libupt/bin/linux-x64/libupt.so.0", "addons/libupt/bundles/liver-coarse/bundle.json"),
        (LEARNED, "liver-coarse"),
        (COMMAND, WINDOWS, "onnxruntime"),
    ),
    Kind("libupt-{v}.tar.gz", ("p/organs/liver-coarse/bundle.json",), (LEARNED, "liver-coarse"), (COMMAND,)),
]


def version() -> str:
    """The workspace's."""
    text = (ROOT / "Cargo.toml").read_text(encoding="utf-8")
    return text.split('\nversion = "')[1].split('"')[0]


def lay_down(place: Path, files: list[str]) -> None:
    """A package of stubs."""
    if place.suffix in (".whl", ".zip"):
        with zipfile.ZipFile(place, "w") as wheel:
            for name in files:
                wheel.writestr(name, name)
        return
    with tarfile.open(place, "w:gz") as archive:
        for name in files:
            entry = tarfile.TarInfo(name)
            entry.size = len(name)
            archive.addfile(entry, io.BytesIO(name.encode()))


def faults(place: Path, kind: Kind) -> list[str]:
    """What its bills say that they should not, or do not say."""
    bill = json.loads(place.with_name(place.name + ".cdx.json").read_bytes())
    other = json.loads(place.with_name(place.name + ".spdx.json").read_bytes())
    names = {one["name"] for one in bill["components"]}
    found = [f"no {name}" for name in (*kind.has, "std") if name not in names]
    found += [f"{name}, which is not in it" for name in kind.lacks if name in names]
    found += [f"{one['name']} without a licence" for one in bill["components"] if not one.get("licenses")]
    found += [f"SPDX lacks {name}" for name in sorted(names - {one["name"] for one in other["packages"]})]
    return [f"{place.name}: {fault}" for fault in found]


def main() -> int:
    """Checks each kind."""
    folder = Path(sys.argv[1])
    folder.mkdir(parents=True, exist_ok=True)
    places = []
    for kind in KINDS:
        places.append(folder / kind.name.format(v=version()))
        lay_down(places[-1], [name.format(v=version()) for name in kind.files])
    script = ROOT / "xtask/package/sbom.py"
    subprocess.run([sys.executable, script, *places], check=True, env={**os.environ, "SOURCE_DATE_EPOCH": "0"})
    wrong = [fault for place, kind in zip(places, KINDS, strict=True) for fault in faults(place, kind)]
    print("\n".join(wrong) or f"{len(KINDS)} kinds of packages")
    return min(len(wrong), 1)


if __name__ == "__main__":
    sys.exit(main())
