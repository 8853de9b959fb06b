"""The envelope of a dataset: what the model was trained on (docs/reference/formats.md, `envelope`)."""

from __future__ import annotations

import numpy as np

from upt_training.dataset import Case, open_trajectory
from upt_training.errors import InputError
from upt_training.loads import TOOL, TWO_INSTRUMENTS
from upt_training.mesh_file import Mesh


def prescribed(cases: list) -> list:
    """Without the cases of tools, unless there are no others."""
    return [case for case in cases if not case.scheme.startswith(TOOL)] or cases


def measure_envelope(mesh: Mesh, cases: list[Case]) -> dict:
    """Largest push and push rate (mm), range of contact areas (mm²), largest displacement times two as the bound.

    They are those of prescribed contacts: cases of tools do not count, whose limits are measured with corrections
    (`cargo xtask study envelope`), and whose first touch is one node and whose slip is fast. An area is that of one
    instrument: cases of two, which may adjoin, do not count for it.
    """
    areas = mesh.node_areas()
    push, rate, smallest, widest, largest = 0.0, 0.0, np.inf, 0.0, 0.0
    for case in prescribed(cases):
        trajectory = open_trajectory(case.path, mesh)
        before: dict[int, np.ndarray] = {}
        for t in range(1, trajectory.frame_count):
            nodes, vectors = trajectory.contact(t)
            if len(nodes):
                push = max(push, float(np.linalg.norm(vectors, axis=1).max()))
                if case.scheme not in TWO_INSTRUMENTS:
                    area = float(areas[nodes].sum())
                    smallest, widest = min(smallest, area), max(widest, area)
                if before:
                    moves = [np.linalg.norm(v - before[n]) for n, v in zip(nodes, vectors, strict=True) if n in before]
                    rate = max([rate, *map(float, moves)])
            before = dict(zip(nodes.tolist(), np.asarray(vectors), strict=True))
        largest = max(
            largest,
            float(np.abs(trajectory.displacement[:: max(1, trajectory.frame_count // 8)]).max()),
        )
    if not np.isfinite(smallest):
        raise InputError("every training case has two instruments: the area of one patch is not known; add others")
    # Sites and frames that were not drawn differ a little from those that were: 5 % on the rate, a quarter on the area.
    return {
        "max_push_mm": round(push, 3),
        "max_push_rate_mm": round(1.05 * rate, 3),
        "contact_area_mm2": [round(0.75 * smallest, 1), round(1.25 * widest, 1)],
        "max_sites": 2 if any(case.scheme in TWO_INSTRUMENTS for case in prescribed(cases)) else 1,
        "displacement_bound_mm": round(max(2.0 * largest, 30.0), 1),
    }
