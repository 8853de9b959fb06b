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


def groups(basis: BlockBasis, samples: int, memory_gib: float) -> list[range]:
    """Consecutive blocks whose sampled fields `[samples, dofs]` (float32) fit into the memory together."""
    sizes = 12 * samples * np.diff(basis.block_offsets).astype(np.int64)
    part = np.cumsum(sizes) // max(int(memory_gib * 2**30), int(sizes.max()))
    ends = [*np.flatnonzero(np.diff(part)) + 1, len(sizes)]
    return [range(first, end) for first, end in zip([0, *ends[:-1]], ends, strict=True)]


def response_fields(mesh: Mesh, columns: Columns, forces: np.ndarray, dofs: np.ndarray) -> np.ndarray:
    """`forces [n, 3D] @ columns[:, dofs]`, float32 `[n, len(dofs)]`.

    One pass through the file: a patch touches neighbouring contact nodes, so each few columns meet a few samples only.
    """
    out = np.zeros((len(forces), len(dofs)), np.float32)
    order, offsets = partition(mesh.positions[columns.contact_nodes], np.zeros(0, np.int64), 32)
    for first, end in zip(offsets[:-1], offsets[1:], strict=True):
        rows = (3 * np.sort(order[first:end]).astype(np.int64)[:, None] + np.arange(3)).ravel()
        part = forces[:, rows].astype(np.float32)
        touching = np.flatnonzero(part.any(axis=1))
        if len(touching):
            near = np.stack([np.take(columns.columns[row], dofs) for row in rows])
            out[touching] += part[touching] @ near
    return out


def build_block_basis(
    mesh: Mesh,
    columns: Columns,
    forces: np.ndarray,
    modes: np.ndarray,
    amplitudes: np.ndarray,
    tolerance_mm: float = 3e-3,
    size: int = 256,
    max_rank: int = 256,
    memory_gib: float = 1.0,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> tuple[BlockBasis, dict]:
    """Bases for the response to `forces [N, 3D]` (mN) and for `modes [r, 3K]` of RMS `amplitudes [r]` (mm).

    The columns are read once for as many blocks as have room in `memory_gib` together.
    Returns the basis and its truncation error: `rms_mm` over all nodes and samples, and the ranks' range.
    """
    surface_nodes = np.unique(mesh.surface)
    block_nodes, block_offsets = partition(mesh.positions, surface_nodes, size)
    basis = BlockBasis(block_nodes, block_offsets, [])
    discarded = 0.0
    blocks = len(block_offsets) - 1
    for group in groups(basis, len(forces), memory_gib):
        group_dofs = np.concatenate([basis.dofs(block) for block in group])
        fields = response_fields(mesh, columns, forces, group_dofs) / np.float32(np.sqrt(len(forces)))
        start = 0
        for block in group:
            dofs = basis.dofs(block)
            samples = fields[:, start : start + len(dofs)]
            start += len(dofs)
            learned = modes[:, dofs] * amplitudes[:, None]
            found, lost = leading_vectors(np.concatenate([samples, learned]), tolerance_mm, max_rank)
            basis.bases.append(found)
            discarded += lost
            progress(block + 1, blocks)
    ranks = [b.shape[1] for b in basis.bases]
    error = float(np.sqrt(discarded / len(mesh.positions)))
    return basis, {"rms_mm": error, "min_rank": min(ranks), "max_rank": max(ranks), "coordinates": sum(ranks)}


def leading_vectors(samples: np.ndarray, tolerance_mm: float, max_rank: int) -> tuple[np.ndarray, float]:
    """The fewest leading right singular vectors (`[dofs, r]`, r a multiple of 8) of `samples [n, dofs]` whose discarded
    energy stays below the tolerance, and that energy in mm² summed over the nodes. Spare columns are zero."""
    matrix = samples.astype(np.float64)
    dofs = matrix.shape[1]
    energy, vectors = np.linalg.eigh(matrix.T @ matrix)
    energy, vectors = np.maximum(energy[::-1], 0.0), vectors[:, ::-1]
    tail = np.concatenate([np.cumsum(energy[::-1])[::-1], [0.0]])
    rank = int(np.searchsorted(-tail, -(tolerance_mm**2) * (dofs // 3)))
    rank = min(max(8, -(-rank // 8) * 8), max_rank, -(-dofs // 8) * 8)
    kept = min(rank, dofs)
    out = np.zeros((dofs, rank), np.float32)
    out[:, :kept] = vectors[:, :kept] * (energy[:kept] > 0.0)
    out[np.abs(matrix).max(axis=0) == 0.0] = 0.0  # held
    return out, float(tail[kept])
