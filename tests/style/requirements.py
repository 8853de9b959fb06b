"""Every requirement has a test, every test names one that exists; known anomalies are complete and lead to their pages.

The rules are `xtask/soup/requirements.py`. Ends with 1 and a line for each fault.
"""

from __future__ import annotations

import json
import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "xtask/soup"))
import requirements  # noqa: E402
import soup  # noqa: E402

ANOMALIES = "docs/reference/anomalies.json"
FIELDS = {"id", "title", "affects", "effect", "told_by", "until_mended", "page"}


def self_test() -> list[str]:
    """The rules find what they are for."""
    source = "//! REQ-901: holds.\n/// REQ-902: untested.\n"
    test = "/// Verifies REQ-901, REQ-903.\n#[test]\nfn it_holds() {}\n"
    found, faults = requirements.collect({"a.rs": source, "b.rs": test})
    wanted = ["b.rs::it_holds verifies REQ-903, which no source states", "a.rs: REQ-902 has no test"]
    no_test = requirements.verified("b.rs", "/// Verifies REQ-901.\nfn helper() {}\n")
    twice = requirements.collect({"a.rs": source, "c.rs": source})[1]
    good = found["REQ-901"].tests == ["b.rs::it_holds"] and faults == wanted and len(twice) == 4
    good = good and no_test == [("REQ-901", f"b.rs::{requirements.NO_TEST}")]
    log = (
        "     Running unittests src/lib.rs (target/release/deps/upt-1)\ntest a::holds ... ok\n"
        "     Running tests/one/main.rs (target/release/deps/one-1)\ntest part::holds ... FAILED\ntest other ... ok\n"
    )
    rust, run = soup.rust_results(log), {"stages": {"c": {"passed": 3, "failed": 0}}}
    tests = (
        "tests/one/part.rs::holds",
        "tests/one/main.rs::other",
        "tests/two.rs::holds",
        "tests/c/a.c::f",
        "tests/d/a.c::f",
    )
    wanted = ["FAILED", "ok", soup.NOT_RUN, "ok", soup.NOT_RUN]
    good = good and [soup.result(test, run, rust) for test in tests] == wanted
    return [] if good else ["the rules for requirements are wrong"]


def anomalies() -> list[str]:
    """What is wrong with the list of known anomalies."""
    faults, seen = [], set()
    constants = (ROOT / "src/ffi/constants.rs").read_text(encoding="utf-8")
    for one in json.loads((ROOT / ANOMALIES).read_bytes())["anomalies"]:
        key = one.get("id", "?")
        if set(one) != FIELDS or not re.fullmatch(r"ANO-\d{3}", key) or key in seen:
            faults.append(f"{ANOMALIES}: {key}: fields must be {sorted(FIELDS)}, and each id its own")
        seen.add(key)
        told = one.get("told_by") or ""
        faults += [f"{ANOMALIES}: {key}: no {flag}" for flag in re.findall(r"UPT_\w+", told) if flag not in constants]
        if not (ROOT / one.get("page", "?").partition("#")[0]).is_file():
            faults.append(f"{ANOMALIES}: {key}: no page {one.get('page')}")
    return faults


def main() -> int:
    """Checks the repository."""
    found, faults = requirements.read()
    faults = self_test() + faults + anomalies()
    tests = sum(len(one.tests) for one in found.values())
    print("\n".join(faults) or f"{len(found)} requirements, verified {tests} times")
    return min(len(faults), 1)


if __name__ == "__main__":
    sys.exit(main())
