"""A preprocessor of mdBook: links that leave docs/ name the file in the repository, since the book does not hold it.

mdBook writes a folder's README.md as index.html but leaves the links to it alone: these change too.
"""

from __future__ import annotations

import json
import os
import re
import sys


def inside(content: str, page: str) -> str:
    """The page with `[text](../../examples/c)` as `text (examples/c in the repository)`."""

    def plain(match: re.Match[str]) -> str:
        text, target = match[1], match[2].partition("#")[0]
        path = os.path.normpath(os.path.join(os.path.dirname(page), target))
        if re.match(r"[a-z]+:", match[2]) or not path.startswith(".."):
            return match[0].replace("README.md", "index.md")
        path = path.removeprefix("../")
        return text if text.strip("`") == path else f"{text} (`{path}` in the repository)"

    return re.sub(r"\[([^\[\]]*)\]\(([^)\s]+)\)", plain, content)


def walk(items: list) -> None:
    """Changes the chapters in place."""
    for item in items:
        chapter = item.get("Chapter") if isinstance(item, dict) else None
        if chapter:
            if chapter["path"]:
                chapter["content"] = inside(chapter["content"], chapter["path"])
            walk(chapter["sub_items"])


if __name__ == "__main__":
    if sys.argv[1:2] == ["supports"]:
        sys.exit(0)
    _, book = json.load(sys.stdin)
    walk(book.get("items", book.get("sections", [])))
    json.dump(book, sys.stdout)
