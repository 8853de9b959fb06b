"""Calls of the C ABI that pages and sources name are in its header: a call that is renamed leaves no old name behind.

Pages that are about what was (the changelog, the decisions, "From 0.1 to 1.0") are not looked at. Names that are no
calls (types, constants, files of tests) are not either: a name counts where it begins as the calls of a handle do.

    python tests/docs/calls.py    # ends with 1 and a line for each name that the header does not have
"""

from __future__ import annotations

import re
import subprocess
import sys
from functools import cache
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
HEADER = ROOT / "include/upt.h"
CALL = re.compile(r"\bupt_(?:scene|model|haptics|hull|blade)_[a-z0-9_]*[a-z0-9]\b")
OF_THE_PAST = {"CHANGELOG.md", "docs/reference/from-0.1-to-1.0.md"}
SOURCES = {".rs", ".c", ".h", ".cpp", ".hpp", ".cs", ".py", ".js", ".md"}


@cache
def known() -> frozenset[str]:
    """Every name of the header's code: calls and types."""
    code = re.sub(r"/\*.*?\*/", "", HEADER.read_text(encoding="utf-8"), flags=re.DOTALL)
    return frozenset(re.findall(r"\bupt_\w+\b", code))


def looked_at(path: Path) -> bool:
    """Pages and sources that say what is."""
    inside = path.relative_to(ROOT).as_posix()
    past = inside in OF_THE_PAST or inside.startswith("docs/decisions/")
    return path.suffix in SOURCES and not past and path != Path(__file__)


def faults(path: Path) -> list[str]:
    """The names of a page or a source that the header does not have, by line."""
    if not looked_at(path):
        return []
    found = []
    for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
        found += [f"{path}:{number}: {name} is no call" for name in CALL.findall(line) if name not in known()]
    return found


def main() -> int:
    """Looks at all files of the clone."""
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    found = [fault for name in listed.split("\0") if name for fault in faults(ROOT / name)]
    print("\n".join(found) or "every call that is named is there")
    return min(len(found), 1)


if __name__ == "__main__":
    sys.exit(main())
