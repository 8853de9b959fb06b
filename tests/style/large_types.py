"""Types of the heart of the library are whole and small: fields and methods of each, over all of its `impl` blocks.

A type that has many fields and many methods is several: its methods each read a part of it, and the compiler cannot
say which. MOST_FIELDS and MOST_METHODS are what a type may have; one that has more stands in LARGER, with what it may
have at most (a ratchet: whoever makes it smaller lowers the number). Methods of traits count with the type that has
them; tests do not count, nor do the structs of the C ABI (`repr(C)`) and RECORDS, whose fields others give.

Prints the largest types, as many as its argument says; ends with 1 and a line for each type that is too large, and for
each exception that is none any more.
"""

from __future__ import annotations

import re
import sys
from collections import defaultdict
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
HEART = {"upt": "src"} | {
    name: f"crates/{name}/src" for name in ("implicit", "contact", "kernels", "prior", "bundle", "field")
}
MOST_FIELDS = 10
MOST_METHODS = 25

# Fields, and why they are not ours to choose.
RECORDS = {
    "bundle::Manifest": "bundle.json",
    "upt::ModelInfo": "upt_model_info",
    "upt::ModelOptions": "upt_model_options",
    "upt::SceneFields": "a line of a recording",
    "upt::SceneOptions": "upt_scene_options",
    "upt::SceneStats": "upt_scene_stats",
    "upt::SceneTiming": "upt_scene_timing",
}

# Crate and type: fields and methods at most.
LARGER: dict[str, tuple[int, int]] = {
    "upt::Scene": (7, 58),
}

TOKEN = re.compile(
    r"""//[^\n]*|/\*.*?\*/|b?r(?P<h>\#*)".*?"(?P=h)|b?"(?:\\.|[^"\\])*"|b?'(?:\\.[^']*|[^'\\])'|'\w+|\w+|->|=>|::|\S""",
    re.DOTALL,
)


def tokens(text: str) -> list[str]:
    """Words and signs of Rust, without comments; a string or a character is one word."""
    found = (match.group() for match in TOKEN.finditer(text))
    return ['""' if word[-1] in "\"'" else word for word in found if not word.startswith(("//", "/*"))]


def end_of(words: list[str], start: int) -> int:
    """The place behind the bracket that closes the one at `start`."""
    depth = 0
    for at in range(start, len(words)):
        depth += (words[at] in "([{") - (words[at] in ")]}")
        if depth == 0:
            return at + 1
    return len(words)


def angle_end(words: list[str], start: int) -> int:
    """The place behind the `>` that closes the `<` at `start`."""
    depth = 0
    for at in range(start, len(words)):
        depth += (words[at] == "<") - (words[at] == ">")
        if depth == 0:
            return at + 1
    return len(words)


def owner(head: list[str]) -> str:
    """The type of an `impl`, without its path and its parameters."""
    at = angle_end(head, 0) if head[:1] == ["<"] else 0
    depth, start = 0, at
    for place in range(at, len(head)):
        depth += (head[place] in "<([") - (head[place] in ">)]")
        if head[place] == "for" and depth == 0:
            start = place + 1
        if head[place] == "where" and depth == 0:
            head = head[:place]
            break
    rest = [word for word in head[start:] if word not in ("&", "mut", "dyn") and not word.startswith("'")]
    name = ""
    for word in rest:
        if word == "<":
            break
        if re.fullmatch(r"\w+", word):
            name = word
    return name


def fields_in(words: list[str]) -> int:
    """Fields between the brackets of a struct: commas at its own depth."""
    depth = count = 0
    filled = False
    at = 0
    while at < len(words):
        word = words[at]
        if word == "#" and depth == 0:
            at = end_of(words, at + 1)
            continue
        if word == "," and depth == 0:
            count += filled
            filled = False
        else:
            filled = True
            depth += (word in "<([{") - (word in ">)]}")
        at += 1
    return count + filled


