"""A bundle as a folder: its manifest, the list of its files, and a new one that takes its place when it is whole."""

from __future__ import annotations

import hashlib
import json
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from upt_training.errors import InputError

MANIFEST = "bundle.json"


@contextmanager
def new_bundle(out: Path) -> Iterator[Path]:
    """A folder beside `out` to write a bundle into; it replaces `out` at the end of the block.

    After an error or an interruption `out` is what it was before.
    """
    folder = out.with_name(out.name + ".new")
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    try:
        yield folder
        for file in folder.iterdir():
            file.chmod(0o644)
        if out.exists():
            shutil.rmtree(out)
        folder.rename(out)
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def read_manifest(bundle: Path) -> dict:
    """`bundle.json` of a bundle's folder."""
    file = bundle / MANIFEST
    if not file.is_file():
        raise InputError(f"{file}: is missing; a bundle is a folder with a bundle.json")
    return json.loads(file.read_text(encoding="utf-8"))


def write_manifest(folder: Path, manifest: dict) -> None:
    """Write `bundle.json`, with every other file's `{"bytes", "sha256"}` under `files`."""
    files = sorted(path for path in folder.iterdir() if not path.name.startswith(MANIFEST))
    manifest["files"] = {path.name: file_entry(path) for path in files}
    partial = folder / (MANIFEST + ".partial")
    partial.write_text(json.dumps(manifest, indent=2) + "\n", encoding="utf-8")
    partial.replace(folder / MANIFEST)


def file_entry(path: Path) -> dict:
    """Size and SHA-256 of a file."""
    data = path.read_bytes()
    return {"bytes": len(data), "sha256": hashlib.sha256(data).hexdigest()}
