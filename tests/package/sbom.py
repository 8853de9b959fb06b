"""The bills of materials of an archive name what is in it.

python tests/package/sbom.py ARCHIVE UNPACKED: the crates are those whose licences the archive carries,
each part has a licence, and the hashes are those of the unpacked files. Ends with 1 and a line for each fault.
"""

from __future__ import annotations

import hashlib
import json
import re
import sys
from pathlib import Path


def digest(file: Path) -> str:
    """SHA-256 of a file."""
    return hashlib.sha256(file.read_bytes()).hexdigest()


def main() -> int:
    """Checks both bills."""
    archive, unpacked = (Path(name) for name in sys.argv[1:3])
    bill = json.loads(archive.with_name(archive.name + ".cdx.json").read_bytes())
    other = json.loads(archive.with_name(archive.name + ".spdx.json").read_bytes())
    parts = {(one["name"], one["version"]): one for one in bill["components"]}
    faults = [f"{name}: no licence" for (name, _), one in parts.items() if not one.get("licenses")]

    notice = (unpacked / "share/doc/upt/THIRD-PARTY.txt").read_text(encoding="utf-8")
    told = set(re.findall(r"^(\S+) v(\S+) ", notice.partition("-" * 80)[0], re.MULTILINE))
    crates = {key for key, one in parts.items() if one.get("purl", "").startswith("pkg:cargo/")}
    faults += [f"{name} {version} is in one of THIRD-PARTY.txt and the bill" for name, version in sorted(told ^ crates)]

    by_name = {one["name"]: one for one in bill["components"]}
    files = {folder.name: folder / "bundle.json" for folder in (unpacked / "share/upt/bundles").iterdir()}
    files["onnxruntime"] = unpacked / "lib/libonnxruntime.so"
    for name, file in files.items():
        hashes = by_name.get(name, {}).get("hashes", [{}])
        if hashes[0].get("content") != digest(file):
            faults.append(f"{name}: the bill has not the hash of {file.name}")
    if bill["metadata"]["component"]["hashes"][0]["content"] != digest(archive):
        faults.append("the bill is of another archive")
    in_other = {(one["name"], one["versionInfo"]) for one in other["packages"]}
    faults += [f"SPDX lacks {name} {version}" for name, version in sorted(parts.keys() - in_other)]
    print("\n".join(faults) or f"{len(parts)} parts, {len(crates)} of them crates")
    return min(len(faults), 1)


if __name__ == "__main__":
    sys.exit(main())
