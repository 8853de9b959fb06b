"""The crates that a build links, as `cargo tree` and `cargo metadata` describe them.

What is compiled in, not what builds it: procedural macros and build scripts are left out.
"""

from __future__ import annotations

import json
import os
import re
import subprocess
import tomllib
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]

# Library and command, as the archive has them.
ALL = ("-p", "libupt", "-p", "upt-cli")


@dataclass
class Crate:
    """One crate. `needs` holds keys of the crates that it calls."""

    name: str
    version: str
    licence: str
    authors: list[str]
    folder: Path
    ours: bool
    sha256: str | None
    needs: list[str] = field(default_factory=list)


@cache
def cargo(*words: str) -> str:
    """What cargo prints, asked once."""
    command = [os.environ.get("CARGO", "cargo"), *words]
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True, encoding="utf-8", check=True).stdout


def linked(words: tuple[str, ...] = ALL) -> dict[str, Crate]:
    """Crates by `name version`, sorted. The words choose packages, features and target."""
    tree = cargo("tree", *words, "--edges", "normal,no-proc-macro", "--prefix", "depth", "--format", " {p}")
    needs: dict[str, set[str]] = {}
    above: list[str] = []
    for line in tree.splitlines():
        found = re.match(r"(\d+) (\S+) v(\S+)", line)
        if not found or "(proc-macro)" in line:
            continue
        depth, key = int(found[1]), f"{found[2]} {found[3]}"
        needs.setdefault(key, set())
        del above[depth:]
        if above:
            needs[above[-1]].add(key)
        above.append(key)
    lock = tomllib.loads((ROOT / "Cargo.lock").read_text(encoding="utf-8"))["package"]
    sums = {f"{one['name']} {one['version']}": one.get("checksum") for one in lock}
    crates = {}
    for one in json.loads(cargo("metadata", "--format-version", "1"))["packages"]:
        key = f"{one['name']} {one['version']}"
        if key in needs:
            folder = Path(one["manifest_path"]).parent
            crates[key] = Crate(
                one["name"],
                one["version"],
                (one["license"] or "").replace("/", " OR "),
                one["authors"],
                folder,
                one["source"] is None,
                sums[key],
                sorted(needs[key]),
            )
    return dict(sorted(crates.items()))
