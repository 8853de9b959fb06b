"""`python -m upt_training transfer BUNDLE --mesh MESH --out OUT`: the same weights as a bundle of another mesh.

The graphs and weights of a `upt` bundle know positions, not nodes, so they are copied; mesh, linear response and
vibration are the new mesh's own. Errors measured on the old mesh and its anchors are left out.
"""

from __future__ import annotations

import argparse
import json
import shutil
from pathlib import Path

from upt_training.bundle import file_table
from upt_training.dataset import map_safetensors
from upt_training.errors import InputError
from upt_training.mesh_file import load_mesh
from upt_training.prior_table import PriorTable


def transfer(
    bundle: Path, mesh_file: Path, out: Path, prior: Path | None, vibration: Path | None, name: str | None = None
) -> dict:
    """Write the folder `out` (made beside it, then moved into place) and return its manifest."""
    manifest_file = bundle / "bundle.json"
    if not manifest_file.is_file():
        raise InputError(f"{manifest_file}: is missing; a bundle is a folder with a bundle.json")
    manifest = json.loads(manifest_file.read_text())
    if manifest["kind"] != "upt":
        raise InputError(f"{manifest_file}: kind is {manifest['kind']!r}; only `upt` weights fit other meshes")
    tables = {"prior": prior, "vibration": vibration}
    entries = manifest.get("prior", {})
    needed = [entry for entry, key in (("prior", "file"), ("vibration", "vibration")) if key in entries]
    for entry in needed:
        if tables[entry] is None:
            raise InputError(f"{bundle}: its model needs the {entry} of the new mesh: pass --{entry}")
    mesh = load_mesh(mesh_file)
    if needed:  # refuses tables of another mesh
        PriorTable(prior, mesh.node_count, vibration if "vibration" in needed else None)
        if map_safetensors(prior)[1].get("mesh_sha256") != mesh.sha256:
            raise InputError(f"{prior}: made for another mesh (mesh_sha256 differs from {mesh_file}); make it again")
    manifest["provenance"]["transferred_from"] = {
        "name": manifest["name"],
        "mesh_sha256": manifest["mesh"]["mesh_sha256"],
    }
    manifest["name"] = name or out.name
    manifest["mesh"] = {"file": "mesh.safetensors", "nodes": mesh.node_count, "mesh_sha256": mesh.sha256}
    manifest["errors"] = {}
    manifest["upt"].pop("anchors", None)
    staging = out.with_name(out.name + ".new")
    shutil.rmtree(staging, ignore_errors=True)
    staging.mkdir(parents=True)
    try:
        for file in [*bundle.glob("*.onnx"), bundle / manifest["upt"]["weights"]]:
            shutil.copyfile(file, staging / file.name)
        mesh.save(staging / "mesh.safetensors")
        if "prior" in needed:
            manifest["prior"] = {entry if entry != "prior" else "file": f"{entry}.safetensors" for entry in needed}
        for entry in needed:
            shutil.copyfile(tables[entry], staging / f"{entry}.safetensors")
        manifest["files"] = file_table(staging)
        (staging / "bundle.json").write_text(json.dumps(manifest, indent=1) + "\n")
        for file in staging.iterdir():
            file.chmod(0o644)
        if out.exists():
            shutil.rmtree(out)
        staging.rename(out)
    finally:
        shutil.rmtree(staging, ignore_errors=True)
    return manifest


def transfer_command(options: argparse.Namespace) -> int:
    manifest = transfer(options.bundle, options.mesh, options.out, options.prior, options.vibration, options.name)
    print(f"{options.out}: {manifest['name']}, {manifest['mesh']['nodes']} nodes")
    return 0
