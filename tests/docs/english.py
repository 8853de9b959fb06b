"""Phrases that pages do not have: those of a laboratory's diary, and those that readers stumble over.

They are looked for in README and docs/, which have the help of `upt` too, and in sources, whose comments and errors
are read as well. Pages say what is. What was before, and when which machine was busy, belongs into the history, the
changelog and the decisions, which are not looked at.
"""

from __future__ import annotations

import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
DIARY = (
    "weights before(?! tools)",
    "before the present",
    "used to be",
    "we tried",
    "earlier attempts?",
    "its first weights",
    "the machine (below|at hand)",
    "another program had",
)
STILTED = (
    "of which (nothing|none|many|several|half)",
    "the same of",
    "(is|are) to be",
    "goes by",
    "gives way",
    "so many a",
    "what it leaves out",
    "answer for nothing",
)
SOURCES = (".rs", ".py", ".h", ".hpp", ".cs", ".js", ".mjs", ".gd")
# A line may end within one.
PHRASES = re.compile(r"\b(" + "|".join(DIARY + STILTED).replace(" ", r"\s+") + r")\b", re.IGNORECASE)


def looked_at(path: Path) -> bool:
    """README, the pages of docs/ but for the decisions, and sources but for this one."""
    inside = path.relative_to(ROOT)
    if path.suffix in SOURCES:
        return path != Path(__file__)
    return path == ROOT / "README.md" or (inside.parts[0] == "docs" and inside.parts[1] != "decisions")


def faults(path: Path) -> list[str]:
    """The phrases of a page, by line."""
    if not looked_at(path):
        return []
    text = path.read_text(encoding="utf-8")
    found = (
        (text.count("\n", 0, phrase.start()) + 1, " ".join(phrase[0].split())) for phrase in PHRASES.finditer(text)
    )
    return [f"{path}:{number}: '{phrase}': say it plainly, and say what is" for number, phrase in found]
