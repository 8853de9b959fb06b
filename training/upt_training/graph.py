"""Supernodes and the radius graph (docs/reference/formats.md), the same in Python and in Rust, bit for bit.

The paper samples `n_S` nodes at random and aggregates the messages of up to 32 nodes in a radius. Here the choice is a
seeded hash (no generator state to agree on), and a full ball keeps the *nearest* nodes and always the self edge.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

GOLDEN = np.uint64(0x9E3779B97F4A7C15)


@dataclass
class Graph:
    """`supernodes [n_S]` ascending node indices; CSR rows: `neighbours[offsets[s]:offsets[s + 1]]`, ascending."""

    supernodes: np.ndarray
    offsets: np.ndarray
    neighbours: np.ndarray

    def padded(self, max_degree: int | None = None) -> tuple[np.ndarray, np.ndarray]:
        """`neighbours [n_S, degree]` int64 (padding 0) and `mask [n_S, degree]` float32."""
        degree = np.diff(self.offsets)
        width = int(max_degree or degree.max())
        mask = np.arange(width)[None, :] < degree[:, None]
        index = np.zeros(mask.shape, np.int64)
        index[mask] = self.neighbours
        return index, mask.astype(np.float32)

    def needed_nodes(self) -> np.ndarray:
        """Nodes whose features the encoder reads: all neighbours and supernodes, ascending."""
        return np.union1d(self.neighbours, self.supernodes)


def node_keys(count: int, seed: int) -> np.ndarray:
    """`key_i = splitmix64(seed * 0x9E3779B97F4A7C15 + i)`, wrapping, `[count]` uint64."""
    with np.errstate(over="ignore"):
        x = np.uint64(seed) * GOLDEN + np.arange(count, dtype=np.uint64)
        x += GOLDEN
        x = (x ^ (x >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
        x = (x ^ (x >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
        return x ^ (x >> np.uint64(31))


def choose_supernodes(
    node_count: int,
    supernode_count: int,
    seed: int,
    domain_nodes: np.ndarray,
    domain_fraction: float,
) -> np.ndarray:
    """Ascending node indices: smallest keys of the domain first (`round(fraction * n_S)`), then of all the rest."""
    if node_count <= supernode_count:
        return np.arange(node_count, dtype=np.int64)
    key = node_keys(node_count, seed)
    order = np.lexsort((np.arange(node_count), key))
    in_domain = np.zeros(node_count, bool)
    in_domain[domain_nodes] = True
    quota = int(np.floor(domain_fraction * supernode_count + 0.5))
    first = order[in_domain[order]][:quota]
    taken = np.zeros(node_count, bool)
    taken[first] = True
    rest = order[~taken[order]][: supernode_count - len(first)]
    return np.sort(np.concatenate([first, rest])).astype(np.int64)


def radius_graph(positions: np.ndarray, supernodes: np.ndarray, radius: float, max_degree: int) -> Graph:
    """Neighbours of each supernode: nearest `max_degree` nodes with `d2 <= radius²`, self always among them."""
    p = positions.astype(np.float64)
    ball = cKDTree(p).query_ball_point(p[supernodes], radius * (1.0 + 1e-9) + 1e-12)
    limit = np.float64(radius) * np.float64(radius)
    rows = []
    for node, candidates in zip(supernodes, ball, strict=True):
        index = np.asarray(candidates, np.int64)
        delta = p[index] - p[node]
        d2 = (delta[:, 0] * delta[:, 0] + delta[:, 1] * delta[:, 1]) + delta[:, 2] * delta[:, 2]
        index, d2 = index[d2 <= limit], d2[d2 <= limit]
        row = index[np.lexsort((index, d2))][:max_degree]
        if node not in row:
            row[-1] = node
        rows.append(np.sort(row))
    offsets = np.concatenate([[0], np.cumsum([len(r) for r in rows])]).astype(np.int64)
    return Graph(supernodes.astype(np.int64), offsets, np.concatenate(rows).astype(np.int64))


def build_graph(mesh, settings) -> Graph:
    """The graph of a mesh for a bundle's `graph` settings (`config.GraphSettings`)."""
    supernodes = choose_supernodes(
        mesh.node_count,
        settings.supernodes,
        settings.seed,
        mesh.domain_nodes,
        settings.domain_fraction,
    )
    return radius_graph(mesh.positions, supernodes, settings.radius_mm, settings.max_degree)
