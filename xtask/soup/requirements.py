"""Requirements and the tests that verify them, as the source states both.

A requirement is a line of a doc comment, `REQ-012: what holds.`, in the file that does it. A test names what it
verifies in the comment of its function: `Verifies REQ-012, REQ-013.` Numbers are never used twice, and a requirement
that goes leaves a gap.
"""

from __future__ import annotations

import re
import subprocess
from dataclasses import dataclass, field
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
STATED = re.compile(r"^\s*//[/!]\s*(REQ-\d{3}): (.+)$")
VERIFIES = re.compile(r"\bVerifies (REQ-\d{3}(?:, REQ-\d{3})*)\.")
FUNCTION = re.compile(r"\b(?:fn|def|void|int) (\w+)\s*\(")
NO_TEST = "(no test)"


@dataclass
class Requirement:
    """What holds, where the code for it is, and `file::function` of each test."""

    key: str
    text: str
    file: str
    tests: list[str] = field(default_factory=list)


def files() -> list[str]:
    """Source files of a clone that may state or verify something; what speaks of the syntax is not among them."""
    command = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
    listed = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout.split("\0")
    kinds = (".rs", ".py", ".c", ".cpp", ".cs")
    own = ("xtask/soup/", "tests/style/")
    return sorted(one for one in listed if one.endswith(kinds) and not one.startswith(own) and (ROOT / one).exists())


def stated(file: str, text: str) -> list[Requirement]:
    """Requirements of a file."""
    found = (STATED.match(line) for line in text.splitlines())
    return [Requirement(match[1], match[2], file) for match in found if match]


def verified(file: str, text: str) -> list[tuple[str, str]]:
    """Pairs of a requirement and a test, `file::function`; in Python the comment is inside of its function."""
    lines = text.splitlines()
    pairs = []
    for number, line in enumerate(lines):
        match = VERIFIES.search(line)
        if not match:
            continue
        around = lines[number::-1] if file.endswith(".py") else lines[number:]
        place = next((n for n, one in enumerate(around) if FUNCTION.search(one)), None)
        is_test = place is not None and (not file.endswith(".rs") or any("#[test]" in one for one in around[:place]))
        function = FUNCTION.search(around[place])[1] if is_test else NO_TEST
        pairs += [(key, f"{file}::{function}") for key in match[1].split(", ")]
    return pairs


def read() -> tuple[dict[str, Requirement], list[str]]:
    """All requirements by number, and faults: a number twice, one without a test, a test of none."""
    texts = {file: (ROOT / file).read_text(encoding="utf-8") for file in files()}
    return collect(texts)


def collect(texts: dict[str, str]) -> tuple[dict[str, Requirement], list[str]]:
    """The same for given files."""
    found: dict[str, Requirement] = {}
    faults = []
    for file, text in texts.items():
        for one in stated(file, text):
            if one.key in found:
                faults.append(f"{one.key} is stated in {found[one.key].file} and in {file}")
            found.setdefault(one.key, one)
    for file, text in texts.items():
        for key, test in verified(file, text):
            if test.endswith(NO_TEST):
                faults.append(f"{file}: what verifies {key} is no test")
            elif key in found:
                found[key].tests.append(test)
            else:
                faults.append(f"{test} verifies {key}, which no source states")
    faults += [f"{one.file}: {one.key} has no test" for one in found.values() if not one.tests]
    return dict(sorted(found.items())), faults
