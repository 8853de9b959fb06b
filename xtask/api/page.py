"""A page of an interface: sections of calls and fields, as Markdown. `cpp.py`, `csharp.py` ... fill it from sources."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
WIDTH = 100


class Undocumented(Exception):
    """Public names without a doc comment."""


@dataclass
class Call:
    """A function or method: how it is declared, and what it does."""

    name: str
    code: str
    doc: str


@dataclass
class Field:
    """A field, property or value."""

    name: str
    kind: str
    doc: str


@dataclass
class Section:
    """A class, or functions that belong together."""

    name: str
    doc: str = ""
    code: str = ""
    calls: list[Call] = field(default_factory=list)
    fields: list[Field] = field(default_factory=list)
    #: Heading of the fields' first column.
    word: str = "field"

    def missing(self) -> list[str]:
        """What has no doc: overloads share one."""
        told = {call.name for call in self.calls if call.doc}
        found = [] if self.doc else [self.name]
        found += [f"{self.name}.{call.name}" for call in self.calls if call.name not in told]
        return found + [f"{self.name}.{one.name}" for one in self.fields if not one.doc]


@dataclass
class Chapter:
    """Sections under one heading."""

    name: str
    about: str
    sections: list[Section]


@dataclass
class Page:
    """A page of `docs/reference`."""

    file: str
    title: str
    about: str
    #: Of a code block.
    language: str
    chapters: list[Chapter]

    def text(self) -> str:
        """The whole page."""
        missing = [name for chapter in self.chapters for one in chapter.sections for name in one.missing()]
        if missing:
            raise Undocumented(f"{self.file}: no doc comment: {', '.join(missing)}")
        parts = [f"# {self.title}", self.about]
        for chapter in self.chapters:
            parts += [f"## {chapter.name}", chapter.about, self._glance(chapter)]
            for one in chapter.sections:
                parts += self._section(one, len(chapter.sections) > 1)
        return "\n\n".join(part for part in parts if part) + "\n"

    def _glance(self, chapter: Chapter) -> str:
        if len(chapter.sections) < 4:
            return ""
        rows = [f"| [`{one.name}`](#{anchor(one.name)}) | {cell(first(one.doc))} |" for one in chapter.sections]
        return "\n".join(["| | |", "|---|---|", *rows])

    def _section(self, one: Section, headed: bool) -> list[str]:
        parts = [f"### {one.name}"] if headed else []
        parts += [self._block([one.code]), one.doc]
        if one.fields:
            kinds = any(row.kind for row in one.fields)
            head = (
                f"| {one.word} | type | meaning |\n|---|---|---|" if kinds else f"| {one.word} | meaning |\n|---|---|"
            )
            rows = [" | ".join(row_cells(row, kinds)) for row in one.fields]
            parts.append("\n".join([head, *(f"| {row} |" for row in rows)]))
        overloads: dict[str, list[Call]] = {}
        for call in one.calls:
            overloads.setdefault(call.name, []).append(call)
        for calls in overloads.values():
            parts.append(self._block([call.code for call in calls]))
            parts.append("\n\n".join(call.doc for call in calls if call.doc))
        return parts

    def _block(self, code: list[str]) -> str:
        lines = "\n".join(wrapped(one) for one in code if one)
        return f"```{self.language}\n{lines}\n```" if lines else ""


def row_cells(row: Field, kinds: bool) -> list[str]:
    """The cells of a field's row."""
    kind = row.kind.replace("|", "\\|")
    return [f"`{row.name}`", *([f"`{kind}`" if kind else ""] if kinds else []), cell(row.doc)]


def anchor(heading: str) -> str:
    """As mdBook and GitHub make it."""
    return re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-")


def first(doc: str) -> str:
    """The first sentence."""
    return re.split(r"(?<=[.:])\s", doc.strip(), maxsplit=1)[0].rstrip(":")


def cell(doc: str) -> str:
    """A doc in a table's cell."""
    return " ".join(doc.split()).replace("|", "\\|")


def plain(lines: list[str]) -> str:
    """Lines of a comment as paragraphs; what Markdown would take for HTML is escaped, but in code."""
    text = "\n".join(lines).strip()
    return "".join(
        part if at % 2 else part.replace("<", "&lt;") for at, part in enumerate(re.split(r"(`[^`]*`)", text))
    )


def wrapped(code: str) -> str:
    """A declaration; its arguments below each other where it is long."""
    if len(code) <= WIDTH or "\n" in code or "(" not in code or "()" in code:
        return code
    start = code.index("(") + 1
    parts, depth, last = [], 0, start
    for at in range(start, len(code)):
        depth += code[at] in "([{<"
        depth -= code[at] in ")]}" or (code[at] == ">" and code[at - 1] not in "-=")
        if depth < 0:
            end = at
            break
        if code[at] == "," and depth == 0:
            parts.append(code[last : at + 1].strip())
            last = at + 1
    parts.append(code[last:end].strip())
    return code[:start] + "\n    " + "\n    ".join(parts) + "\n" + code[end:]
