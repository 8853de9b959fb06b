"""Tables in pages: what stands between `<!-- NAME: begin -->` and `<!-- NAME: end -->` is written by a command."""

from __future__ import annotations

from pathlib import Path

from upt_training.errors import InputError


def replaced(text: str, name: str, lines: list[str], page: Path) -> str:
    """`text` with the lines between the marks of `name` exchanged; `page` is named in the error."""
    begin, end = f"<!-- {name}: begin -->\n", f"<!-- {name}: end -->"
    if text.count(begin) != 1 or text.count(end) != 1 or text.index(begin) > text.index(end):
        raise InputError(f"{page}: needs one line '{begin.strip()}' and after it one line '{end}'")
    return text[: text.index(begin) + len(begin)] + "\n".join(lines) + "\n" + text[text.index(end) :]


def rows_of(page: Path, name: str) -> list[str]:
    """The rows of the table `name` that the page has, without its heading; none where there is no table yet."""
    text = page.read_text().split(f"<!-- {name}: begin -->")[1].split(f"<!-- {name}: end -->")[0]
    return [line for line in text.splitlines() if line.startswith("|")][2:]


def write_table(page: Path, name: str, lines: list[str]) -> None:
    """Exchange the table `name` of the file `page`."""
    page.write_text(replaced(page.read_text(), name, lines, page))
