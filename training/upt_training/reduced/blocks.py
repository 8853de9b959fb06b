"""Spatial blocks of the nodes: recursive coordinate bisection, surface nodes first in each block."""

from __future__ import annotations

import numpy as np


def partition(positions: np.ndarray, surface_nodes: np.ndarray, size: int = 256) -> tuple[np.ndarray, np.ndarray]:
    """`block_nodes [K]` and `block_offsets [B+1]`: blocks of at most `size` nodes, cut at medians of the longest axis.

    In a block the surface nodes come first (they are what renderers need), each group ascending.
    """
    on_surface = np.zeros(len(positions), bool)
    on_surface[surface_nodes] = True
    blocks: list[np.ndarray] = []

    def cut(nodes: np.ndarray) -> None:
        if len(nodes) <= size:
            blocks.append(nodes[np.lexsort((nodes, ~on_surface[nodes]))])
            return
        points = positions[nodes]
        axis = int(np.argmax(points.max(0) - points.min(0)))
        order = np.lexsort((nodes, points[:, axis]))
        half = len(nodes) // 2
        cut(nodes[order[:half]])
        cut(nodes[order[half:]])

    cut(np.arange(len(positions)))
    offsets = np.concatenate([[0], np.cumsum([len(block) for block in blocks])])
    return np.concatenate(blocks).astype(np.int32), offsets.astype(np.int32)
