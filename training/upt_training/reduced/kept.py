"""Retrains the correction of a finished bundle: its modes and tables stay, byte for byte, only `latent.onnx` is new.

The tables of a fine mesh are the largest part of a bundle, and its corrections and natural modes belong to them.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import onnx

from upt_training.bundle_folder import copy_whole, file_of, new_bundle, read_manifest, write_manifest
from upt_training.errors import InputError
from upt_training.mesh_file import Mesh
from upt_training.reduced.columns import Columns
from upt_training.reduced.export import Description, self_check
from upt_training.reduced.latent_graph import latent_graph
from upt_training.reduced.modes import Modes
from upt_training.reduced.network import Correction
from upt_training.reduced.prior import Prior, load_prior
from upt_training.reduced.rollout import Limits

CUT = 1e-6  # of the largest eigenvalue: what lies below is rounding of the tables


def kept_tables(bundle: Path, mesh: Mesh, columns: Columns) -> tuple[Modes, Prior, dict]:
    """Modes and tables of a reduced bundle of this mesh, and what its manifest says of its block basis."""
    manifest = read_manifest(bundle)
    if manifest.get("kind") != "reduced" or "reduced" not in manifest:
        raise InputError(
            f"{bundle}/bundle.json: no learned correction to train again; take a bundle that `build` wrote"
        )
    if manifest["mesh"]["mesh_sha256"] != mesh.sha256:
        raise InputError(f"{bundle}/bundle.json: mesh_sha256 differs from --mesh; pass the mesh of this bundle")
    if manifest["boundary"] != columns.metadata["boundary"]:
        raise InputError(f"{bundle}/bundle.json: boundary is {manifest['boundary']!r}, --columns has another")
    entry = manifest["prior"]
    learned = entry.get("residual") and file_of(bundle, manifest, entry["residual"])
    prior = load_prior(file_of(bundle, manifest, entry["file"]), learned)
    residual = prior.field(prior.residual).reshape(len(prior.residual), -1)
    response = response_modes(columns, prior.force_to_z)
    unknown = np.zeros(0, np.float32)
    return Modes(residual, unknown, response, unknown), prior, manifest["provenance"].get("block_basis", {})


def response_modes(columns: Columns, force_to_z: np.ndarray) -> np.ndarray:
    """`Psi [r_z, 3K]` in the span of the columns `C` that has `C Psi^T = force_to_z` (least squares, float64)."""
    rows = len(columns.columns)
    gram = np.zeros((rows, rows))
    for at in range(0, columns.columns.shape[1], 4096):
        part = np.asarray(columns.columns[:, at : at + 4096], np.float64)
        gram += part @ part.T
    values, vectors = np.linalg.eigh(gram)
    kept = values > CUT * values[-1]
    weights = (vectors[:, kept] / values[kept]) @ (vectors[:, kept].T @ force_to_z.astype(np.float64))
    out = np.zeros((force_to_z.shape[1], columns.columns.shape[1]), np.float32)
    for at in range(0, rows, 96):
        out += (weights[at : at + 96].T @ np.asarray(columns.columns[at : at + 96], np.float64)).astype(np.float32)
    return out


def write_retrained(
    kept: Path, out: Path, mesh: Mesh, columns: Columns, model: Correction, limits: Limits, about: Description
) -> dict:
    """The folder `out`: a copy of `kept` with another `latent.onnx`, and what belongs to it in the manifest."""
    manifest = read_manifest(kept)
    envelope = about.envelope | {name: v for name, v in manifest["envelope"].items() if name == "tools"}
    with new_bundle(out) as folder:
        copy_whole(kept, manifest, folder)
        onnx.save(latent_graph(model.eval()), str(folder / "latent.onnx"))
        manifest |= {
            "name": about.name,
            "description": about.text,
            "envelope": envelope,
            "provenance": about.provenance,
            "errors": about.errors,
        }
        manifest["reduced"] |= {
            "bound": {"relative": limits.relative, "decay": limits.decay},
            "fade": {"start_push_mm": limits.start_push_mm, "end_push_mm": limits.end_push_mm},
        }
        write_manifest(folder, manifest)
        manifest["provenance"]["self_check"] = self_check(folder, mesh, columns, model)
        write_manifest(folder, manifest)
    return manifest
