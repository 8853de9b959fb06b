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
DIGEST = "manifest_sha256"


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


def file_of(bundle: Path, manifest: dict, name: str) -> Path:
    """Where a file of a bundle lies: in its folder, else in that of its body beside it (the field `body`)."""
    own, body = bundle / name, manifest.get("body")
    return own if own.exists() or not body else bundle.absolute().with_name(body) / name


def copy_whole(bundle: Path, manifest: dict, out: Path) -> None:
    """Copy the files of a bundle, those of its body too, to the folder `out`; `manifest` shares nothing then."""
    names = {path.name for path in bundle.iterdir()} | set(manifest["files"])
    for name in sorted(names):
        shutil.copyfile(file_of(bundle, manifest, name), out / name)
    manifest.pop("body", None)


def write_manifest(folder: Path, manifest: dict) -> None:
    """Write `bundle.json`: every other file's `{"bytes", "sha256"}` under `files`, what a reader must know under
    `requires`, and the manifest's own digest. Files of the body (`body`) stay listed."""
    files = sorted(path for path in folder.iterdir() if not path.name.startswith(MANIFEST))
    shared = manifest.get("files", {}) if manifest.get("body") else {}
    manifest["files"] = dict(sorted((shared | {path.name: file_entry(path) for path in files}).items()))
    _write(folder, manifest, indent=2)


def seal(folder: Path, entries: dict | None = None) -> None:
    """Renew what a manifest says of itself after a change by hand, and set `entries` (None removes one)."""
    manifest = {k: v for k, v in (read_manifest(folder) | (entries or {})).items() if v is not None}
    second = (folder / MANIFEST).read_text(encoding="utf-8").split("\n")[1]
    _write(folder, manifest, indent=len(second) - len(second.lstrip(" ")))


def _write(folder: Path, manifest: dict, indent: int) -> None:
    """`requires`, the digest (docs/reference/formats.md, "The manifest's digest"), and the file, moved into place."""
    needed = requirements(manifest)
    manifest.pop("requires", None)
    if needed:
        manifest["requires"] = needed
    blank = "0" * 64
    manifest.pop(DIGEST, None)
    manifest[DIGEST] = blank
    text = json.dumps(manifest, indent=indent) + "\n"
    manifest[DIGEST] = hashlib.sha256(text.encode("utf-8")).hexdigest()
    partial = folder / (MANIFEST + ".partial")
    partial.write_text(text.replace(blank, manifest[DIGEST]), encoding="utf-8")
    partial.replace(folder / MANIFEST)


def requirements(manifest: dict) -> list[str]:
    """Parts of a bundle that change what a step gives: a library that does not know one must refuse the bundle."""
    parts = {
        "anchors": "anchors" in manifest.get("upt", {}),
        "corrections": "corrections" in manifest,
        "gravity_at_rest": "gravity_at_rest_m_s2" in manifest,
        "law": "law" in manifest.get("material", {}),
        "laws": bool(manifest.get("laws")),
        "relaxation": "relaxation" in manifest.get("material", {}),
        "release": "release" in manifest.get("prior", {}),
        "unlearned": manifest.get("kind") == "reduced" and "reduced" not in manifest,
        "vibration": "vibration" in manifest.get("prior", {}),
    }
    return [name for name, used in parts.items() if used]


def file_entry(path: Path) -> dict:
    """Size and SHA-256 of a file."""
    data = path.read_bytes()
    return {"bytes": len(data), "sha256": hashlib.sha256(data).hexdigest()}
