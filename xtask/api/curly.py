"""Declarations of languages with braces (C++, C#, TypeScript), with the doc comments above them. Bodies are skipped."""

from __future__ import annotations

import re
from dataclasses import dataclass

#: A comment, a string, a preprocessor line, or one character.
TOKEN = re.compile(
    r"(?P<doc>///[^\n]*|/\*\*.*?\*/)|(?P<comment>//[^\n]*|/\*.*?\*/)"
    r'|(?P<text>"(?:\\.|[^"\\\n])*"|\'(?:\\.|[^\'\\\n])*\')|(?P<line>(?<=\n)[ \t]*#[^\n]*)|(?P<one>.)',
    re.DOTALL,
)
LABELS = ("public", "private", "protected")


@dataclass
class Item:
    """One declaration."""

    #: Lines of the doc comment.
    doc: list[str]
    #: All up to `;` or to the braces, on one line.
    head: str
    #: What is in the braces.
    body: str | None


def items(text: str, comma: bool = False, inline: str = "=") -> list[Item]:
    """The declarations of a file, a namespace or a class.

    Args:
        text: what is read.
        comma: whether commas end a declaration, as in an enumeration.
        inline: characters after which braces are part of the declaration.
    """
    found: list[Item] = []
    doc: list[str] = []
    head, depth, braces, start = "", 0, 0, 0

    def end(body: str | None) -> None:
        nonlocal doc, head
        if head.strip():
            found.append(Item(doc, " ".join(head.split()), body))
        doc, head = [], ""

    for token in TOKEN.finditer(text):
        one = token["one"]
        if braces:
            braces += (one == "{") - (one == "}")
            if braces == 0:
                end(text[start : token.start()])
        elif token["doc"]:
            if not head.strip():
                doc += lines(token["doc"])
        elif token["text"]:
            head += token["text"]
        elif one == "{" and depth == 0 and not head.rstrip().endswith(tuple(inline)):
            braces, start = 1, token.end()
        elif depth == 0 and (one == ";" or (comma and one == ",") or (one == ":" and head.strip() in LABELS)):
            end(None)
        elif one:
            depth += (one in "([{") - (one in ")]}")
            head += one
    end(None)
    return found


def lines(comment: str) -> list[str]:
    """The text of a doc comment."""
    if comment.startswith("///"):
        return [comment[3:].removeprefix(" ").rstrip()]
    inside = comment[3:-2].strip().splitlines()
    return [re.sub(r"^\s*\* ?", "", line).rstrip() for line in inside]


def without_attributes(head: str) -> tuple[str, str]:
    """What stands in square brackets before a declaration of C#, and the declaration."""
    at, depth, quoted = 0, 0, False
    while at < len(head) and (depth or quoted or head[at] in "[ "):
        quoted ^= head[at] == '"' and head[at - 1] != "\\"
        depth += not quoted and ((head[at] == "[") - (head[at] == "]"))
        at += 1
    return head[:at].strip(), head[at:].strip()
