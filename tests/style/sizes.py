"""No file of our own code is longer than 400 lines: longer ones hold more than one idea.

Generated and vendored files do not count. A file may be longer with a reason in LONGER, and not longer than it says
there. Ends with 1 and a line for each that is too long, and for each exception that is no longer needed.
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
MOST = 400
CODE = (".rs", ".py", ".cs", ".c", ".h", ".cpp", ".hpp", ".sh", ".gd", ".js", ".cmake")

# Written by a command, or somebody else's.
NOT_OURS = {
    "include/upt.h": "written by `cargo xtask header`",
    "web/src/abi.js": "written by `cargo xtask header`",
    "python/upt/_native.py": "written by `cargo xtask header`",
    "unity-plugin/Runtime/Interop/Native.g.cs": "written by `cargo xtask header`",
    "crates/page/src/three.js": "three.js, vendored",
}

# Path: lines at most, and why it is one file.
LONGER = {
    "include/upt.hpp": (1169, "hosts copy it next to upt.h: one file to include, without others"),
    "unity-plugin/Runtime/Components/SoftTissue.cs": (550, "one component: inspector fields, and what Unity calls"),
}


def main() -> int:
    """Checks all files that git knows."""
    command = ["git", "ls-files", "--cached", "--others", "--exclude-standard"]
    listed = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout.split("\n")
    names = [name for name in listed if name.endswith(CODE) and name not in NOT_OURS and (ROOT / name).exists()]
    lines = {name: (ROOT / name).read_bytes().count(b"\n") for name in names}
    faults = []
    for name, count in sorted(lines.items()):
        most = LONGER.get(name, (MOST, ""))[0]
        if count > most:
            faults.append(f"{name}: {count} lines, at most {most}: split it by ideas (tests/style/sizes.py)")
    faults += [f"{name}: needs no exception" for name in LONGER if lines.get(name, 0) <= MOST]
    print("\n".join(faults) or f"{len(names)} files, the longest but for exceptions has {longest(lines)} lines")
    return min(len(faults), 1)


def longest(lines: dict[str, int]) -> int:
    """Of those without an exception."""
    return max(count for name, count in lines.items() if name not in LONGER)


if __name__ == "__main__":
    sys.exit(main())
