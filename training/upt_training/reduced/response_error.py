"""The linear response of a bundle against exact compliance columns of its mesh."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from upt_training.mesh_file import Mesh
from upt_training.reduced.columns import Columns, contact_forces
from upt_training.reduced.runner import ReducedRunner


def response_error(
    folder: Path, exact: Columns, mesh: Mesh, samples: int = 24, seed: int = 5, sites: int = 1
) -> dict[str, float]:
    """Error of the bundle's `L(c)` against columns of its own mesh on patches pushed as one by 10 mm, mm.

    `exact` may hold columns of a part of the domain only: patches are drawn there, `sites` of them at a time.
    """
    runner = ReducedRunner(folder)
    runner.correct = False
    rng = np.random.default_rng(seed)
    points = mesh.positions[exact.contact_nodes].astype(np.float64)
    square, truth, largest = 0.0, 0.0, 0.0
    for _ in range(samples):
        pushed = np.zeros_like(points)
        for _ in range(sites):
            centre = points[rng.integers(len(points))]
            distance = np.linalg.norm(points - centre, axis=1)
            direction = rng.normal(size=3)
            near = distance <= np.sqrt(rng.uniform(60.0, 280.0) / np.pi)
            pushed[near] = 10.0 * direction / np.linalg.norm(direction)
        rows = np.flatnonzero(pushed.any(axis=1))
        vectors = pushed[rows].astype(np.float32)
        forces = contact_forces(exact.compliance, rows, vectors).ravel().astype(np.float32)
        dofs = (3 * rows[:, None] + np.arange(3)).ravel()
        field = (forces @ exact.columns[dofs]).reshape(-1, 3)
        field[exact.contact_nodes[rows]] = vectors
        runner.reset()
        error = runner.step(exact.contact_nodes[rows], vectors) - field
        square += float((error.astype(np.float64) ** 2).sum(1).mean()) / samples
        truth += float((field.astype(np.float64) ** 2).sum(1).mean()) / samples
        largest = max(largest, float(np.abs(error).max()))
    return {"rms_mm": square**0.5, "response_rms_mm": truth**0.5, "max_mm": largest}
