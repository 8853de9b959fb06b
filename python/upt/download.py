"""Bundles from a mirror: each file is checked against a hash that this package knows, or that the caller states."""

from __future__ import annotations

import hashlib
import json
import os
import re
import shutil
import tempfile
from pathlib import Path
from typing import Any
from urllib.request import urlopen

from upt.bundles import ORGANS, downloads

#: A manifest is a page of text.
_LARGEST_MANIFEST = 1 << 20


def download(name: str, mirror: str | os.PathLike[str] | None = None, sha256: str | None = None) -> Path:
    """Fetches a bundle once and gives its folder: `upt.Model(upt.download("brain-coarse-reduced"))`.

    Args:
        name: that of the bundle.
        mirror: a folder or an address (`https://...`) that holds `NAME/bundle.json` and the files beside it. Default:
            the environment variable `UPT_MIRROR`; libupt has no server of its own.
        sha256: of `bundle.json`, which holds those of all other files. Default: what this version shipped with.

    The bundle appears in the cache when all of its files are there and right, and not before; a later call fetches
    nothing.

    Raises:
        ValueError: no mirror; a name that is no bundle of this version, and no `sha256`; a file that is not what its
            hash says.
        OSError: the mirror does not answer, or lacks a file.
    """
    if not re.fullmatch(r"[\w-]+", name):
        raise ValueError(f"name: {name!r} is no name of a bundle")
    wanted = (sha256 or _known().get(name, "")).lower()
    if not re.fullmatch(r"[0-9a-f]{64}", wanted):
        known = ", ".join(sorted(_known()))
        raise ValueError(
            f"sha256: this version knows none of {name!r} (it knows {known}): state that of its bundle.json"
        )
    folder = downloads() / name
    if _is(folder / "bundle.json", wanted):
        return folder
    place = os.fspath(mirror) if mirror is not None else os.environ.get("UPT_MIRROR", "")
    if not place:
        raise ValueError("mirror: give a folder or an address, or set UPT_MIRROR; libupt has no server of its own")
    folder.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=folder.parent, prefix=".") as scratch:
        made = Path(scratch) / name
        made.mkdir()
        _bundle(place.rstrip("/"), name, wanted, made)
        if folder.exists():
            shutil.rmtree(folder)
        made.rename(folder)
    return folder


def _known() -> dict[str, str]:
    """SHA-256 of `bundle.json` by name of the bundle, from the day this package was built."""
    index = ORGANS / "index.json"
    known: dict[str, str] = json.loads(index.read_text(encoding="utf-8")) if index.is_file() else {}
    return known


def _bundle(mirror: str, name: str, wanted: str, folder: Path) -> None:
    """The manifest, then the files that it lists: beside it, or with the body that it names."""
    _fetch(f"{mirror}/{name}/bundle.json", folder / "bundle.json", _LARGEST_MANIFEST, wanted)
    manifest = json.loads((folder / "bundle.json").read_text(encoding="utf-8"))
    files: dict[str, dict[str, Any]] = manifest["files"]
    body = manifest.get("body")
    for file, stated in files.items():
        if not all(re.fullmatch(r"[\w.-]+", one) and not one.startswith(".") for one in (file, body or name)):
            raise ValueError(f"{name}/bundle.json: files: {file!r} of {body or name!r} is no plain name")
        to, size = folder / file, int(stated["bytes"])
        try:
            _fetch(f"{mirror}/{name}/{file}", to, size, stated["sha256"])
        except OSError:
            if body is None:
                raise
            _fetch(f"{mirror}/{body}/{file}", to, size, stated["sha256"])


def _fetch(source: str, to: Path, most: int, wanted: str) -> None:
    """One file of at most `most` bytes; it stays only if its hash is the one that is wanted."""
    remote = re.match(r"(https?|file)://", source)
    with urlopen(source) if remote else Path(source).open("rb") as stream, to.open("wb") as file:
        left = most + 1
        while left > 0 and (part := stream.read(min(left, 1 << 20))):
            file.write(part)
            left -= len(part)
    if left <= 0:
        to.unlink()
        raise ValueError(f"{source}: is larger than the {most} bytes that it should have")
    if not _is(to, wanted):
        to.unlink()
        raise ValueError(f"{source}: sha256 is not {wanted}: the file is damaged, or of another version")


def _is(file: Path, wanted: str) -> bool:
    """Whether the file is there and has this SHA-256."""
    if not file.is_file():
        return False
    with file.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest() == wanted
