"""Circles of imports, of any length: files of which each names something of the next, and the last of the first.

All crates of the workspace, and Python. A module that only declares (`mod`) and passes on (`pub use`) names nothing.
One that also works, and gives its children something, is in a circle with them like any other pair of files.

A circle is cut by moving what both need into a file of its own, or by passing in what one takes from the other.
Ends with 1 and a line for each arrow of a circle.
"""

from __future__ import annotations

import sys
from collections.abc import Hashable, Mapping
from pathlib import Path

from structure import python, rust


def circles(arrows: Mapping[Hashable, Mapping[Hashable, object]]) -> list[list]:
    """The strongly connected components of more than one file (Tarjan)."""
    index: dict = {}
    low: dict = {}
    stack: list = []
    found: list[list] = []

    def visit(at: Hashable) -> None:
        index[at] = low[at] = len(index)
        stack.append(at)
        for to in arrows[at]:
            if to not in index:
                visit(to)
            if to in stack:
                low[at] = min(low[at], low[to])
        if low[at] == index[at]:
            circle = stack[stack.index(at) :]
            del stack[stack.index(at) :]
            if len(circle) > 1:
                found.append(circle)

    sys.setrecursionlimit(10_000)
    for at in arrows:
        if at not in index:
            visit(at)
    return found


def lines(arrows: Mapping[Hashable, Mapping[Hashable, list[str]]], path: Mapping[Hashable, Path]) -> list[str]:
    """A line for each circle, and below it one for each of its arrows."""
    said = []
    for circle in circles(arrows):
        said.append(f"a circle of {len(circle)} files:")
        for a in sorted(circle):
            for b in sorted(set(circle) & set(arrows[a])):
                names = ", ".join(f"`{name}`" for name in arrows[a][b][:4])
                said.append(f"  {path[a].relative_to(rust.ROOT)} names {path[b].relative_to(rust.ROOT)}: {names}")
    return said


def main() -> int:
    """Checks all crates of the workspace, and all Python files."""
    said, files = [], 0
    for crate in rust.crates():
        said += lines(crate.arrows(), {module: source.path for module, source in crate.files.items()})
        files += len(crate.files)
    imports = python.Files().arrows()
    said += lines(imports, {path: path for path in imports})
    files += len(imports)
    print("\n".join(said) or f"{files} files without a circle")
    return min(len(said), 1)


if __name__ == "__main__":
    sys.exit(main())
