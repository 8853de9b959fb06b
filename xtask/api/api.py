"""`cargo xtask api`: the pages of docs/reference that are made of what each language's sources declare and say.

python xtask/api/api.py [--check]. A public name without a doc comment stops it.
"""

from __future__ import annotations

import sys
from collections.abc import Callable

import cpp
import csharp
import docstrings
import godot
import typescript
from page import ROOT, Page, Undocumented

PAGES: list[Callable[[], Page]] = [cpp.page, csharp.page, docstrings.page, godot.page, typescript.page]
FOLDER = ROOT / "docs/reference"


def stale(make: Callable[[], Page], write: bool = False) -> list[str]:
    """What is wrong with a page: it is older than its source, or something in there is not documented."""
    made = make()
    try:
        text = made.text()
    except Undocumented as error:
        return [str(error)]
    file = FOLDER / made.file
    if file.exists() and file.read_text(encoding="utf-8") == text:
        return []
    if write:
        file.write_text(text, encoding="utf-8")
        print(f"docs/reference/{made.file} written")
        return []
    return [f"docs/reference/{made.file} is older than its source; run `cargo xtask api`"]


def main() -> int:
    """Writes the pages, or says which are stale."""
    faults = [fault for make in PAGES for fault in stale(make, write="--check" not in sys.argv[1:])]
    print("\n".join(faults) if faults else "all pages are up to date")
    return min(len(faults), 1)


if __name__ == "__main__":
    sys.exit(main())
