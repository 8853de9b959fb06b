"""Scenes side by side give the bits of scenes one after another."""

from __future__ import annotations

import numpy as np
import pytest
import upt
from conftest import FIXTURES, push
from test_instruments import pressing


@pytest.mark.parametrize("workers", [1, 2, 5])
def test_the_same_bits_for_any_number_of_workers(model, workers):
    count = 7
    expected = []
    for i in range(count):
        with model.scene(threads=1, sleep=False) as scene:
            expected.append([scene.step(contacts=push(model, t + i)) for t in range(4)])
    with upt.BatchedScenes(model, count, workers=workers, sleep=False) as batch:
        for t in range(4):
            out = batch.step(contacts=[push(model, t + i) for i in range(count)])
            np.testing.assert_array_equal(out, [states[t] for states in expected])
        np.testing.assert_array_equal(batch.read(), out)
        batch.reset([2, 4])
        still = batch.read()
        assert not still[2].any() and not still[4].any() and still[3].any()


def test_dense_fields(model):
    with upt.BatchedScenes(model, 2, sleep=False) as batch:
        collision = np.zeros((2, model.node_count, 3), np.float32)
        nodes, vectors = push(model, 3)
        collision[1, nodes] = vectors
        out = np.empty_like(collision)
        assert batch.step(collision=collision, out=out) is out
        np.testing.assert_array_equal(out[0], model.scene(sleep=False).step())
        np.testing.assert_array_equal(out[1], model.scene(sleep=False).step(contacts=(nodes, vectors)))
        with pytest.raises(ValueError, match="collision has shape"):
            batch.step(collision=collision[:1])


def test_instruments():
    model = upt.Model(FIXTURES / "tiny-corrected")
    tools = [[upt.Instrument.capsule(3.0, position=pressing(model, 0.3 * i))] if i else [] for i in range(3)]
    expected = []
    for one in tools:
        with model.scene(threads=1, sleep=False) as scene:
            expected.append([scene.step(one).copy() for _ in range(3)])
    with upt.BatchedScenes(model, 3, sleep=False) as batch:
        for step in range(3):
            np.testing.assert_array_equal(batch.step(tools), [states[step] for states in expected])
        assert [len(scene.readings()) for scene in batch.scenes] == [0, 1, 1]
        assert batch.scenes[2].readings()[0].contact_count > 0
        with pytest.raises(ValueError, match="instruments has 1 entries, must have one for each of 3"):
            batch.step(tools[:1])


def test_one_failure_stops_no_other_scene(model):
    with upt.BatchedScenes(model, 3, sleep=False) as batch:
        good = push(model, 1)
        with pytest.raises(upt.ArgumentError) as caught:
            batch.step(contacts=[good, ([0], [[np.nan, 0, 0]]), good])
        assert "scene 1 of 3" in caught.value.__notes__[0]
        assert [scene.stats.step_count for scene in batch.scenes] == [1, 0, 1]
        with pytest.raises(ValueError, match="one for each of 3"):
            batch.step(contacts=[good])


def test_a_region_for_all(model):
    with upt.BatchedScenes(model, 2) as batch:
        batch.set_region(model.domain_nodes[:4])
        assert batch.step().shape == (2, 4, 3)
