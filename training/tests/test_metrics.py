"""Metrics against SciPy and a hand-made case."""

import numpy as np
import pytest
from scipy.spatial.distance import directed_hausdorff

from upt_training.metrics import RolloutMetrics, hausdorff, summary


def test_hausdorff_equals_scipy():
    a, b = np.random.default_rng(0).uniform(0, 10, (2, 80, 3))
    assert hausdorff(a, b) == pytest.approx(max(directed_hausdorff(a, b)[0], directed_hausdorff(b, a)[0]))


def test_first_step_is_excluded():
    p = np.array([[0.0, 0, 0], [10, 0, 0], [100, 0, 0]])
    metrics = RolloutMetrics(p, np.zeros(3))
    truth = np.zeros((3, 3))
    far = truth.copy()
    far[1] = [50, 0, 0]
    metrics.add(far, truth)  # the first step: not counted
    near = truth.copy()
    near[1] = [0, 2, 0]
    metrics.add(near, truth + [0, 0, 1.0])
    scores = metrics.scores()
    assert scores["mse_mm2"] == pytest.approx((1 + 5 + 1) / 3)
    assert scores["max_mm"] == 2.0
    assert scores["hausdorff_mm"] == pytest.approx(5**0.5)
    assert scores["relative_l2"] == pytest.approx((7 / 3) ** 0.5)
    table = summary([scores, {k: 2 * v for k, v in scores.items()}])
    assert table["max_mm"] == {"mean": 3.0, "std": 1.0, "min": 2.0, "max": 4.0}
