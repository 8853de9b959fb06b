"""`python -m upt_training transfer BUNDLE --mesh MESH --out OUT`: the same weights as a bundle of another mesh.

The graphs and weights of a `upt` bundle know positions, not nodes, so they are copied; mesh, linear response and
vibration are the new mesh's own. Errors measured on the old mesh and its anchors are left out.
"""

from __future__ import annotations

import argparse
import shutil
from pathlib import Path

from upt_training.bundle_folder import MANIFEST, new_bundle, read_manifest, write_manifest
from upt_training.dataset import map_safetensors
from upt_training.errors import InputError
from upt_training.mesh_file import load_mesh
from upt_training.prior_table import PriorTable
from upt_training.rest import write_rest


def transfer(
    bundle: Path, mesh_file: Path, out: Path, prior: Path | None, vibration: Path | None, name: str | None = None
) -> dict:
    """Write the folder `out` (made beside it, then moved into place) and return its manifest."""
    manifest = read_manifest(bundle)
    if manifest["kind"] != "upt":
        raise InputError(f"{bundle / MANIFEST}: kind is {manifest['kind']!r}; only `upt` weights fit other meshes")
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
    manifest.pop("rest_displacement_mm", None)
    manifest["upt"].pop("anchors", None)
    manifest.pop("body", None)
    with new_bundle(out) as folder:
        for file in [*bundle.glob("*.onnx"), bundle / manifest["upt"]["weights"]]:
            shutil.copyfile(file, folder / file.name)
        mesh.save(folder / "mesh.safetensors")
        if "prior" in needed:
            manifest["prior"] = {entry if entry != "prior" else "file": f"{entry}.safetensors" for entry in needed}
        for entry in needed:
            shutil.copyfile(tables[entry], folder / f"{entry}.safetensors")
        write_manifest(folder, manifest)
    return manifest


def transfer_command(options: argparse.Namespace) -> int:
    manifest = transfer(options.bundle, options.mesh, options.out, options.prior, options.vibration, options.name)
    write_rest(options.out)
    print(f"{options.out}: {manifest['name']}, {manifest['mesh']['nodes']} nodes")
    return 0
