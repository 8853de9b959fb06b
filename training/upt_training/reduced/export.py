"""Writes a bundle of kind `reduced` (docs/reference/formats.md) and checks what it wrote.

The self-check runs `latent.onnx` in ONNX Runtime against the PyTorch model, and a short scene through the bundle
against the compliance columns: contact nodes at `c`, and `L(c)` within the block basis' tolerance.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import onnx
import onnxruntime
import torch

from upt_training.bundle_folder import new_bundle, write_manifest
from upt_training.errors import InputError
from upt_training.mesh_file import Mesh
from upt_training.reduced.block_basis import BlockBasis
from upt_training.reduced.columns import Columns, linear_fields
from upt_training.reduced.latent_graph import latent_graph
from upt_training.reduced.make_prior import block_basis_of
from upt_training.reduced.modes import Modes
from upt_training.reduced.near import near_tensors
from upt_training.reduced.network import INPUTS, Correction
from upt_training.reduced.prior import Prior, response_in_blocks, save_prior
from upt_training.reduced.rollout import Limits
from upt_training.reduced.runner import ReducedRunner

TOLERANCE = 1e-5


@dataclass
class Description:
    """What the manifest says about a bundle beside its tables."""

    name: str
    text: str
    envelope: dict
    provenance: dict = field(default_factory=dict)
    errors: dict = field(default_factory=dict)
    license: str = "Apache-2.0 OR MIT"
    material: dict = field(
        default_factory=lambda: {"young_pa": 3000.0, "poisson": 0.49, "density_kg_m3": 1000.0, "damping_per_s": 20.0}
    )


def residual_prior(mesh: Mesh, columns: Columns, modes: Modes, basis: BlockBasis) -> Prior:
    """All tables of the bundle: response, residual modes, and the maps from forces to `z` and `p`."""
    rows = len(columns.columns)
    force_to_z = np.zeros((rows, len(modes.response)), np.float32)
    force_to_p = np.zeros((rows, len(modes.residual)), np.float32)
    for at in range(0, rows, 96):
        part = np.asarray(columns.columns[at : at + 96])
        force_to_z[at : at + 96] = part @ modes.response.T
        force_to_p[at : at + 96] = part @ modes.residual.T
    keys = ("mesh_name", "mesh_sha256", "boundary", "young_pa", "poisson")
    metadata = {key: columns.metadata[key] for key in keys}
    response = response_in_blocks(columns.columns, basis)
    residual = basis.project(modes.residual)
    return Prior(columns.contact_nodes, columns.compliance, basis, response, residual, force_to_z, force_to_p, metadata)


def tables_of(mesh: Mesh, columns: Columns, modes: Modes, tolerance_mm: float, progress) -> tuple[Prior, dict]:
    """Block basis (responses and residual modes together) and the tables in it, with the basis' error."""
    amplitudes = modes.residual_amplitudes
    basis, info = block_basis_of(mesh, columns, modes.residual, amplitudes, tolerance_mm, progress)
    prior = residual_prior(mesh, columns, modes, basis)
    lost = 1.0 - (prior.residual.astype(np.float64) ** 2).sum(1)
    energy = np.maximum(lost, 0.0) @ amplitudes.astype(np.float64) ** 2
    info["residual_rms_mm"] = float(np.sqrt(energy / mesh.node_count))
    return prior, info


def write_reduced_bundle(
    out: Path,
    mesh: Mesh,
    columns: Columns,
    prior: Prior,
    model: Correction,
    limits: Limits,
    description: Description,
    table_dtype: type = np.float16,
    near_mm: float | None = None,
) -> dict:
    """Write the folder `out` (made beside it, then moved into place) and return its manifest.

    With `near_mm` the compliance of contact nodes farther apart is left to the response (`near.py`).
    """
    out = Path(out)
    with new_bundle(out) as folder:
        onnx.save(latent_graph(model.eval()), str(folder / "latent.onnx"))
        near = near_of(mesh, prior, near_mm)
        save_prior(folder / "prior.safetensors", prior, table_dtype, near)
        mesh.save(folder / "mesh.safetensors")
        manifest = {
            "format": "upt-bundle",
            "version": 1,
            "kind": "reduced",
            "name": description.name,
            "description": description.text,
            "license": description.license,
            "dt_s": 0.05,
            "length_unit": "mm",
            "force_unit": "mN",
            "boundary": prior.metadata["boundary"],
            "material": description.material,
            "mesh": {"file": "mesh.safetensors", "nodes": mesh.node_count, "mesh_sha256": mesh.sha256},
            "envelope": description.envelope,
            "precisions": ["f32"],
            "prior": {"file": "prior.safetensors"},
            "reduced": {
                "modes": model.modes,
                "response_modes": model.response_modes,
                "inputs": list(INPUTS),
                "bound": {"relative": limits.relative, "decay": limits.decay},
                "fade": {"start_push_mm": limits.start_push_mm, "end_push_mm": limits.end_push_mm},
            },
            "provenance": description.provenance,
            "errors": description.errors,
        }
        write_manifest(folder, manifest)
        manifest["provenance"]["self_check"] = self_check(folder, mesh, columns, model)
        write_manifest(folder, manifest)
    return manifest


def near_of(mesh: Mesh, prior: Prior, near_mm: float | None) -> dict[str, np.ndarray] | None:
    """The compressed compliance of a prior on its mesh; None where it stays whole."""
    if near_mm is None:
        return None
    return near_tensors(prior.compliance, mesh.positions[prior.contact_nodes].astype(np.float64), near_mm)


def self_check(folder: Path, mesh: Mesh, columns: Columns, model: Correction) -> dict[str, float]:
    """Relative difference of the graph from PyTorch, and of the bundle's `L(c)` from the columns (mm, 10 mm push)."""
    rng = np.random.default_rng(7)
    states = rng.standard_normal((16, model.inputs)).astype(np.float32)
    scale = model.input_scale.numpy()
    states /= np.where(scale > 0.0, scale, scale.max())
    states[:, -2:] = rng.integers(0, 2, (16, 2))
    with torch.no_grad():
        expected = model(torch.from_numpy(states)).numpy()
    session = onnxruntime.InferenceSession(str(folder / "latent.onnx"), providers=["CPUExecutionProvider"])
    found = np.concatenate([session.run(None, {"state": state[None]})[0] for state in states])
    difference = float(np.abs(found - expected).max() / (np.abs(expected).max() + 1e-12))
    if not difference < TOLERANCE:
        raise InputError(f"{folder}/latent.onnx: differs from PyTorch by {difference:.2e}, limit {TOLERANCE}")

    runner = ReducedRunner(folder)
    runner.correct = False
    points = mesh.positions[columns.contact_nodes]
    order = np.argsort(np.linalg.norm(points - points[len(points) // 2], axis=1), kind="stable")[:8]
    nodes = np.sort(columns.contact_nodes[order])
    vectors = np.tile(np.array([[6.0, -4.0, 6.9]], np.float32), (len(nodes), 1))
    field_ = runner.step(nodes, vectors)
    forces = runner.prior.forces(nodes, vectors)
    exact = linear_fields(columns, forces[None])[0].reshape(-1, 3)
    exact[nodes] = vectors
    error = float(np.sqrt(((field_ - exact) ** 2).sum(1).mean()))
    if not error < 0.05:
        raise InputError(f"{folder}/prior.safetensors: L(c) is off by {error:.3f} mm RMS; lower the tolerance")
    return {"onnxruntime_vs_pytorch": difference, "response_rms_mm": error}
