"""`cargo xtask test --only docs`: links, code blocks, commands, the index and the book. The last line counts.

A page without a fault in one of these is one passed test; so is each code block that compiles.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path
from urllib.parse import unquote

sys.path.insert(0, str(Path(__file__).parent))
sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "xtask/api"))
import api
import blocks
import bundles
import calls
import commands
import english
import lines
import links
import results

ROOT = Path(__file__).resolve().parents[2]
RELEASE = Path(os.environ.get("UPT_LIB_DIR", ROOT / "target/release"))
WORK = Path(os.environ.get("UPT_BUILD_DIR", ROOT / "target")) / "docs-test"


class Tally:
    """Counts, and prints what failed."""

    def __init__(self) -> None:
        self.passed = 0
        self.failed = 0

    def add(self, faults: list[str]) -> None:
        """One test."""
        self.passed += not faults
        self.failed += bool(faults)
        for fault in faults:
            print(f"FAILED {fault}")


def known_files() -> set[Path]:
    """Files that a clone has, and their folders."""
    command = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
    listed = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout
    files = {ROOT / name for name in listed.split("\0") if name and (ROOT / name).exists()}
    return files | {parent for file in files for parent in file.parents}


def index(pages: list[Path], name: str) -> list[str]:
    """The pages of docs/ that a table of contents leaves out; the decisions have a table of their own."""
    contents = ROOT / "docs" / name
    listed = {(contents.parent / link.target.partition("#")[0]).resolve() for link in links.page(contents).links}
    decisions = ROOT / "docs/decisions"
    within = [path for path in pages if path.is_relative_to(ROOT / "docs") and not path.stem.isupper()]
    if name != "SUMMARY.md":
        within = [path for path in within if (path.parent == decisions) == (contents.parent == decisions)]
    return [f"docs/{name} does not list {path.relative_to(ROOT)}" for path in within if path not in listed]


def book() -> list[str]:
    """Builds the book; a warning is a fault."""
    WORK.mkdir(parents=True, exist_ok=True)
    command = [
        str(Path(sys.executable).parent / "mdbook"),
        "build",
        str(ROOT / "docs"),
        "--dest-dir",
        str(WORK / "book"),
    ]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    said = [line for line in done.stderr.splitlines() if "WARN" in line or "ERROR" in line]
    if done.returncode != 0 or said:
        return ["mdbook: " + "\n".join(said or [done.stderr])]
    return dead_links(WORK / "book")


def dead_links(folder: Path) -> list[str]:
    """Links of the built pages that lead to no file."""
    found = []
    for page in sorted(folder.rglob("*.html")):
        for target in re.findall(r'(?:href|src)="([^"#?]+)', page.read_text(encoding="utf-8")):
            if not re.match(r"[a-z]+:|//", target) and not (page.parent / unquote(target)).exists():
                found.append(f"{page.relative_to(folder)}: {target} is not in the book")
    return found


def main() -> int:
    """Runs all checks."""
    tally = Tally()
    known = known_files()
    pages = sorted(path for path in known if path.suffix == ".md")
    for path in pages:
        tally.add(links.faults(path, known.__contains__))
        tally.add(english.faults(path))
        tally.add(lines.faults(path))
        if path.name != "CHANGELOG.md":
            tally.add(commands.faults(path))
    sources = sorted(path for path in known if path.suffix in english.SOURCES)
    tally.add([fault for path in sources for fault in english.faults(path)])
    named = sorted(path for path in known if path.suffix in calls.SOURCES)
    tally.add([fault for path in named for fault in calls.faults(path)])
    for name in ("README.md", "SUMMARY.md", "decisions/README.md"):
        tally.add(index(pages, name))
    for make in api.PAGES:
        tally.add(api.stale(make))
    tally.add(bundles.faults())
    tally.add(results.faults())
    tally.add(book())
    for path in pages:
        page = links.page(path)
        for block in blocks.marked(page):
            fault = blocks.fault(page, block, WORK, RELEASE)
            tally.add([fault] if fault else [])
    old = results.ages()
    if old:
        print(f"{len(old)} measurements of docs/results are older than their code: python tests/docs/results.py ages")
    print(f"{tally.passed} passed, {tally.failed} failed, 0 skipped")
    return min(tally.failed, 1)


if __name__ == "__main__":
    sys.exit(main())
