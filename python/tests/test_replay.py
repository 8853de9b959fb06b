"""`upt.Recorder`: what a scene is given, in the lines of `upt replay` (crates/cli/tests/replay/ replays them)."""

import hashlib
import json

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
        field = scene.step([ball], loads=upt.Loads(gravity=(0, 0, -1), pressures=[(None, 100.0)]))
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
    assert second["step"]["loads"]["pressures"] == [{"nodes": [], "pascal": 100}] and reset == {"reset": {}}
    assert second["step"]["sha256"] == hashlib.sha256(field.tobytes()).hexdigest()
    with pytest.raises(upt.StateError, match="no recording is on"):
        scene.end_record()
    with pytest.raises(upt.UnsupportedError, match="budget"):
        upt.Model(upt.bundle("liver-coarse")).scene(corrections=upt.Corrections(budget_us=500)).record()
