"""Block-wise bases: per block of nodes, an orthonormal basis `U_k [3 n_k, r_k]` of responses and residual modes.

The basis of a block is the leading left singular vectors of `[responses of sampled patches | residual modes times
their amplitudes]`, so truncation is measured in mm of typical pushes. The rank is the smallest multiple of 8 whose
discarded energy stays below the tolerance (RMS over the block's nodes and the samples).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from upt_training.mesh_file import Mesh
from upt_training.reduced.blocks import partition
from upt_training.reduced.columns import Columns


@dataclass
class BlockBasis:
    """Blocks of nodes and their bases; `bases[k]` is `[3 n_k, r_k]` float32."""

    block_nodes: np.ndarray
    block_offsets: np.ndarray
    bases: list[np.ndarray]

    @property
    def rank_offsets(self) -> np.ndarray:
        return np.concatenate([[0], np.cumsum([basis.shape[1] for basis in self.bases])]).astype(np.int32)

    def dofs(self, block: int) -> np.ndarray:
        """Degrees of freedom (`3 * node + axis`) of a block's rows."""
        nodes = self.block_nodes[self.block_offsets[block] : self.block_offsets[block + 1]]
        return (3 * nodes.astype(np.int64)[:, None] + np.arange(3)).ravel()

    def project(self, fields: np.ndarray) -> np.ndarray:
        """Block coordinates `[n, Q]` of whole-mesh fields `[n, 3K]`."""
        parts = [fields[:, self.dofs(k)].astype(np.float32) @ basis for k, basis in enumerate(self.bases)]
        return np.concatenate(parts, axis=1)


def response_fields(columns: Columns, forces: np.ndarray, dofs: np.ndarray) -> np.ndarray:
    """`forces [n, 3D] @ columns[:, dofs]`, float32 `[n, len(dofs)]`."""
    return forces.astype(np.float32) @ np.ascontiguousarray(columns.columns[:, dofs])


def build_block_basis(
    mesh: Mesh,
    columns: Columns,
    forces: np.ndarray,
    modes: np.ndarray,
    amplitudes: np.ndarray,
    tolerance_mm: float = 3e-3,
    size: int = 256,
    max_rank: int = 256,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> tuple[BlockBasis, dict]:
    """Bases for the response to `forces [N, 3D]` (mN) and for `modes [r, 3K]` of RMS `amplitudes [r]` (mm).

    Returns the basis and its truncation error: `rms_mm` over all nodes and samples, and the ranks' range.
    """
    surface_nodes = np.unique(mesh.surface)
    block_nodes, block_offsets = partition(mesh.positions, surface_nodes, size)
    basis = BlockBasis(block_nodes, block_offsets, [])
    discarded = 0.0
    blocks = len(block_offsets) - 1
    for block in range(blocks):
        dofs = basis.dofs(block)
        samples = response_fields(columns, forces, dofs) / np.sqrt(len(forces))
        learned = modes[:, dofs] * amplitudes[:, None]
        matrix = np.concatenate([samples, learned]).astype(np.float64)
        energy, vectors = np.linalg.eigh(matrix.T @ matrix)
        energy, vectors = np.maximum(energy[::-1], 0.0), vectors[:, ::-1]
        tail = np.concatenate([np.cumsum(energy[::-1])[::-1], [0.0]])
        nodes = len(dofs) // 3
        rank = int(np.searchsorted(-tail, -(tolerance_mm**2) * nodes))
        rank = min(max(8, -(-rank // 8) * 8), max_rank, -(-len(dofs) // 8) * 8)
        kept = min(rank, len(dofs))
        held = np.abs(matrix).max(axis=0) == 0.0
        padded = np.zeros((len(dofs), rank), np.float32)
        padded[:, :kept] = vectors[:, :kept]
        padded[:, :kept] *= energy[:kept] > 0.0
        padded[held] = 0.0
        basis.bases.append(padded)
        discarded += float(tail[kept])
        progress(block + 1, blocks)
    ranks = [b.shape[1] for b in basis.bases]
    error = float(np.sqrt(discarded / len(mesh.positions)))
    return basis, {"rms_mm": error, "min_rank": min(ranks), "max_rank": max(ranks), "coordinates": sum(ranks)}
