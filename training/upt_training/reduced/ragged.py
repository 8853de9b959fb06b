"""A response without what a contact node does not reach: of each block the leading coordinates alone.

Where the coordinates of a block are sorted by what contacts do there, a node far from the block needs a few of them,
and the others are rounding. `response_ranks [D, B]` u8 says how many a node's three rows hold, in eights
(docs/reference/formats.md).
"""

from __future__ import annotations

import numpy as np


def ragged_tensors(response: np.ndarray, rank_offsets: np.ndarray, drop: float) -> dict[str, np.ndarray]:
    """`response` flat f16 and `response_ranks [D, B]` of a whole response `[3D, Q]`.

    Of a node's rows in a block the tail is left out whose norm is at most `drop`, mm/mN.
    """
    columns, blocks = len(response) // 3, len(rank_offsets) - 1
    ranks = np.zeros((columns, blocks), np.uint8)
    for block, (start, end) in enumerate(zip(rank_offsets[:-1], rank_offsets[1:], strict=True)):
        part = response[:, start:end].astype(np.float64).reshape(columns, 3, -1, 8)
        tail = np.cumsum((part**2).sum(axis=(1, 3))[:, ::-1], axis=1)[:, ::-1]
        ranks[:, block] = (tail > drop**2).sum(axis=1)
    return {"response": response[kept(ranks, rank_offsets)].astype(np.float16), "response_ranks": ranks}


def kept(ranks: np.ndarray, rank_offsets: np.ndarray) -> np.ndarray:
    """Which numbers of the whole response are stored, `[3D, Q]`."""
    at = np.arange(rank_offsets[-1])
    block = np.searchsorted(rank_offsets, at, side="right") - 1
    mask = at - np.asarray(rank_offsets)[block] < 8 * ranks.astype(np.int64)[:, block]
    return np.repeat(mask, 3, axis=0)


def whole_response(tensors: dict[str, np.ndarray]) -> np.ndarray:
    """The response `[3D, Q]` of a prior's tensors, whole or ragged."""
    stored = np.asarray(tensors["response"])
    if "response_ranks" not in tensors:
        return stored
    mask = kept(np.asarray(tensors["response_ranks"]), np.asarray(tensors["rank_offsets"]))
    out = np.zeros(mask.shape, stored.dtype)
    out[mask] = stored
    return out
