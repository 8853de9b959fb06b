"""What a manufacturer needs to know of libupt as software of unknown provenance (SOUP): soup.json and soup.md.

python xtask/soup/soup.py FOLDER. docs/reference/soup.md says what each part is for. Everything is read from this tree:
requirements and tests from comments (`requirements.py`), ways to fail from `src/ffi`, hashes from `onnx/`, results from
the last run of `cargo xtask test`.
"""

from __future__ import annotations

import hashlib
import json
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import requirements
from requirements import ROOT, Requirement

LOGS = ROOT / "target/xtask-logs"
NOT_RUN = "not run at this commit"


def git(*words: str) -> str:
    """What git prints."""
    return subprocess.run(["git", *words], cwd=ROOT, capture_output=True, text=True, check=True).stdout.strip()


def evidence(commit: str, changed: bool) -> dict | None:
    """The last run of the tests, where it was of this very commit."""
    file = LOGS / "evidence.json"
    found = json.loads(file.read_bytes()) if file.exists() else None
    return found if found and not changed and not found["changed"] and found["commit"] == commit else None


def whole(run: dict | None) -> dict | None:
    """A run, with the stages that it lacks and the hash of each log that it left in `target/xtask-logs`."""
    if not run:
        return None
    missing = [name for name in run["of"] if name not in run["stages"]]
    failed = [name for name, one in run["stages"].items() if one["failed"]]
    logs = {file.name: digest(file) for file in sorted(LOGS.glob("*.log"))}
    return {**run, "is_whole": not missing, "not_run": missing, "failed_stages": failed, "logs_sha256": logs}


def rust_results(log: str) -> dict[str, str]:
    """`file of the test program::function` -> ok, FAILED or ignored, out of what `cargo test` printed."""
    results, program = {}, ""
    for line in log.splitlines():
        if match := re.match(r"\s*Running (?:unittests )?(\S+) \(", line):
            program = match[1]
        elif match := re.match(r"test (\S+) \.\.\. (ok|FAILED|ignored)", line):
            results[f"{program}::{match[1].split('::')[-1]}"] = match[2]
    return results


def result(test: str, run: dict | None, rust: dict[str, str]) -> str:
    """Of one test: Rust's by name, others by their stage."""
    if not run:
        return NOT_RUN
    file, _, function = test.partition("::")
    if file.endswith(".rs"):
        places = (file, str(Path(file).parent / "main.rs"))
        found = [rust.get(f"{one[one.index('tests/') :]}::{function}") for one in places if "tests/" in one]
        return next((one for one in found if one), NOT_RUN)
    stage = Path(file).parts[1] if file.startswith("tests/") else Path(file).parts[0]
    row = run["stages"].get(stage)
    if not row or not row["passed"] + row["failed"]:
        return NOT_RUN
    return "FAILED" if row["failed"] else "ok"


def failures() -> list[dict]:
    """Errors and flags with their meaning: how libupt fails, and how it says so."""
    found = []
    for file in ("crates/field/src/status.rs", "src/ffi/constants.rs"):
        doc: list[str] = []
        for line in (ROOT / file).read_text(encoding="utf-8").splitlines():
            if line.startswith("///"):
                doc.append(line.removeprefix("///").strip())
                continue
            if match := re.match(r"pub const (UPT_(?:ERR|FLAG)_\w+)", line):
                found.append({"name": match[1], "meaning": " ".join(doc)})
            doc = []
    return found


def bundle(folder: Path) -> dict:
    """Hashes of a bundle, and its certificate where `upt make` wrote one."""
    manifest = json.loads((folder / "bundle.json").read_bytes())
    certificate = folder / "certificate.json"
    measured = None
    if certificate.exists():
        told = json.loads(certificate.read_bytes())
        keys = ("contact", "free", "force_error", "envelope", "regions", "tools", "verdict")
        measured = {key: told[key] for key in keys if key in told}
        measured["is_of_this_manifest"] = told["bundle"]["sha256"] == digest(folder / "bundle.json")
    return {
        "name": manifest["name"],
        "folder": folder.relative_to(ROOT).as_posix(),
        "body": manifest.get("body"),
        "sha256": {file.name: digest(file) for file in sorted(folder.iterdir()) if file.is_file()},
        "material": manifest["material"],
        "boundary": manifest["boundary"],
        "envelope": manifest.get("envelope"),
        "certificate": measured,
    }


def digest(file: Path) -> str:
    """SHA-256 of a file."""
    return hashlib.sha256(file.read_bytes()).hexdigest()


def row(one: Requirement, run: dict | None, rust: dict[str, str]) -> dict:
    """A requirement with the results of its tests."""
    tests = [{"test": test, "result": result(test, run, rust)} for test in one.tests]
    return {"id": one.key, "text": one.text, "implemented_in": one.file, "verified_by": tests}


