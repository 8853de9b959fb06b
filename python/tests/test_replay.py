"""`upt.Recorder`: what a scene is given, in the lines of `upt replay` (crates/cli/tests/replay/ replays them)."""

import hashlib
import json

import numpy as np
import pytest
import upt


def test_a_recorder_writes_what_the_scene_was_given(tmp_path):
    model = upt.Model(upt.bundle("liver-coarse"), portable=True)
    scene = model.scene(step_s=0.02, corrections=3)
    place = tmp_path / "exam.replay"
    tip = model.positions[model.indices(upt.IndexSet.DOMAIN_NODES)[0]]
    ball = upt.Instrument.sphere(6, position=tip + (0, 0, 3), friction=0.1)
    with upt.Recorder(scene, place, every=2) as recorder:
        scene.step([ball])
        recorder.flush()
        assert len(place.read_text().splitlines()) == 2
        nodes, weights = model.locate([tip])
        np.testing.assert_allclose(weights[0] @ model.positions[nodes[0]], tip, atol=1e-3)
        pull = upt.PointForce(nodes[0], (0, 0, 5), weights[0])
        loads = upt.Loads(gravity=(0, 0, -1), pressures=[(None, 100.0)], point_forces=[pull])
        field = scene.step([ball], loads=loads)
        with pytest.raises(ValueError, match=r"point_forces\[0\] has 2 nodes"):
            scene.step(loads=upt.Loads(point_forces=[upt.PointForce([1, 2], (0, 0, 5))]))
        with pytest.raises(upt.ArgumentError, match=r"point_forces\[0\]: node 1000000"):
            scene.step(loads=upt.Loads(point_forces=[upt.PointForce([1000000], (0, 0, 5))]))
        with pytest.raises(upt.StateError, match="a recording is on"):
            scene.record()
        with pytest.raises(upt.BundleError):
            scene.restore(b"nothing")
        scene.reset()
    recorder.close()
    header, first, second, reset, end = [json.loads(line) for line in place.read_text().splitlines()]
    assert header["portable"] and header["scene"]["corrections"] == {"fixed": 3} and end == {"end": 3}
    assert header["bundle_sha256"] == model.describe()["bundle_sha256"]
    given = first["step"]["instruments"][0]
    assert given["shape"] == {"kind": "sphere", "radius": 6} and "sha256" not in first["step"]
    assert given["position"] == pytest.approx([float(x) for x in tip + (0, 0, 3)])
    assert second["step"]["loads"]["pressures"] == [{"nodes": [], "pascal": 100}]
    assert second["step"]["loads"]["point_forces"][0]["nodes"] == nodes[0].tolist()
    assert reset == {"reset": {}}
    assert second["step"]["sha256"] == hashlib.sha256(field.tobytes()).hexdigest()
    with pytest.raises(upt.StateError, match="no recording is on"):
        scene.end_record()
    with pytest.raises(upt.UnsupportedError, match="budget"):
        upt.Model(upt.bundle("liver-coarse")).scene(corrections=upt.Corrections(budget_us=500)).record()
