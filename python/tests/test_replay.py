"""`upt.Recorder`: the lines that `upt replay` reads (crates/cli/tests/replay.rs reads and verifies such a file)."""

import hashlib
import json

import pytest
import upt


def test_a_recorder_writes_what_the_scene_was_given(tmp_path):
    model = upt.Model(upt.bundle("liver-coarse"), portable=True)
    place = tmp_path / "exam.replay"
    tip = model.positions[model.indices(upt.IndexSet.DOMAIN_NODES)[0]]
    ball = upt.Instrument.sphere(6, position=tip + (0, 0, 3), friction=0.1)
    with upt.Recorder(model, place, every=2, step_s=0.02, corrections=3) as recorder:
        recorder.step([ball])
        field = recorder.step([ball], loads=upt.Loads(gravity=(0, 0, -1)))
        with pytest.raises(ValueError, match="gravity, and no other load"):
            recorder.step([ball], loads=upt.Loads(pressures=[(None, 100.0)]))
    header, first, second, end = [json.loads(line) for line in place.read_text().splitlines()]
    assert header["portable"] and header["scene"]["corrections"]["count"] == 3 and end == {"end": 2}
    assert header["bundle_sha256"] == model.describe()["bundle_sha256"]
    assert first["step"]["instruments"][0]["position"] == [float(x) for x in tip + (0, 0, 3)]
    assert "sha256" not in first["step"] and second["step"]["gravity"] == [0, 0, -1]
    assert second["step"]["sha256"] == hashlib.sha256(field.tobytes()).hexdigest()
    with pytest.raises(TypeError, match="cannot hold the option 'kernel'"):
        upt.Recorder(model, place, kernel="native")