def gather() -> tuple[dict, list[str]]:
    """The whole file, and what is wrong with the requirements."""
    found, faults = requirements.read()
    commit, changed = git("rev-parse", "HEAD"), bool(git("status", "--porcelain"))
    run = evidence(commit, changed)
    log = LOGS / "cargo-test.log"
    rust = rust_results(log.read_text(encoding="utf-8", errors="replace")) if run and log.exists() else {}
    workspace = tomllib.loads((ROOT / "Cargo.toml").read_text(encoding="utf-8"))["workspace"]["package"]
    folders = sorted(path.parent for path in (ROOT / "onnx").glob("*/bundle.json"))
    return {
        "format": "libupt-soup",
        "version": 1,
        "notice": "No certification, no validation for a medical purpose, no warranty. libupt is not a medical device.",
        "identification": {
            "title": "libupt",
            "manufacturer": workspace["authors"][0],
            "version": workspace["version"],
            "commit": commit,
            "files_changed_since_the_commit": changed,
            "licence": workspace["license"],
            "bill_of_materials": "beside each package: .cdx.json, .spdx.json",
        },
        "needs": json.loads((ROOT / "xtask/soup/needs.json").read_bytes()),
        "requirements": [row(one, run, rust) for one in found.values()],
        "ways_to_fail": failures(),
        "known_anomalies": json.loads((ROOT / "docs/reference/anomalies.json").read_bytes())["anomalies"],
        "test_run": whole(run),
        "bundles": [bundle(folder) for folder in folders],
    }, faults


def page(soup: dict) -> str:
    """The same for people."""
    name = soup["identification"]
    lines = [
        f"# libupt {name['version']} as SOUP",
        "",
        soup["notice"],
        "",
        f"Commit `{name['commit']}`, licence {name['licence']}.",
    ]
    if name["files_changed_since_the_commit"]:
        lines += ["", "**Files differ from the commit's**: this page is a draft."]
    lines += ["", "## Hardware and software that it needs", "", "| | |", "|---|---|"]
    lines += [f"| {key} | {value} |" for key, value in soup["needs"].items()]
    lines += ["", "## Requirements", "", "| | what holds | verified by | result |", "|---|---|---|---|"]
    for one in soup["requirements"]:
        tests = "<br>".join(f"`{test['test']}`" for test in one["verified_by"])
        results = "<br>".join(test["result"] for test in one["verified_by"])
        lines.append(f"| {one['id']} | {one['text']} | {tests} | {results} |")
    lines += ["", "## How it fails, and how it says so", "", "| | |", "|---|---|"]
    lines += [f"| `{one['name']}` | {one['meaning']} |" for one in soup["ways_to_fail"]]
    lines += [
        "",
        "## Known anomalies",
        "",
        "| | what | effect | told by | until it is mended |",
        "|---|---|---|---|---|",
    ]
    for one in soup["known_anomalies"]:
        told = one["told_by"] or "**nothing**"
        lines.append(
            f"| {one['id']} | {one['title']}: {one['affects']} | {one['effect']} | {told} | {one['until_mended']} |"
        )
    lines += ["", "## Test run", ""]
    run = soup["test_run"]
    if run:
        machine = run["machine"]
        lines += [
            f"{machine['cpu']}, {machine['cores']} cores, {machine['system']} {machine['architecture']}, "
            f"{run['rustc']}.",
            "",
        ]
        lines += ["| stage | passed | failed | skipped |", "|---|---|---|---|"]
        lines += [
            f"| {key} | {one['passed']} | {one['failed']} | {one['skipped']} |" for key, one in run["stages"].items()
        ]
        lines += [f"| {key} | **not run** | | |" for key in run["not_run"]]
        lines += ["", f"SHA-256 of the {len(run['logs_sha256'])} logs: `soup.json`."]
    else:
        lines.append("None of this commit: run `cargo xtask test` in a clean clone first.")
    lines += [
        "",
        "## Bundles",
        "",
        "| | SHA-256 of bundle.json | certificate: error in contact, mm² | force |",
        "|---|---|---|---|",
    ]
    for one in soup["bundles"]:
        told = one["certificate"]
        measured = (
            f"{told['contact']['mse_mm2']:.2g} | {100 * told['force_error']:.1f} %"
            if told
            else "none: [results](docs/results) | "
        )
        lines.append(f"| {one['folder']} | `{one['sha256']['bundle.json']}` | {measured} |")
    return "\n".join(lines) + "\n"


def main() -> int:
    """Writes both files; ends with 1 where a requirement is not tested, or a test failed."""
    folder = Path(sys.argv[1])
    folder.mkdir(parents=True, exist_ok=True)
    soup, faults = gather()
    (folder / "soup.json").write_text(json.dumps(soup, indent=1) + "\n", encoding="utf-8", newline="\n")
    (folder / "soup.md").write_text(page(soup), encoding="utf-8", newline="\n")
    results = [test["result"] for one in soup["requirements"] for test in one["verified_by"]]
    count = {one: results.count(one) for one in sorted(set(results))}
    print(f"{folder}/soup.json, soup.md: {len(soup['requirements'])} requirements, tests of them: {count}")
    run = soup["test_run"]
    if run and not run["is_whole"]:
        print(f"the test run is not whole: {', '.join(run['not_run'])} did not run at this commit")
    print("\n".join(faults), end="\n" if faults else "")
    return int(bool(faults) or "FAILED" in results)


if __name__ == "__main__":
    sys.exit(main())
