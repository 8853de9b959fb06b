"""Ties: what they pull with, beds, and what is refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import upt

FIXTURES = Path(__file__).parents[2] / "tests" / "fixtures"


def test_a_thread_pulls_and_breaks_and_a_bed_holds() -> None:
    model = upt.Model(FIXTURES / "tiny-corrected")
    with model.scene(corrections=5) as scene:
        domain = model.indices(upt.IndexSet.DOMAIN_NODES)
        node = int(domain[len(domain) // 2])
        site = model.positions[node]
        bed = scene.bed(site, 15, stiffness=20, break_force=1000)
        assert len(bed) > 2
        assert sum(tie.stiffness for tie in bed) == pytest.approx(20, rel=1e-4)
        assert len(scene.bed(nodes=domain[:6], stiffness=1)) <= 6
        nodes, weights = scene.tie_points([site])
        assert node in nodes[0]
        np.testing.assert_allclose(weights.sum(1), 1, rtol=1e-5)
        thread = upt.Tie(nodes[0], site + (0, 0, 3), 5, weights[0], slack=1)
        for _ in range(5):
            u = scene.step(loads=upt.Loads(ties=[*bed, thread]))
        pulled = scene.tie_readings()[-1]
        assert pulled.force[2] > 0.1
        assert pulled.force[2] == pytest.approx(5 * (pulled.length_mm - 1), abs=0.1)
        assert u[node, 2] > 0
        thread.break_force = 0.5 * pulled.force[2]
        scene.submit(loads=upt.Loads(ties=[*bed, thread]))
        scene.wait()
        assert scene.tie_readings()[-1].broke
        scene.step()
        assert scene.tie_readings() == []


def test_ties_that_there_cannot_be_are_refused() -> None:
    model = upt.Model(FIXTURES / "tiny-corrected")
    with model.scene(corrections=5) as scene:
        node = int(model.indices(upt.IndexSet.DOMAIN_NODES)[0])
        for tie, error, words in [
            (upt.Tie([node], stiffness=-1), upt.ArgumentError, "stiffness"),
            (upt.Tie([node], (np.nan, 0, 0), 1), upt.ArgumentError, "not finite"),
            (upt.Tie([10**6], stiffness=1), upt.ArgumentError, "node 1000000"),
            (upt.Tie([], stiffness=1), ValueError, "nodes"),
            (upt.Tie([node], stiffness=1, to="moon"), ValueError, "moon"),
        ]:
            with pytest.raises(error, match=words):
                scene.step(loads=upt.Loads(ties=[tie]))
        with pytest.raises(upt.ArgumentError, match="bed"):
            scene.bed((900, 0, 0), 1, stiffness=1)
