"""Decoder anchors: nodes at which a bundle's correction is decoded, and weights to interpolate it to the others.

`python -m upt_training anchors onnx/brain-fast --spacing 6.5` adds `anchors.safetensors` to a `upt` bundle whose base
is the linear response: what the network adds to it is smooth, and decoding is most of a step. Anchors are a
Poisson-disk sample in the distance along the mesh's edges; a node follows its nearest ones in that distance (so never
across a gap between folds or hemispheres), by moving least squares that reproduce linear fields. Where the anchors
around a node lie in a line or a plane, a small ridge keeps the weights bounded.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from safetensors.numpy import save_file
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra

from upt_training.bundle_folder import MANIFEST, file_of, read_manifest, write_manifest
from upt_training.errors import InputError
from upt_training.mesh_file import Mesh, load_mesh

FILE = "anchors.safetensors"
# Distances along edges are searched up to this many spacings.
REACH = 4.0
# Ridge on the slopes of the least squares, relative to the sum of weights.
RIDGE = 1e-4


@dataclass(frozen=True)
class Anchors:
    """`nodes [M]` ascending; `neighbours [K, n]` places in `nodes`; `weights [K, n]`, a node's add up to one."""

    nodes: np.ndarray
    neighbours: np.ndarray
    weights: np.ndarray

    def interpolate(self, values: np.ndarray) -> np.ndarray:
        """`[M, c]` at the anchors -> `[K, c]`."""
        return np.einsum("kn,knc->kc", self.weights, values[self.neighbours])


def edge_lengths(mesh: Mesh) -> csr_matrix:
    pairs = np.concatenate([mesh.tets[:, [a, b]] for a in range(4) for b in range(a)])
    pairs = np.unique(np.sort(pairs, axis=1), axis=0)
    lengths = np.linalg.norm(mesh.positions[pairs[:, 0]].astype(float) - mesh.positions[pairs[:, 1]], axis=1)
    return csr_matrix((lengths, (pairs[:, 0], pairs[:, 1])), (mesh.node_count, mesh.node_count))


def make_anchors(mesh: Mesh, spacing_mm: float, per_node: int = 8, seed: int = 0) -> Anchors:
    """Anchors at least `spacing_mm` apart; every node of the mesh is within `spacing_mm` of one."""
    lengths = edge_lengths(mesh)
    count = mesh.node_count
    free = np.ones(count, bool)
    chosen, reached = [], []
    for node in np.random.default_rng(seed).permutation(count):
        if free[node]:
            distance = dijkstra(lengths, directed=False, indices=node, limit=REACH * spacing_mm)
            near = np.flatnonzero(np.isfinite(distance))
            free[near[distance[near] < spacing_mm]] = False
            chosen.append(node)
            reached.append((near.astype(np.int32), distance[near].astype(np.float32)))
    order = np.argsort(chosen)
    nodes = np.asarray(chosen, np.int32)[order]
    anchor = np.concatenate([np.full(len(reached[o][0]), place, np.int32) for place, o in enumerate(order)])
    node = np.concatenate([reached[o][0] for o in order])
    distance = np.concatenate([reached[o][1] for o in order])
    ranked = np.lexsort((anchor, distance, node))
    anchor, node, distance = anchor[ranked], node[ranked], distance[ranked]
    first = np.searchsorted(node, np.arange(count + 1))
    rank = np.arange(len(node)) - first[node]
    kept = rank < per_node
    # Places that a node lacks repeat its nearest anchor with no weight.
    neighbours = np.repeat(anchor[first[:-1]][:, None], per_node, axis=1)
    distances = np.full((count, per_node), np.inf)
    neighbours[node[kept], rank[kept]] = anchor[kept]
    distances[node[kept], rank[kept]] = distance[kept]
    weights = moving_least_squares(mesh.positions.astype(float), nodes, neighbours, distances)
    return Anchors(nodes, neighbours.astype(np.int32), weights.astype(np.float32))


def moving_least_squares(positions: np.ndarray, nodes: np.ndarray, neighbours: np.ndarray, distances: np.ndarray):
    """Weights `[K, n]` that add up to one and, where the anchors allow it, reproduce linear fields."""
    farthest = np.where(np.isfinite(distances), distances, 0.0).max(axis=1)[:, None]
    scale = 1.15 * np.maximum(farthest, 1e-6)
    near = np.where(np.isfinite(distances), (1.0 - np.minimum(distances / scale, 1.0) ** 2) ** 2, 0.0)
    offset = (positions[nodes[neighbours]] - positions[:, None]) / scale[..., None]
    basis = np.concatenate([np.ones((*offset.shape[:2], 1)), offset], axis=2)
    ridge = RIDGE * near.sum(axis=1)[:, None, None] * np.diag([0.0, 1.0, 1.0, 1.0])
    normal = np.einsum("kni,kn,knj->kij", basis, near, basis) + ridge
    right = np.zeros((len(positions), 4, 1))
    right[:, 0] = 1.0
    weights = near * np.einsum("kni,ki->kn", basis, np.linalg.solve(normal, right)[..., 0])
    own = distances[:, 0] == 0.0
    weights[own] = np.eye(1, weights.shape[1])
    return weights / weights.sum(axis=1, keepdims=True)


def add_to_bundle(bundle: Path, spacing_mm: float, per_node: int) -> Anchors:
    """Write `anchors.safetensors` into a bundle and name it in bundle.json."""
    manifest = read_manifest(bundle)
    if manifest["kind"] != "upt" or manifest["upt"]["base"] != "prior":
        raise InputError(f"{bundle / MANIFEST}: anchors are for kind `upt` with base `prior`")
    if not spacing_mm > 0.0 or per_node < 4:
        raise InputError("anchors: --spacing must be positive and --neighbours at least 4")
    anchors = make_anchors(load_mesh(file_of(bundle, manifest, manifest["mesh"]["file"])), spacing_mm, per_node)
    tensors = {"nodes": anchors.nodes, "neighbours": anchors.neighbours, "weights": anchors.weights}
    save_file(tensors, bundle / FILE, metadata={"spacing_mm": str(spacing_mm)})
    (bundle / FILE).chmod(0o644)
    manifest["upt"]["anchors"] = FILE
    write_manifest(bundle, manifest)
    return anchors
