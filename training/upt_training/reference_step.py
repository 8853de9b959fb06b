"""One step of a bundle's network in float64, for the error of every float32 path: `reference.safetensors`.

From rest, without boundary conditions, a push of 5 mm into the domain: `contact_nodes [n]` int32, `contact_vectors
[n, 3]` mm, `displacement [K, 3]` mm, rounded to float32 once. Weights and mesh are the bundle's float32 numbers.
"""

from __future__ import annotations

import copy
from pathlib import Path

import numpy as np
import torch
from safetensors.numpy import save_file

from upt_training.config import FEATURE_WIDTH
from upt_training.errors import InputError
from upt_training.graph import Graph
from upt_training.mesh_file import Mesh
from upt_training.model import Upt

PUSH_MM = (0.0, 0.0, -5.0)
REACH_MM = 8.0
CHUNK = 2048


def pushed_nodes(mesh: Mesh) -> np.ndarray:
    """Nodes of the domain within `REACH_MM` of one in its middle."""
    nodes = mesh.domain_nodes
    if len(nodes) == 0:
        raise InputError("the mesh has no domain, so the reference step has no contact: leave out --paper-split")
    points = mesh.positions[nodes].astype(np.float64)
    apart = np.linalg.norm(points - points[len(nodes) // 2], axis=1)
    return nodes[apart < REACH_MM].astype(np.int32)


def step_in_float64(model: Upt, mesh: Mesh, graph: Graph, nodes: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    """`[K, 3]` mm from rest with the contact `vectors [n, 3]`, before `base`, without boundary conditions."""
    if model.settings.uses_prior:
        raise InputError("the reference step has no linear response: use a configuration without the prior")
    exact = copy.deepcopy(model).double().eval()
    positions = torch.from_numpy(mesh.positions.astype(np.float64))
    fields = {
        name: torch.zeros(mesh.node_count, FEATURE_WIDTH[name], dtype=torch.float64) for name in model.settings.features
    }
    for name, value in (("collision", torch.from_numpy(vectors).double()), ("contact", 1.0)):
        if name in fields:
            fields[name][torch.from_numpy(nodes).long()] = value
    neighbours, mask = (torch.from_numpy(a) for a in graph.padded())
    with torch.no_grad():
        w_source, w_target = exact.encoder_weights()
        features = exact.normalise(fields)
        source, target, _ = exact.tables(positions)
        source, target = features @ w_source.T + source, features @ w_target.T + target
        mean = exact.aggregate(source, target[torch.from_numpy(graph.supernodes)], neighbours, mask.double())
        keys, values = exact.latent(mean)
        rows = [
            exact.decode(exact.tables(part)[2], keys, values)  # scores of all nodes at once would be gigabytes
            for part in positions.split(CHUNK)
        ]
    return torch.cat(rows).numpy()


def write_reference(folder: Path, model: Upt, mesh: Mesh, graph: Graph) -> None:
    """`reference.safetensors` in a bundle's folder."""
    nodes = pushed_nodes(mesh)
    vectors = np.tile(np.float32(PUSH_MM), (len(nodes), 1))
    tensors = {
        "contact_nodes": nodes,
        "contact_vectors": vectors,
        "displacement": step_in_float64(model, mesh, graph, nodes, vectors).astype(np.float32),
    }
    save_file(tensors, str(folder / "reference.safetensors"))
