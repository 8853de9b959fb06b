"""Circles between two Rust files of one crate: each names something that the other defines.

What a file names is read from its paths (`use crate::...`, `super::...`, inline ones too); a name that a module only
passes on (`pub use`) counts for the file that it comes from. Not a circle:

- a module's file and a file below it (`scene/mod.rs` and `scene/state/records.rs`): the first declares the second,
  which fills in for it and may use its types. They are one room, read from the top;
- anything in tests (`#[cfg(test)]`, tests.rs), which look at everything.

A circle is cut by moving what both need into a file of its own, or by passing in what one takes from the other.
Ends with 1 and a line for each circle.
"""

from __future__ import annotations

import re
import sys
import tomllib
from functools import cached_property
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def without_tests(text: str) -> str:
    """The source without comments, strings and inline test modules."""
    text = re.sub(r"//[^\n]*|/\*.*?\*/", "", text, flags=re.DOTALL)
    text = re.sub(r'r#".*?"#|"(?:\\.|[^"\\])*"', '""', text, flags=re.DOTALL)
    while found := re.search(r"#\[cfg\((?:all\()?test\b[^\n]*\]\s*(?:pub(?:\(\w+\))? )?mod \w+ \{", text):
        depth, end = 1, found.end()
        while depth and end < len(text):
            depth += {"{": 1, "}": -1}.get(text[end], 0)
            end += 1
        text = text[: found.start()] + text[end:]
    return text


def leaves(tree: str) -> list[tuple[str, str]]:
    """The paths of a use tree, `a::{b, c as d}`, each with the name that it gets here."""
    head, brace, rest = tree.partition("{")
    if not brace:
        path, _, name = tree.strip().partition(" as ")
        path = re.sub(r"\s", "", path)
        return [(path, name.strip() or path.rpartition("::")[2])] if path else []
    parts, depth, start = [], 0, 0
    inner = rest[: rest.rindex("}")]
    for at, sign in enumerate(inner + ","):
        depth += {"{": 1, "}": -1}.get(sign, 0)
        if sign == "," and depth == 0:
            parts.append(inner[start:at])
            start = at + 1
    found = []
    for path, name in [leaf for part in parts for leaf in leaves(part)]:
        whole = re.sub(r"\s", "", head) + path
        # `a::{self}` is `a`.
        found.append((whole.removesuffix("::self"), whole.split("::")[-2] if path == "self" else name))
    return found


class Source:
    """A file: its module's path in the crate, and its text."""

    def __init__(self, path: Path, module: tuple[str, ...]) -> None:
        self.path = path
        self.module = module
        self.text = without_tests(path.read_text(encoding="utf-8"))

    @cached_property
    def passed_on(self) -> dict[str, str]:
        """Names that it only passes on, with their paths; `*` has several."""
        uses = re.findall(r"\bpub(?:\([^)]*\))? use ([^;]+);", self.text)
        return {name: path for use in uses for path, name in leaves(use)}

    @cached_property
    def names(self) -> set[str]:
        """Paths that it names."""
        uses = re.findall(r"(?<!pub )(?<!\) )\buse ([^;]+);", self.text)
        without = re.sub(r"\buse [^;]+;", "", self.text)
        inline = re.findall(r"\b(?:crate|super)(?:::\w+)+", without)
        return {path for use in uses for path, _ in leaves(use)} | set(inline)


class Crate:
    """The files of a crate by their modules."""

    def __init__(self, folder: Path) -> None:
        self.files: dict[tuple[str, ...], Source] = {}
        for path in sorted(folder.rglob("*.rs")):
            module = (*path.relative_to(folder).parts[:-1], path.stem)
            if module[-1] in ("lib", "main", "mod"):
                module = module[:-1]
            if "tests" not in module and "bin" not in module:
                self.files[module] = Source(path, module)

    def target(self, source: Source, path: str, depth: int = 0) -> Source | None:
        """The file that defines what a path names; none outside of the crate."""
        first, *rest = path.split("::")
        at = source.module
        if first == "crate":
            at = ()
        elif first in ("self", "super"):
            at = at[:-1] if first == "super" else at
            while rest and rest[0] == "super":
                at, rest = at[:-1], rest[1:]
        elif (*at, first) in self.files:
            at = (*at, first)
        elif first in source.passed_on and not path.startswith(source.passed_on[first]):
            pass
        else:
            return None
        while rest and (*at, rest[0]) in self.files:
            at, rest = (*at, rest[0]), rest[1:]
        found = self.files.get(at)
        if found is not None and rest and rest[0] in found.passed_on and depth < 8:
            passed = "::".join([found.passed_on[rest[0]], *rest[1:]])
            return self.target(found, passed, depth + 1) or found
        return found

    def circles(self) -> list[str]:
        """Pairs of files that name each other, without those of which one is the module around the other."""
        named: dict[tuple[str, ...], dict[tuple[str, ...], str]] = {}
        for module, source in self.files.items():
            targets = {path: self.target(source, path) for path in sorted(source.names)}
            named[module] = {target.module: path for path, target in targets.items() if target is not None}
        found = []
        for a, others in named.items():
            for b, path in others.items():
                around = a[: len(b)] == b or b[: len(a)] == a
                if a < b and a in named[b] and not around:
                    first, second = (self.files[one].path.relative_to(ROOT) for one in (a, b))
                    found.append(f"{first} and {second} name each other: `{path}`, `{named[b][a]}`")
        return found


def main() -> int:
    """Checks all crates of the workspace."""
    members = tomllib.loads((ROOT / "Cargo.toml").read_text(encoding="utf-8"))["workspace"]["members"]
    crates = [Crate(ROOT / member / "src") for member in members]
    circles = [circle for crate in crates for circle in crate.circles()]
    print("\n".join(circles) or f"{sum(len(crate.files) for crate in crates)} files without a circle")
    return min(len(circles), 1)


if __name__ == "__main__":
    sys.exit(main())
