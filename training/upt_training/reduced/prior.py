"""The linear-elastic response `L(c)` from a `prior.safetensors` file (docs/reference/formats.md).

`f = A_CC^-1 c`, `q = f response`, `u_block = U_k q_k`; also `z = f force_to_z` and `p = f force_to_p`.
Contact nodes outside of `contact_nodes` have no column and do not act; `Prior.rows` tells which.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from safetensors.numpy import save_file

from upt_training.errors import InputError
from upt_training.reduced.block_basis import BlockBasis
from upt_training.reduced.columns import contact_forces, map_tensors, rows_of
from upt_training.reduced.near import whole_compliance
from upt_training.reduced.ragged import whole_response
from upt_training.reduced.stepped import in_numbers


@dataclass
class Prior:
    """Response tables of one mesh and boundary condition. Lengths mm, forces mN."""

    contact_nodes: np.ndarray
    compliance: np.ndarray
    basis: BlockBasis
    response: np.ndarray
    residual: np.ndarray
    force_to_z: np.ndarray
    force_to_p: np.ndarray
    metadata: dict

    @property
    def node_count(self) -> int:
        return len(self.basis.block_nodes)

    def rows(self, nodes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Row of each node in `contact_nodes`, and a mask of the nodes that have one."""
        return rows_of(self.contact_nodes, nodes)

    def forces(self, nodes: np.ndarray, vectors: np.ndarray) -> np.ndarray:
        """Contact forces over all columns, `[..., 3D]` (mN), of `vectors [..., m, 3]` (mm) at `nodes [m]`."""
        rows, found = self.rows(np.asarray(nodes))
        vectors = np.asarray(vectors)
        out = np.zeros((*vectors.shape[:-2], len(self.contact_nodes), 3))
        if found.any():
            out[..., rows[found], :] = contact_forces(self.compliance, rows[found], vectors[..., found, :])
        return out.reshape(*vectors.shape[:-2], -1)

    def coordinates(self, forces: np.ndarray) -> np.ndarray:
        """Block coordinates `q [..., Q]` of `L` for `forces [..., 3D]`. `|q|` is the norm of the field."""
        touched = np.flatnonzero(np.any(forces.reshape(-1, forces.shape[-1]) != 0.0, axis=0))
        return forces[..., touched].astype(np.float32) @ self.response[touched].astype(np.float32)

    def field(self, q: np.ndarray) -> np.ndarray:
        """Field `[..., K, 3]` (mm) of block coordinates `q [..., Q]`."""
        rank = self.basis.rank_offsets
        out = np.zeros((*q.shape[:-1], 3 * self.node_count), np.float32)
        for block, basis in enumerate(self.basis.bases):
            part = q[..., rank[block] : rank[block + 1]] @ basis.astype(np.float32).T
            out[..., self.basis.dofs(block)] = part
        return out.reshape(*q.shape[:-1], self.node_count, 3)

    def linear_response(self, nodes: np.ndarray, vectors: np.ndarray) -> np.ndarray:
        """`L(c)` at all nodes, `[..., K, 3]` mm, for `vectors [..., m, 3]` at `nodes [m]`; nothing is overwritten."""
        return self.field(self.coordinates(self.forces(nodes, vectors)))

    def trajectory_response(self, offsets: np.ndarray, nodes: np.ndarray, vectors: np.ndarray) -> np.ndarray:
        """`L(c[t])` of every row of a trajectory's contact arrays, `[F, K, 3]` mm; rows without contact are zero."""
        forces = trajectory_forces(self.contact_nodes, self.compliance, offsets, nodes, vectors)
        return self.field(self.coordinates(forces))

    def z(self, forces: np.ndarray) -> np.ndarray:
        """Response in its leading modes `[..., r_z]`."""
        return (forces @ self.force_to_z).astype(np.float32)

    def p(self, forces: np.ndarray) -> np.ndarray:
        """`Phi^T L` `[..., r]`, mm."""
        return (forces @ self.force_to_p).astype(np.float32)


