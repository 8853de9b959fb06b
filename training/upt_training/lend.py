"""Contact nodes without compliance columns lend their displacement to the nearest column, as the runtime does.

Domains of other meshes, contacts beyond the domain and bundles that keep columns of a part of the domain need it.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from upt_training.mesh_file import Mesh

REACH = 4.0  # How far a node may borrow, in typical edges of the contact nodes.


class Lender:
    """Turns contact nodes into nodes with columns: `lender(nodes [m], vectors [m,3]) -> (nodes [n], vectors [n,3])`."""

    def __init__(self, mesh: Mesh, contact_nodes: np.ndarray, boundary: str) -> None:
        self.contact_nodes = np.asarray(contact_nodes)
        points = mesh.positions[self.contact_nodes]
        distance, self.column = cKDTree(points).query(mesh.positions)
        edge = np.sqrt(mesh.node_areas()[self.contact_nodes].mean())
        self.column[distance > REACH * edge] = -1
        self.column[mesh.held_nodes(boundary)] = -1
        self.held = np.zeros(mesh.node_count, bool)
        self.held[mesh.held_nodes(boundary)] = True

    def __call__(self, nodes: np.ndarray, vectors: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """A column's own node goes before those that borrow it; several borrowers give their mean."""
        column = self.column[nodes]
        nodes, vectors, column = nodes[column >= 0], vectors[column >= 0], column[column >= 0]
        own = self.contact_nodes[column] == nodes
        if own.all():
            return nodes, vectors
        columns, place = np.unique(column, return_inverse=True)
        taken = np.zeros(len(columns), bool)
        taken[place[own]] = True
        share = (own | ~taken[place]).astype(np.float64)
        total = np.zeros((len(columns), 3))
        np.add.at(total, place, share[:, None] * vectors)
        mean = total / np.bincount(place, share, len(columns))[:, None]
        return self.contact_nodes[columns], mean.astype(np.float32)
