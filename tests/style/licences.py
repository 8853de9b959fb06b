"""The crates that libupt and the command link, and the texts of their licences.

python tests/style/licences.py [--write FILE]: ends with 1 where a licence is not in ACCEPTED or a text is missing.
FILE gets the notice that the packages carry. A crate's own files are taken where it ships them. Some crates on
crates.io leave the text out and only name the licence: then it is the standard text, with the crate's authors.
"""

from __future__ import annotations

import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "xtask/package"))
from crates import Crate, linked  # noqa: E402

# Licences under which a crate may be linked. MPL-2.0 is of each file by itself: it asks for the text and for where the
# source is, and nothing of what links it.
ACCEPTED = {"0BSD", "Apache-2.0", "BSD-2-Clause", "ISC", "MIT", "MPL-2.0", "Unicode-3.0", "Unlicense", "Zlib"}

HEAD = (
    "Rust crates linked into libupt and the command upt, unmodified: name, version, licence. "
    "Their source: https://crates.io/crates/NAME/VERSION\n\n"
)


def is_accepted(expression: str) -> bool:
    """True where one side of every `AND` has an accepted choice."""
    plain = re.sub(r"[()]", " ", expression or "").replace("/", " OR ")
    return all(any(choice.strip() in ACCEPTED for choice in part.split(" OR ")) for part in plain.split(" AND "))


def texts(package: Crate) -> list[str]:
    """The licence files of a crate. Of several to choose from the MIT licence is enough; notices always stay."""
    begins = ("LICEN", "COPYING", "COPYRIGHT", "NOTICE", "UNLICENSE")
    entries = sorted(package.folder.iterdir())
    files = [file for file in entries if file.is_file() and file.name.upper().startswith(begins)]
    if any("MIT" in file.name for file in files):
        files = [file for file in files if not re.search("APACHE|UNLICENSE", file.name)]
    return [file.read_bytes().decode("utf-8", "replace").replace("\r\n", "\n").strip() for file in files]


def standard_text(package: Crate) -> str | None:
    """For a crate that ships no text: this repository's own copies of the two licences."""
    if "MIT" in package.licence:
        authors = ", ".join(author.split(" <")[0] for author in package.authors)
        terms = (ROOT / "LICENSE-MIT").read_text(encoding="utf-8").partition("Permission is")[2].rstrip()
        return f"MIT License\n\nCopyright (c) {authors or 'the authors of ' + package.name}\n\nPermission is{terms}"
    if "Apache-2.0" in package.licence:
        return (ROOT / "LICENSE-APACHE").read_text(encoding="utf-8").strip()
    return None


def main() -> int:
    """A list of all crates, then each text once with the crates that it is for."""
    notice, faults = HEAD, []
    crates_of: dict[str, list[str]] = {}
    packages = [crate for crate in linked().values() if not crate.ours]
    for package in packages:
        name, version, licence = package.name, package.version, package.licence
        if not is_accepted(licence):
            faults.append(f"{name} {version}: the licence {licence} is not accepted (tests/style/licences.py)")
            continue
        found = texts(package) or [standard_text(package)]
        if None in found:
            faults.append(f"{name} {version} ships no licence text, and there is none here for {licence}")
            continue
        notice += f"{name} v{version} {licence}\n"
        for text in found:
            crates_of.setdefault(text, []).append(name)
    for text, names in sorted(crates_of.items(), key=lambda one: (one[1], one[0])):
        notice += f"\n{'-' * 80}\n{', '.join(names)}\n\n{text}\n"
    if "\nort v" not in notice:
        faults.append("`ort` is not among the linked crates: the list is not to be trusted")
    judged = {"MIT/Apache-2.0": True, "(MIT OR X) AND Zlib": True, "MIT AND GPL-3.0": False, "": False}
    faults += [f"`{one}`: the rule for licences is wrong" for one, good in judged.items() if is_accepted(one) != good]
    if sys.argv[1:2] == ["--write"] and not faults:
        Path(sys.argv[2]).write_text(notice, encoding="utf-8", newline="\n")
    print("\n".join(faults) or f"{len(packages)} linked crates with an accepted licence and its text")
    return min(len(faults), 1)


if __name__ == "__main__":
    sys.exit(main())
