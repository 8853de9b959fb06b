"""Support groups: where a host leads their nodes, and what is refused."""

from __future__ import annotations

import hashlib
import json
import shutil
from pathlib import Path

import numpy as np
import pytest
import upt

FIXTURES = Path(__file__).parents[2] / "tests" / "fixtures"


def grouped(folder: Path) -> Path:
    """A bundle whose first held nodes are a group."""
    shutil.copytree(FIXTURES / "tiny-corrected", folder)
    held = upt.Model(folder).indices(upt.IndexSet.FIXED_NODES)
    file = folder / "bundle.json"
    manifest = json.loads(file.read_text(encoding="utf-8"))
    manifest["supports"] = [{"name": "ligament", "nodes": held[: len(held) // 2].tolist()}]
    blank = manifest["manifest_sha256"] = "0" * 64
    text = json.dumps(manifest)
    file.write_text(text.replace(blank, hashlib.sha256(text.encode()).hexdigest()), encoding="utf-8")
    return folder


def test_a_group_goes_where_it_is_led_and_is_let_go(tmp_path: Path) -> None:
    model = upt.Model(grouped(tmp_path / "grouped"))
    nodes = model.supports["ligament"]
    with model.scene(corrections=5) as scene:
        u = scene.step(loads=upt.Loads(supports=[upt.Support(0, (0.0, 0.1, 0.2))]))
        np.testing.assert_allclose(u[nodes], np.tile((0.0, 0.1, 0.2), (len(nodes), 1)), atol=1e-6)
        there = np.full((len(nodes), 3), 0.1, np.float32)
        u = scene.step(loads=upt.Loads(supports=[upt.Support(0, displacements=there)]))
        np.testing.assert_allclose(u[nodes], there, atol=1e-6)
        go = upt.Loads(gravity=(0, 0, -3), supports=[upt.Support(0, let_go=True)])
        for _ in range(10):
            u = scene.step(loads=go)
        assert u[nodes, 2].min() < -0.1
        with pytest.raises(upt.Error, match="group 1 is beyond"):
            scene.step(loads=upt.Loads(supports=[upt.Support(1)]))


def test_a_ball_presses_a_body_whose_support_moves() -> None:
    """What pushes out of balance throws no tissue: some of these steps once went 30 to 900 mm."""
    model = upt.Model(Path(__file__).parents[2] / "onnx" / "brain-coarse-reduced")
    rng = np.random.default_rng(5)
    domain = model.indices(upt.IndexSet.DOMAIN_NODES)
    away, farthest = 0.0, 0.0
    with model.scene(corrections=10, threads=1) as scene:
        for step in range(240):
            if step % 120 == 0:
                site = model.positions[domain[rng.integers(len(domain))]]
                at = site + (0, 0, 10)
            at = at + 0.1 * (site + rng.normal(0, 3, 3) - at) + rng.normal(0, 0.2, 3)
            away += rng.normal(0, 0.1)
            loads = upt.Loads(
                support=((0, 0, away), (0, 0, 0, 1)),
                gravity=(0.2, 0, -0.3),
                pressures=[(None, 10 * np.sin(0.1 * step))],
            )
            u = scene.step([upt.Instrument.sphere(4.0, position=tuple(at), friction=0.3)], loads=loads)
            assert scene.stats.min_det > 0, step
            farthest = max(farthest, float(np.abs(u).max()))
    assert 1 < farthest < 15
