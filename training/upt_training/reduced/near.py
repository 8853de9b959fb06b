"""Compressed compliance: blocks of neighbouring contact nodes exact, what lies farther apart from the response tables.

The block `[3D, 3D]` grows with the square of the domain (221 MB for 2,476 contact nodes). Between nodes that are far
apart it is smooth, and the response holds it: `A_ij = U_i response[j]` with the rows `U_i` of node `i` in the bases of
its block.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from upt_training.errors import InputError
from upt_training.reduced.ragged import whole_response


def near_tensors(compliance: np.ndarray, points: np.ndarray, near_mm: float) -> dict[str, np.ndarray]:
    """`near_offsets [D+1]`, `near_nodes [E]`, `near_compliance [E, 9]`: pairs `i <= j` at most `near_mm` apart."""
    pairs = cKDTree(points).query_pairs(near_mm, output_type="ndarray")
    own = np.arange(len(points))
    pairs = np.concatenate([np.sort(pairs, axis=1), np.stack([own, own], axis=1)])
    first, second = pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))].T
    blocks = compliance.reshape(len(points), 3, len(points), 3)[first, :, second]
    return {
        "near_offsets": np.searchsorted(first, np.arange(len(points) + 1)).astype(np.int32),
        "near_nodes": second.astype(np.int32),
        "near_compliance": blocks.reshape(-1, 9).astype(np.float32),
    }


def whole_compliance(tensors: dict[str, np.ndarray], path: object) -> np.ndarray:
    """`[3D, 3D]` float32 from the tensors of a prior, whole or compressed, as the runtime reads its upper triangle."""
    if "compliance" in tensors:
        return np.array(tensors["compliance"])
    for name in ("near_offsets", "near_nodes", "near_compliance"):
        if name not in tensors:
            raise InputError(f"{path}: neither `compliance` nor {name!r} is there; build it with upt_training.reduced")
    nodes, block_nodes = np.array(tensors["contact_nodes"]), np.array(tensors["block_nodes"])
    count = len(nodes)
    row = np.full(len(block_nodes), -1)
    row[nodes] = np.arange(count)
    offsets, ranks = np.array(tensors["block_offsets"]), np.array(tensors["rank_offsets"])
    out = np.zeros((count, 3, 3 * count), np.float32)
    whole = whole_response(tensors)
    at = 0
    for block in range(len(offsets) - 1):
        members, rank = block_nodes[offsets[block] : offsets[block + 1]], ranks[block + 1] - ranks[block]
        size = 3 * len(members) * rank
        touched = row[members] >= 0
        if touched.any():
            basis = np.asarray(tensors["basis"][at : at + size], np.float32).reshape(len(members), 3, rank)
            response = np.asarray(whole[:, ranks[block] : ranks[block + 1]], np.float32)
            rows = basis[touched].reshape(-1, rank) @ response.T
            out[row[members[touched]]] = rows.reshape(-1, 3, 3 * count)
        at += size
    blocks = out.reshape(count, 3, count, 3)
    starts = np.array(tensors["near_offsets"])
    first = np.repeat(np.arange(count), np.diff(starts))
    blocks[first, :, np.array(tensors["near_nodes"])] = np.array(tensors["near_compliance"]).reshape(-1, 3, 3)
    whole = blocks.reshape(3 * count, 3 * count)
    upper = np.triu(whole)
    return upper + np.triu(whole, 1).T
