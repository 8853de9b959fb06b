"""Which file of a crate names what of which other: read from its paths, with `use` followed to the file that defines.

A path is followed through every `use` and `pub use` on its way, so that a name which a module only passes on counts
for the file that it comes from. Tests (`#[cfg(test)]`, tests.rs, tests/) are left out. A method call names nothing.
"""

from __future__ import annotations

import re
import tomllib
from functools import cached_property
from pathlib import Path

ROOT = Path(__file__).resolve().parents[3]
Module = tuple[str, ...]

_ITEM = r"(?:\s*#\[[^\]]*\])*\s*(?:pub(?:\([^)]*\))?\s+)?"


def without_tests(text: str) -> str:
    """The source without comments, strings and what is compiled for tests only."""
    text = re.sub(r"//[^\n]*|/\*.*?\*/", "", text, flags=re.DOTALL)
    text = re.sub(r'r#".*?"#|"(?:\\.|[^"\\])*"', '""', text, flags=re.DOTALL)
    while found := re.search(r"#\[cfg\((?:all\()?test\b[^\n]*\]" + _ITEM, text):
        depth, end = 0, found.end()
        while end < len(text):
            depth += {"{": 1, "}": -1}.get(text[end], 0)
            end += 1
            if depth == 0 and text[end - 1] in ";}":
                break
        text = text[: found.start()] + text[end:]
    return text


def without_inner(text: str) -> str:
    """`super` of a module written inside of the file is the file: `self`."""
    for found in reversed(list(re.finditer(r"\bmod \w+ \{", text))):
        depth, end = 1, found.end()
        while depth and end < len(text):
            depth += {"{": 1, "}": -1}.get(text[end], 0)
            end += 1
        inner = text[found.end() : end].replace("super::super::", "\0").replace("super::", "self::")
        text = text[: found.end()] + inner.replace("\0", "super::") + text[end:]
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
        found.append((whole.removesuffix("::self"), whole.split("::")[-2] if name == "self" else name))
    return found


class Source:
    """A file: its module's path in the crate, and its text."""

    def __init__(self, path: Path, module: Module) -> None:
        self.path = path
        self.module = module
        # `pub(in crate::scene)` names no item.
        text = re.sub(r"\bpub\(in [^)]*\)", "pub(crate)", path.read_text(encoding="utf-8"))
        self.text = without_inner(without_tests(text))

    @cached_property
    def imports(self) -> dict[str, str]:
        """The names that it takes by `use` and `pub use`, with their paths."""
        uses = re.findall(r"\buse ([^;]+);", self.text)
        return {name: path for use in uses for path, name in leaves(use)}

    @cached_property
    def code(self) -> str:
        """Its text without `use` and `mod` lines."""
        return re.sub(r"\b(?:use|mod) [^;{]+(?:\{[^;]*\})?[^;{]*;", "", self.text)

    @cached_property
    def names(self) -> set[str]:
        """The paths that it names. A name that it only passes on (`pub use`) is none of them."""
        kept = {path for use in re.findall(r"(?<!pub )(?<!\) )\buse ([^;]+);", self.text) for path, _ in leaves(use)}
        words = set(re.findall(r"\w+", self.code))
        kept |= {path for name, path in self.imports.items() if name in words}
        return kept | set(re.findall(r"(?<![\w:])\w+(?:::\w+)+", self.code))


class Crate:
    """The files of a crate by their modules."""

    def __init__(self, folder: Path) -> None:
        self.files: dict[Module, Source] = {}
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
        elif first in source.imports and depth < 16:
            taken = source.imports[first]
            if taken.split("::")[0] == first:  # another crate's
                return None
            return self.target(source, "::".join([taken, *rest]), depth + 1)
        else:
            return None
        while rest and (*at, rest[0]) in self.files:
            at, rest = (*at, rest[0]), rest[1:]
        found = self.files.get(at)
        if found is not None and rest and rest[0] in found.imports and depth < 16:
            passed = "::".join([found.imports[rest[0]], *rest[1:]])
            if passed != path or found is not source:
                return self.target(found, passed, depth + 1)
        return found

    def arrows(self) -> dict[Module, dict[Module, list[str]]]:
        """For each file the others that it names, with the paths."""
        drawn: dict[Module, dict[Module, list[str]]] = {}
        for module, source in self.files.items():
            drawn[module] = {}
            for path in sorted(source.names):
                target = self.target(source, path)
                if target is not None and target is not source:
                    drawn[module].setdefault(target.module, []).append(path)
        return drawn


def crates() -> list[Crate]:
    """All crates of the workspace."""
    members = tomllib.loads((ROOT / "Cargo.toml").read_text(encoding="utf-8"))["workspace"]["members"]
    return [Crate(ROOT / member / "src") for member in (".", *members)]
