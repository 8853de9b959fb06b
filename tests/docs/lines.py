"""Lines of pages have at most 100 columns: whoever reads a change of one sees the sentence that changed.

    python tests/docs/lines.py --fix    # breaks the long lines of paragraphs, which changes nothing of what is shown

Tables, code, headings and what has no space to break at may be longer, and so may what a command writes: pages of
interfaces, figures behind `<!-- results: ... -->`, and what is between marks of a beginning and an end.
"""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

from markdown_it import MarkdownIt

ROOT = Path(__file__).resolve().parents[2]
COLUMNS = 100
#: Written by `cargo xtask api` and `upt reference`, or not ours to change.
WRITTEN = {
    *(f"docs/reference/{name}.md" for name in ("cli", "cpp", "csharp", "gdscript", "javascript", "python")),
    "unity-plugin/Third Party Notices.md",
    "unity-plugin/LICENSE.md",
}
#: A word at which a line would begin something else than its paragraph.
BEGINS = re.compile(r"([-+*=]+|#+|>.*|\|.*|\d+[.)]|<.*|~~~.*|```.*|\[\^?[^\]]*\]:.*)$")
#: Marks around what commands write.
BLOCK_BEGINS = re.compile(r"<!-- (begin: .*|.*: begin|programmes|schemes) -->")
BLOCK_ENDS = re.compile(r"<!-- (end: .*|.*: end|end) -->")
PARSER = MarkdownIt("commonmark").enable("table")


def is_written(name: str) -> bool:
    """Whether most of a page comes from commands, as the figures of docs/results do."""
    return name in WRITTEN or name.startswith("docs/results/")


def paragraphs(text: str) -> list[tuple[int, int, str]]:
    """First line, end and first words behind the marks of lists and quotes, of paragraphs that no command writes."""
    lines = text.splitlines()
    written: set[int] = set()
    block = shown = False
    for number, line in enumerate(lines):
        block = block or bool(BLOCK_BEGINS.match(line))
        shown = (shown or line.startswith("<!-- results: ")) and line.strip() != ""
        if block or shown:
            written.add(number)
        block = block and not BLOCK_ENDS.match(line)
    tokens = PARSER.parse(text)
    found = [
        (token.map[0], token.map[1], tokens[at + 1].content.split("\n")[0])
        for at, token in enumerate(tokens)
        if token.type == "paragraph_open" and token.map
    ]
    return [own for own in found if not written.intersection(range(own[0], own[1]))]


def words(text: str) -> list[str]:
    """What a line may be broken between: code, pictures and targets of links stay whole, and no list begins."""
    atoms = re.findall(r"(?:`+[^`]*`+|!\[[^\]]*\]\([^)]*\)|\]\([^)]*\)|<[^>]*>|[^\s`])+", text)
    joined: list[str] = []
    for atom in atoms:
        if joined and BEGINS.match(atom):
            joined[-1] += " " + atom
        else:
            joined.append(atom)
    return joined


def broken(lines: list[str], first: str) -> list[str]:
    """The lines of a paragraph, none longer than needs be; `first` is the first without marks of lists."""
    before = lines[0][: lines[0].index(first)]
    later = re.sub(r"[^>\s]", " ", before)
    rest = [line.lstrip(" >" if ">" in before else " ") for line in lines[1:]]
    made: list[str] = []
    line = ""
    for word in words(" ".join([first, *rest])):
        room = COLUMNS - len(later)
        if line and len(line) + 1 + len(word) > room:
            made.append(line)
            line = word
        else:
            line = f"{line} {word}".lstrip()
    made.append(line)
    return [before + made[0], *(later + line for line in made[1:])]


def meaning(text: str) -> str:
    """What a page shows, whatever its lines."""
    return re.sub(r"\s+", " ", PARSER.render(text))


def fixed(text: str) -> str:
    """A page whose paragraphs have no long lines, and which shows the same."""
    lines = text.splitlines()
    long = []
    for start, end, first in reversed(paragraphs(text)):
        own = lines[start:end]
        is_long = any(len(line) > COLUMNS for line in own)
        if is_long and first in own[0] and not any(line.endswith(("  ", "\\")) for line in own):
            long.append((start, end, broken(own, first)))

    def with_broken(these: list[tuple[int, int, list[str]]]) -> str:
        made = list(lines)
        for start, end, other in these:
            made[start:end] = other
        return "\n".join(made) + "\n"

    wanted = meaning(text)
    if meaning(with_broken(long)) == wanted:
        return with_broken(long)
    return with_broken([one for one in long if meaning(with_broken([one])) == wanted])


def faults(path: Path) -> list[str]:
    """The lines of paragraphs that are longer than they need to be."""
    if is_written(path.relative_to(ROOT).as_posix()):
        return []
    text = path.read_text(encoding="utf-8")
    lines = text.splitlines()
    long = [at for start, end, _ in paragraphs(text) for at in range(start, end) if len(lines[at]) > COLUMNS]
    if not long or fixed(text) == text:
        return []
    return [f"{path}:{at + 1}: longer than {COLUMNS} columns; run `python tests/docs/lines.py --fix`" for at in long]


def main() -> int:
    """Says which pages have long lines, or breaks them."""
    listed = subprocess.run(
        ["git", "ls-files", "-z", "*.md"], cwd=ROOT, capture_output=True, text=True, check=True
    ).stdout
    found = []
    for name in filter(None, listed.split("\0")):
        path = ROOT / name
        if "--fix" in sys.argv[1:] and not is_written(name):
            text = path.read_text(encoding="utf-8")
            if (other := fixed(text)) != text:
                path.write_text(other, encoding="utf-8")
        found += faults(path)
    print("\n".join(found) or "all lines are short enough")
    return min(len(found), 1)


if __name__ == "__main__":
    sys.exit(main())