class Heart:
    """Counts by crate and type."""

    def __init__(self) -> None:
        """Nothing counted yet."""
        self.fields: dict[str, int] = defaultdict(int)
        self.methods: dict[str, int] = defaultdict(int)
        self.files: dict[str, set[str]] = defaultdict(set)
        self.abi: set[str] = set()

    def read(self, crate: str, path: Path) -> None:
        """Counts in one file."""
        words = tokens(path.read_text(encoding="utf-8"))
        self.items(crate, path.as_posix(), words)

    def items(self, crate: str, path: str, words: list[str]) -> None:
        """Structs and `impl` blocks at one level of modules."""
        at = 0
        is_abi = False
        while at < len(words):
            word = words[at]
            if word == "#":
                start = at + 1 + (words[at + 1] == "!")
                end = end_of(words, start)
                what = "".join(words[start:end])
                is_abi |= what == "[repr(C)]"
                at = past_item(words, end) if what == "[cfg(test)]" else end
            elif word == "struct":
                if is_abi:
                    self.abi.add(f"{crate}::{words[at + 1]}")
                is_abi = False
                at = self.struct(crate, words, at)
            elif word == "impl":
                brace = words.index("{", at)
                end = end_of(words, brace)
                name = f"{crate}::{owner(words[at + 1 : brace])}"
                count = methods_in(words[brace + 1 : end - 1])
                self.methods[name] += count
                if count:
                    self.files[name].add(path)
                at = end
            elif word == "mod" and words[at + 2] == "{":
                end = end_of(words, at + 2)
                self.items(crate, path, words[at + 3 : end - 1])
                at = end
            elif word in "([{":
                at = end_of(words, at)
            else:
                at += 1

    def struct(self, crate: str, words: list[str], at: int) -> int:
        """A struct at `at`; the place behind it."""
        name = f"{crate}::{words[at + 1]}"
        at += 2
        if words[at] == "<":
            at = angle_end(words, at)
        while words[at] not in ("{", "(", ";"):
            at += 1
        if words[at] == ";":
            return at + 1
        end = end_of(words, at)
        self.fields[name] = max(self.fields[name], fields_in(words[at + 1 : end - 1]))
        return end


def past_item(words: list[str], at: int) -> int:
    """The place behind the item that begins at `at`."""
    while words[at] not in ("{", ";"):
        at = end_of(words, at) if words[at] in "([" else at + 1
    return end_of(words, at) if words[at] == "{" else at + 1


def methods_in(words: list[str]) -> int:
    """Functions at the depth of the block itself."""
    count = at = 0
    while at < len(words):
        if words[at] == "#":
            end = end_of(words, at + 1)
            at = past_item(words, end) if "".join(words[at + 1 : end]) == "[cfg(test)]" else end
        elif words[at] in "([{":
            at = end_of(words, at)
        else:
            count += words[at] == "fn"
            at += 1
    return count


def main() -> int:
    """Checks the heart, and prints its largest types."""
    heart = Heart()
    for crate, folder in HEART.items():
        for path in sorted((ROOT / folder).rglob("*.rs")):
            if path.stem != "tests" and "tests" not in path.relative_to(ROOT / folder).parts:
                heart.read(crate, path)
    faults = []
    names = sorted((set(heart.fields) | set(heart.methods)) - heart.abi - set(RECORDS))
    for name in names:
        has = (heart.fields[name], heart.methods[name])
        larger = LARGER.get(name, (0, 0))
        most = (max(larger[0], MOST_FIELDS), max(larger[1], MOST_METHODS))
        if has[0] > most[0] or has[1] > most[1]:
            faults.append(
                f"{name}: {has[0]} fields, {has[1]} methods; at most {most[0]} and {most[1]}: split it by ideas"
            )
    small = [name for name in LARGER if heart.fields[name] <= MOST_FIELDS and heart.methods[name] <= MOST_METHODS]
    faults += [f"{name}: needs no exception (tests/style/large_types.py)" for name in small]
    share = {name: max(heart.fields[name] / MOST_FIELDS, heart.methods[name] / MOST_METHODS) for name in names}
    largest = sorted(names, key=lambda name: -share[name])
    for name in largest[: int(sys.argv[1]) if len(sys.argv) > 1 else 8]:
        fields, methods, files = heart.fields[name], heart.methods[name], len(heart.files[name])
        print(f"{name:36} {fields:3} fields {methods:4} methods in {files} files")
    if faults:
        print("\n".join(faults))
    return min(len(faults), 1)


if __name__ == "__main__":
    sys.exit(main())
