"""JavaScript: what the type declarations of the npm package say."""

from __future__ import annotations

import re

import curly
from page import ROOT, Call, Chapter, Field, Page, Section, plain

FILES = {"index": "libupt", "worker": "libupt/worker", "three": "libupt/three", "block": "libupt/block"}
ABOUT = """\
The npm package `libupt`, for browsers and Node ([in the browser](../guide/web.md)): `libupt` itself, a worker that
steps while the page draws, and a mesh for three.js. A call that the library refuses throws `UptError` with the
library's message. Fields with a `?` may be left out.

This page is made of the package's type declarations by `cargo xtask api`."""


def page() -> Page:
    """The page of JavaScript."""
    return Page("javascript.md", "JavaScript", ABOUT, "ts", [chapter(name, module) for name, module in FILES.items()])


def chapter(file: str, module: str) -> Chapter:
    """What a module exports."""
    functions = Section("Functions", f"What `{module}` exports beside types.", word="name")
    found: list[Section] = []
    for item in curly.items((ROOT / f"web/src/{file}.d.ts").read_text(encoding="utf-8"), inline="=:|&<"):
        head = item.head.removeprefix("export ").removeprefix("declare ")
        if kind := re.match(r"(?:class|interface) (\w+)", head):
            found.append(section(kind[1], head, item))
        elif kind := re.match(r"type (\w+) = ", head):
            found.append(Section(kind[1], plain(item.doc), f"{head};"))
        elif kind := re.match(r"function (\w+)", head):
            functions.calls.append(Call(kind[1], f"{head.removeprefix('function ')};", plain(item.doc)))
        elif kind := re.match(r"const (\w+): (\w+)", head):
            functions.fields.append(Field(kind[1], kind[2], plain(item.doc)))
    if functions.calls or functions.fields:
        found.insert(0, functions)
    return Chapter(f"`{module}`", "", found)


def section(name: str, head: str, item: curly.Item) -> Section:
    """The members of a class or interface."""
    made = Section(name, plain(item.doc), head if "extends" in head else "")
    for member in curly.items(item.body or "", inline="=:|&<"):
        if call := re.match(r"(?:static )?(\w+)\(", member.head):
            made.calls.append(Call(call[1], f"{member.head};", plain(member.doc)))
        elif field := re.match(r"(?:readonly )?(\w+\??): (.*)", member.head):
            made.fields.append(Field(field[1], field[2], plain(member.doc)))
    return made
