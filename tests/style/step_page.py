"""Every function that docs/reference/step.md names stands in the file that it names beside it."""

import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs/reference/step.md"
# A file, and the functions that follow it in the same list: `file.rs` `one`, `two`.
NAMED = re.compile(r"`([\w/]+\.rs)` ((?:`\w+`(?:, )?)+)")


def main() -> int:
    missing, count = [], 0
    for file, functions in NAMED.findall(PAGE.read_text(encoding="utf-8")):
        path = ROOT / file
        text = path.read_text(encoding="utf-8") if path.is_file() else ""
        for function in re.findall(r"\w+", functions):
            count += 1
            if not re.search(rf"\bfn {function}\b", text):
                missing.append(f"{PAGE.relative_to(ROOT)}: {file} has no function `{function}`")
    print("\n".join(missing) or f"step.md names {count} functions, all of them where it says")
    return 1 if missing or not count else 0


if __name__ == "__main__":
    sys.exit(main())
