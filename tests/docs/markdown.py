"""Reads a Markdown page: its links, anchors and code blocks."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

from markdown_it import MarkdownIt


@dataclass(frozen=True)
class Block:
    """A fenced code block: its language, the words after it, its first line in the page, its text."""

    language: str
    marks: tuple[str, ...]
    line: int
    text: str


@dataclass(frozen=True)
class Link:
    """A link or picture and the first line of its paragraph."""

    target: str
    line: int


@dataclass(frozen=True)
class Page:
    """What the tests ask of a page."""

    path: Path
    links: tuple[Link, ...]
    anchors: frozenset[str]
    blocks: tuple[Block, ...]


def slug(heading: str) -> str:
    """The anchor that GitHub and mdBook give a heading."""
    kept = re.sub(r"[^\w\- ]", "", heading.strip().lower())
    return kept.replace(" ", "-")


def read(path: Path) -> Page:
    """Parses a page."""
    links: list[Link] = []
    anchors: set[str] = set()
    blocks: list[Block] = []
    tokens = MarkdownIt("commonmark").enable("table").parse(path.read_text(encoding="utf-8"))
    for i, token in enumerate(tokens):
        line = token.map[0] + 1 if token.map else 0
        if token.type == "fence":
            words = token.info.split()
            language = words[0] if words else ""
            blocks.append(Block(language, tuple(words[1:]), line + 1, token.content))
        elif token.type == "heading_open":
            text = "".join(child.content for child in tokens[i + 1].children or [])
            anchor, count = slug(text), 1
            while anchor in anchors:
                anchor = f"{slug(text)}-{count}"
                count += 1
            anchors.add(anchor)
        elif token.type == "inline":
            for child in token.children or []:
                target = child.attrGet("href") if child.type == "link_open" else None
                target = child.attrGet("src") if child.type == "image" else target
                if target is not None:
                    links.append(Link(str(target), line))
        if token.type in ("html_block", "inline"):
            anchors.update(re.findall(r'<a (?:id|name)="([^"]+)"', token.content))
    return Page(path, tuple(links), frozenset(anchors), tuple(blocks))
