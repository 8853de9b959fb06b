"""Which Python file imports which other, imports for types and inside of functions included.

A name that a package's `__init__.py` only passes on counts for the file that it comes from.
"""

from __future__ import annotations

import ast
import subprocess
from pathlib import Path

from .rust import ROOT

Arrows = dict[Path, dict[Path, list[str]]]


class Source:
    """A file: the folder of its imports, its own imports by the names that they get, and the names that it uses."""

    def __init__(self, path: Path) -> None:
        self.path = path
        tree = ast.parse(path.read_text(encoding="utf-8"))
        self.imports: dict[str, tuple[int, str, str]] = {}
        for node in ast.walk(tree):
            if isinstance(node, ast.ImportFrom):
                for alias in node.names:
                    self.imports[alias.asname or alias.name] = (node.level, node.module or "", alias.name)
            elif isinstance(node, ast.Import):
                for alias in node.names:
                    self.imports[alias.asname or alias.name] = (0, alias.name, "")
        self.used = {node.id for node in ast.walk(tree) if isinstance(node, ast.Name)}


class Files:
    """All Python files that git knows, but for tests."""

    def __init__(self) -> None:
        command = ["git", "ls-files", "--cached", "--others", "--exclude-standard", "*.py"]
        listed = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout.split()
        paths = [ROOT / name for name in listed if (ROOT / name).exists()]
        self.files = {path: Source(path) for path in paths if "tests" not in path.parent.parts[-1:]}

    def file(self, base: Path) -> Source | None:
        """A module's file."""
        return self.files.get(base.with_name(base.name + ".py")) or self.files.get(base / "__init__.py")

    def target(self, source: Source, taken: tuple[int, str, str], depth: int = 0) -> Source | None:
        """The file that defines what an import takes; none outside of the repository."""
        level, module, name = taken
        words = [word for word in module.split(".") if word]
        roots = [source.path.parents[level - 1]] if level else [source.path.parent, *source.path.parents]
        for root in roots:
            base = root.joinpath(*words)
            below = self.file(base / name) if name else None
            found = below or (self.file(base) if words or level else None)
            if below is None and found is not None and name in found.imports and depth < 16:
                return self.target(found, found.imports[name], depth + 1)
            if found is not None:
                return found
        return None

    def arrows(self) -> Arrows:
        """For each file the others that it imports, with the names."""
        drawn: Arrows = {}
        for path, source in self.files.items():
            drawn[path] = {}
            face = path.name == "__init__.py"
            for name, taken in source.imports.items():
                target = self.target(source, taken)
                if target is None or target is source or (face and name not in source.used):
                    continue
                drawn[path].setdefault(target.path, []).append(name)
        return drawn
