"""Builds a prior file without residual modes: what `upt` bundles and training need of the linear response."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from upt_training.errors import InputError
from upt_training.mesh_file import Mesh
from upt_training.reduced.block_basis import BlockBasis, build_block_basis, response_fields
from upt_training.reduced.columns import Columns
from upt_training.reduced.patches import sample_forces
from upt_training.reduced.prior import Prior, response_in_blocks


def check_columns(mesh: Mesh, columns: Columns) -> None:
    """Refuse compliance columns of another mesh."""
    if columns.metadata.get("mesh_sha256") != mesh.sha256:
        raise InputError(f"{columns.path}: columns of another mesh (mesh_sha256 differs); run `upt prior` on this mesh")


def block_basis_of(
    mesh: Mesh,
    columns: Columns,
    modes: np.ndarray,
    amplitudes: np.ndarray,
    tolerance_mm: float,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> tuple[BlockBasis, dict]:
    """Block basis for sampled patches and for `modes [r, 3K]` with their `amplitudes [r]` (mm)."""
    forces = sample_forces(mesh, columns, int(np.clip(3 * len(columns.contact_nodes), 1024, 4096)))
    return build_block_basis(mesh, columns, forces, modes, amplitudes, tolerance_mm, progress=progress)


def make_prior(
    mesh: Mesh,
    columns: Columns,
    tolerance_mm: float = 3e-3,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> tuple[Prior, dict]:
    """A prior of the linear response alone, and the size and error of its block basis."""
    check_columns(mesh, columns)
    none = np.zeros((0, 3 * mesh.node_count), np.float32)
    basis, info = block_basis_of(mesh, columns, none, np.zeros(0), tolerance_mm, progress)
    response = response_in_blocks(columns.columns, basis)
    empty = np.zeros((len(response), 0), np.float32)
    metadata = {key: columns.metadata[key] for key in ("mesh_name", "mesh_sha256", "boundary", "young_pa", "poisson")}
    residual = np.zeros((0, response.shape[1]), np.float32)
    return Prior(columns.contact_nodes, columns.compliance, basis, response, residual, empty, empty, metadata), info


def prior_error(mesh: Mesh, columns: Columns, prior: Prior, samples: int = 64, seed: int = 5) -> dict:
    """Error of a prior's block basis against the exact columns on fresh patches (10 mm pushes): RMS and largest, mm."""
    forces = sample_forces(mesh, columns, samples, seed=seed)
    exact = response_fields(mesh, columns, forces, np.arange(3 * mesh.node_count)).reshape(samples, -1, 3)
    found = prior.field(prior.coordinates(forces))
    error = np.linalg.norm(found - exact, axis=2)
    return {
        "rms_mm": float(np.sqrt((error**2).mean())),
        "max_mm": float(error.max()),
        "response_rms_mm": float(np.sqrt((exact**2).sum(2).mean())),
    }


def save_path(folder: Path, name: str, boundary: str) -> Path:
    return folder / f"{name}-{boundary}.prior.safetensors"
