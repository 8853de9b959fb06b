"""Dependencies that no source names, as cargo-machete finds them: by the name of the crate in the package's Rust files.

Ends with 1 and a line for each; a dependency of the workspace's table that no package takes counts too.
"""

from __future__ import annotations

import re
import sys
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
SECTIONS = ("dependencies", "dev-dependencies", "build-dependencies")


def stated(manifest: dict) -> set[str]:
    """Names of all dependencies of a manifest, those for single platforms included."""
    tables = [manifest, *manifest.get("target", {}).values()]
    return {name for table in tables for section in SECTIONS for name in table.get(section, {})}


def sources(package: Path, others: list[Path]) -> str:
    """The Rust files of a package, without those of packages below it."""
    below = [other for other in others if other != package and other.is_relative_to(package)]
    files = [file for file in package.rglob("*.rs") if "target" not in file.relative_to(package).parts]
    own = [file for file in files if not any(file.is_relative_to(other) for other in below)]
    extra = [*(ROOT / "xtask/gpu").rglob("*.rs")] if package == ROOT else []
    return "\n".join(file.read_text(encoding="utf-8") for file in own + extra)


def main() -> int:
    """Checks all packages of the workspace."""
    root = tomllib.loads((ROOT / "Cargo.toml").read_text(encoding="utf-8"))
    packages = [(ROOT / member).resolve() for member in (".", *root["workspace"]["members"])]
    left = set(root["workspace"]["dependencies"])
    faults = []
    for package in packages:
        manifest = tomllib.loads((package / "Cargo.toml").read_text(encoding="utf-8"))
        text = sources(package, packages)
        for name in sorted(stated(manifest)):
            if not re.search(rf"\b{name.replace('-', '_')}\b", text):
                faults.append(f"{package.relative_to(ROOT)}/Cargo.toml: no source names `{name}`")
        left -= stated(manifest)
    faults += [f"Cargo.toml: no package takes `{name}` of the workspace's table" for name in sorted(left)]
    print("\n".join(faults) or f"{len(packages)} packages, every dependency is used")
    return min(len(faults), 1)


if __name__ == "__main__":
    sys.exit(main())
