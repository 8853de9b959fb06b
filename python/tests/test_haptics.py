"""The force of one tool between steps."""

from __future__ import annotations

import numpy as np
import pytest
import upt
from conftest import FIXTURES
from test_instruments import pressing, site


def test_a_hand_feels_what_the_step_told():
    model = upt.Model(FIXTURES / "tiny-corrected")
    _, normal = site(model)
    scene = model.scene(corrections=5)
    tool = upt.Instrument.capsule(3.0, position=pressing(model, -5.0))
    hand = upt.Haptics(scene, tool, step_latency_ms=0.001)
    time = 0.0
    free = hand.render(time, 1e-3 * pressing(model, -5.0))
    assert free.force_n == (0.0, 0.0, 0.0) and not free.contact
    tool.position = pressing(model, 0.8)
    for _ in range(30):
        scene.step([tool])
        for _ in range(50):
            time += 1e-3
            felt = hand.render(time, 1e-3 * tool.position)
    told = np.array(scene.readings()[0].force)
    assert felt.contact and felt.contact_count > 0 and told @ normal > 1
    np.testing.assert_allclose(1e3 * np.array(felt.force_n), told, atol=0.02 * np.linalg.norm(told))
    stiffness = np.array(felt.stiffness_n_per_m).reshape(3, 3)
    assert normal @ stiffness @ normal > 0
    assert 0.049 < felt.age_s < 0.051 and felt.step_count == 31
    with pytest.raises(upt.Error, match="NON_FINITE|finite"):
        hand.render(time, (np.nan, 0, 0))
    with pytest.raises(upt.ArgumentError, match="time_s"):
        hand.render(0.0, 1e-3 * tool.position)
    hand.close()
    with pytest.raises(upt.StateError, match="HANDLE"):
        hand.render(time, 1e-3 * tool.position)


def test_a_bundle_that_cannot_is_refused():
    scene = upt.Model(FIXTURES / "tiny-upt").scene()
    with pytest.raises(upt.UnsupportedError, match="linear response"):
        upt.Haptics(scene, upt.Instrument.capsule(2.0))


def test_the_scene_may_end_first():
    model = upt.Model(FIXTURES / "tiny-corrected")
    scene = model.scene(corrections=5)
    hand = upt.Haptics(scene, upt.Instrument.capsule(3.0))
    scene.close()
    with pytest.raises(upt.StateError, match="scene was destroyed"):
        hand.render(0.0, (0.0, 0.0, 0.0))
