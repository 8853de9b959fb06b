"""What a finished bundle keeps when its network is trained again.

Tables of its mesh, corrections, anchors, and the limits of tools, which were measured with the corrections.
"""

from __future__ import annotations

import shutil
from pathlib import Path

from upt_training.bundle_folder import MANIFEST, file_of, read_manifest, write_manifest
from upt_training.errors import InputError
from upt_training.mesh_file import Mesh


def keep_parts(kept: Path, out: Path, mesh: Mesh) -> None:
    """Complete the new bundle `out` of kind `upt` by the files of `kept`, byte for byte, that do not hold weights."""
    before, manifest = read_manifest(kept), read_manifest(out)
    if before["kind"] != "upt":
        raise InputError(f"{kept / MANIFEST}: kind is {before['kind']!r}; --keep takes a bundle of kind 'upt'")
    for name, found, wanted in (
        ("mesh_sha256", before["mesh"]["mesh_sha256"], mesh.sha256),
        ("boundary", before["boundary"], manifest["boundary"]),
    ):
        if found != wanted:
            raise InputError(
                f"{kept / MANIFEST}: {name} is {found}, of the new bundle {wanted}; keep one of the same body"
            )
    files = {before["mesh"]["file"], *before.get("prior", {}).values()}
    if "corrections" in before:
        manifest["corrections"] = before["corrections"]
        files |= {name for key, name in before["corrections"].items() if key in ("file", "whole")}
    if "anchors" in before["upt"]:
        manifest["upt"]["anchors"] = before["upt"]["anchors"]
        files.add(before["upt"]["anchors"])
    if "tools" in before["envelope"]:
        manifest["envelope"]["tools"] = before["envelope"]["tools"]
    for name in files:
        shutil.copyfile(file_of(kept, before, name), out / name)
    write_manifest(out, manifest)
