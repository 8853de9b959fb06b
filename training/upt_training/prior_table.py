"""Evaluates the linear-elastic response `L(c)` from `prior.safetensors` (docs/formats.md).

Contact forces `f = A_CC^-1 c`, block coordinates `q = f response`, field `u_block = U_k q_k`. Lengths mm, forces mN.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from upt_training.dataset import map_safetensors
from upt_training.errors import InputError

DENSE_LIMIT = 1 << 30  # bytes of a dense table made by `restrict`


class PriorTable:
    """`response(nodes, vectors)` gives `L(c)` at the chosen field nodes, `[n, 3]` mm."""

    def __init__(self, path: Path, node_count: int):
        tensors, _ = map_safetensors(Path(path))
        for name in (
            "contact_nodes",
            "compliance",
            "block_nodes",
            "block_offsets",
            "rank_offsets",
            "basis",
            "response",
        ):
            if name not in tensors:
                raise InputError(f"{path}: tensor {name!r} is missing; this is not a prior")
        if len(tensors["block_nodes"]) != node_count:
            raise InputError(f"{path}: made for {len(tensors['block_nodes'])} nodes, the mesh has {node_count}")
        self.path, self.node_count = Path(path), node_count
        self.row = np.full(node_count, -1)
        self.row[tensors["contact_nodes"]] = np.arange(len(tensors["contact_nodes"]))
        self.compliance = np.asarray(tensors["compliance"], np.float64)
        self.response_q = np.asarray(tensors["response"], np.float32)
        self.blocks = []
        basis, at = np.asarray(tensors["basis"], np.float32), 0
        offsets, ranks, nodes = (
            tensors["block_offsets"],
            tensors["rank_offsets"],
            np.asarray(tensors["block_nodes"]),
        )
        for k in range(len(offsets) - 1):
            members = nodes[offsets[k] : offsets[k + 1]]
            rank = int(ranks[k + 1] - ranks[k])
            size = 3 * len(members) * rank
            self.blocks.append((members, int(ranks[k]), basis[at : at + size].reshape(3 * len(members), rank)))
            at += size
        self.dense, self.nodes = None, None

    def restrict(self, nodes: np.ndarray | None) -> PriorTable:
        """Answer for these nodes only (None: all), by one dense product where the table fits."""
        wanted = np.arange(self.node_count) if nodes is None else np.asarray(nodes)
        out = object.__new__(PriorTable)
        out.__dict__.update(self.__dict__)
        out.nodes, out.dense = wanted, None
        if self.response_q.shape[0] * 3 * len(wanted) * 4 <= DENSE_LIMIT:
            place = np.full(self.node_count, -1)
            place[wanted] = np.arange(len(wanted))
            table = np.zeros((self.response_q.shape[0], len(wanted), 3), np.float32)
            for members, start, basis in self.blocks:
                here = place[members] >= 0
                if here.any():
                    part = basis.reshape(len(members), 3, -1)[here].reshape(-1, basis.shape[1])
                    field = self.response_q[:, start : start + basis.shape[1]] @ part.T
                    table[:, place[members[here]]] = field.reshape(len(field), -1, 3)
            out.dense = table.reshape(len(table), -1)
        return out

    def forces(self, nodes: np.ndarray, vectors: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Contact dofs and the forces there that impose `vectors`."""
        known = self.row[nodes] >= 0
        dofs = (3 * self.row[nodes[known]][:, None] + np.arange(3)).ravel()
        block = self.compliance[np.ix_(dofs, dofs)]
        block = 0.5 * (block + block.T)
        try:
            return dofs, cho_solve(cho_factor(block), np.asarray(vectors[known], np.float64).ravel())
        except np.linalg.LinAlgError:
            shift = 1e-6 * np.trace(block) / len(block)
            factor = cho_factor(block + shift * np.eye(len(block)))
            return dofs, cho_solve(factor, np.asarray(vectors[known], np.float64).ravel())

    def response(self, nodes: np.ndarray, vectors: np.ndarray) -> np.ndarray:
        """Contact nodes `[m]`, prescribed displacement `[m, 3]` mm -> `L(c)` `[n, 3]` mm float32."""
        if self.nodes is None:
            return self.restrict(None).response(nodes, vectors)
        if len(nodes) == 0:
            return np.zeros((len(self.nodes), 3), np.float32)
        dofs, force = self.forces(np.asarray(nodes), np.asarray(vectors))
        force = force.astype(np.float32)
        if self.dense is not None:
            return (force @ self.dense[dofs]).reshape(-1, 3)
        q = force @ self.response_q[dofs]
        field = np.zeros((self.node_count, 3), np.float32)
        for members, start, basis in self.blocks:
            field[members] = (basis @ q[start : start + basis.shape[1]]).reshape(-1, 3)
        return field[self.nodes]
