"""Fields of one tetrahedral mesh at the nodes of another of the same body (barycentric interpolation).

Trajectories of a coarse mesh cost a tenth of those of the fine one and hold the same physics in the leading modes:
interpolated, they add contact sites to the training of a fine model.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.sparse
from scipy.spatial import cKDTree

from upt_training.mesh_file import Mesh
from upt_training.reduced.columns import Columns, linear_fields
from upt_training.reduced.trajectories import Case

INWARD = 0.2


def interpolation(coarse: Mesh, fine: Mesh, candidates: int = 32) -> scipy.sparse.csr_matrix:
    """`[K_fine, K_coarse]` weights, rows summing to 1.

    Each fine node is searched a little towards the middle of its own elements, so that coincident nodes on either
    side of the midline find their own hemisphere. Outside of its element a node is extrapolated (weights above -1).
    """
    centres = fine.positions[fine.tets].mean(axis=1, dtype=np.float64)
    count = np.bincount(fine.tets.ravel(), minlength=fine.node_count)
    middle = (
        np.stack(
            [np.bincount(fine.tets.ravel(), np.repeat(centres[:, a], 4), fine.node_count) for a in range(3)], axis=1
        )
        / np.maximum(count, 1)[:, None]
    )
    own = fine.positions.astype(np.float64)
    inner = own + INWARD * (middle - own)
    corner = coarse.positions[coarse.tets].astype(np.float64)
    inverse = np.linalg.inv((corner[:, 1:] - corner[:, :1]).transpose(0, 2, 1))
    _, near = cKDTree(corner.mean(axis=1)).query(inner, k=min(candidates, len(corner)))

    def barycentric(points: np.ndarray, tets: np.ndarray) -> np.ndarray:
        part = np.einsum("...ij,...j->...i", inverse[tets], points - corner[tets, 0])
        return np.concatenate([1.0 - part.sum(-1, keepdims=True), part], axis=-1)

    inside = barycentric(inner[:, None], near).min(axis=-1)
    best = near[np.arange(len(near)), inside.argmax(axis=1)]
    weights = np.maximum(barycentric(own, best), -1.0)
    weights /= weights.sum(axis=1, keepdims=True)
    rows = np.repeat(np.arange(fine.node_count), 4)
    shape = (fine.node_count, coarse.node_count)
    return scipy.sparse.csr_matrix((weights.ravel().astype(np.float32), (rows, coarse.tets[best].ravel())), shape)


@dataclass
class Source:
    """Trajectories of one mesh with its compliance columns, and the interpolation to the model's mesh if it differs."""

    columns: Columns
    cases: list[Case]
    transfer: scipy.sparse.csr_matrix | None = None

    @property
    def width(self) -> int:
        """Degrees of freedom of the model's mesh, `3K`."""
        return self.columns.columns.shape[1] if self.transfer is None else 3 * self.transfer.shape[0]

    def own_fields(self, case: Case, frames: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray]:
        """Linear response and displacement on the trajectory's own mesh, each `[n, 3K_own]` float32, mm."""
        picked = np.arange(case.frames) if frames is None else frames
        linear = linear_fields(self.columns, case.forces(self.columns)[picked])
        return linear, np.asarray(case.displacement[picked], np.float32).reshape(len(picked), -1)

    def fields(self, case: Case, frames: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray]:
        """Linear response and displacement on the model's mesh, each `[n, 3K]` float32, mm."""
        linear, field = self.own_fields(case, frames)
        if self.transfer is None:
            return linear, field
        return node_product(self.transfer, linear), node_product(self.transfer, field)

    def adjoint(self, modes: np.ndarray) -> np.ndarray:
        """Modes `[r, 3K]` as `[r, 3K_own]`, whose products with own fields are those of the modes with moved fields."""
        return modes if self.transfer is None else node_product(self.transfer.T.tocsr(), modes)

    def squares(self, fields: np.ndarray) -> np.ndarray:
        """Squared norm on the model's mesh of each of own `fields [n, 3K_own]`, float64."""
        other = fields if self.transfer is None else node_product(self._gram, fields)
        return np.array([np.dot(a, b) for a, b in zip(fields, other, strict=True)], np.float64)

    @cached_property
    def _gram(self) -> scipy.sparse.csr_matrix:
        assert self.transfer is not None
        return (self.transfer.T @ self.transfer).tocsr()


def node_product(matrix: scipy.sparse.csr_matrix, fields: np.ndarray) -> np.ndarray:
    """`matrix [K', K]` applied to every axis of `fields [n, 3K]`: `[n, 3K']`."""
    count = len(fields)
    by_node = fields.reshape(count, -1, 3).transpose(1, 0, 2).reshape(matrix.shape[1], -1)
    out = (matrix @ by_node).reshape(-1, count, 3).transpose(1, 0, 2)
    return np.ascontiguousarray(out).reshape(count, -1)
