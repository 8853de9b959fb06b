"""Sampled contact patches: the forces that weigh compliance columns by what instruments do."""

from __future__ import annotations

import numpy as np

from upt_training.mesh_file import Mesh
from upt_training.reduced.columns import Columns, contact_forces


def sample_forces(mesh: Mesh, columns: Columns, count: int, push_mm: float = 10.0, seed: int = 11) -> np.ndarray:
    """Forces `[count, 3D]` (mN) of random patches in the domain, each pushed by `push_mm` in a random direction.

    Areas are uniform in 60 to 280 mm² (at least three nodes); a hundredth of the push varies from node to node, so that
    patches that deform are spanned too.
    """
    rng = np.random.default_rng(seed)
    points = mesh.positions[columns.contact_nodes].astype(np.float64)
    forces = np.zeros((count, 3 * len(points)), np.float32)
    for sample in range(count):
        centre = points[rng.integers(len(points))]
        distance = np.linalg.norm(points - centre, axis=1)
        radius = np.sqrt(rng.uniform(60.0, 280.0) / np.pi)
        rows = np.argsort(distance, kind="stable")[: max(3, int((distance <= radius).sum()))]
        direction = rng.normal(size=3)
        vectors = push_mm * direction / np.linalg.norm(direction) + 0.01 * push_mm * rng.normal(size=(len(rows), 3))
        force = contact_forces(columns.compliance, rows, vectors)
        forces[sample].reshape(-1, 3)[rows] = force
    return forces
