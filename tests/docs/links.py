"""Every link of a page leads to a file that exists, and its anchor to a heading there.

python tests/docs/links.py FOLDER checks all pages below a folder, for instance of an unpacked archive.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Callable
from functools import cache
from pathlib import Path
from urllib.parse import unquote

import markdown


@cache
def page(path: Path) -> markdown.Page:
    """A page, parsed once."""
    return markdown.read(path)


def faults(path: Path, exists: Callable[[Path], bool] = Path.exists) -> list[str]:
    """The dead links of a page. `exists` says what counts as there: on disk, or known to git."""
    found = []
    for link in page(path).links:
        if re.match(r"[a-z]+:", link.target):
            continue
        name, _, anchor = link.target.partition("#")
        target = (path.parent / unquote(name)).resolve() if name else path
        if not exists(target):
            found.append(f"{path}:{link.line}: {link.target} does not exist")
        elif anchor and target.suffix == ".md" and anchor not in page(target).anchors:
            found.append(f"{path}:{link.line}: {link.target}: no heading gives this anchor")
    return found


def main() -> int:
    """Checks a folder; the number of pages with a dead link ends the program."""
    pages = sorted(Path(sys.argv[1]).resolve().rglob("*.md"))
    dead = [fault for path in pages for fault in faults(path)]
    print("\n".join(dead) or f"{len(pages)} pages without a dead link")
    return min(len(dead), 1)


if __name__ == "__main__":
    sys.exit(main())
