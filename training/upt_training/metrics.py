"""The paper's metrics of a rollout (section "Evaluation metrics"); lengths in mm.

Per frame: MSE (mean over nodes of the squared distance, mm²), the largest error over nodes and axes, and the Hausdorff
distance of the deformed node positions that lie within 50 mm of the contact site at rest. Autoregressive averages
exclude the first step, whose input is the true rest state; the maximum error is the largest over all other steps.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

HAUSDORFF_RADIUS_MM = 50.0


def hausdorff(a: np.ndarray, b: np.ndarray) -> float:
    """Hausdorff distance of two point sets `[n, 3]`."""
    forward, backward = cKDTree(b).query(a)[0], cKDTree(a).query(b)[0]
    return float(max(forward.max(), backward.max()))


def near_site(positions: np.ndarray, site: np.ndarray) -> np.ndarray:
    """Nodes within 50 mm of the site at rest; all nodes where there is none."""
    near = np.flatnonzero(np.linalg.norm(positions.astype(np.float64) - site, axis=1) <= HAUSDORFF_RADIUS_MM)
    return near if len(near) else np.arange(len(positions))


class RolloutMetrics:
    """Collects the frames of one rollout; `add` is called for frames 1, 2, ..."""

    def __init__(self, positions: np.ndarray, site: np.ndarray | None, with_hausdorff: bool = True):
        self.rest = positions.astype(np.float64)
        self.near = near_site(positions, site) if site is not None and with_hausdorff else None
        self.mse, self.largest, self.distance, self.truth = [], [], [], []

    def add(self, predicted: np.ndarray, truth: np.ndarray) -> None:
        difference = predicted.astype(np.float64) - truth
        self.mse.append(float((difference**2).sum(axis=1).mean()))
        self.largest.append(float(np.abs(difference).max()))
        self.truth.append(float((truth.astype(np.float64) ** 2).sum(axis=1).mean()))
        if self.near is not None:
            rest = self.rest[self.near]
            self.distance.append(hausdorff(rest + predicted[self.near], rest + truth[self.near]))

    def scores(self) -> dict[str, float]:
        """`mse_mm2`, `max_mm`, `hausdorff_mm`, `relative_l2` over all steps but the first."""
        out = {
            "mse_mm2": float(np.mean(self.mse[1:])),
            "max_mm": float(np.max(self.largest[1:])),
            "relative_l2": float(np.sqrt(np.sum(self.mse[1:]) / max(1e-12, np.sum(self.truth[1:])))),
        }
        if self.distance:
            out["hausdorff_mm"] = float(np.mean(self.distance[1:]))
        return out


def summary(scores: list[dict[str, float]]) -> dict[str, dict[str, float]]:
    """Mean, standard deviation and range of each score over the cases."""
    out = {}
    for name in scores[0]:
        values = np.asarray([s[name] for s in scores])
        out[name] = {
            "mean": float(values.mean()),
            "std": float(values.std()),
            "min": float(values.min()),
            "max": float(values.max()),
        }
    return out
