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
