"""What a measurement measures, as one hash a path: code as it is committed, without what no figure comes from.

Left out are comments, empty lines, Rust's `#[cfg(test)]` modules at the end of a file, files of tests and pages of
Markdown. Strings stay, whatever is in them. Everything else (bundles, tables, C, JavaScript) counts by its bytes.
"""

from __future__ import annotations

import functools
import hashlib
import re
import subprocess
from pathlib import Path, PurePosixPath

ROOT = Path(__file__).resolve().parents[2]

RUST = re.compile(
    r"""(?P<kept>r(?P<fence>\#*)".*?"(?P=fence)|"(?:\\.|[^"\\])*"|'(?:\\[^'\n]+|[^'\\])')|//[^\n]*|/\*.*?\*/""",
    re.DOTALL | re.VERBOSE,
)
PYTHON = re.compile(
    r"""(?P<kept>\"{3}.*?\"{3}|'{3}.*?'{3}|"(?:\\.|[^"\\\n])*"|'(?:\\.|[^'\\\n])*')|\#[^\n]*""",
    re.DOTALL | re.VERBOSE,
)
#: The last item of a file: its inner lines are indented.
TESTS = re.compile(r"\n#\[cfg\(test\)\]\nmod \w+ \{\n(?:[^}\n].*\n|\n)*\}\n\Z")


def stripped(name: str, content: bytes) -> bytes:
    """What counts of a file."""
    comments = {".rs": RUST, ".py": PYTHON}.get(PurePosixPath(name).suffix)
    if comments is None:
        return content
    text = content.decode("utf-8")
    if comments is RUST:
        text = TESTS.sub("\n", text)
    text = comments.sub(lambda match: match["kept"] or "", text)
    return "\n".join(line.rstrip() for line in text.splitlines() if line.strip()).encode("utf-8")


EXAMPLES = [
    (
        "a.rs",
        '//! Gone.\nlet s = "// kept # \\" it"; // gone\n\nlet q = \'"\'; // "\n',
        'let s = "// kept # \\" it";\nlet q = \'"\';',
    ),
    ("a.rs", "fn f() {}\n\n#[cfg(test)]\nmod tests {\n    fn g() {}\n}\n", "fn f() {}"),
    ("a.rs", "#[cfg(test)]\nmod tests;\nfn f() {}\n", "#[cfg(test)]\nmod tests;\nfn f() {}"),
    ("a.py", '# gone\nx = "# kept"  # gone\n', 'x = "# kept"'),
    ("a.csv", "# kept\n", "# kept\n"),
]


def faults() -> list[str]:
    """What is left out of the examples that should count, or the other way round."""
    made = [(wanted, stripped(name, text.encode()).decode()) for name, text, wanted in EXAMPLES]
    return [f"tests/docs/code_hash.py: {got!r} in place of {wanted!r}" for wanted, got in made if got != wanted]


def counts(name: str) -> bool:
    """Whether a file below a measured path is more than a test or a page."""
    path = PurePosixPath(name)
    return path.suffix != ".md" and "tests" not in path.parts and path.name != "tests.rs"


def git(*words: str, given: bytes = b"") -> bytes:
    """What git says; nothing where it fails."""
    done = subprocess.run(["git", *words], cwd=ROOT, input=given, capture_output=True, check=False)
    return done.stdout if done.returncode == 0 else b""


@functools.cache
def of(path: str, commit: str = "HEAD") -> str:
    """The hash of a folder or file in a commit; empty where it has none."""
    entries = []
    for line in git("ls-tree", "-r", "-z", commit, "--", path).decode("utf-8").split("\0")[:-1]:
        (_, kind, blob), name = line.split("\t")[0].split(), line.split("\t")[1]
        if kind == "blob" and (name == path or counts(name.removeprefix(path))):
            entries.append((name, blob))
    if not entries:
        return ""
    read = [blob for name, blob in entries if PurePosixPath(name).suffix in (".rs", ".py")]
    contents = iter(contents_of(read))
    digest = hashlib.sha256()
    for name, blob in entries:
        is_code = PurePosixPath(name).suffix in (".rs", ".py")
        content = stripped(name, next(contents)) if is_code else blob.encode("ascii")
        digest.update(f"{name}\0{len(content)}\0".encode())
        digest.update(content)
    return digest.hexdigest()[:40]


def contents_of(blobs: list[str]) -> list[bytes]:
    """What git has under these names."""
    out, at, contents = git("cat-file", "--batch", given="".join(f"{blob}\n" for blob in blobs).encode()), 0, []
    for _ in blobs:
        end = out.index(b"\n", at)
        size = int(out[at:end].split()[2])
        contents.append(out[end + 1 : end + 1 + size])
        at = end + 2 + size
    return contents
