"""The commands of shell blocks exist, with the options that they are given.

Known are `cargo xtask` (its own help is asked), `upt` (docs/reference/cli.md, which a test keeps fresh), cargo's
packages, scripts and modules of Python. Other programs are the system's.
"""

from __future__ import annotations

import re
import shlex
import subprocess
from functools import cache
from pathlib import Path

import links
import markdown

ROOT = Path(__file__).resolve().parents[2]
SHELL = {"sh", "bash", "console"}


def lines(block: markdown.Block) -> list[list[str]]:
    """The commands of a block as words; lines that end with a backslash go on."""
    text = block.text.replace("\\\n", " ")
    found = []
    for line in text.splitlines():
        try:
            words = shlex.split(line, comments=True)
        except ValueError:
            continue
        while words and re.fullmatch(r"\w+=.*", words[0]):
            words = words[1:]
        if words:
            found.append(words)
    return found


@cache
def help_of(words: tuple[str, ...]) -> str:
    """The help of a command of xtask; empty where there is no such command."""
    command = ["cargo", "xtask", *words, "--help"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    return done.stdout if done.returncode == 0 else ""


@cache
def cli() -> dict[str, str]:
    """The sections of the reference of `upt`, by command."""
    page = (ROOT / "docs/reference/cli.md").read_text(encoding="utf-8")
    sections = re.split(r"^## `(upt[^`]*)`$", page, flags=re.MULTILINE)
    return dict(zip(sections[1::2], sections[2::2], strict=True))


def options(words: list[str]) -> list[str]:
    """The long options among the words."""
    return [word.split("=")[0] for word in words if re.match(r"--[a-z]", word)]


def fault(words: list[str]) -> str:
    """What is wrong with a command; empty where nothing is known to be."""
    if words[:2] == ["cargo", "xtask"] and len(words) > 2:
        if words[2] == "study" and len(words) > 3:
            return missing(help_of(("study", words[3])), words, f"cargo xtask study {words[3]}")
        own = words[: words.index("--")] if "--" in words else words
        return missing(help_of((own[2],)), own, f"cargo xtask {own[2]}")
    if words[0] == "upt" and len(words) > 1 and not words[1].startswith("-"):
        name = " ".join(words[:3])
        name = name if name in cli() else " ".join(words[:2])
        return missing(cli().get(name, ""), words, name)
    if words[0] == "cargo":
        packages = [words[i + 1] for i, word in enumerate(words[:-1]) if word in ("-p", "--package")]
        known = {"libupt"} | {re.search(r'name = "([^"]+)"', p.read_text())[1] for p in ROOT.glob("*/*/Cargo.toml")}
        absent = [package for package in packages if package not in known]
        return f"no package is called {absent[0]}" if absent else ""
    if re.fullmatch(r"python3?", words[0]) and words[1:2] == ["-m"] and words[2].startswith("upt_training"):
        place = ROOT / "training" / words[2].replace(".", "/")
        return "" if place.with_suffix(".py").exists() or place.is_dir() else f"no module {words[2]}"
    if re.fullmatch(r"python3?|bash", words[0]) and len(words) > 1 and words[1].endswith((".py", ".sh")):
        places = [ROOT, ROOT / "python"]
        return "" if any((place / words[1]).exists() for place in places) else f"{words[1]} does not exist"
    return ""


def missing(described: str, words: list[str], name: str) -> str:
    """The first option that the description of a command does not name."""
    if not described:
        return f"there is no command `{name}`"
    absent = [option for option in options(words) if not re.search(re.escape(option) + r"(?![\w-])", described)]
    return f"`{name}` has no option {absent[0]}" if absent else ""


def faults(path: Path) -> list[str]:
    """The commands of a page that do not exist."""
    found = []
    for block in links.page(path).blocks:
        if block.language not in SHELL:
            continue
        for words in lines(block):
            said = fault(words)
            if said:
                found.append(f"{path}:{block.line}: {said}: {shlex.join(words)[:120]}")
    return found