def trajectory_forces(
    contact_nodes: np.ndarray, compliance: np.ndarray, offsets: np.ndarray, nodes: np.ndarray, vectors: np.ndarray
) -> np.ndarray:
    """Contact forces `[F, 3D]` (float32, mN) of a trajectory's rows; equal consecutive contact sets share a factor."""
    frames = len(offsets) - 1
    out = np.zeros((frames, len(contact_nodes), 3), np.float32)
    start = 0
    while start < frames:
        first = nodes[offsets[start] : offsets[start + 1]]
        end = start + 1
        while end < frames and np.array_equal(nodes[offsets[end] : offsets[end + 1]], first):
            end += 1
        if len(first):
            rows, found = rows_of(contact_nodes, first)
            run = vectors[offsets[start] : offsets[end]].reshape(end - start, len(first), 3)
            if found.any():
                force = contact_forces(compliance, rows[found], run[:, found])
                out[start:end, rows[found]] = force
        start = end
    return out.reshape(frames, -1)


def load_prior(path: Path | str, residual: Path | str | None = None) -> Prior:
    """Read a prior file into memory, its residual modes from a file of their own where a bundle has one.

    Raises `InputError` naming the missing tensor."""
    tensors, metadata = map_tensors(path)
    learned = map_tensors(residual)[0] if residual else tensors
    names = ("contact_nodes", "block_nodes", "block_offsets", "rank_offsets", "basis", "response")
    for name in names:
        if name not in tensors:
            raise InputError(f"{path}: tensor {name!r} is missing; build it with `python -m upt_training.reduced`")
    tensors = in_numbers(tensors)
    block_offsets, rank_offsets = np.array(tensors["block_offsets"]), np.array(tensors["rank_offsets"])
    flat = np.array(tensors["basis"])
    bases, at = [], 0
    for block in range(len(block_offsets) - 1):
        rows = 3 * int(block_offsets[block + 1] - block_offsets[block])
        rank = int(rank_offsets[block + 1] - rank_offsets[block])
        bases.append(flat[at : at + rows * rank].reshape(rows, rank).astype(np.float32))
        at += rows * rank
    basis = BlockBasis(np.array(tensors["block_nodes"]), block_offsets, bases)
    response = np.array(whole_response(tensors))
    empty = np.zeros((len(response), 0), np.float32)
    return Prior(
        np.array(tensors["contact_nodes"]),
        whole_compliance(tensors, path),
        basis,
        response,
        np.array(learned.get("residual", np.zeros((0, response.shape[1]), np.float32))),
        np.array(learned.get("force_to_z", empty)),
        np.array(learned.get("force_to_p", empty)),
        metadata,
    )


def save_prior(
    path: Path | str, prior: Prior, table_dtype: type = np.float16, near: dict[str, np.ndarray] | None = None
) -> None:
    """Write a prior file; `basis` and `response` in `table_dtype` (float16 or float32), the rest float32.

    `near` (of `near_tensors`) takes the place of the whole compliance.
    """
    basis = prior.basis
    tensors = {
        "contact_nodes": prior.contact_nodes.astype(np.int32),
        **(near or {"compliance": prior.compliance.astype(np.float32)}),
        "block_nodes": basis.block_nodes.astype(np.int32),
        "block_offsets": basis.block_offsets.astype(np.int32),
        "rank_offsets": basis.rank_offsets,
        "basis": np.concatenate([b.ravel() for b in basis.bases]).astype(table_dtype),
        "response": prior.response.astype(table_dtype),
    }
    if len(prior.residual):
        tensors["residual"] = prior.residual.astype(np.float32)
        tensors["force_to_z"] = prior.force_to_z.astype(np.float32)
        tensors["force_to_p"] = prior.force_to_p.astype(np.float32)
    metadata = {"format": "upt-prior", "version": "1", **prior.metadata}
    partial = Path(path).with_suffix(".partial")
    save_file(
        {name: np.ascontiguousarray(tensor) for name, tensor in tensors.items()},
        str(partial),
        metadata={key: str(value) for key, value in metadata.items()},
    )
    partial.chmod(0o644)
    partial.rename(path)


def response_in_blocks(columns: np.ndarray, basis: BlockBasis, chunk: int = 64) -> np.ndarray:
    """Compliance columns `[3D, 3K]` in block coordinates, `[3D, Q]` float32, `chunk` columns at a time."""
    parts = [basis.project(np.asarray(columns[at : at + chunk])) for at in range(0, len(columns), chunk)]
    return np.concatenate(parts)
