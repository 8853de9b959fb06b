"""The documentation in a package: pages and docs/, with links that lead somewhere there.

python xtask/package/documents.py FOLDER copies each page and picture to its place in the repository, below FOLDER. A
link to what the package does not have becomes plain text. `tests/docs/links.py FOLDER` finds what is dead all the same.
"""

from __future__ import annotations

import os
import re
import shutil
import sys
from pathlib import Path, PurePosixPath

ROOT = Path(__file__).resolve().parents[2]

# Where in the package a file or folder of the repository is, seen from the folder of the documents.
ELSEWHERE = {
    "examples/c": "../../upt/examples/c",
    "examples/cpp": "../../upt/examples/cpp",
    "onnx": "../../upt/bundles",
}

# Pages outside docs/ that the package has too.
PAGES = [
    "README.md",
    "CHANGELOG.md",
    "CONTRIBUTING.md",
    "CODE_OF_CONDUCT.md",
    "SECURITY.md",
    "NOTICE",
    "examples/README.md",
    "python/README.md",
    "unity-plugin/Documentation~/index.md",
]


def place(link: str, page: str, files: set[str]) -> str | None:
    """Where a link of a page leads in the package; none where the package does not have its target."""
    target = link.partition("#")[0]
    if not target or ":" in link:
        return link
    folder = os.path.dirname(page)
    target = os.path.normpath(os.path.join(folder, target)).replace(os.sep, "/")
    if target in files:
        return link
    for begin, to in ELSEWHERE.items():
        if PurePosixPath(target).is_relative_to(begin):
            return "../" * len(PurePosixPath(folder).parts) + to + target[len(begin) :]
    return None


def relinked(text: str, page: str, files: set[str]) -> str:
    """A page with its links as they are in the package."""

    def link(found: re.Match[str]) -> str:
        to = place(found["link"], page, files)
        return found["label"] if to is None else f"{found['mark']}[{found['label']}]({to})"

    return re.sub(r"(?P<mark>!?)\[(?P<label>[^\[\]]*)\]\((?P<link>[^)\s]*)\)", link, text)


def main() -> None:
    """Copies the documents."""
    folder = Path(sys.argv[1])
    documents = [path for path in (ROOT / "docs").rglob("*") if path.is_file()]
    files = {*PAGES, *(path.relative_to(ROOT).as_posix() for path in documents)}
    for file in sorted(files):
        to = folder / file
        to.parent.mkdir(parents=True, exist_ok=True)
        if to.suffix == ".md":
            text = (ROOT / file).read_bytes().decode("utf-8")
            to.write_bytes(relinked(text, file, files).encode("utf-8"))
        else:
            shutil.copy(ROOT / file, to)


if __name__ == "__main__":
    main()
